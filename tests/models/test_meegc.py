"""Monotone EEGCs of any order: what is admitted, the inequalities, the repair."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import each, examples, polynomials

from chartless.curves.fitting import fit
from chartless.models import Ameegc, AmeegcExact, Eegc, Meegc
from chartless.types import Floats

EXACT = AmeegcExact()
# As fine as a brute-force search may be, and clustered at both ends.
VERY_FINE = np.unique(
    np.concatenate(
        [
            np.arange(1, 100_000) / 100_000,
            np.geomspace(1e-15, 1e-3, 4000),
            1 - np.geomspace(1e-13, 1e-3, 4000),
        ]
    )
)
ORDERS = range(3, 9)


def barrier(x: Floats) -> Floats:
    """h(I) = −1/(I ln I): EEGCs increase where ψ' ≤ h."""
    return -1 / (x * np.log(x))


BARRIER = barrier(VERY_FINE)


def excess(alpha: Floats) -> tuple[float, float]:
    """Greatest ψ' − h by brute force, and where it is."""
    slope = np.polynomial.polynomial.polyval(VERY_FINE, alpha[1:] * np.arange(1, alpha.size))
    values = slope - BARRIER
    place = int(values.argmax())
    return float(values[place]), float(VERY_FINE[place])


def alphas(order: int, size: float = 20.0) -> st.SearchStrategy[Floats]:
    """Coefficients of ψ, whose slope turns often."""
    return polynomials(order, size).map(
        lambda slope: np.concatenate([[0.3], slope / np.arange(1, order + 1)])
    )


def touching(alpha: Floats, gap: float = 0.0) -> Floats:
    """The same ψ, tilted until ψ' is a gap below h."""
    moved = alpha.copy()
    moved[1] -= excess(alpha)[0] + gap
    return moved


@given(
    a=st.floats(-10, 10),
    c=st.floats(-8, 8),
    gap=st.floats(-9, 0).map(lambda power: 10.0**power),
    above=st.booleans(),
)
def test_order_2_admits_exactly_what_the_exact_form_reaches(
    a: float, c: float, gap: float, above: bool
):
    alpha = EXACT.coefficients(np.array([a, 0.0, c]))  # ψ' is a tangent of h
    distance = gap * max(1.0, float(np.abs(alpha[1:]).max()))
    alpha[1] += distance if above else -distance

    assert bool(Meegc(order=2).admits(alpha)) is not above


@given(
    first=st.floats(-20, 2 * np.e).filter(lambda value: abs(value - np.e) > 1e-9),
    a=st.floats(-5, 5),
)
def test_order_1_admits_slopes_up_to_e(first: float, a: float):
    admitted = bool(Meegc(order=1).admits(np.array([a, first])))

    assert admitted == (first < np.e)
    if admitted:
        same = Ameegc(order=1).coefficients(np.array([a, np.sqrt(np.e - first)]))
        assert same == pytest.approx([a, first], abs=1e-12)


@each("a", [-1e6, -3.0, 0.0, 5.0, 1e6])
def test_order_0_admits_every_finite_number(a: float):
    assert Meegc(order=0).admits(np.array([a]))
    assert not Meegc(order=0).admits(np.array([np.inf]))


@each("order", ORDERS)
@examples(25)
@given(data=st.data())
def test_admission_agrees_with_a_search_on_a_very_fine_grid(order: int, data: st.DataObject):
    model = Meegc(order=order)
    alpha = data.draw(alphas(order))
    size = max(1.0, float(np.abs(alpha).max()))
    greatest, _ = excess(alpha)
    rounding = 1e-12 * size

    if greatest > rounding:
        assert not model.admits(alpha)
    # The grid misses the top of a peak by its curvature times the square of a step.
    touch = touching(alpha)
    assert not model.admits(touch + 1e-6 * size * np.eye(order + 1)[1])
    assert model.admits(touch - 1e-6 * size * np.eye(order + 1)[1])


