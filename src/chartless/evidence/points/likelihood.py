r"""Measured points given a curve: a regression of light on brightness.

A point of the irradiance E and the brightness b stands for

    g(b) = k E + error,   variance  v = (s g'(b))² + (σ k E)²,

with one factor k for all points, the deviation s of the brightness, which is given, and a relative
scatter σ of light, which is found with the curve: what stray light, uneven lighting and processing
do. What was measured is E, given b: its density has a factor k for each point, without which less
light for everything would explain it better. Brightness is interpolated between the edges of
levels, so that g(b) is linear in them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chartless.inference.term import Expansion
from chartless.types import Floats

_LEAST_STEP = 1e-9  # of irradiance from one edge to the next


@dataclass(frozen=True, eq=False)
class PointModel:
    """Points of one channel, ready for many looks at them."""

    irradiance: Floats
    """Up to the factor k, shape (N,)."""
    brightness: Floats
    """Shape (N,)."""
    std: Floats
    """Deviation of the brightness, shape (N,)."""
    n_levels: int

    @property
    def by_edges(self) -> Floats:
        """Derivatives of g(b) in the edges, shape (N, L − 1)."""
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
        """Ln k for a first curve: the median of what points ask for."""
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
            g'(b), by a look before: held, as it only weighs the points.
        """
        scale, scatter = np.exp(own)
        known = scale * self.irradiance
        residual = self.light(edges) - known
        by_scatter = (scatter * known) ** 2
        variance = (self.std * slope) ** 2 + by_scatter
        # Of the residual; and of ln of the variance, in ln k and in ln σ alike.
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
        """Edge below each point, that of black included, and the share of the way to the next."""
        place = self.brightness * (self.n_levels - 1) + 0.5
        below = np.clip(np.floor(place).astype(np.intp), 0, self.n_levels - 1)
        return below, place - below

    @cached_property
    def _weights(self) -> Floats:
        """How g(b) is made of the edges and the ends, shape (N, L + 1)."""
        below, part = self._places()
        rows = np.arange(below.size)
        weights = np.zeros((below.size, self.n_levels + 1))
        weights[rows, below] = 1 - part
        weights[rows, below + 1] = part
        return weights

    @staticmethod
    def _with_ends(edges: Floats) -> Floats:
        return np.concatenate([[0.0], edges, [1.0]])
