"""Likelihood of JPEG levels given the light of raw files, one channel at a time.

A block of pixels with light x = (R, G, B) in the raw file, at distance r from the
middle of the picture, has the irradiance

    (b·x + k₁ (R − G) + k₂ (B − G) + p) · exp(a + q₁ r² + q₂ r⁴)

in a channel, and the level f of that. Here b are the weights of the channel without a
matrix, k the rest of its row of the camera's matrix (of sum 1, so that greys stay
grey), p the error of the black level of the raw file, a the gain of the shot, and q the
lens falloff that the camera corrected. All are estimated together with the curve. The
regression is of the level, not of g(level): the light of a block is accurate to a
thousandth, its level is not.

Residuals beyond three deviations get less and less weight; deviations include the
scatter of grey blocks.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag, inv

from chartless.evidence.raw.blocks import RawBlocks
from chartless.types import Floats

BLOCKS_OF_LEVEL = 3.0
"""Largest effective number of blocks of one level: errors that no curve explains are
common to them."""
COLOUR = 0.2
"""Relative deviation of irradiance by gamut and film looks, per chroma of a block."""
_NEUTRAL = 0.05  # chroma at which a block counts half for the scatter
_GAIN, _GAINS, _MATRIX, _FALLOFF = 5.0, 0.1, 0.5, 0.1  # prior deviations; a of all shots and of one
_ROUNDING = 0.3  # levels
_LEAST_SCATTER, _FAR, _REACH = 0.005, 3.0, 3.0
_MEDIAN_SQUARE = 0.4549  # of a standard normal number
_LEAST_LIGHT = 0.05  # share of b·x: a matrix may make a colour black
_LEAST_WIDTH = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """Blocks predicted from a curve and own unknowns, shape (N,) each."""

    irradiance: Floats
    by_rest: Floats
    """Derivatives with respect to the own unknowns except the gains, shape (N, 5)."""
    below: npt.NDArray[np.intp]
    """Index of the edge below."""
    width: Floats
    """Irradiance from that edge to the next."""
    part: Floats
    """Share of this width that lies below the block."""
    residual: Floats
    """Level minus the predicted level."""

    @property
    def steepness(self) -> Floats:
        """Change of level with the logarithm of irradiance."""
        return self.irradiance / self.width


class RawModel:
    """Model of the blocks of one channel, prepared for repeated evaluation."""

    def __init__(self, blocks: RawBlocks) -> None:
        self._n_inner = blocks.n_levels - 1
        n_shots = blocks.n_shots
        self.gains = slice(n_shots)
        self._matrix = slice(n_shots, n_shots + 2)
        self._pedestal = n_shots + 2
        self.falloff = slice(n_shots + 3, n_shots + 5)
        self.n_own = n_shots + 5
        self._blocks = blocks
        self._base = blocks.light @ blocks.base
        self._apart = blocks.light[:, [0, 2]] - blocks.light[:, [1]]
        self._radii = np.stack([blocks.radius**2, blocks.radius**4], axis=1)
        self._colour = (COLOUR * blocks.chroma) ** 2
        nearest = np.rint(blocks.level).astype(np.intp)
        self.share = np.minimum(1.0, BLOCKS_OF_LEVEL / np.bincount(nearest)[nearest])
        self._grey = self.share / (1 + (blocks.chroma / _NEUTRAL) ** 2)

    @property
    def own_precision(self) -> Floats:
        """Inverse covariance of the prior of gains, matrix, pedestal and falloff."""
        n_shots = self._blocks.n_shots
        gains = np.full((n_shots, n_shots), _GAIN**2) + _GAINS**2 * np.eye(n_shots)
        others = [_MATRIX, _MATRIX, self._blocks.light_error, _FALLOFF, _FALLOFF]
        return block_diag(inv(gains), np.diag(np.array(others) ** -2.0))

    def start(self, edges: Floats) -> Floats:
        """Own unknowns of a camera that leaves colours unchanged, shape (S + 5,)."""
        own = np.zeros(self.n_own)
        irradiance = np.interp(self._blocks.level, np.arange(edges.size) + 0.5, edges)
        own[self.gains] = np.median(np.log(irradiance / self._base))
        return own

    def matrix(self, own: Floats) -> Floats:
        """Weights of red, green and blue of the raw file in the channel, shape (3,), of sum 1."""
        red, blue = own[self._matrix]
        return np.asarray(self._blocks.base + np.array([red, -red - blue, blue]))

    def shown(self, edges: Floats, own: Floats) -> Shown:
        """Predict the blocks from a curve and own unknowns."""
        light = self._base + self._apart @ own[self._matrix] + own[self._pedestal]
        seen = light > _LEAST_LIGHT * self._base
        light = np.where(seen, light, _LEAST_LIGHT * self._base)
        gain = np.exp(own[self._blocks.shot] + self._radii @ own[self.falloff])
        irradiance = light * gain
        below = np.searchsorted(edges, irradiance, side="right") - 1
        below = np.clip(below, 0, edges.size - 2)
        width = np.maximum(edges[below + 1] - edges[below], _LEAST_WIDTH)
        part = (irradiance - edges[below]) / width
        residual = self._blocks.level - (below + 0.5 + part)
        by_light = np.column_stack([self._apart, np.ones(light.size)])
        by_light *= (gain * seen)[:, np.newaxis]
        by_rest = np.hstack([by_light, self._radii * irradiance[:, np.newaxis]])
        return Shown(irradiance, by_rest, below, width, part, residual)

    def scatter(self, now: Shown) -> float:
        """Weighted median error of greys, rounding excluded."""
        squares = now.residual**2 / _MEDIAN_SQUARE - _ROUNDING**2
        squares = squares / now.steepness**2 - self._colour
        order = np.argsort(squares)
        counted = np.cumsum(self._grey[order])
        median = squares[order[np.searchsorted(counted, counted[-1] / 2)]]
        return math.sqrt(max(float(median), _LEAST_SCATTER**2))

    def variance(self, now: Shown, scatter: float) -> Floats:
        """Variance of the level of each block, shape (N,)."""
        return np.asarray((scatter**2 + self._colour) * now.steepness**2 + _ROUNDING**2)

    def inner_share(self, now: Shown, variance: Floats) -> Floats:
        """`share` without the blocks predicted close to black or white, shape (N,).

        Such blocks are missing if they turned out black or white, which would bend the
        curve.
        """
        shown = self._blocks.level - now.residual
        reach = _REACH * np.sqrt(variance)
        near = (shown - reach < 0) | (shown + reach > self._n_inner)
        return np.where(near, 0.0, self.share)

    def cost(self, now: Shown, variance: Floats, share: Floats) -> float:
        """Half the robust sum of squares."""
        squares = now.residual**2 / (_FAR**2 * variance)
        return 0.5 * _FAR**2 * float(share @ np.log1p(squares))

    def normal(self, now: Shown, variance: Floats, share: Floats) -> tuple[Floats, Floats]:
        """Gradient of the cost in edges and own unknowns, and their information."""
        from scipy.sparse import csr_array

        n = now.residual.size
        weight = share / (variance + (now.residual / _FAR) ** 2)
        # Derivatives of the residual by the edges around a block and by its gain.
        entries = np.concatenate([1 - now.part, now.part, -now.irradiance])
        columns = np.concatenate([now.below, now.below + 1, self._n_inner + self._blocks.shot])
        places = np.tile(np.arange(n), 3), columns
        shape = n, self._n_inner + self.n_own
        changes = csr_array((entries / np.tile(now.width, 3), places), shape=shape)
        others = -now.by_rest / now.width[:, np.newaxis]
        weighted = csr_array(changes.T * weight)
        cross = weighted @ others
        rest = slice(self._n_inner + self._matrix.start, None)
        information = (weighted @ changes).toarray()
        information[:, rest] += cross
        information[rest] += cross.T
        information[rest, rest] += others.T @ (others * weight[:, np.newaxis])
        gradient = weighted @ now.residual
        gradient[rest] += others.T @ (weight * now.residual)
        return gradient, information
