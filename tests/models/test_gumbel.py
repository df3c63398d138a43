"""The monotone family of any order, where its quadrature has most to do."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from members import each, examples, furthest, polynomials

from chartless.errors import ParameterError
from chartless.models import Eegc, Gumbel
from chartless.types import Floats

STEEPEST = 6.0
T = np.unique(np.concatenate([np.linspace(0, 1, 4001)[1:-1], np.geomspace(1e-9, 1e-3, 200)]))
T_LOG_T = T * np.log(T)
# Between points of the quadrature, and in clusters at the ends.
FINE = np.unique(np.concatenate([np.linspace(0, 1, 2500), np.geomspace(1e-15, 1e-3, 300)]))


def log_slope(parameters: Floats) -> Floats:
    """Ln F' = t ln t q(t)."""
    return T_LOG_T * np.polynomial.polynomial.polyval(T, parameters[1:])


def at_the_limit(model: Gumbel, a: float, series: Floats) -> Floats:
    parameters = furthest(model, np.concatenate([[0.0], series]))
    parameters[0] = a
    return parameters


@pytest.mark.slow
@each("order", range(1, 11))
@examples(30)
@given(data=st.data(), a=st.floats(-4, 4))
def test_members_at_the_limit_never_decrease(order: int, data: st.DataObject, a: float):
    model = Gumbel(order=order)
    series = data.draw(polynomials(order))
    parameters = at_the_limit(model, a, series)

    curve = model.response(FINE, parameters)

    assert np.diff(curve).min() >= -1e-15
    assert curve[0] == 0
    assert curve[-1] == 1


@examples(30)
@given(
    waves=st.lists(st.floats(-1, 1), min_size=10, max_size=10), a=st.sampled_from([-3.0, 0.0, 3.0])
)
@example(waves=[0.0] * 9 + [1.0], a=0.0)
@example(waves=[0.0] * 9 + [-1.0], a=0.0)
@example(waves=[0.0] * 8 + [1.0, 0.0], a=-3.0)
@example(waves=[0.0] * 8 + [1.0, 1.0], a=3.0)
def test_order_10_keeps_most_of_its_least_slope(waves: list[float], a: float):
    series = np.polynomial.Chebyshev(waves, domain=[0, 1]).convert(
        kind=np.polynomial.Polynomial, domain=[-1, 1]
    )
    model = Gumbel(order=10)
    coefficients = np.pad(series.coef, (0, 10 - series.coef.size))
    parameters = at_the_limit(model, a, coefficients)

    # F' from differences of F = x + ψ at the places where it is least.
    slopes = log_slope(parameters)
    places = np.argsort(slopes)[:50]
    places = places[(T[places] > 1e-4) & (T[places] < 1 - 1e-4)]
    step = 1e-4  # of x = ln(−ln I)
    x = np.log(-np.log(T[places]))
    before, after = (np.exp(-np.exp(x + move)) for move in (-step, step))
    rise = 2 * step + model._psi(after, parameters) - model._psi(before, parameters)

    assert np.all(rise / (2 * step) >= 0.9 * np.exp(slopes[places]) - 1e-9)


@each("order", [1, 3, 6, 10])
@examples(30)
@given(data=st.data())
def test_the_limit_is_that_of_the_slope_between_the_points_as_well(order: int, data: st.DataObject):
    model = Gumbel(order=order)
    series = data.draw(polynomials(order))
    most = float(np.abs(log_slope(np.concatenate([[0.0], series]))).max())
    if most < 1e-3:
        return
    unit = np.concatenate([[0.0], series / most])

    assert model.admits(0.999 * STEEPEST * unit)
    assert not model.admits(1.01 * STEEPEST * unit)


def test_steep_members_are_refused_and_not_approximated():
    with pytest.raises(ParameterError, match=r"gumbel1 .* not 0, 17$"):
        Gumbel(order=1).response(0.5, [0.0, 17.0])  # 17/e > 6

    assert Gumbel(order=1).response(0.5, [0.0, 16.0]) > 0


@each("order", [1, 2, 5])
def test_small_parameters_give_the_eegc_with_that_slope(order: int):
    q = np.random.default_rng(order).normal(size=order)
    x = np.linspace(0.01, 0.99, 31)

    def difference(size: float) -> float:
        alpha = np.concatenate([[0.2], size * q / np.arange(1, order + 1)])
        gumbel = Gumbel(order=order).response(x, np.concatenate([[0.2], size * q]))
        return float(np.abs(gumbel - Eegc(order=order).response(x, alpha)).max())

    assert difference(1e-4) < 1e-8
    assert difference(2e-3) / difference(1e-3) == pytest.approx(4, rel=0.05)  # of second order


def test_order_0_is_the_power_law():
    x = np.linspace(0, 1, 33)

    assert Gumbel(order=0).response(x, [np.log(0.45)]) == pytest.approx(x**0.45, abs=1e-14)


def test_curves_are_the_same_whatever_is_asked_along_with_them():
    model, parameters = Gumbel(order=3), [0.1, 1.0, -2.0, 0.5]
    together = model.response(FINE, parameters)

    one_by_one = [float(model.response(x, parameters)) for x in FINE[::100]]

    assert one_by_one == pytest.approx(together[::100], abs=1e-14)
