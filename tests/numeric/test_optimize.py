"""The short Nelder–Mead search against SciPy's, iteration by iteration."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize, rosen

from chartless._numeric.optimize import nelder_mead

Objective = Callable[[np.ndarray], float]


def quadratic(n: int) -> Objective:
    rng = np.random.default_rng(n)
    factor = rng.normal(size=(n, n))
    centre = rng.normal(size=n)
    return lambda x: float(np.sum((factor @ (x - centre)) ** 2))


def rippled(x: np.ndarray) -> float:
    """Return a bowl with ripples: no point of a large simplex improves, so it shrinks."""
    return float(np.sum(x**2) + 3 * np.sum(1 - np.cos(7 * x)))


OBJECTIVES = {"rosenbrock": lambda _: rosen, "quadratic": quadratic, "ripples": lambda _: rippled}


class Counted:
    def __init__(self, objective: Objective):
        self.objective, self.calls = objective, 0

    def __call__(self, x: np.ndarray) -> float:
        self.calls += 1
        return float(self.objective(x))


def scipys_path(
    objective: Objective, start: np.ndarray, steps: np.ndarray, iterations: int
) -> tuple[list[float], list[int], np.ndarray]:
    """Best value after each iteration, evaluations until then, and the last best point."""
    counted = Counted(objective)
    simplex = np.vstack([start, start + np.diag(steps)])
    values, evaluations = [min(map(objective, simplex))], [start.size + 1]

    def after_iteration(*, intermediate_result):
        values.append(intermediate_result.fun)
        evaluations.append(counted.calls)

    result = minimize(
        counted,
        start,
        method="Nelder-Mead",
        callback=after_iteration,
        options={
            "initial_simplex": simplex,
            "maxiter": iterations + 1,  # SciPy counts the first simplex
            "maxfev": 10**6,
            "xatol": 0,
            "fatol": 0,
        },
    )
    assert result.nfev == counted.calls
    return values, evaluations, result.x


@pytest.mark.parametrize("n", [2, 3, 4, 5])
@pytest.mark.parametrize("name", OBJECTIVES)
def test_walks_the_same_path_as_scipy(name: str, n: int):
    objective = OBJECTIVES[name](n)
    start = np.random.default_rng(100 + n).uniform(-2, 2, n)
    steps = np.linspace(0.5, 1.0, n)
    values, evaluations, best = scipys_path(objective, start, steps, 60)

    found = nelder_mead(objective, start, steps=steps, max_iterations=60)

    assert found.best_values == pytest.approx(values, rel=1e-9, abs=1e-14)
    assert found.evaluations == evaluations[-1]
    np.testing.assert_allclose(found.x, best, rtol=1e-7, atol=1e-9)
    assert found.value == found.best_values[-1]


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_the_compared_paths_have_a_shrinking_step(n: int):
    start = np.random.default_rng(100 + n).uniform(-2, 2, n)

    _, evaluations, _ = scipys_path(rippled, start, np.linspace(0.5, 1.0, n), 60)

    assert np.diff(evaluations).max() == n + 2


def test_evaluations_are_counted_exactly():
    counted = Counted(rosen)

    found = nelder_mead(counted, np.array([-1.2, 1.0]), steps=np.ones(2), max_iterations=40)

    assert found.evaluations == counted.calls
    assert len(found.best_values) == 41
    assert np.all(np.diff(found.best_values) <= 0)


def test_an_infinite_objective_is_walked_around():
    def half_plane(x: np.ndarray) -> float:
        return np.inf if x[0] < 0.5 else float(x @ x)

    found = nelder_mead(half_plane, np.array([2.0, 1.0]), steps=-np.ones(2), max_iterations=150)

    assert found.x == pytest.approx([0.5, 0.0], abs=1e-3)


def test_values_that_are_no_number_never_win():
    def holed(x: np.ndarray) -> float:
        return np.nan if x[0] < 0.5 else float(x @ x)

    found = nelder_mead(holed, np.array([2.0, 1.0]), steps=-np.ones(2), max_iterations=150)

    assert found.x == pytest.approx([0.5, 0.0], abs=1e-3)


def test_start_is_not_changed():
    start = np.array([1.0, 2.0])

    nelder_mead(rosen, start, steps=np.ones(2), max_iterations=5)

    assert start.tolist() == [1.0, 2.0]
