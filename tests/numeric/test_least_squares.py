"""Many small least-squares problems at once, against SciPy one by one and closed forms."""

import numpy as np
import pytest
from scipy import optimize
from slow_cases import slow_but

from chartless._numeric.least_squares import Function, least_squares
from chartless.types import Floats, Indices

RNG_SEED = 20030617
TIMES = np.linspace(0, 2, 25)


def unbounded(n_parameters: int) -> tuple[Floats, Floats]:
    return np.full(n_parameters, -np.inf), np.full(n_parameters, np.inf)


def rosenbrock(p: Floats, which: Indices) -> tuple[Floats, Floats]:
    x, y = p.T
    residual = np.stack([10 * (y - x**2), 1 - x], axis=1)
    jacobian = np.zeros((len(p), 2, 2))
    jacobian[:, 0] = np.stack([-20 * x, np.full_like(x, 10)], axis=1)
    jacobian[:, 1, 0] = -1
    return residual, jacobian


def powell(p: Floats, which: Indices) -> tuple[Floats, Floats]:
    """Singular at its solution, the origin."""
    a, b, c, d = p.T
    residual = np.stack(
        [a + 10 * b, np.sqrt(5) * (c - d), (b - 2 * c) ** 2, np.sqrt(10) * (a - d) ** 2], axis=1
    )
    jacobian = np.zeros((len(p), 4, 4))
    jacobian[:, 0, :2] = [1, 10]
    jacobian[:, 1, 2:] = [np.sqrt(5), -np.sqrt(5)]
    jacobian[:, 2, 1], jacobian[:, 2, 2] = 2 * (b - 2 * c), -4 * (b - 2 * c)
    jacobian[:, 3, 0] = 2 * np.sqrt(10) * (a - d)
    jacobian[:, 3, 3] = -jacobian[:, 3, 0]
    return residual, jacobian


def helix(p: Floats, which: Indices) -> tuple[Floats, Floats]:
    """Fletcher and Powell's helical valley, for x > 0."""
    x, y, z = p.T
    radius = np.hypot(x, y)
    residual = np.stack([10 * (z - 10 * np.arctan2(y, x) / (2 * np.pi)), 10 * (radius - 1), z], 1)
    jacobian = np.zeros((len(p), 3, 3))
    turn = 50 / np.pi / radius**2
    jacobian[:, 0] = np.stack([turn * y, -turn * x, np.full_like(x, 10)], axis=1)
    jacobian[:, 1] = np.stack([10 * x / radius, 10 * y / radius, np.zeros_like(x)], axis=1)
    jacobian[:, 2, 2] = 1
    return residual, jacobian


def decays(n_problems: int) -> Function:
    """Sums of an exponential and a constant with errors, other ones in each problem."""
    rng = np.random.default_rng(RNG_SEED)
    truth = rng.uniform([0.5, 0.3, -0.5], [3, 3, 0.5], size=(n_problems, 3))
    measured = truth[:, :1] * np.exp(-truth[:, 1:2] * TIMES) + truth[:, 2:]
    measured += rng.normal(scale=0.05, size=measured.shape)

    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        decay = np.exp(-p[:, 1:2] * TIMES)
        residual = p[:, :1] * decay + p[:, 2:] - measured[which]
        jacobian = np.stack([decay, -p[:, :1] * TIMES * decay, np.ones_like(decay)], axis=2)
        return residual, jacobian

    return function


def by_scipy(
    function: Function, starts: Floats, bounds: tuple[Floats, Floats] | None = None
) -> tuple[Floats, Floats]:
    """Parameters and sums of squares, problem by problem."""
    found = [
        optimize.least_squares(
            lambda p, k=k: function(p[np.newaxis], np.array([k]))[0][0],
            start,
            jac=lambda p, k=k: function(p[np.newaxis], np.array([k]))[1][0],
            bounds=unbounded(start.size) if bounds is None else bounds,
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-15,
            max_nfev=2000,
        )
        for k, start in enumerate(starts)
    ]
    return np.array([each.x for each in found]), np.array([2 * each.cost for each in found])


def starts_around(centre: list[float], n_problems: int, scale: float = 1.0) -> Floats:
    rng = np.random.default_rng(RNG_SEED)
    return np.array(centre) + rng.normal(scale=scale, size=(n_problems, len(centre)))


