"""Least-squares fit of a family to a measured response curve."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from chartless.models import AbstractModel
from chartless.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A member of a family and how near it comes to the samples."""

    parameters: Floats
    """Shape (P,)."""
    rmse: float
    """Root of the mean squared difference in brightness."""


def fit(model: AbstractModel, irradiance: npt.ArrayLike, brightness: npt.ArrayLike) -> Fit:
    """Fit a family to samples of a response curve, by least squares on brightness.

    Starts from the linear camera, a typical one (its first parameter 0.8 lower) and a dark
    one (0.4 higher), with the analytic gradient; the best of the three ends is returned.

    Parameters
    ----------
    model : AbstractModel
    irradiance, brightness : array_like of float, shape (N,), 0 … 1

    Returns
    -------
    Fit
    """
    from scipy.optimize import least_squares

    x = np.asarray(irradiance, dtype=np.float64)
    y = np.asarray(brightness, dtype=np.float64)
    starts = [model.identity.copy() for _ in range(3)]
    for start, shift in zip(starts, (0.0, -0.8, 0.4), strict=True):
        start[0] += shift

    def residual(parameters: Floats) -> Floats:
        return model.response(x, parameters) - y

    def jacobian(parameters: Floats) -> Floats:
        return model.gradient(x, parameters)

    solutions = [
        least_squares(
            residual,
            start,
            jac=jacobian,
            bounds=model.bounds,
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
        )
        for start in starts
    ]
    best = min(solutions, key=lambda solution: solution.cost)
    return Fit(best.x, float(np.sqrt(2 * best.cost / x.size)))
