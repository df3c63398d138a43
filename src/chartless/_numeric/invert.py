"""Where an increasing function takes given values: Newton steps kept inside a bracket."""

from collections.abc import Callable

import numpy as np

from chartless.types import Floats


def invert_increasing(
    function: Callable[[Floats], tuple[Floats, Floats]],
    target: Floats,
    low: Floats,
    high: Floats,
    start: Floats,
    *,
    tolerance: float,
    max_steps: int = 200,
) -> Floats:
    """Solve ``function(x) = target`` for each element, by safeguarded Newton steps.

    A Newton step is taken where it stays inside the bracket and at least halves
    the step before it; elsewhere the bracket is bisected. So the search converges
    quadratically where the slope allows and never worse than bisection: also at
    an inflection with slope zero, and where the slope overflows.

    Parameters
    ----------
    function : callable
        Takes points of shape (N,), returns values and slopes of shape (N,). Need not
        be increasing everywhere: any sign change inside the bracket may be found.
    target : ndarray of float, shape (N,)
    low, high : ndarray of float, shape (N,)
        Bracket: ``function(low) <= target <= function(high)``. Where this does not hold
        the nearer end is returned.
    start : ndarray of float, shape (N,)
        First guess, inside the bracket.
    tolerance : float
        Accepted distance to `target`, in units of the function's values.
    max_steps : int
        Upper limit of steps; 200 bisections exhaust float64 from any bracket.

    Returns
    -------
    ndarray of float, shape (N,)
    """
    x = start
    step_before = high - low
    for _ in range(max_steps):
        value, slope = function(x)
        excess = value - target
        open_ = np.abs(excess) > tolerance
        if not open_.any():
            break
        above = excess > 0
        high = np.where(above, x, high)
        low = np.where(above, low, x)
        middle = 0.5 * (low + high)
        open_ &= (middle > low) & (middle < high)
        if not open_.any():
            break
        with np.errstate(all="ignore"):
            newton = x - excess / slope
        step = np.abs(newton - x)
        keeps = (newton > low) & (newton < high) & (step <= 0.5 * step_before)
        x = np.where(open_, np.where(keeps, newton, middle), x)
        step_before = np.where(keeps, step, 0.5 * (high - low))
    return x


def invert_on_grid(
    function: Callable[[Floats], tuple[Floats, Floats]],
    target: Floats,
    grid: Floats,
    *,
    tolerance: float,
) -> Floats:
    """Solve ``function(x) = target`` between the ends of a grid.

    Parameters
    ----------
    function : callable
        As for `invert_increasing`. Where it decreases somewhere, its running maximum over
        the grid is inverted.
    target : ndarray of float, shape (N,)
        Beyond the values at the ends of the grid, the nearer end is returned.
    grid : ndarray of float, shape (K,)
        Increasing; fine enough that Newton steps from a straight line between two points
        converge.
    tolerance : float
        Accepted distance to `target`, in units of the function's values.

    Returns
    -------
    ndarray of float, shape (N,)
    """
    values = np.maximum.accumulate(function(grid)[0])
    above = np.searchsorted(values, target).clip(1, grid.size - 1)
    low, high = grid[above - 1], grid[above]
    with np.errstate(all="ignore"):  # values may be equal, or as large as float64 allows
        share = (target - values[above - 1]) / (values[above] - values[above - 1])
    start = low + np.where(np.isfinite(share), share, 0.5).clip(0, 1) * (high - low)
    return invert_increasing(function, target, low, high, start, tolerance=tolerance)