@each("order", ORDERS)
@examples(25)
@given(data=st.data())
def test_inequalities_contain_the_true_peak(order: int, data: st.DataObject):
    alpha = touching(data.draw(alphas(order)), gap=-0.1)  # over by a tenth
    greatest, place = excess(alpha)

    rows, limit = Meegc(order=order).inequalities(alpha)

    powers = np.arange(1, order + 1)
    at_place = powers * place ** (powers - 1)
    over = rows @ alpha - limit
    assert over.max() == pytest.approx(greatest, abs=1e-6 * max(1.0, float(np.abs(alpha).max())))
    # One of the rows is that of the peak itself.
    if VERY_FINE[0] < place < VERY_FINE[-1]:
        worst = rows[int(over.argmax()), 1:]
        assert worst == pytest.approx(at_place, rel=2e-3, abs=2e-3)


@each("order", [1, 2, 3, 8])
@examples(25)
@given(data=st.data())
def test_repaired_members_are_admitted_and_have_moved_little(order: int, data: st.DataObject):
    model = Meegc(order=order)
    violation = data.draw(st.floats(-12, 0).map(lambda power: 10.0**power))
    over = touching(data.draw(alphas(order)), gap=-violation)
    size = max(1.0, float(np.abs(over).max()))

    repaired = model.repaired(over)

    assert model.admits(repaired)
    move = np.abs(repaired - over)
    assert move.max() <= violation + 2e-6 * size
    assert not np.any(np.delete(move, 1))


def test_members_that_are_admitted_are_not_repaired():
    several = np.array([[0.0, 0.0, 0.0, 0.0], [0.2, 1.0, -0.5, 0.1], [0.0, 9.0, 0.0, 0.0]])

    repaired = Meegc(order=3).repaired(several)

    assert np.array_equal(repaired[:2], several[:2])
    assert repaired[2, 1] == pytest.approx(np.e, abs=1e-6)


@each("order", ORDERS)
def test_admitted_members_on_the_boundary_never_decrease(order: int):
    rng = np.random.default_rng(order)
    for size in (1.0, 30.0, 1000.0):
        slope = rng.uniform(-size, size, order)
        alpha = Meegc(order=order).repaired(np.concatenate([[rng.normal()], slope]))
        _, place = excess(alpha)

        around = place * (1 + np.linspace(-0.01, 0.01, 200))
        irradiance = np.sort(np.concatenate([VERY_FINE[::20], around[around < 1]]))
        curve = Meegc(order=order).response(irradiance, alpha)

        assert np.diff(curve).min() >= -1e-12


@each(
    "alpha, place",
    [
        # ψ' − h is greatest before the first and after the last place of the published grid
        ([0.0, 123.6, -11354.77], 0.0025),
        ([-3.0, 1800.0, -3243229.0], 0.00013),
        ([0.0, -8886000.0, 4446036.5], 0.99966),
    ],
)
def test_peaks_close_to_black_and_white_are_found(alpha: list[float], place: float):
    model, coefficients = Meegc(order=2), np.array(alpha)
    greatest, where = excess(coefficients)
    assert greatest > 0
    assert where == pytest.approx(place, rel=0.3)

    assert not model.admits(coefficients)
    assert model.admits(model.repaired(coefficients))


def test_a_peak_between_two_places_of_the_published_grid_is_found():
    places = np.arange(1, 256) / 256
    alpha = EXACT.coefficients(np.array([0.0, 0.0, np.log(100.5 / 155.5)]))  # tangent at 100.5/256
    alpha[1] += 1e-5
    assert np.all(alpha[1] + 2 * alpha[2] * places < barrier(places))

    assert not Meegc(order=2).admits(alpha)
    around = 100.5 / 256 + 1e-3 * np.linspace(-1, 1, 9)
    assert np.any(np.diff(Eegc(order=2).response(around, alpha)) < 0)


def test_a_fit_keeps_the_constraint_where_the_free_fit_breaks_it():
    irradiance = np.linspace(0, 1, 257)
    curve = Eegc(order=3).response(irradiance, [-0.5, 8.0, -12.0, 6.0])
    assert np.any(np.diff(curve) < 0)

    free, kept = fit(Eegc(order=3), irradiance, curve), fit(Meegc(order=3), irradiance, curve)

    assert free.rmse < 1e-8
    assert kept.rmse > free.rmse
    assert Meegc(order=3).admits(kept.parameters)
    assert excess(kept.parameters)[0] == pytest.approx(0, abs=1e-4)  # the constraint is in force
