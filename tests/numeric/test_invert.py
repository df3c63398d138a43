import numpy as np
import pytest
from scipy.optimize import brentq

from chartless._numeric.invert import invert_increasing

TOLERANCE = 1e-13


class Counted:
    """A function with its slope that counts how often it is evaluated."""

    def __init__(self, value, slope):
        self.value, self.slope, self.calls = value, slope, 0

    def __call__(self, x):
        self.calls += 1
        with np.errstate(all="ignore"):
            return self.value(x), self.slope(x)


def solve(function, target, low, high, start=None, **settings):
    target = np.atleast_1d(np.asarray(target, dtype=float))
    ends = np.full(target.shape, float(low)), np.full(target.shape, float(high))
    first = np.full(target.shape, 0.5 * (low + high) if start is None else start)
    return invert_increasing(function, target, *ends, first, tolerance=TOLERANCE, **settings)


def test_agrees_with_brent():
    function = Counted(lambda x: x + np.sin(x) / 2, lambda x: 1 + np.cos(x) / 2)
    targets = np.linspace(0.05, 9.0, 20)

    found = solve(function, targets, 0, 10)

    expected = [brentq(lambda x, y=y: x + np.sin(x) / 2 - y, 0, 10, xtol=1e-14) for y in targets]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_converges_quadratically_on_a_smooth_function():
    function = Counted(np.exp, np.exp)

    found = solve(function, [1.3, 2.0, 2.6], 0, 1)

    np.testing.assert_allclose(found, np.log([1.3, 2.0, 2.6]), atol=1e-13)
    assert function.calls <= 7


@pytest.mark.parametrize("start", [-0.9, 0.0, 0.4])
def test_passes_an_inflection_with_slope_zero(start: float):
    function = Counted(lambda x: x**3, lambda x: 3 * x**2)
    targets = np.array([-0.5, 0.0, 1e-6, 0.3])

    found = solve(function, targets, -1, 1.5, start)

    assert np.abs(found**3 - targets).max() <= TOLERANCE


@pytest.mark.parametrize("start", [-0.9, 0.0, 0.4])
def test_passes_a_point_with_infinite_slope(start: float):
    function = Counted(np.cbrt, lambda x: 1 / (3 * np.cbrt(x) ** 2))
    targets = np.array([-0.5, 0.3, 1e-3])

    found = solve(function, targets, -1, 1.5, start)

    np.testing.assert_allclose(found, targets**3, atol=1e-12)


def test_passes_a_plateau_and_a_step_that_overflows():
    function = Counted(lambda x: np.exp(np.exp(8 * x)), np.zeros_like)

    found = solve(function, [10.0, 1e10], 0, 1)

    np.testing.assert_allclose(found, np.log(np.log([10.0, 1e10])) / 8, rtol=1e-12)


def test_a_useless_slope_costs_no_more_than_bisection():
    function = Counted(lambda x: x, lambda x: np.full_like(x, np.nan))

    found = solve(function, [1 / 3], 0, 1)

    assert found == pytest.approx([1 / 3], abs=TOLERANCE)
    assert function.calls <= 60


@pytest.mark.parametrize(("target", "end"), [(-1.0, 0.2), (5.0, 0.8)])
def test_returns_the_nearer_end_where_the_target_lies_outside(target: float, end: float):
    function = Counted(lambda x: x**2, lambda x: 2 * x)

    found = solve(function, [target, 0.25], 0.2, 0.8)

    assert found == pytest.approx([end, 0.5], abs=1e-12)


def test_elements_are_solved_independently():
    function = Counted(lambda x: x**5, lambda x: 5 * x**4)
    targets = np.linspace(0, 1, 101)

    together = solve(function, targets, 0, 1)

    alone = [solve(function, y, 0, 1)[0] for y in targets]
    np.testing.assert_allclose(together**5, np.array(alone) ** 5, atol=2 * TOLERANCE)


def test_stops_at_the_limit_of_steps():
    function = Counted(lambda x: x, np.zeros_like)

    solve(function, [1 / 3], 0, 1, max_steps=5)

    assert function.calls <= 6


def test_nothing_to_solve_is_no_error():
    assert solve(Counted(np.exp, np.exp), [], 0, 1).shape == (0,)
