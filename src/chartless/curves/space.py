"""Curves as the likelihood moves them: coordinates with a Gaussian prior, and the edges they give.

The likelihood knows a curve by its edges only, the irradiance between the levels. A space of
curves says how edges follow from coordinates, and which coordinates cameras have. There are
two: any curve at all, and the members of a family.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves.prior import (
    CurvePrior,
    bin_edges,
    irradiance_at_edges,
    log_slopes_of,
)
from chartless.curves.whitening import whitening
from chartless.errors import ParameterError
from chartless.models import AbstractModel
from chartless.types import Floats

# A family that is not always monotone may have flat and falling stretches: less than this, a slope
# of f counts as this.
_LEAST_SLOPE = 1e-3
_NEAREST_STEPS, _NEAREST_WEIGHT = 30, 1e-6
_SETTLED = 1e-12  # gain in mean squared irradiance


class AbstractCurveSpace(ABC):
    """Coordinates x of curves, with a Gaussian prior."""

    mean: Floats
    """Mean of the prior, shape (P,)."""
    precision: Floats
    """Inverse covariance of the prior, shape (P, P)."""
    log_precision: float
    """Logarithm of the determinant of `precision`."""
    uses_ratio: ClassVar[bool]
    """Whether the information of pairs on the ratio u/v is used. What a family cannot follow in a
    curve it makes good by a wrong ratio."""

    @abstractmethod
    def edges(self, coordinates: Floats) -> Floats:
        """Irradiance between the levels, shape (L − 1,), never decreasing.

        Raises
        ------
        ParameterError
            If these are coordinates of no curve.
        """

    @abstractmethod
    def pull(self, coordinates: Floats) -> Callable[[Floats], Floats]:
        """Return the map rows → Jᵀ rows, J the derivatives of the edges, shape (L − 1, P).

        Rows have the shape (L − 1,) or (L − 1, N).
        """

    @abstractmethod
    def nearest(self, edges: Floats) -> Floats:
        """Coordinates of a curve near given edges, shape (P,)."""


def in_coordinates(information: Floats, n_inner: int, pull: Callable[[Floats], Floats]) -> Floats:
    """Information on coordinates and what follows, from that on the edges and what follows.

    Parameters
    ----------
    information : ndarray, shape (L − 1 + N, L − 1 + N)
    n_inner : int
        L − 1.
    pull : callable
        As `AbstractCurveSpace.pull` returns it.

    Returns
    -------
    ndarray, shape (P + N, P + N)
    """
    edge, rest = slice(n_inner), slice(n_inner, None)
    own = pull(pull(information[edge, edge]).T)
    cross = pull(information[edge, rest])
    return np.block([[own, cross], [cross.T, information[rest, rest]]])


@final
class FreeCurve(AbstractCurveSpace):
    """Any increasing curve: its coordinates are the log slopes of g in each level."""

    uses_ratio = True

    def __init__(self, prior: CurvePrior) -> None:
        self.prior = prior
        self.mean = prior.mean
        self.precision = prior.precision
        self._column_sums = self.precision.sum(axis=0)
        self.log_precision = -float(np.linalg.slogdet(prior.covariance)[1])

    @override
    def edges(self, coordinates: Floats) -> Floats:
        return irradiance_at_edges(coordinates)[1:-1]

    @override
    def pull(self, coordinates: Floats) -> Callable[[Floats], Floats]:
        edges = irradiance_at_edges(coordinates)
        widths = np.diff(edges)

        # Widths are w's softmax, edges their sums: ∂e_m/∂w_i = width_i (1[i ≤ m] − e_m).
        def pulled(rows: Floats) -> Floats:
            above = np.zeros((widths.size, *rows.shape[1:]))
            above[:-1] = np.cumsum(rows[::-1], axis=0)[::-1]
            above -= np.tensordot(edges[1:-1], rows, axes=1)
            return (above.T * widths).T

        return pulled

    @override
    def nearest(self, edges: Floats) -> Floats:
        slopes = log_slopes_of(np.concatenate([[0.0], edges, [1.0]]))
        # A constant more or less gives the same curve: take the most probable.
        constant = self._column_sums @ (self.mean - slopes) / self._column_sums.sum()
        return np.asarray(slopes + constant)

    @cached_property
    def populations(self) -> tuple["FreeCurve", ...]:
        """Spaces of the parts of the prior, if it is a mixture."""
        return tuple(free_curve(part) for _, part in self.prior.parts)


@lru_cache(maxsize=64)
def free_curve(prior: CurvePrior) -> FreeCurve:
    """Any curve, with a prior that is used again and again."""
    return FreeCurve(prior)


@final
class FamilyCurve(AbstractCurveSpace):
    """Members of a family, in whitened parameters: standard normal over measured cameras."""

    uses_ratio = False

    def __init__(self, model: AbstractModel, n_levels: int) -> None:
        self.model = model
        self._whitening = whitening(model)
        self._brightness = bin_edges(n_levels)[1:-1]
        self.mean = np.zeros(model.n_parameters)
        self.precision = np.eye(model.n_parameters)
        self.log_precision = 0.0

    def parameters(self, coordinates: Floats) -> Floats:
        """Raw parameters of the family, shape (P,)."""
        return self._whitening.colour(coordinates)

    def parameter_covariance(self, covariance: Floats) -> Floats:
        """Covariance of the raw parameters, shape (P, P), from that of coordinates: exact."""
        return np.asarray(self._whitening.matrix @ covariance @ self._whitening.matrix.T)

    @override
    def edges(self, coordinates: Floats) -> Floats:
        edges = self.model.inverse(self._brightness, self.parameters(coordinates))
        return np.maximum.accumulate(edges)

    @override
    def pull(self, coordinates: Floats) -> Callable[[Floats], Floats]:
        parameters = self.parameters(coordinates)
        edges = self.model.inverse(self._brightness, parameters)
        slope = np.maximum(self.model.derivative(edges, parameters), _LEAST_SLOPE)
        gradient = self.model.gradient(edges, parameters) @ self._whitening.matrix
        jacobian = -gradient / slope[:, np.newaxis]
        return lambda rows: np.asarray(jacobian.T @ rows)

    @override
    def nearest(self, edges: Floats) -> Floats:
        """Gauss–Newton on the squared difference of edges, from the mean camera."""
        x, damping = self.mean, 1e-3
        rest = edges - self.edges(x)
        for _ in range(_NEAREST_STEPS):
            pulled = self.pull(x)
            jacobian = pulled(np.eye(edges.size))
            normal = jacobian @ jacobian.T
            normal += (_NEAREST_WEIGHT + damping) * np.eye(x.size)
            trial = x + np.linalg.solve(normal, jacobian @ rest - _NEAREST_WEIGHT * x)
            try:
                trial_rest = edges - self.edges(trial)
            except ParameterError:
                damping *= 10
                continue
            if trial_rest @ trial_rest < rest @ rest:
                settled = rest @ rest - trial_rest @ trial_rest < _SETTLED * edges.size
                x, rest, damping = trial, trial_rest, damping / 10
                if settled:
                    break
            else:
                damping *= 10
        return np.asarray(x)
