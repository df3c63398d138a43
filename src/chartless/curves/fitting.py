"""Least-squares fits of families to measured response curves, one curve or many at once."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from chartless._numeric.least_squares import least_squares
from chartless.errors import ParameterError
from chartless.models import MODELS, AbstractModel, LinearModel
from chartless.types import Bools, Floats, Indices

# Numbers in residuals and Jacobians that are at work at once: 2 MB stay in the cache.
_CHUNK = 2**18
# Where a parameter moves no sample by more than this share of what the others do, it is
# not determined.
_RANK = 1e-12
_ACTIVE = 1e-6  # room that an inequality in force leaves, relative to its size


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A member of a family and how near it comes to the samples."""

    model: AbstractModel
    parameters: Floats
    """Shape (P,)."""
    rmse: float
    """Root of the mean squared difference in brightness, weighted if weights were given."""
    covariance: Floats
    """Covariance of the parameters, shape (P, P), if the differences are independent errors of
    equal size (after weighting); infinite where the samples do not determine a parameter, zero
    across side constraints in force."""
    n_samples: int
    n_free: float
    """Effective number of parameters: without a penalty, those that no side constraint holds."""
    converged: bool
    """False if the limit of iterations came first, or the search ended at a wall of the family."""

    @property
    def standard_errors(self) -> Floats:
        """Deviation of each parameter, shape (P,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def increases(self) -> bool:
        """Whether the curve never decreases; see `AbstractModel.increases`."""
        return self.model.increases(self.parameters)

    def response(self, irradiance: npt.ArrayLike) -> Floats:
        """Brightness of the fitted curve; see `AbstractModel.response`."""
        return self.model.response(irradiance, self.parameters)


def fit(
    model: str | AbstractModel,
    irradiance: npt.ArrayLike,
    brightness: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
) -> Fit:
    """Fit a family to samples of a response curve, by least squares on brightness.

    Parameters
    ----------
    model : str or AbstractModel
        Name in `MODELS`, such as ``"ameegc2-exact"``, or a model.
    irradiance, brightness : array_like of float, shape (N,), 0 … 1
        Irradiance strictly increasing.
    weights : array_like of float, shape (N,), optional
        Weights of the squared differences: 1/variance where it is known.

    Returns
    -------
    Fit

    Raises
    ------
    UnknownNameError
        If no model has this name.
    ParameterError
        If the samples are no measured curve, or too few for the family.

    Examples
    --------
    >>> x = np.linspace(0, 1, 50)
    >>> fit("gamma", x, x**0.45).parameters.round(6)
    array([0.45])
    """
    curves = np.asarray(brightness, dtype=np.float64)[np.newaxis]
    return fit_many(model, irradiance, curves, weights=weights)[0]


def fit_many(
    model: str | AbstractModel,
    irradiance: npt.ArrayLike,
    curves: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    starts: npt.ArrayLike | None = None,
) -> list[Fit]:
    """Fit a family to many curves, sampled at the same irradiances, at once.

    Parameters
    ----------
    model, weights
        As for `fit`.
    irradiance : array_like of float, shape (N,), 0 … 1
    curves : array_like of float, shape (B, N), 0 … 1
    starts : array_like of float, shape (K, P), optional
        Parameters to start from, instead of those that the family proposes.

    Returns
    -------
    list of B Fit

    Raises
    ------
    UnknownNameError, ParameterError
        As for `fit`.
    """
    family = MODELS[model] if isinstance(model, str) else model
    x, y, root = checked_samples(irradiance, curves, weights)
    _check_count(family, x.size)
    if isinstance(family, LinearModel) and not family.constrained:
        parameters = _solve_linear(family, x, y, root)
        converged = np.ones(len(y), dtype=bool)
    else:
        parameters, converged = _search(family, x, y, root, starts)
    return list(_finished(family, x, y, root, parameters, converged=converged))


def checked_samples(
    irradiance: npt.ArrayLike, curves: npt.ArrayLike, weights: npt.ArrayLike | None = None
) -> tuple[Floats, Floats, Floats]:
    """Irradiance (N,), curves (B, N) and roots of the weights (N,).

    Raises
    ------
    ParameterError
        If they are no measured curves; the message says what to do.
    """
    x = np.asarray(irradiance, dtype=np.float64)
    y = np.atleast_2d(np.asarray(curves, dtype=np.float64))
    root = np.ones_like(x) if weights is None else np.asarray(weights, dtype=np.float64)
    if x.ndim != 1 or y.ndim != 2 or y.shape[1:] != x.shape or root.shape != x.shape:  # noqa: PLR2004
        msg = (
            "a curve needs as many irradiances as brightnesses and weights, not "
            f"{x.size}, {y.shape[-1] if y.ndim else 1} and {root.size}"
        )
        raise ParameterError(msg)
    for what, values in (("irradiance", x), ("brightness", y), ("weight", root)):
        if not np.all(np.isfinite(values)):
            place = int(np.argwhere(~np.isfinite(values))[0][-1])
            msg = f"sample {place + 1}: {what} is not a finite number"
            raise ParameterError(msg)
    for what, values, most in (
        ("irradiance", x, "its value at saturation"),
        ("brightness", y, "the highest level, 255 for 8 bits"),
    ):
        if values.size and (values.min() < 0 or values.max() > 1):
            msg = (
                f"{what} runs from {values.min():g} to {values.max():g} instead of within 0 … 1; "
                f"subtract its value at black and divide by {most}"
            )
            raise ParameterError(msg)
    falls = np.flatnonzero(np.diff(x) <= 0)
    if falls.size:
        place = int(falls[0]) + 1
        msg = (
            f"irradiance must increase from sample to sample, but sample {place + 1} is "
            f"{x[place]:g} after {x[place - 1]:g}; sort them, and join samples of equal irradiance"
        )
        raise ParameterError(msg)
    if y.size and np.any(np.ptp(y, axis=1) == 0):
        msg = f"brightness is {y[np.ptp(y, axis=1) == 0][0, 0]:g} everywhere: not a response curve"
        raise ParameterError(msg)
    if np.any(root < 0) or not np.any(root > 0):
        msg = "weights must not be negative, and not all zero"
        raise ParameterError(msg)
    return x, y, np.sqrt(root)


def _check_count(family: AbstractModel, n_samples: int) -> None:
    needed = 3 if family.penalty is not None else family.n_parameters
    if n_samples < needed:
        msg = f"{family.name} needs {needed} samples or more, not {n_samples}"
        raise ParameterError(msg)


def _solve_linear(family: LinearModel, x: Floats, y: Floats, root: Floats) -> Floats:
    """All curves are right sides of one linear system."""
    offset, basis = family.design(x)
    length = np.linalg.norm(basis, axis=0)
    scale = np.where(length > 0, length, 1.0)
    weighted = basis / scale * root[:, np.newaxis]
    solution = np.linalg.lstsq(weighted, ((y - offset) * root).T, rcond=None)[0]
    parameters: Floats = solution.T / scale
    return parameters


def _search(
    family: AbstractModel, x: Floats, y: Floats, root: Floats, starts: npt.ArrayLike | None
) -> tuple[Floats, Bools]:
    """Best of the local minima that the starts lead to: parameters (B, P), and if converged."""
    if starts is None:
        begin = family.starts(x, y)
        if family.lower is not None:
            below = [each.parameters for each in fit_many(family.lower, x, y, weights=root**2)]
            promoted = family.promoted(np.array(below))[:, np.newaxis]
            begin = np.concatenate([promoted, begin], axis=1)
    else:
        given = np.atleast_2d(np.asarray(starts, dtype=np.float64))
        if given.shape[1:] != (family.n_parameters,):
            msg = f"starts are rows of {family.n_parameters} parameters, not {given.shape[1:]}"
            raise ParameterError(msg)
        begin = np.tile(given, (len(y), 1, 1))
    found, cost, ended = _descend(family, x, y, root, begin)
    best = np.argmin(np.where(np.isfinite(cost), cost, np.inf), axis=1)
    row = np.arange(len(y))
    return family.repaired(found[row, best]), ended[row, best]


def _descend(
    family: AbstractModel, x: Floats, y: Floats, root: Floats, starts: Floats
) -> tuple[Floats, Floats, Bools]:
    """Local minima (A, K, P) from starts (A, K, P), their costs and whether they converged."""
    n_starts, n_parameters = starts.shape[1:]
    penalty, weighted = family.penalty, bool(np.any(root != 1))

    def function(parameters: Floats, which: Indices) -> tuple[Floats, Floats]:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):  # steps go anywhere
            response, jacobian = family.evaluate(x, parameters)
        residual = response - y[which // n_starts]
        if weighted:
            residual *= root
            jacobian = jacobian * root[:, np.newaxis]
        if penalty is not None:
            rows = np.broadcast_to(penalty, (len(parameters), *penalty.shape))
            residual = np.concatenate([residual, parameters @ penalty.T], axis=1)
            jacobian = np.concatenate([jacobian, rows], axis=1)
        if not family.constrained:
            residual[~family.admits(parameters)] = np.inf
        return residual, jacobian

    solutions = least_squares(
        function,
        starts.reshape(-1, n_parameters),
        bounds=family.bounds,
        inequalities=family.inequalities if family.constrained else None,
        at_once=_at_once(family, x.size),
    )
    shape = starts.shape[:2]
    return (
        solutions.parameters.reshape(starts.shape),
        solutions.cost.reshape(shape),
        solutions.converged.reshape(shape),
    )


def _finished(
    family: AbstractModel,
    x: Floats,
    y: Floats,
    root: Floats,
    parameters: Floats,
    *,
    converged: Bools,
) -> Iterator[Fit]:
    """Fits at parameters (B, P) of the curves (B, N), with their errors."""
    size = _at_once(family, x.size)
    for first in range(0, len(y), size):
        part = slice(first, first + size)
        responses, gradients = family.evaluate(x, parameters[part])
        residuals = (responses - y[part]) * root
        gradients = gradients * root[:, np.newaxis]
        for each in zip(parameters[part], residuals, gradients, converged[part], strict=True):
            yield _judged(family, *each, weight=float(root @ root))


def _judged(
    family: AbstractModel,
    parameters: Floats,
    residual: Floats,
    gradient: Floats,
    converged: np.bool_,
    *,
    weight: float,
) -> Fit:
    total = float(residual @ residual)
    free = _free_directions(family, parameters) if family.constrained else np.eye(parameters.size)
    moves = gradient @ free
    n_free = float(free.shape[1])
    if family.penalty is not None:  # the trace of the smoother, instead of its parameters
        moves = np.vstack([moves, family.penalty @ free])
        n_free = float(np.sum(np.linalg.qr(moves)[0][: residual.size] ** 2))
    variance = total / (residual.size - n_free) if residual.size > n_free else np.inf
    return Fit(
        model=family,
        parameters=parameters,
        rmse=float(np.sqrt(total / weight)),
        covariance=_covariance(moves, free, variance),
        n_samples=residual.size,
        n_free=n_free,
        converged=bool(converged),
    )


def _at_once(family: AbstractModel, n_samples: int) -> int:
    """How many curves are at work at once."""
    return max(1, _CHUNK // (n_samples * (family.n_parameters + 1)))


def _covariance(moves: Floats, free: Floats, variance: float) -> Floats:
    """Variance times (JᵀJ)⁻¹ within the directions F that are free, for moves J F."""
    scale = np.linalg.norm(moves, axis=0)
    known = scale > _RANK * scale.max(initial=0.0)
    triangle = np.linalg.qr(moves / np.where(known, scale, 1.0), mode="r")
    _, singular, axes = np.linalg.svd(triangle, full_matrices=False)
    determined = singular > _RANK * singular.max(initial=0.0)
    if np.isinf(variance) or not np.all(known) or not np.all(determined):
        return np.full((len(free), len(free)), np.inf)
    root = free @ (axes.T / singular / scale[:, np.newaxis])
    covariance: Floats = root @ root.T * variance
    return covariance


def _free_directions(family: AbstractModel, parameters: Floats) -> Floats:
    """Orthonormal columns (P, F) along which no side constraint in force is crossed."""
    rows, limit = family.inequalities(parameters)
    size = np.abs(rows) @ np.abs(parameters) + np.abs(limit)
    active = rows[limit - rows @ parameters <= _ACTIVE * size]
    if not active.size:
        return np.eye(parameters.size)
    _, singular, axes = np.linalg.svd(active)
    rank = int(np.sum(singular > _ACTIVE * singular[0]))
    free: Floats = axes[rank:].T
    return free
