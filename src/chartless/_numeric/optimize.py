"""Nelder–Mead search for a few steps at a time.

SciPy has this method too. Ours is here because importing `scipy.optimize` takes longer than
the whole search (half a second), and counts evaluations exactly; tests hold it to SciPy's
path, point by point.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chartless.types import Floats


@dataclass(frozen=True, slots=True)
class Minimum:
    """Where a search ended."""

    x: Floats
    """Best point, shape (P,)."""
    value: float
    """Objective there."""
    evaluations: int
    """How often the objective was evaluated."""
    best_values: tuple[float, ...]
    """Best value after the first simplex and after each iteration."""


def nelder_mead(
    objective: Callable[[Floats], float],
    start: Floats,
    *,
    steps: Floats,
    max_iterations: int,
) -> Minimum:
    """Minimise by the simplex method of Nelder and Mead (1965), doi:10.1093/comjnl/7.4.308.

    Reflection 1, expansion 2, contraction and shrinkage ½.

    Parameters
    ----------
    objective : callable
        Takes a point of shape (P,); may return ``inf`` or NaN, which never win.
    start : ndarray of float, shape (P,)
    steps : ndarray of float, shape (P,)
        The first simplex is `start` and `start` with each coordinate moved by its step.
    max_iterations : int
        Iterations after the first simplex.
    """
    n = start.size

    def evaluate(point: Floats) -> float:
        value = objective(point)
        return np.inf if np.isnan(value) else value

    simplex = np.vstack([start, start + np.diag(steps)])
    values = np.array([evaluate(point) for point in simplex])
    evaluations = n + 1

    def rank() -> None:
        order = np.argsort(values, kind="stable")
        simplex[:], values[:] = simplex[order], values[order]

    rank()
    history = [float(values[0])]
    for _ in range(max_iterations):
        centre = simplex[:-1].mean(axis=0)
        away = centre - simplex[-1]
        candidate = centre + away
        value = evaluate(candidate)
        evaluations += 1
        if value < values[0]:
            further = centre + 2 * away
            value_further = evaluate(further)
            evaluations += 1
            if value_further < value:
                candidate, value = further, value_further
            accepted = True
        elif value < values[-2]:
            accepted = True
        else:
            outside = value < values[-1]
            nearer = centre + (0.5 if outside else -0.5) * away
            value_nearer = evaluate(nearer)
            evaluations += 1
            accepted = value_nearer <= value if outside else value_nearer < values[-1]
            candidate, value = nearer, value_nearer
        if accepted:
            simplex[-1], values[-1] = candidate, value
        else:
            simplex[1:] = 0.5 * (simplex[0] + simplex[1:])
            values[1:] = [evaluate(point) for point in simplex[1:]]
            evaluations += n
        rank()
        history.append(float(values[0]))
    return Minimum(simplex[0], float(values[0]), evaluations, tuple(history))
