"""The families that have a formula, against that formula in 40-digit arithmetic."""

from collections.abc import Callable, Sequence

import mpmath as mp
import numpy as np
import pytest
from members import FAMILIES, each, each_by_family, typical

from chartless.models import MODELS, AbstractModel, Gumbel, Property
from chartless.types import Floats

Numbers = Sequence[mp.mpf]
Formula = Callable[[Numbers, mp.mpf], mp.mpf]
IRRADIANCES = (1e-12, 1e-3, 0.18, 0.5, 0.9, 0.999999)


def barrier(irradiance: mp.mpf) -> mp.mpf:
    """h(I) = −1/(I ln I), the greatest slope of ψ under which I^exp ψ(I) increases."""
    return -1 / (irradiance * mp.log(irradiance))


def exact_exponent(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    """Integrate the tangent of h at t, lowered by s²; the slope of h is numerical here."""
    a, s, c = p
    t = 1 / (1 + mp.exp(-c))
    slope = mp.diff(barrier, t)
    lowest = barrier(t) - t * slope - s**2
    return a + lowest * irradiance + slope * irradiance**2 / 2


def power_series(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    return mp.fsum(a * irradiance**j for j, a in enumerate(p))


def affine_or_power(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    return p[0] + p[1] * irradiance ** p[2] if len(p) == 3 else irradiance ** (1 / p[0])


def through_white(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    highest = irradiance ** (len(p) + 1)
    return highest + mp.fsum(c * (irradiance ** (j + 1) - highest) for j, c in enumerate(p))


def paper_exponent(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    alpha = [p[0]]
    if len(p) > 1:
        alpha.append(mp.e - p[1] ** 2)
    if len(p) > 2:
        alpha.append(p[1] ** 2 - p[2] ** 2 / 2)
    return power_series(alpha, irradiance)


def gumbel_exponent(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    def integrand(t: mp.mpf) -> mp.mpf:
        t_log_t = t * mp.log(t)
        return mp.expm1(t_log_t * power_series(p[1:], t)) / t_log_t

    ends = [0, irradiance / 100, irradiance / 8, irradiance / 2, irradiance]
    return p[0] + (mp.quad(integrand, ends) if len(p) > 1 else 0)


def toe_and_shoulder(p: Numbers, irradiance: mp.mpf) -> mp.mpf:
    """PPISP: the heights of both parts follow from values and slopes that meet at c."""
    toe, shoulder, gamma = (
        mp.mpf(least) + mp.log1p(mp.exp(raw))
        for least, raw in zip(("0.3", "0.3", "0.1"), p, strict=False)
    )
    c = 1 / (1 + mp.exp(-p[3]))
    a, b = mp.lu_solve([[1, 1], [toe / c, -shoulder / (1 - c)]], [1, 0])
    if irradiance <= c:
        return (a * (irradiance / c) ** toe) ** gamma
    return (1 - b * ((1 - irradiance) / (1 - c)) ** shoulder) ** gamma


def of_exponent(exponent: Formula) -> Formula:
    return lambda p, irradiance: irradiance ** mp.exp(exponent(p, irradiance))


# Written down from the papers, not from the code.
FORMULAS: dict[str, Formula] = {
    "gamma": lambda p, irradiance: irradiance ** p[0],
    "eegc": of_exponent(power_series),
    "meegc": of_exponent(power_series),
    "ameegc": of_exponent(paper_exponent),
    "ameegc-exact": of_exponent(exact_exponent),
    "pegc": lambda p, irradiance: irradiance ** power_series(p, irradiance),
    "ggc": affine_or_power,
    "poly": lambda p, irradiance: irradiance * power_series(p, irradiance),
    "conpoly": through_white,
    "gumbel": of_exponent(gumbel_exponent),
    "ppisp": toe_and_shoulder,
}


CASES = [
    (model, parameters)
    for family in FORMULAS
    if family != "gumbel"
    for model in FAMILIES[family]
    if model.order in {0, 1, 2, 4, 10} or family == "ppisp"
    for parameters in [model.identity, typical(model, 1, 1.5), typical(model, 2, 1.5)]
]


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


def exactly(model: AbstractModel, irradiance: mp.mpf | float, parameters: Sequence) -> mp.mpf:
    return FORMULAS[model.family](list(map(mp.mpf, parameters)), mp.mpf(irradiance))


def test_every_family_with_a_formula_is_compared_with_it():
    has_formula = {
        model.family for model in MODELS.values() if Property.ANALYTICAL in model.properties
    }

    assert set(FORMULAS) == has_formula | {"meegc"}  # which has side constraints besides


@each_by_family("model, parameters", CASES)
def test_response_agrees_with_the_formula(model: AbstractModel, parameters: Floats):
    expected = [float(exactly(model, x, parameters)) for x in IRRADIANCES]

    response = model.response(IRRADIANCES, parameters)

    size = max(1.0, float(np.abs(parameters).max()))
    np.testing.assert_allclose(response, expected, rtol=1e-13 * size, atol=1e-15 * size)


@each(
    "name, irradiance, parameters, brightness",
    [
        ("eegc2", 0.25, [-0.8, 0.5, 0.1], 0.491513440568158785),
        ("eegc2", 0.90, [-1.0, 2.0, -0.75], 0.880094423749732008),
        ("meegc2", 0.25, [-0.8, 0.5, 0.1], 0.491513440568158785),
        ("gamma", 0.18, [2.2], 0.022993204992707),
        ("ggc0", 0.18, [1 / 2.2], 0.022993204992707),
        ("pegc1", 0.25, [0.5, 2.0], 0.25),
        ("ggc2", 0.25, [0.1, 0.8, 0.5], 0.5),
        ("poly2", 0.5, [1.0, 1.0, 1.0], 0.875),
        ("conpoly1", 0.5, [1.0, 1.0], 0.625),
        ("ppisp", 0.5, np.log(np.expm1([0.7, 0.7, 1.9, np.log(2)])), 0.25),  # I²
        ("ppisp", 0.25, np.log(np.expm1([1.7, 0.7, 0.9, np.log(2)])), 1 / 12),  # a = 1/3 at ½
        ("ppisp", 0.75, np.log(np.expm1([1.7, 0.7, 0.9, np.log(2)])), 2 / 3),
    ],
)
def test_response_agrees_with_a_number_from_elsewhere(
    name: str, irradiance: float, parameters: Sequence[float], brightness: float
):
    # mpmath to 30 digits, colour-science 0.4.6 (gamma), or arithmetic on paper
    assert MODELS[name].response(irradiance, parameters) == pytest.approx(brightness, rel=1e-12)


@each_by_family("model, parameters", CASES)
def test_derivative_agrees_with_the_slope_of_the_formula(model: AbstractModel, parameters: Floats):
    expected = [
        float(mp.diff(lambda x: exactly(model, x, parameters), mp.mpf(x), h=x * 1e-15))
        for x in IRRADIANCES
    ]

    slope = model.derivative(IRRADIANCES, parameters)

    scale = np.abs(expected).max(initial=1.0, where=np.array(IRRADIANCES) > 1e-6)
    np.testing.assert_allclose(slope, expected, rtol=1e-11, atol=1e-13 * scale)


@each_by_family("model, parameters", CASES)
def test_gradient_agrees_with_the_formula_at_other_parameters(
    model: AbstractModel, parameters: Floats
):
    def along(j: int, x: float) -> float:
        def response(value: mp.mpf) -> mp.mpf:
            return exactly(model, x, [*parameters[:j], value, *parameters[j + 1 :]])

        return float(mp.diff(response, mp.mpf(parameters[j])))

    expected = [[along(j, x) for j in range(model.n_parameters)] for x in IRRADIANCES]

    gradient = model.gradient(IRRADIANCES, parameters)

    np.testing.assert_allclose(gradient, expected, rtol=1e-11, atol=1e-14)


@each_by_family("model, parameters", CASES)
def test_slopes_at_the_ends_are_the_limits(model: AbstractModel, parameters: Floats):
    at_zero, at_one = model.derivative([0.0, 1.0], parameters)

    near_zero = mp.mpf("1e-4000")
    # An offset does not move the slope.
    moved = [0.0, *parameters[1:]] if model.name == "ggc2" else parameters
    limit = exactly(model, near_zero, moved) / near_zero
    expected = np.inf if limit > 1e6 else 0.0 if abs(limit) < 1e-6 else float(limit)
    assert at_zero == pytest.approx(expected, rel=1e-12)
    assert at_one == pytest.approx(slope_at_white(model, parameters), rel=1e-11, abs=1e-12)


def slope_at_white(model: AbstractModel, parameters: Floats) -> float:
    if model.family != "ppisp":
        slope = mp.diff(lambda x: exactly(model, x, parameters), 1, h=mp.mpf("1e-15"))
        return float(slope)
    with mp.workdps(2100):  # a power of 1 − I, so that no difference shows the limit but this
        near = mp.mpf("1e-2000")
        limit = (1 - exactly(model, 1 - near, parameters)) / near
    return np.inf if limit > 1e6 else 0.0 if limit < 1e-6 else float(limit)


# -- the integral of the Gumbel family --


def steep_members(order: int, steepness: float) -> list[list[float]]:
    """Members whose greatest |ln F'| is a share of what is admitted."""
    rng = np.random.default_rng(order)
    members = []
    for sign in (1, -1):
        roots = np.sort(rng.uniform(0, 1, order - 1))
        q = sign * np.polynomial.polynomial.polyfromroots(roots)
        t = np.linspace(0, 1, 4001)[1:-1]
        most = np.abs(np.polynomial.polynomial.polyval(t, q) * t * np.log(t)).max()
        members.append([-0.4, *(q * steepness / most)])
    return members


@pytest.mark.slow
@each(
    "order, steepness, tolerance",
    [(1, 1.0, 1e-13), (3, 1.0, 1e-13), (3, 5.9, 1e-12), (6, 3.0, 1e-12), (10, 2.0, 1e-12)],
)
def test_gumbel_agrees_with_its_integral(order: int, steepness: float, tolerance: float):
    model = Gumbel(order=order)
    for parameters in steep_members(order, steepness):
        expected, slopes = [], []
        with mp.workdps(20):
            numbers = list(map(mp.mpf, parameters))
            for x in map(mp.mpf, IRRADIANCES):
                f, x_log_x = exactly(model, x, parameters), x * mp.log(x)
                # F' = exp(I ln I q), and f' = F' f ln f / (I ln I).
                slope = mp.exp(x_log_x * power_series(numbers[1:], x)) * f * mp.log(f) / x_log_x
                expected.append(float(f))
                slopes.append(float(slope))

        np.testing.assert_allclose(
            model.response(IRRADIANCES, parameters), expected, rtol=10 * tolerance, atol=tolerance
        )
        np.testing.assert_allclose(
            model.derivative(IRRADIANCES, parameters), slopes, rtol=1e-11, atol=1e-13
        )


@each("order", [1, 3])
def test_gradient_of_gumbel_agrees_with_its_integral(order: int):
    model, parameters = Gumbel(order=order), steep_members(order, 2.0)[0]
    irradiance, expected = (1e-3, 0.3, 0.9), []
    with mp.workdps(18):
        numbers = list(map(mp.mpf, parameters))
        for x in map(mp.mpf, irradiance):
            f = exactly(model, x, parameters)
            # dψ/dq_j = ∫ t^j exp(t ln t q) dt
            by_q = [
                mp.quad(
                    lambda t, j=j: t ** (j + t * power_series(numbers[1:], t)),
                    [0, x / 100, x / 8, x],
                )
                for j in range(order)
            ]
            expected.append([float(f * mp.log(f) * each) for each in [1, *by_q]])

    np.testing.assert_allclose(
        model.gradient(irradiance, parameters), expected, rtol=1e-11, atol=1e-14
    )
