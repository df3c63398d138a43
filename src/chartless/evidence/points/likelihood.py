r"""Likelihood of measured points given a curve: a regression of light on brightness.

A point of irradiance E and brightness b is modelled by

    g(b) = k E + error,   variance  v = (s g'(b))² + (σ k E)²,

with one factor k for all points, the given deviation s of the brightness, and a
relative scatter σ of light, which is due to stray light, uneven lighting and processing
and estimated with the curve. The measurement is E, given b: its density has a factor k
for each point, without which less light for all points would fit better. Brightness is
interpolated between the edges of levels, so that g(b) is linear in them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chartless.inference.term import Expansion
from chartless.types import Floats

_LEAST_STEP = 1e-9  # irradiance from one edge to the next


@dataclass(frozen=True, eq=False)
class PointModel:
    """Model of the points of one channel, prepared for repeated evaluation."""

    irradiance: Floats
    """Irradiance up to the factor k, shape (N,)."""
    brightness: Floats
    """Brightness, shape (N,)."""
    std: Floats
    """Deviation of the brightness, shape (N,)."""
    n_levels: int

    @property
    def by_edges(self) -> Floats:
        """Derivatives of g(b) with respect to the edges, shape (N, L − 1)."""
        return self._weights[:, 1:-1]

    def light(self, edges: Floats) -> Floats:
        """g(b), shape (N,)."""
        return np.asarray(self._weights @ self._with_ends(edges))

    def slope(self, edges: Floats) -> Floats:
        """g'(b), shape (N,)."""
        below, _ = self._places()
        ends = self._with_ends(edges)
        width = np.maximum(ends[below + 1] - ends[below], _LEAST_STEP)
        return np.asarray(width * (self.n_levels - 1))

    def start(self, edges: Floats) -> float:
        """Return ln k for a first curve: the median over the points."""
        lit = self.irradiance > 0
        return float(np.median(np.log(self.light(edges)[lit] / self.irradiance[lit])))

    def expand(self, edges: Floats, own: Floats, slope: Floats) -> Expansion:
        """Log-likelihood, gradient and information in edges, ln k and ln σ.

        Parameters
        ----------
        edges : ndarray, shape (L − 1,)
        own : ndarray, shape (2,)
            Ln k and ln σ.
        slope : ndarray, shape (N,)
            g'(b), from an earlier state: fixed, as it only weights the points.
        """
        scale, scatter = np.exp(own)
        known = scale * self.irradiance
        residual = self.light(edges) - known
        by_scatter = (scatter * known) ** 2
        variance = (self.std * slope) ** 2 + by_scatter
        # Derivatives of the residual; of ln of the variance, equal for ln k and ln σ.
        moved = np.column_stack([self.by_edges, -known, np.zeros(known.size)])
        widened = 2 * by_scatter / variance
        squares = residual**2 / variance
        value = -0.5 * float(np.sum(squares + np.log(variance))) + known.size * float(own[0])
        gradient = -(residual / variance) @ moved
        gradient[-2:] += 0.5 * (squares - 1) @ widened
        gradient[-2] += known.size
        information = (moved / variance[:, np.newaxis]).T @ moved
        information[-2:, -2:] += 0.5 * widened @ widened
        return Expansion(value, gradient, information)

    def _places(self) -> tuple[np.ndarray, Floats]:
        """Edge below each point, counting that of black, and fraction to the next."""
        place = self.brightness * (self.n_levels - 1) + 0.5
        below = np.clip(np.floor(place).astype(np.intp), 0, self.n_levels - 1)
        return below, place - below

    @cached_property
    def _weights(self) -> Floats:
        """Weights of the edges and the ends in g(b), shape (N, L + 1)."""
        below, part = self._places()
        rows = np.arange(below.size)
        weights = np.zeros((below.size, self.n_levels + 1))
        weights[rows, below] = 1 - part
        weights[rows, below + 1] = part
        return weights

    @staticmethod
    def _with_ends(edges: Floats) -> Floats:
        return np.concatenate([[0.0], edges, [1.0]])
