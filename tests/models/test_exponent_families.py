"""Every family of `MODELS` against its formula in 40-digit arithmetic, and its promises."""

from collections.abc import Callable, Sequence

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless.errors import ParameterError, UnknownNameError
from chartless.models import MODELS, AbstractModel, Ameegc, Eegc

Parameters = Sequence[float]
Exponent = Callable[[Sequence[mp.mpf], mp.mpf], mp.mpf]
IRRADIANCES = (1e-12, 1e-3, 0.18, 0.5, 0.9, 0.999999)


def barrier(irradiance: mp.mpf) -> mp.mpf:
    """h(I) = −1/(I ln I), the greatest slope of ψ under which I^exp ψ(I) increases."""
    return -1 / (irradiance * mp.log(irradiance))


def exact_exponent(p: Sequence[mp.mpf], irradiance: mp.mpf) -> mp.mpf:
    """Integrate the tangent of h at t, lowered by s²; the slope of h is numerical here."""
    a, s, c = p
    t = 1 / (1 + mp.exp(-c))
    slope = mp.diff(barrier, t)
    lowest = barrier(t) - t * slope - s**2
    return a + lowest * irradiance + slope * irradiance**2 / 2


def polynomial_exponent(p: Sequence[mp.mpf], irradiance: mp.mpf) -> mp.mpf:
    return mp.fsum(a * irradiance**j for j, a in enumerate(p))


# ψ(I) of f = I^exp ψ(I), written down from the papers, not from the code.
EXPONENTS: dict[str, Exponent] = {
    "gamma": lambda p, _: mp.log(p[0]),
    **{f"eegc{order}": polynomial_exponent for order in range(7)},
    "ameegc0": lambda p, _: p[0],
    "ameegc1": lambda p, x: p[0] + (mp.e - p[1] ** 2) * x,
    "ameegc2": lambda p, x: p[0] + (mp.e - p[1] ** 2) * x + (p[1] ** 2 - p[2] ** 2 / 2) * x**2,
    "ameegc2-exact": exact_exponent,
}


def exact_response(name: str, irradiance: float | mp.mpf, parameters: Parameters) -> mp.mpf:
    x = mp.mpf(irradiance)
    return x ** mp.exp(EXPONENTS[name]([mp.mpf(p) for p in parameters], x))


def members(model: AbstractModel) -> list[list[float]]:
    """Return the linear camera and three members at some distance, the same in every run."""
    if model.name == "gamma":
        return [[1.0], [0.1], [1 / 2.2], [3.0]]
    rng = np.random.default_rng(2008)
    offsets = [np.zeros(model.n_parameters), *rng.uniform(-1.5, 1.5, (3, model.n_parameters))]
    return [list(map(float, model.identity + offset)) for offset in offsets]


CASES = [
    pytest.param(name, parameters, id=f"{name}-{k}")
    for name, model in MODELS.items()
    for k, parameters in enumerate(members(model))
]


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


@pytest.fixture(params=list(MODELS), scope="module")
def model(request: pytest.FixtureRequest) -> AbstractModel:
    return MODELS[request.param]


def parameters_of(model: AbstractModel, reach: float = 3.0) -> st.SearchStrategy[list[float]]:
    """Any member, far enough from the linear camera to find a false claim."""
    if model.name == "gamma":
        return st.lists(st.floats(0.02, 50.0), min_size=1, max_size=1)
    n = model.n_parameters
    return st.lists(st.floats(-reach, reach), min_size=n, max_size=n).map(
        lambda offsets: list(model.identity + offsets)
    )


