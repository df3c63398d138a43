"""Constrained linear least squares against every active set, tried in turn."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize

from chartless._numeric.quadratic import constrained_step
from chartless.types import Floats


def by_active_sets(triangle: Floats, right: Floats, rows: Floats, room: Floats) -> Floats | None:
    """Best allowed of the minimisers on every intersection of boundaries; None without any."""
    n_rows, n_parameters = rows.shape
    gram, slope = triangle.T @ triangle, triangle.T @ right
    best, least = None, np.inf
    for count in range(min(n_rows, n_parameters) + 1):
        for chosen in combinations(range(n_rows), count):
            active = rows[list(chosen)]
            system = np.block([[gram, active.T], [active, np.zeros((count, count))]])
            if np.linalg.matrix_rank(system) < len(system):
                continue
            step = np.linalg.solve(system, np.append(-slope, room[list(chosen)]))[:n_parameters]
            cost = float(np.sum((triangle @ step + right) ** 2))
            if np.all(rows @ step <= room + 1e-9 * (1 + np.abs(room))) and cost < least:
                best, least = step, cost
    return best


def problem(
    seed: int, n_parameters: int, n_rows: int, *, allowed: bool
) -> tuple[Floats, Floats, Floats, Floats]:
    rng = np.random.default_rng(seed)
    triangle = rng.normal(size=(n_parameters + 3, n_parameters))
    right = rng.normal(size=n_parameters + 3) * 3
    rows = rng.normal(size=(n_rows, n_parameters))
    room = np.abs(rng.normal(size=n_rows)) if allowed else rng.normal(size=n_rows)
    return triangle, right, rows, room


SIZES = {
    "seed": st.integers(0, 2**31),
    "n_parameters": st.integers(1, 4),
    "n_rows": st.integers(1, 6),
}


@given(**SIZES)
def test_the_best_active_set_is_found(seed: int, n_parameters: int, n_rows: int):
    triangle, right, rows, room = problem(seed, n_parameters, n_rows, allowed=True)

    step = constrained_step(triangle, right, rows, room)

    expected = by_active_sets(triangle, right, rows, room)
    assert expected is not None
    size = np.abs(expected).max() + 1
    np.testing.assert_allclose(step, expected, rtol=0, atol=1e-8 * size)


@given(**SIZES)
def test_a_start_that_is_not_allowed_is_left(seed: int, n_parameters: int, n_rows: int):
    triangle, right, rows, room = problem(seed, n_parameters, n_rows, allowed=False)
    expected = by_active_sets(triangle, right, rows, room)
    size = 1 if expected is None else np.abs(expected).max() + 1
    if expected is None:
        with pytest.raises(ValueError, match=r"^the inequalities contradict each other$"):
            constrained_step(triangle, right, rows, room)
        return

    step = constrained_step(triangle, right, rows, room)

    np.testing.assert_allclose(step, expected, rtol=0, atol=1e-7 * size)


@given(**SIZES)
def test_the_conditions_of_karush_kuhn_and_tucker_hold(seed: int, n_parameters: int, n_rows: int):
    """The slope is a nonnegative sum of rows in force: exact, with no second solver at all."""
    triangle, right, rows, room = problem(seed, n_parameters, n_rows, allowed=True)

    step = constrained_step(triangle, right, rows, room)

    slack = room - rows @ step
    assert np.all(slack >= -1e-10 * (1 + np.abs(rows) @ np.abs(step)))
    slope = triangle.T @ (triangle @ step + right)
    active = rows[slack < 1e-8]
    size = 1 + np.abs(triangle.T) @ np.abs(right)
    if not active.size:
        np.testing.assert_allclose(slope / size, 0, atol=1e-9)
    else:
        assert optimize.nnls(active.T, -slope)[1] < 1e-7 * size.max()


def test_inactive_inequalities_give_the_solution_of_lstsq():
    triangle, right, rows, _ = problem(4, 4, 6, allowed=True)
    free = -np.linalg.lstsq(triangle, right, rcond=None)[0]

    step = constrained_step(triangle, right, rows, rows @ free + 1e-3)

    np.testing.assert_allclose(step, free, rtol=1e-12)


def test_no_inequalities_give_the_solution_of_lstsq():
    triangle, right, _, _ = problem(5, 3, 1, allowed=True)

    step = constrained_step(triangle, right, np.empty((0, 3)), np.empty(0))

    np.testing.assert_allclose(step, -np.linalg.lstsq(triangle, right, rcond=None)[0], rtol=1e-12)


def test_a_corner_without_room_holds_the_step_there():
    """All steps that lower the sum leave the cone: the best of them is none."""
    step = constrained_step(np.eye(2), np.array([-1.0, -1.0]), np.eye(2), np.zeros(2))

    np.testing.assert_allclose(step, 0, atol=1e-15)


@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1e4, 1e8])
def test_units_of_the_parameters_do_not_matter(scale: float):
    triangle, right, rows, room = problem(6, 4, 6, allowed=True)
    units = scale ** np.linspace(-0.5, 0.5, 4)
    expected = by_active_sets(triangle, right, rows, room)
    assert expected is not None
    assert np.min(np.abs(room - rows @ expected)) < 1e-9  # some inequality is in force

    step = constrained_step(triangle / units, right, rows / units, room)

    np.testing.assert_allclose(step / units, expected, rtol=1e-8)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e6, 1e12])
def test_units_of_the_residuals_do_not_matter(scale: float):
    triangle, right, rows, room = problem(7, 4, 6, allowed=True)
    expected = constrained_step(triangle, right, rows, room)
    assert np.min(np.abs(room - rows @ expected)) < 1e-9

    step = constrained_step(scale * triangle, scale * right, rows, room)

    np.testing.assert_allclose(step, expected, rtol=1e-9)


@pytest.mark.parametrize("scale", [1e-10, 1e10])
def test_units_of_each_inequality_do_not_matter(scale: float):
    triangle, right, rows, room = problem(8, 4, 6, allowed=True)
    expected = constrained_step(triangle, right, rows, room)
    assert np.min(np.abs(room - rows @ expected)) < 1e-9
    units = scale ** np.linspace(-0.5, 0.5, 6)

    step = constrained_step(triangle, right, rows * units[:, np.newaxis], room * units)

    np.testing.assert_allclose(step, expected, rtol=1e-9)


def test_nearly_dependent_columns_keep_the_inequalities():
    triangle, right, rows, room = problem(9, 4, 6, allowed=True)
    triangle[:, 3] = triangle[:, 2] + 1e-7 * triangle[:, 3]

    step = constrained_step(triangle, right, rows, room)

    assert np.all(rows @ step <= room + 1e-6 * (np.abs(rows) @ np.abs(step)))
    assert np.sum((triangle @ step + right) ** 2) <= np.sum(right**2)


def test_a_thousand_rows_of_which_few_matter():
    """Tangents to a ball: the step to a point outside ends on the line to it."""
    rng = np.random.default_rng(10)
    rows = rng.normal(size=(1000, 3))
    target = np.array([3.0, -2.0, 1.0])
    rows[0] = target
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)

    step = constrained_step(np.eye(3), -target, rows, np.ones(1000))

    slack = 1 - rows @ step
    assert slack.min() > -1e-12
    multipliers, distance = optimize.nnls(rows[slack < 1e-9].T, target - step)
    assert distance < 1e-9
    assert np.all(multipliers >= 0)


def test_a_row_of_zeros_says_nothing_where_there_is_room():
    rows, room = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([1.0, 0.5])

    step = constrained_step(np.eye(2), np.array([-1.0, -1.0]), rows, room)

    np.testing.assert_allclose(step, [0.5, 1.0], rtol=1e-12)


def test_repeated_inequalities_are_one():
    rows, room = np.tile([1.0, 1.0], (5, 1)), np.full(5, 1.0)

    step = constrained_step(np.eye(2), np.array([-2.0, -1.0]), rows, room)

    np.testing.assert_allclose(step, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("rows", "room"),
    [
        ([[1.0, 0.0], [-1.0, 0.0]], [-1.0, -1.0]),
        ([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [-0.1, 0.0, 0.0]),
        ([[1e6, 0.0], [-1e-6, 0.0]], [-1e6, -1e-6]),
    ],
)
def test_inequalities_that_contradict_each_other_are_refused(
    rows: list[list[float]], room: list[float]
):
    with pytest.raises(ValueError, match=r"^the inequalities contradict each other$"):
        constrained_step(np.eye(2), np.array([0.3, 0.2]), np.array(rows), np.array(room))
