"""Nonlinear least squares for many small problems at once, with or without linear constraints.

One problem is a few parameters and some thousand residuals; a solver called once for each
spends its time between the calls. Here all problems take their steps together as arrays of
shape (B, …), and a problem that has converged drops out.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chartless._numeric.quadratic import constrained_step
from chartless.types import Bools, Floats, Indices

Function = Callable[[Floats, Indices], tuple[Floats, Floats]]
"""(parameters (A, P), which problems (A,)) → residuals (A, N) and Jacobians (A, N, P)."""

Inequalities = Callable[[Floats], tuple[Floats, Floats]]
"""Parameters (P,) → C (M, P) and d (M,) of the side constraints C p ≤ d there."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 1e-14, 1e12
_LEAST_GAIN = 1e-4
_ROUNDING = 1e-30  # of squared residuals of order 1
_LEAST_EIGENVALUE = 1e-7  # of JᵀJ with unit diagonal: J has a condition of some thousands
_STOP = 0.9  # of the way to a bound is as far as a step goes


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Where B searches ended."""

    parameters: Floats
    """Shape (B, P)."""
    cost: Floats
    """Sum of squared residuals, shape (B,)."""
    converged: Bools
    """Shape (B,); False where the limit of iterations came first, or no step was allowed."""
    evaluations: int
    """Evaluations of the function for one problem, in all."""


def least_squares(
    function: Function,
    start: Floats,
    *,
    bounds: tuple[Floats, Floats],
    inequalities: Inequalities | None = None,
    tolerance: float = 1e-12,
    iterations: int = 200,
    at_once: int | None = None,
) -> Solutions:
    """Minimise sums of squares by the method of Levenberg and Marquardt.

    Parameters
    ----------
    function : Function
        Residuals and their derivatives. A residual that is not finite rejects the step.
    start : ndarray, shape (B, P)
        Must be allowed.
    bounds : (ndarray, ndarray), each of shape (P,)
        Excluded; a step stops nine tenths of the way to one.
    inequalities : Inequalities, optional
        Side constraints; each step is the solution of a quadratic program.
    tolerance : float
        A problem has converged when the linear model promises to lower the sum of squares
        by less than this part of it.
    iterations : int
        Steps tried per problem, at most.
    at_once : int, optional
        How many problems are at work, at most; the next one begins when one has ended, so that
        their Jacobians stay in the cache. By default all.

    Returns
    -------
    Solutions

    Notes
    -----
    Moré, *The Levenberg–Marquardt algorithm: implementation and theory* (1978), for the scale
    of the parameters; Nielsen, *Damping parameter in Marquardt's method* (1999), for the damping.
    Jacobians of great condition go through QR factorisations, the others through normal equations.
    """
    n_problems, n_parameters = start.shape
    parameters, cost = start.copy(), np.full(n_problems, np.inf)
    converged = np.zeros(n_problems, dtype=bool)
    triangle = np.zeros((n_problems, n_parameters, n_parameters))
    right = np.zeros((n_problems, n_parameters))
    scale = np.zeros((n_problems, n_parameters))
    damping = np.full(n_problems, _FIRST_DAMPING)
    growth = np.full(n_problems, 2.0)

    trial, predicted = start.copy(), np.full(n_problems, np.inf)
    used = np.zeros(n_problems, dtype=np.intp)
    room = n_problems if at_once is None else at_once
    begun = min(room, n_problems)
    active = np.arange(begun)
    while active.size:
        residual, jacobian = function(trial[active], active)
        used[active] += 1
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            trial_cost = np.einsum("ij,ij->i", residual, residual)
            gain = (cost[active] - trial_cost) / predicted[active]
        # The very first point has nothing to be compared with.
        better = np.isfinite(trial_cost) & ((gain > _LEAST_GAIN) | np.isinf(cost[active]))

        moved = active[better]
        parameters[moved], cost[moved] = trial[moved], trial_cost[better]
        if not np.all(better):
            jacobian, residual = jacobian[better], residual[better]
        triangle[moved], right[moved] = _factors(jacobian, residual)
        scale[moved] = np.maximum(scale[moved], np.linalg.norm(triangle[moved], axis=1))
        known = np.isfinite(gain)
        shrink = np.maximum(1 / 3, 1 - (2 * np.where(known, gain, 1.0)[better].clip(0, 2) - 1) ** 3)
        damping[moved] = (damping[moved] * shrink).clip(min=_LEAST_DAMPING)
        growth[moved] = 2.0
        stuck = active[~better]
        damping[stuck] *= growth[stuck]
        growth[stuck] *= 2.0

        delta, predicted[active] = _damped_step(
            triangle[active],
            right[active],
            scale[active],
            damping[active],
            parameters=parameters[active],
            bounds=bounds,
            inequalities=inequalities,
        )
        settled = predicted[active] * damping[active].clip(min=1) <= tolerance * cost[active]
        settled |= cost[active] <= _ROUNDING * residual.shape[1]
        hopeless = (damping[active] > _MOST_DAMPING) | ~np.isfinite(cost[active])
        converged[active] = settled & np.isfinite(cost[active])
        done = settled | hopeless
        trial[active] = parameters[active] + delta
        active = active[~done & (used[active] < iterations)]
        following = np.arange(begun, min(begun + room - active.size, n_problems))
        active, begun = np.concatenate([active, following]), begun + following.size
    return Solutions(parameters, cost, converged, int(used.sum()))


def _damped_step(
    triangle: Floats,
    right: Floats,
    scale: Floats,
    damping: Floats,
    *,
    parameters: Floats,
    bounds: tuple[Floats, Floats],
    inequalities: Inequalities | None,
) -> tuple[Floats, Floats]:
    """Minimiser of |T δ + r|² + damping |scale δ|², and how much it lowers |T δ + r|²."""
    unit = np.where(scale > 0, scale, 1.0)
    damper = np.sqrt(damping)[:, np.newaxis, np.newaxis] * np.eye(scale.shape[1])
    if inequalities is None:
        delta = _free_step(triangle, right, unit, damper)
        for k in map(int, np.flatnonzero(np.any(_leaves(parameters + delta, bounds), axis=1))):
            rows, ways = _sides(parameters[k], bounds)
            delta[k] = _held_step(triangle[k], right[k], damper[k] * unit[k], rows, _STOP * ways)
        # Nine tenths of the way to the next number are the whole way.
        delta[_leaves(parameters + delta, bounds)] = 0.0
    else:
        delta = np.empty_like(parameters)
        for k, here in enumerate(parameters):
            rows, limit = inequalities(here)
            room = limit - rows @ here
            delta[k] = _held_step(triangle[k], right[k], damper[k] * unit[k], rows, room)
    change = np.einsum("bij,bj->bi", triangle, delta)
    predicted = -np.einsum("bi,bi->b", change, change + 2 * right)
    return delta, predicted.clip(min=0)


def _held_step(
    triangle: Floats, right: Floats, damper: Floats, rows: Floats, room: Floats
) -> Floats:
    """Minimiser of |T δ + r|² + |D δ|² for one problem, subject to rows · δ ≤ room."""
    stacked = np.concatenate([triangle, damper])
    return constrained_step(stacked, np.append(right, np.zeros(len(damper))), rows, room)


def _free_step(triangle: Floats, right: Floats, unit: Floats, damper: Floats) -> Floats:
    """Minimiser of |T δ + r|² + |D unit δ|² for each problem."""
    n_parameters = unit.shape[1]
    stacked = np.concatenate([triangle / unit[:, np.newaxis, :], damper], axis=1)
    below = np.zeros((*right.shape, 1))
    joined = np.concatenate([right[:, :, np.newaxis], below], axis=1)
    factor = _triangle(np.concatenate([stacked, joined], axis=2))
    square, side = factor[:, :n_parameters, :n_parameters], factor[:, :n_parameters, -1:]
    delta: Floats = -np.linalg.solve(square, side)[:, :, 0] / unit
    return delta


def _factors(jacobian: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Triangles R (A, P, P) and right sides r (A, P) with |J δ + residual|² = |R δ + r|² + const.

    By Cholesky's factors of JᵀJ, which squares the condition of J, where J can stand it; by QR,
    which takes three times as long, elsewhere.
    """
    transposed = np.swapaxes(jacobian, 1, 2)
    gram, side = transposed @ jacobian, (transposed @ residual[..., np.newaxis])[..., 0]
    length = np.sqrt(np.einsum("aii->ai", gram))
    unit = np.where(length > 0, length, 1.0)
    gram /= unit[:, :, np.newaxis] * unit[:, np.newaxis, :]
    well = np.linalg.eigvalsh(gram)[:, 0] > _LEAST_EIGENVALUE
    triangle, right = np.empty_like(gram), np.empty_like(side)
    lower = np.linalg.cholesky(gram[well])
    triangle[well] = np.swapaxes(lower, 1, 2) * unit[well, np.newaxis, :]
    right[well] = np.linalg.solve(lower, (side / unit)[well, :, np.newaxis])[..., 0]
    if not np.all(well):
        n_parameters = side.shape[1]
        factor = _triangle(_joined(jacobian[~well], residual[~well]))
        triangle[~well] = factor[:, :n_parameters, :n_parameters]
        right[~well] = factor[:, :n_parameters, n_parameters]
    return triangle, right