def test_every_family_has_an_independent_formula():
    assert set(EXPONENTS) == set(MODELS)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_response_agrees_with_the_formula_in_40_digits(name: str, parameters: Parameters):
    expected = [float(exact_response(name, x, parameters)) for x in IRRADIANCES]

    response = MODELS[name].response(IRRADIANCES, parameters)

    np.testing.assert_allclose(response, expected, rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize(
    ("name", "irradiance", "parameters", "brightness"),
    [
        ("eegc2", 0.25, [-0.8, 0.5, 0.1], 0.491513440568158785),
        ("eegc2", 0.90, [-1.0, 2.0, -0.75], 0.880094423749732008),
        ("gamma", 0.18, [2.2], 0.022993204992707),
    ],
    ids=["mpmath, 30 digits", "mpmath, 30 digits, near white", "colour-science 0.4.6"],
)
def test_response_agrees_with_a_number_from_elsewhere(
    name: str, irradiance: float, parameters: Parameters, brightness: float
):
    assert MODELS[name].response(irradiance, parameters) == pytest.approx(brightness, rel=1e-12)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_derivative_agrees_with_differentiation_in_40_digits(name: str, parameters: Parameters):
    expected = [
        float(mp.diff(lambda x: exact_response(name, x, parameters), mp.mpf(x), h=x * 1e-15))
        for x in IRRADIANCES
    ]

    slope = MODELS[name].derivative(IRRADIANCES, parameters)

    scale = np.abs(expected).max(initial=1.0, where=np.array(IRRADIANCES) > 1e-6)
    np.testing.assert_allclose(slope, expected, rtol=1e-11, atol=1e-13 * scale)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_gradient_agrees_with_differentiation_in_40_digits(name: str, parameters: Parameters):
    def along(j: int, x: float) -> float:
        def response(value: mp.mpf) -> mp.mpf:
            moved = [*parameters[:j], value, *parameters[j + 1 :]]
            return exact_response(name, x, moved)

        return float(mp.diff(response, mp.mpf(parameters[j])))

    expected = [[along(j, x) for j in range(len(parameters))] for x in IRRADIANCES]

    gradient = MODELS[name].gradient(IRRADIANCES, parameters)

    np.testing.assert_allclose(gradient, expected, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_slopes_at_the_ends_are_the_limits(name: str, parameters: Parameters):
    at_zero, at_one = MODELS[name].derivative([0.0, 1.0], parameters)

    near_zero = mp.mpf("1e-4000")
    limit = exact_response(name, near_zero, parameters) / near_zero
    assert at_zero == (np.inf if limit > 1e6 else 0.0 if limit < 1e-6 else 1.0)
    expected = mp.diff(lambda x: exact_response(name, x, parameters), 1, h=mp.mpf("1e-15"))
    assert at_one == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_ends_do_not_move_with_the_parameters(name: str, parameters: Parameters):
    gradient = MODELS[name].gradient([0.0, 1.0], parameters)

    assert np.array_equal(gradient, np.zeros((2, len(parameters))))


@given(data=st.data())
def test_every_member_keeps_the_ends_and_the_range(model: AbstractModel, data: st.DataObject):
    parameters = data.draw(parameters_of(model))

    curve = model.response(np.linspace(0, 1, 257), parameters)

    assert curve[0] == 0
    assert curve[-1] == 1
    assert np.all((curve >= 0) & (curve <= 1))


PROMISED = [name for name, model in MODELS.items() if model.always_monotone]


@pytest.mark.parametrize("name", PROMISED)
@given(data=st.data())
def test_curves_that_are_said_to_increase_never_decrease(name: str, data: st.DataObject):
    parameters = data.draw(parameters_of(MODELS[name], reach=6.0))

    curve = MODELS[name].response(np.linspace(0, 1, 2001), parameters)

    assert np.all(np.diff(curve) >= 0)


def test_the_families_that_cannot_decrease_say_so():
    # orders whose parameters leave no room, and the exact form
    assert set(PROMISED) == {"gamma", "eegc0", "ameegc0", "ameegc1", "ameegc2-exact"}


def test_identity_parameters_give_the_linear_camera(model: AbstractModel):
    irradiance = np.linspace(0, 1, 1025)

    response = model.response(irradiance, model.identity)

    np.testing.assert_allclose(response, irradiance, rtol=0, atol=4e-16)


@pytest.mark.parametrize(("name", "parameters"), CASES)
@pytest.mark.parametrize("n_levels", [256, 65536])
def test_inverse_comes_back_to_every_level(name: str, parameters: Parameters, n_levels: int):
    model = MODELS[name]
    brightness = np.arange(n_levels) / (n_levels - 1)

    irradiance = model.inverse(brightness, parameters)

    assert irradiance[0] == 0
    assert irradiance[-1] == 1
    assert np.all((irradiance >= 0) & (irradiance <= 1))
    assert np.abs(model.response(irradiance, parameters) - brightness).max() <= 1e-12


@given(data=st.data())
def test_inverse_comes_back_from_any_member_even_one_that_decreases(
    model: AbstractModel, data: st.DataObject
):
    parameters = data.draw(parameters_of(model))
    brightness = np.arange(1, 255) / 255

    irradiance = model.inverse(brightness, parameters)

    found = irradiance > 0  # 0: smaller than any float64
    error = np.abs(model.response(irradiance, parameters) - brightness)
    # Where the curve is very steep, the nearest float64 is all that can be had.
    nearest = np.spacing(irradiance) * np.abs(model.derivative(irradiance, parameters))
    assert np.all(error[found] <= (1e-12 + nearest)[found])
    # What underflows is below the smallest normal float64.
    assert np.all(model.response(2.3e-308, parameters) >= brightness[~found])


def test_irradiance_beyond_the_ends_is_clipped(model: AbstractModel):
    response = model.response([-0.5, 1.5], model.identity)

    assert response.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("wrong", ["none", "too few", "too many", "nested", "nan", "infinite"])
@pytest.mark.parametrize("method", ["response", "inverse", "derivative", "gradient"])
def test_unusable_parameters_are_refused(model: AbstractModel, wrong: str, method: str):
    good = model.identity
    parameters = {
        "none": [],
        "too few": good[:-1],
        "too many": [*good, 1.0],
        "nested": [good],
        "nan": [*good[:-1], np.nan],
        "infinite": [*good[:-1], np.inf],
    }[wrong]

    with pytest.raises(ParameterError, match=rf"^{model.name} takes {model.n_parameters} "):
        getattr(model, method)(0.5, parameters)


@pytest.mark.parametrize("gamma", [0.0, -1.0])
def test_gamma_must_be_positive(gamma: float):
    with pytest.raises(ParameterError, match="gamma > 0"):
        MODELS["gamma"].response(0.5, [gamma])


@pytest.mark.parametrize("brightness", [-1e-9, 1 + 1e-9, np.nan])
def test_brightness_outside_the_range_is_refused(model: AbstractModel, brightness: float):
    with pytest.raises(ParameterError, match="brightness"):
        model.inverse([0.5, brightness], model.identity)


@pytest.mark.parametrize("order", [-1, 3])
def test_ameegc_has_three_orders(order: int):
    with pytest.raises(ParameterError, match="orders 0, 1 and 2"):
        Ameegc(order=order)


def test_unknown_name_suggests_the_closest():
    with pytest.raises(UnknownNameError, match=r"'ameegc2-exat'\. Did you mean 'ameegc2-exact'\?"):
        MODELS["ameegc2-exat"]


def test_names_are_those_of_the_registry(model: AbstractModel):
    assert MODELS[model.name] is model
    assert model.n_parameters == model.order + 1
    assert model.identity.shape == (model.n_parameters,)


@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 3, 4)])
def test_shapes_are_kept(model: AbstractModel, shape: tuple[int, ...]):
    values = np.full(shape, 0.5)

    assert model.response(values, model.identity).shape == shape
    assert model.inverse(values, model.identity).shape == shape
    assert model.derivative(values, model.identity).shape == shape
    assert model.gradient(values, model.identity).shape == (*shape, model.n_parameters)


def test_arguments_are_left_as_they_were(model: AbstractModel):
    values, parameters = np.linspace(0, 1, 5), model.identity

    for method in (model.response, model.inverse, model.derivative, model.gradient):
        method(values, parameters)

    assert np.array_equal(values, np.linspace(0, 1, 5))
    assert np.array_equal(parameters, model.identity)


def test_eegc_goes_to_any_order_and_each_contains_the_one_below():
    grid = np.linspace(0, 1, 101)

    low = Eegc(order=7).response(grid, [-0.5, 0.4, 0.1, 0.0, 0.2, 0.0, 0.1, 0.3])
    high = Eegc(order=8).response(grid, [-0.5, 0.4, 0.1, 0.0, 0.2, 0.0, 0.1, 0.3, 0.0])

    assert np.array_equal(low, high)