PROBLEMS = {
    "rosenbrock": (rosenbrock, starts_around([-1.2, 1.0], 40)),
    "helix": (helix, np.abs(starts_around([1.0, 0.5, 0.5], 40, 0.3))),
    "powell": (powell, starts_around([3.0, -1.0, 0.0, 1.0], 40)),
    "decays": (decays(40), np.tile([1.0, 1.0, 0.0], (40, 1))),
}


@pytest.mark.parametrize("name", ["rosenbrock", "helix"])
def test_a_sum_of_squares_that_can_vanish_does(name: str):
    function, starts = PROBLEMS[name]

    found = least_squares(function, starts, bounds=unbounded(starts.shape[1]))

    assert np.all(found.converged)
    assert np.all(found.cost < 1e-24)
    solution = {"rosenbrock": [1, 1], "helix": [1, 0, 0]}[name]
    np.testing.assert_allclose(found.parameters, np.tile(solution, (40, 1)), atol=1e-10)


def test_a_singular_solution_is_approached():
    function, starts = PROBLEMS["powell"]

    found = least_squares(function, starts, bounds=unbounded(4))

    assert np.all(found.cost < 1e-20)
    np.testing.assert_allclose(found.parameters, 0, atol=1e-4)  # the fourth root of the cost


def test_fits_of_decays_are_those_of_scipy():
    function, starts = PROBLEMS["decays"]

    found = least_squares(function, starts, bounds=unbounded(3))

    parameters, cost = by_scipy(function, starts)
    assert np.all(found.converged)
    np.testing.assert_allclose(found.cost, cost, rtol=1e-11)
    np.testing.assert_allclose(found.parameters, parameters, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", slow_but(PROBLEMS, "rosenbrock"))
def test_many_at_once_end_where_each_ends_alone(name: str):
    function, starts = PROBLEMS[name]
    starts = starts[:9]
    bounds = unbounded(starts.shape[1])
    alone = [
        least_squares(
            lambda p, which, k=k: function(p, which + k), start[np.newaxis], bounds=bounds
        )
        for k, start in enumerate(starts)
    ]

    for at_once in (None, 1, 4):
        together = least_squares(function, starts, bounds=bounds, at_once=at_once)

        one_by_one = np.concatenate([each.parameters for each in alone])
        np.testing.assert_allclose(together.parameters, one_by_one, rtol=1e-7, atol=1e-12)
        np.testing.assert_array_equal(together.converged, [each.converged[0] for each in alone])
        evaluations = sum(each.evaluations for each in alone)
        assert together.evaluations == pytest.approx(evaluations, rel=0.02)  # of rounding


def test_no_more_problems_than_asked_for_are_at_work():
    function, starts = PROBLEMS["decays"]
    seen: list[int] = []

    def watched(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        seen.append(which.size)
        assert np.unique(which).size == which.size
        return function(p, which)

    found = least_squares(watched, starts, bounds=unbounded(3), at_once=6)

    assert max(seen) == 6
    assert sum(seen) == found.evaluations
    assert np.all(found.converged)


def test_the_order_of_problems_does_not_matter():
    function, starts = PROBLEMS["decays"]
    order = np.random.default_rng(1).permutation(len(starts))

    straight = least_squares(function, starts, bounds=unbounded(3))
    shuffled = least_squares(
        lambda p, which: function(p, order[which]), starts[order], bounds=unbounded(3)
    )

    np.testing.assert_allclose(shuffled.parameters, straight.parameters[order], rtol=1e-9)


def test_a_start_at_the_solution_stays_there():
    found = least_squares(rosenbrock, np.array([[1.0, 1.0]]), bounds=unbounded(2))

    assert found.cost[0] == 0
    assert found.converged[0]
    assert found.evaluations == 1
    np.testing.assert_array_equal(found.parameters, [[1.0, 1.0]])


def test_linear_problems_are_solved_like_lstsq_however_badly_scaled():
    rng = np.random.default_rng(RNG_SEED)
    scales = 10.0 ** np.array([-9, -4, 0, 5])
    matrix = rng.normal(size=(30, 12, 4)) * scales
    right = rng.normal(size=(30, 12))

    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        return np.einsum("aij,aj->ai", matrix[which], p) - right[which], matrix[which]

    found = least_squares(function, np.zeros((30, 4)), bounds=unbounded(4))

    exact = [
        np.linalg.lstsq(m / scales, r, rcond=None)[0] / scales
        for m, r in zip(matrix, right, strict=True)
    ]
    assert np.all(found.converged)
    assert found.evaluations < 30 * 6
    np.testing.assert_allclose(found.parameters * scales, exact * scales, rtol=1e-5, atol=1e-6)


def test_a_parameter_without_effect_keeps_its_value():
    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        residual, jacobian = rosenbrock(p[:, :2], which)
        return residual, np.concatenate([jacobian, np.zeros((len(p), 2, 1))], axis=2)

    starts = np.column_stack([PROBLEMS["rosenbrock"][1], np.linspace(-3, 3, 40)])

    found = least_squares(function, starts, bounds=unbounded(3))

    assert np.all(found.converged)
    np.testing.assert_array_equal(found.parameters[:, 2], starts[:, 2])
    np.testing.assert_allclose(found.parameters[:, :2], 1, rtol=1e-10)


def test_equal_columns_share_what_one_would_take():
    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        total = p.sum(axis=1, keepdims=True)
        column = np.exp(0.3 * TIMES) * total**2
        derivative = 2 * np.exp(0.3 * TIMES) * total
        return column - 2 * np.exp(0.3 * TIMES) - 1, np.stack([derivative, derivative], axis=2)

    found = least_squares(function, np.array([[0.3, 0.5], [2.0, 2.0]]), bounds=unbounded(2))

    basis = np.exp(0.3 * TIMES)
    total = np.sqrt(basis @ (2 * basis + 1) / (basis @ basis))
    assert np.all(found.converged)
    np.testing.assert_allclose(found.parameters.sum(axis=1), total, rtol=1e-8)
    np.testing.assert_allclose(np.diff(found.parameters)[:, 0], [0.2, 0.0], atol=1e-9)


def test_fewer_residuals_than_parameters_find_a_solution():
    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        value = p[:, 0] ** 2 + p[:, 1] ** 2 + p[:, 2] ** 2 - 4
        return value[:, np.newaxis], 2 * p[:, np.newaxis, :]

    found = least_squares(function, np.array([[1.0, 2.0, 3.0]]), bounds=unbounded(3))

    assert found.cost[0] < 1e-20
    assert np.linalg.norm(found.parameters) == pytest.approx(2, rel=1e-10)


def test_bounds_are_approached_but_never_met():
    function, starts = PROBLEMS["decays"]
    bounds = np.array([-np.inf, 0.0, -0.1]), np.array([np.inf, 2.0, np.inf])
    starts = np.tile([1.0, 0.5, 0.2], (40, 1))

    found = least_squares(function, starts, bounds=bounds)

    assert np.all((found.parameters > bounds[0]) & (found.parameters < bounds[1]))
    parameters, cost = by_scipy(function, starts, bounds)
    # Neither ends higher than the other, but for three that end in another local minimum.
    assert np.sum(found.cost > cost * (1 + 1e-6)) <= 3
    _, again = by_scipy(function, found.parameters, bounds)
    np.testing.assert_allclose(found.cost, again, rtol=1e-6)
    free = by_scipy(function, starts)[0]
    inside = np.all((free > bounds[0]) & (free < bounds[1]), axis=1)
    assert 3 < inside.sum() < 37  # some bounds are in force, some are not
    np.testing.assert_allclose(found.parameters[inside], parameters[inside], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("wrong", [np.inf, np.nan])
def test_steps_to_residuals_that_are_not_finite_are_refused(wrong: float):
    """The first step from 3.9 leads far beyond 4, where there is nothing."""

    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        outside = p > 4
        with np.errstate(invalid="ignore"):
            root = np.sqrt(np.where(outside, np.nan, 4 - p))
        residual = np.where(outside, wrong, 0.2 - root)
        return residual, (0.5 / root)[:, :, np.newaxis]

    found = least_squares(function, np.array([[3.9], [-30.0], [3.999]]), bounds=unbounded(1))

    assert np.all(found.converged)
    np.testing.assert_allclose(found.parameters, 3.96, rtol=1e-10)


def test_a_start_without_a_finite_residual_does_not_converge():
    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        residual, jacobian = rosenbrock(p, which)
        residual[which == 1] = np.inf
        return residual, jacobian

    found = least_squares(function, PROBLEMS["rosenbrock"][1][:3], bounds=unbounded(2))

    np.testing.assert_array_equal(found.converged, [True, False, True])
    np.testing.assert_array_equal(found.parameters[1], PROBLEMS["rosenbrock"][1][1])
    np.testing.assert_allclose(found.parameters[[0, 2]], 1, rtol=1e-10)


def test_the_limit_of_iterations_is_kept_and_told():
    found = least_squares(
        rosenbrock, PROBLEMS["rosenbrock"][1], bounds=unbounded(2), iterations=3, at_once=8
    )

    assert found.evaluations == 3 * 40
    assert not np.any(found.converged)


def constrained_by_slsqp(
    function: Function, start: Floats, rows: Floats, limit: Floats
) -> tuple[Floats, float]:
    none = np.zeros(1, dtype=np.intp)

    def cost(p: Floats) -> float:
        residual = function(p[np.newaxis], none)[0][0]
        return float(residual @ residual)

    def slope(p: Floats) -> Floats:
        residual, jacobian = function(p[np.newaxis], none)
        return 2 * jacobian[0].T @ residual[0]

    found = optimize.minimize(
        cost, start, jac=slope, method="SLSQP", options={"ftol": 1e-15, "maxiter": 1000},
        constraints={"type": "ineq", "fun": lambda p: limit - rows @ p, "jac": lambda p: -rows},
    )  # fmt: skip
    return found.x, float(found.fun)


@pytest.mark.parametrize("seed", range(12))
def test_inequalities_lead_where_slsqp_leads(seed: int):
    """A valley of Rosenbrock's, cut by random half-planes that leave the start inside."""
    rng = np.random.default_rng(seed)
    start = np.array([-0.5, 0.5])
    rows = rng.normal(size=(3, 2))
    limit = rows @ start + rng.uniform(0.05, 1, size=3)

    found = least_squares(
        rosenbrock, start[np.newaxis], bounds=unbounded(2), inequalities=lambda p: (rows, limit)
    )

    parameters, cost = constrained_by_slsqp(rosenbrock, start, rows, limit)
    assert np.all(rows @ found.parameters[0] <= limit + 1e-12)
    assert found.cost[0] <= cost * (1 + 1e-7) + 1e-12
    if found.cost[0] > cost * (1 - 1e-6) - 1e-12:  # the same of several local minima
        np.testing.assert_allclose(found.parameters[0], parameters, atol=2e-5)


def test_linear_problems_under_inequalities_have_a_closed_form():
    """Least distance to a point from an orthant: the point, clipped."""
    rng = np.random.default_rng(RNG_SEED)
    target = rng.normal(size=(20, 4))

    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        return p - target[which], np.broadcast_to(np.eye(4), (len(p), 4, 4))

    found = least_squares(
        function,
        np.ones((20, 4)),
        bounds=unbounded(4),
        inequalities=lambda p: (-np.eye(4), np.zeros(4)),
    )

    assert np.all(found.converged)
    np.testing.assert_allclose(found.parameters, target.clip(min=0), atol=1e-9)


def test_inequalities_may_follow_the_parameters():
    """Half-planes that touch the unit circle, one of them right where the solver is."""
    fixed = np.arange(180) * np.pi / 90

    def function(p: Floats, which: Indices) -> tuple[Floats, Floats]:
        return p - [2.0, 1.0], np.broadcast_to(np.eye(2), (len(p), 2, 2))

    def tangents(p: Floats) -> tuple[Floats, Floats]:
        angle = np.append(fixed, np.arctan2(p[1], p[0]))
        return np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(angle.size)

    found = least_squares(
        function, np.array([[0.1, 0.0]]), bounds=unbounded(2), inequalities=tangents
    )

    direction = np.array([2, 1]) / np.sqrt(5)
    np.testing.assert_allclose(found.parameters[0] @ direction, 1, atol=2e-4)  # of a corner
    assert np.all(tangents(direction)[0] @ found.parameters[0] <= 1 + 2e-4)


@pytest.mark.parametrize("name", PROBLEMS)
def test_more_iterations_never_end_higher(name: str):
    function, starts = PROBLEMS[name]
    bounds = unbounded(starts.shape[1])

    costs = [
        least_squares(function, starts, bounds=bounds, iterations=count).cost
        for count in range(1, 25)
    ]

    assert np.all(np.diff(costs, axis=0) <= 0)
    assert np.all(costs[-1] < costs[0])
