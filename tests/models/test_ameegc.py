"""The exact second-order form holds all monotone EEGCs and no others; the paper's does not."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from members import each

from chartless.curves.fitting import fit
from chartless.errors import ParameterError
from chartless.models import Ameegc, AmeegcExact, Eegc

EXACT, PAPER, EEGC = AmeegcExact(), Ameegc(order=2), Eegc(order=2)


def logit(t: float) -> float:
    return float(np.log(t / (1 - t)))


EXACT_PARAMETERS = st.tuples(
    st.floats(-4, 4), st.floats(-6, 6), st.floats(1e-3, 1 - 1e-3).map(logit)
)


def barrier(x: np.ndarray) -> np.ndarray:
    """h(I) = −1/(I ln I): EEGCs increase where ψ' ≤ h."""
    return -1 / (x * np.log(x))


def tangent_point(slope: float) -> float:
    """Where h has this slope, by bisection on h' = (ln t + 1)/(t ln t)²."""
    low, high = 1e-12, 1 - 1e-12
    for _ in range(200):
        middle = (low + high) / 2
        log_t = np.log(middle)
        if (log_t + 1) / (middle * log_t) ** 2 < slope:
            low = middle
        else:
            high = middle
    return middle


def highest_first(second: float) -> tuple[float, float]:
    """Return the tangent point and the greatest monotone α₁ at a given α₂: h(t) − t h'(t)."""
    t = tangent_point(2 * second)
    return t, barrier(t) - t * 2 * second


@given(parameters=EXACT_PARAMETERS)
@example(parameters=(0.0, 0.0, logit(1e-3)))
@example(parameters=(0.0, 0.0, logit(0.999)))
@example(parameters=(0.0, 0.0, logit(np.exp(-1))))
@example(parameters=(4.0, 0.0, logit(0.5)))
@example(parameters=(-4.0, 6.0, logit(0.01)))
def test_exact_form_increases_for_all_parameters(parameters: tuple[float, float, float]):
    curve = EXACT.response(np.linspace(0, 1, 20_000), parameters)

    assert curve[0] == 0
    assert curve[-1] == 1
    assert np.all(np.diff(curve) >= 0)


@given(parameters=EXACT_PARAMETERS)
def test_exact_form_inverts_to_1e_12(parameters: tuple[float, float, float]):
    brightness = np.arange(4096) / 4095

    irradiance = EXACT.inverse(brightness, parameters)

    assert np.all(np.diff(irradiance) >= 0)
    assert np.abs(EXACT.response(irradiance, parameters) - brightness).max() <= 1e-12


@each("c", [-800.0, -300.0, -40.0, 40.0, 300.0, 800.0])
def test_exact_form_increases_or_refuses_when_a_search_runs_away(c: float):
    parameters = np.array([0.0, 1.0, c])
    irradiance = np.linspace(0, 1, 257)

    with suppress(ParameterError):
        curve = EXACT.response(irradiance, parameters)
        assert np.all(np.diff(curve) >= 0)  # not so where something is NaN
        assert np.all(np.diff(EXACT.inverse(irradiance, parameters)) >= 0)


def test_exact_form_at_one_over_e_is_the_first_order_form():
    alpha = EXACT.coefficients(np.array([0.3, 1.2, logit(np.exp(-1))]))

    assert alpha == pytest.approx([0.3, np.e - 1.2**2, 0.0], abs=1e-14)


@each("c", [-5.0, -0.54, 0.0, 3.0])
def test_coefficients_of_the_exact_form_differentiate_as_it_says(c: float):
    centre, step = np.array([0.2, 1.7, c]), 1e-6
    moves = step * np.eye(3)

    slopes = [
        (EXACT.coefficients(centre + d) - EXACT.coefficients(centre - d)) / (2 * step)
        for d in moves
    ]

    expected = np.transpose(slopes)  # central differences
    np.testing.assert_allclose(
        EXACT.coefficient_jacobian(centre), expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max()
    )


def test_paper_form_decreases_between_the_roots_of_its_barrier():
    irradiance = np.linspace(0, 1, 10_001)
    inside = irradiance[1:-1]
    broken = inside[np.e - 9 + 18 * inside > barrier(inside)]

    curve = PAPER.response(irradiance, [0.0, 3.0, 0.0])

    falling = irradiance[:-1][np.diff(curve) < 0]
    assert 0.8 in falling
    assert falling.min() == pytest.approx(broken.min(), abs=2e-4)
    assert falling.max() == pytest.approx(broken.max(), abs=2e-4)
    assert not PAPER.always_monotone


@given(parameters=st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-9, 9)))
def test_paper_form_never_has_a_first_coefficient_above_e(parameters: tuple[float, ...]):
    assert PAPER.coefficients(np.array(parameters))[1] <= np.e


def test_paper_form_misses_a_monotone_curve_that_the_exact_form_holds():
    second = -6.0
    _, bound = highest_first(second)
    irradiance = np.linspace(0, 1, 513)
    curve = EEGC.response(irradiance, [-0.5, bound - 0.01, second])
    assert bound > np.e + 1
    assert np.all(np.diff(curve) >= 0)

    assert fit(EXACT, irradiance, curve).rmse < 1e-8
    assert fit(PAPER, irradiance, curve).rmse > 1e-3


def test_every_monotone_curve_found_by_brute_force_has_exact_parameters():
    rng = np.random.default_rng(1990)
    grid = np.linspace(0, 1, 20_001)[1:-1]
    h = barrier(grid)
    pairs = rng.uniform(-10, 10, (1500, 2))
    monotone = [pair for pair in pairs if np.all(pair[0] + 2 * pair[1] * grid <= h)]
    assert 300 < len(monotone) < 1200

    for first, second in monotone:
        t, bound = highest_first(second)
        squared = bound - first
        assert squared > -1e-4  # a grid sees the bound a little too high
        parameters = np.array([0.0, np.sqrt(max(squared, 0.0)), logit(t)])
        expected = [0.0, min(first, bound), second]
        assert EXACT.coefficients(parameters) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@each("second", np.random.default_rng(7).uniform(-10, 10, 25))
def test_raising_the_first_coefficient_past_the_bound_breaks_monotony(second: float):
    t, bound = highest_first(second)
    near_t = np.linspace(0.999 * t, t + 0.001 * min(t, 1 - t), 101)
    margin = 1e-3 * abs(bound)

    def steps(first: float) -> np.ndarray:
        return np.diff(EEGC.response(near_t, [0.0, first, second]))

    assert np.all(steps(bound - margin) > 0)
    assert np.any(steps(bound + margin) < 0)