def _joined(jacobian: Floats, residual: Floats) -> Floats:
    """Jacobians with the residuals as their last column, each column contiguous for LAPACK."""
    n_problems, n_residuals, n_parameters = jacobian.shape
    columns = np.zeros((n_problems, n_parameters + 1, max(n_residuals, n_parameters)))
    columns[:, :-1, :n_residuals] = np.swapaxes(jacobian, 1, 2)
    columns[:, -1, :n_residuals] = residual
    return np.swapaxes(columns, 1, 2)


def _triangle(matrices: Floats) -> Floats:
    """R of the QR factorisation of each matrix (A, N, P), shape (A, P, P)."""
    return np.asarray(np.linalg.qr(matrices, mode="r"))


def _leaves(parameters: Floats, bounds: tuple[Floats, Floats]) -> Bools:
    """Which parameters are not within their bounds."""
    return np.asarray((parameters <= bounds[0]) | (parameters >= bounds[1]))


def _sides(parameters: Floats, bounds: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Directions (M, P) to the bounds, of those that there are, and how far they are (M,)."""
    directions = np.concatenate([-np.eye(parameters.size), np.eye(parameters.size)])
    ways = np.concatenate([parameters - bounds[0], bounds[1] - parameters])
    return directions[np.isfinite(ways)], ways[np.isfinite(ways)]
