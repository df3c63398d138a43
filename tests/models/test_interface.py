"""What `AbstractModel` promises, of every family: values, inverse, slopes, shapes, refusals."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import FAMILIES, GRID, SAMPLE, anything, each, each_by_family, examples, typical

from chartless.errors import ParameterError, UnknownNameError
from chartless.models import (
    MODELS,
    AbstractModel,
    Ameegc,
    AmeegcExact,
    ConPoly,
    Eegc,
    Gamma,
    Ggc,
    Gumbel,
    LogEmor,
    Meegc,
    Pegc,
    Poly,
    PolynomialExponentModel,
    Property,
    Table,
)
from chartless.types import Floats

METHODS = ("response", "inverse", "derivative", "gradient")
ON_NODES = {"emor": 1024, "emor-monotone": 1024, "logemor": 1025}  # of irradiance
INVERSE_ON_NODES = {"inverse-emor": 1024, "table": 256}  # of brightness


def increasing(model: AbstractModel) -> list[Floats]:
    """Members that increase: at least one, and those that can be found nearby."""
    members = [typical(model, seed, reach) for seed in range(2) for reach in (0.1, 1.0)]
    if model.family in {"emor", "logemor"}:
        members.append(np.zeros(model.n_parameters))  # their mean
    found = [each for each in members if np.all(np.diff(model.response(GRID, each)) >= 0)]
    assert found
    return found


def between_nodes(model: AbstractModel, parameters: Floats) -> Floats:
    """Irradiances at which the curve has a slope: not where two straight lines meet."""
    if model.family in ON_NODES:
        last = ON_NODES[model.family] - 1
        return (np.arange(3, last - 3, 41) + 0.5) / last
    if model.family in INVERSE_ON_NODES:
        last = INVERSE_ON_NODES[model.family] - 1
        brightness = (np.arange(last // 10, last - 3, last // 25) + 0.5) / last
        return model.inverse(brightness, parameters)
    return np.linspace(0.01, 0.99, 25)


def rounding(model: AbstractModel, irradiance: Floats, parameters: Floats) -> Floats:
    """What the spacing of float64 in irradiance does to the brightness."""
    with np.errstate(invalid="ignore"):
        moved = np.spacing(irradiance) * np.abs(model.derivative(irradiance, parameters))
    return np.where(np.isfinite(moved), moved, 0.0)


def largest_term(model: AbstractModel, irradiance: Floats, parameters: Floats) -> Floats:
    """Of the sum ψ, which is computed to the last bits of it."""
    if not isinstance(model, PolynomialExponentModel):
        return np.full_like(irradiance, np.abs(parameters).max())
    alpha = np.abs(model.coefficients(parameters))
    return np.max(alpha * irradiance[:, np.newaxis] ** np.arange(alpha.size), axis=1)


# -- inverse --


@each_by_family("model", SAMPLE)
def test_inverse_comes_back_to_every_level_that_the_curve_reaches(model: AbstractModel):
    for parameters in increasing(model):
        least, greatest = model.response([0, 1], parameters)
        brightness = np.arange(1024) / 1023
        brightness = brightness[(brightness >= max(least, 0)) & (brightness <= greatest)]

        irradiance = model.inverse(brightness, parameters)

        assert np.all(np.diff(irradiance) >= -1e-15)
        error = np.abs(model.response(irradiance, parameters) - brightness)
        inside = (brightness > 0) & (brightness < 1)  # elsewhere 0 → 0 and 1 → 1 come first
        assert np.all(error[inside] <= 1e-12 + rounding(model, irradiance, parameters)[inside])


@each_by_family("model", SAMPLE)
def test_inverse_comes_back_to_the_irradiance(model: AbstractModel):
    irradiance = np.linspace(0.001, 0.999, 199)
    for parameters in increasing(model):
        brightness = model.response(irradiance, parameters)
        slope = model.derivative(irradiance, parameters)
        clear = (brightness >= 0) & (brightness <= 1) & (slope > 1e-3)
        assert clear.any()

        found = model.inverse(brightness[clear], parameters)

        error = np.abs(found - irradiance[clear])
        assert np.all(error <= 2e-12 / slope[clear] + 1e-14)
        assert np.all(error <= 3e-9)


@pytest.mark.slow
@each_by_family(
    "model",
    [
        model
        for model in SAMPLE
        if Property.MONOTONE in model.properties and model.family not in INVERSE_ON_NODES
    ],
)
@examples(12)
@given(data=st.data())
def test_inverse_comes_back_from_the_steepest_members(model: AbstractModel, data: st.DataObject):
    parameters = data.draw(anything(model))
    brightness = np.arange(1, 64) / 64

    irradiance = model.inverse(brightness, parameters)

    assert np.all((irradiance >= 0) & (irradiance <= 1))
    least, greatest = model.response([2.3e-308, 1 - 2.0**-53], parameters)
    found = (irradiance > 1e-307) & (brightness >= least) & (brightness <= greatest)
    error = np.abs(model.response(irradiance, parameters) - brightness)
    # An increasing curve takes the brightness between the neighbours of the irradiance.
    below = model.response(np.nextafter(irradiance, 0), parameters)
    above = model.response(np.nextafter(irradiance, 1), parameters)
    least_error = 1.1e-12 + 8 * np.finfo(float).eps * largest_term(model, irradiance, parameters)
    # It is found as ln(−ln I), whose last bit is that many of I.
    minus_log = -np.log(irradiance.clip(1e-307, 1 - 2.0**-53))
    bits = 2 + minus_log * (1 + np.abs(np.log(minus_log)))
    assert np.all(error[found] <= (least_error + bits * (above - below))[found])


@each(
    "model, parameters, brightness, irradiance",
    [
        (Poly(order=0), [0.5], [0.25, 0.5, 0.6, 0.999], [0.5, 1.0, 1.0, 1.0]),
        (Poly(order=2), [0.2, 0.2, 0.1], [0.51, 0.9], [1.0, 1.0]),
        (Ggc(order=2), [0.2, 0.5, 1.0], [0.1, 0.199, 0.45, 0.701, 0.9], [0.0, 0.0, 0.5, 1.0, 1.0]),
        (Pegc(order=0), [1e-3], [0.1], [0.0]),
        (Pegc(order=0), [1e6], [1 - 2.0**-53], [1.0]),
        (Gamma(), [1e-3], [0.1], [0.0]),
        (Eegc(order=0), [-30.0], [0.1, 0.9], [0.0, 0.0]),
    ],
)
def test_brightness_out_of_reach_gives_the_nearer_end(
    model: AbstractModel, parameters: list[float], brightness: list[float], irradiance: list[float]
):
    assert model.inverse(brightness, parameters) == pytest.approx(irradiance, abs=1e-12)


@each("model", [Pegc(order=0), Gamma()])
def test_a_very_steep_end_is_inverted_to_the_last_float(model: AbstractModel):
    brightness = 1 - np.array([1e-7, 1e-8, 1e-9])

    irradiance = model.inverse(brightness, [1e6])

    error = np.abs(model.response(irradiance, [1e6]) - brightness)
    assert error.max() <= 1e6 * np.spacing(1.0)


@each("steep", [0.01, 0.05, 0.2])
def test_a_steep_start_is_inverted(steep: float):
    parameters = [steep, 0.5, 0.3]
    brightness = np.arange(1, 256) / 255

    irradiance = Pegc(order=2).inverse(brightness, parameters)

    found = irradiance > 1e-307
    assert found.sum() > 100
    error = np.abs(Pegc(order=2).response(irradiance, parameters) - brightness)
    assert error[found].max() <= 1e-12
    assert np.all(np.diff(irradiance[found]) > 0)


@pytest.mark.slow
@each_by_family("model", SAMPLE)
@examples(8)
@given(data=st.data())
def test_black_and_white_are_inverted_exactly_whatever_the_member(
    model: AbstractModel, data: st.DataObject
):
    parameters = data.draw(anything(model))

    irradiance = model.inverse(np.linspace(0, 1, 33), parameters)

    assert irradiance[0] == 0
    assert irradiance[-1] == 1
    assert np.all((irradiance >= 0) & (irradiance <= 1))


@each(
    "model, parameters",
    [
        (Eegc(order=2), [0.0, 6.0, -1.0]),
        (Ameegc(order=2), [0.0, 3.0, 0.0]),
        (Pegc(order=2), [0.3, 3.0, 0.0]),
        (Poly(order=2), [3.0, -5.0, 3.0]),
        (ConPoly(order=2), [3.0, -5.0, 2.0]),
    ],
)
def test_inverse_of_a_curve_that_decreases_is_one_of_the_places(
    model: AbstractModel, parameters: list[float]
):
    assert np.any(np.diff(model.response(GRID, parameters)) < 0)
    brightness = np.linspace(0.01, 0.99, 99)

    irradiance = model.inverse(brightness, parameters)

    assert np.abs(model.response(irradiance, parameters) - brightness).max() <= 1e-12
    assert np.all(np.diff(irradiance) >= 0)


@each("model", SAMPLE)
@each("brightness", [-1e-9, 1 + 1e-9, np.nan])
def test_brightness_outside_the_range_is_refused(model: AbstractModel, brightness: float):
    with pytest.raises(ParameterError, match="brightness"):
        model.inverse([0.5, brightness], model.identity)


# -- slopes --


@each_by_family("model", SAMPLE)
def test_gradient_agrees_with_differences(model: AbstractModel):
    for seed in range(2):
        parameters = typical(model, seed, reach=0.5)
        irradiance = between_nodes(model, parameters)
        step = 1e-7 if model.family in INVERSE_ON_NODES else 1e-5
        moves = step * np.eye(model.n_parameters)
        sets = np.concatenate([parameters + moves, parameters - moves])
        if model.constrained:  # a table need not admit a member next to one that it admits
            after, before = np.split(model._response(irradiance, sets), 2)
        else:
            after, before = np.split(model.response(irradiance, sets), 2)

        gradient = model.gradient(irradiance, parameters)

        expected = ((after - before) / (2 * step)).T
        size = max(1.0, float(np.abs(expected).max()))
        # Second differences and rounding over the step.
        np.testing.assert_allclose(gradient, expected, rtol=1e-6, atol=4e-8 * size)


@each_by_family("model", SAMPLE)
def test_derivative_agrees_with_differences(model: AbstractModel):
    for seed in range(3):
        parameters = typical(model, seed, reach=0.5)
        irradiance, step = between_nodes(model, parameters), 1e-6
        around = np.concatenate([irradiance + step, irradiance - step])

        slope = model.derivative(irradiance, parameters)

        after, before = np.split(model.response(around, parameters), 2)
        np.testing.assert_allclose(slope, (after - before) / (2 * step), rtol=1e-6, atol=1e-7)


@each_by_family("model", SAMPLE)
def test_evaluate_gives_response_and_gradient(model: AbstractModel):
    sets = np.array([typical(model, seed) for seed in range(3)])
    irradiance = np.linspace(0, 1, 17)

    for parameters in (sets, sets[0]):
        response, gradient = model.evaluate(irradiance, parameters)

        assert np.array_equal(response, model.response(irradiance, parameters))
        assert np.array_equal(gradient, model.gradient(irradiance, parameters))


@each("model", SAMPLE)
def test_ends_that_do_not_move_have_no_gradient(model: AbstractModel):
    if Property.ENDS not in model.properties:
        return
    gradient = model.gradient([0, 1], typical(model, 0))

    # Rounding of a basis that is stored as float32 moves no end: it is exactly 0 there.
    assert np.array_equal(gradient, np.zeros((2, model.n_parameters)))


# -- many at once, shapes --


@each_by_family("model", SAMPLE)
def test_many_members_at_once_are_the_same_as_one_by_one(model: AbstractModel):
    sets = np.array([[typical(model, 3 * i + j) for j in range(3)] for i in range(2)])
    irradiance = np.array([[0.0, 0.2], [0.7, 1.0]])

    response = model.response(irradiance, sets)
    gradient = model.gradient(irradiance, sets)

    assert response.shape == (2, 3, 2, 2)
    assert gradient.shape == (2, 3, 2, 2, model.n_parameters)
    for place in np.ndindex(2, 3):
        one = model.response(irradiance, sets[place])
        np.testing.assert_allclose(response[place], one, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(
            gradient[place], model.gradient(irradiance, sets[place]), rtol=1e-12, atol=1e-14
        )
    assert model.admits(sets).shape == (2, 3)
    assert model.repaired(sets).shape == sets.shape


@each_by_family("model", SAMPLE)
def test_shapes_are_kept(model: AbstractModel):
    for shape in ((), (0,), (3,), (2, 0), (2, 3, 4)):
        values = np.full(shape, 0.5)

        for method in ("response", "inverse", "derivative"):
            result = getattr(model, method)(values, model.identity)
            assert (result.shape, result.dtype) == (shape, np.float64), method
        assert model.gradient(values, model.identity).shape == (*shape, model.n_parameters)


@each("model", SAMPLE)
def test_no_members_are_no_error(model: AbstractModel):
    none = np.empty((0, model.n_parameters))

    assert model.response([0.2, 0.5], none).shape == (0, 2)
    assert model.gradient([0.2, 0.5], none).shape == (0, 2, model.n_parameters)
    assert model.admits(none).shape == (0,)


@each("model", SAMPLE)
def test_arguments_are_left_as_they_were(model: AbstractModel):
    values, parameters = np.linspace(0, 1, 5), typical(model, 0)
    before = parameters.copy()

    for method in METHODS:
        getattr(model, method)(values, parameters)
    model.repaired(parameters)
    model.inequalities(parameters)

    assert np.array_equal(values, np.linspace(0, 1, 5))
    assert np.array_equal(parameters, before)


@each("model", SAMPLE)
def test_irradiance_beyond_the_ends_is_clipped(model: AbstractModel):
    parameters = typical(model, 0)

    beyond = model.response([-0.5, 1.5], parameters)

    assert np.array_equal(beyond, model.response([0, 1], parameters))


# -- the linear camera --

NEAREST_ONLY = {"emor", "emor-monotone", "inverse-emor", "logemor"}


@each("model", SAMPLE)
def test_identity_is_the_linear_camera(model: AbstractModel):
    if model.family in NEAREST_ONLY:
        return
    irradiance = np.linspace(0, 1, 1025)

    np.testing.assert_allclose(
        model.response(irradiance, model.identity), irradiance, rtol=0, atol=4e-16
    )


@each("family", sorted(NEAREST_ONLY))
def test_identity_of_measured_families_is_the_nearest_member(family: str):
    irradiance = np.linspace(0, 1, 1024)
    distances = []
    for model in FAMILIES[family]:
        assert model.admits(model.identity)
        away = model.response(irradiance, model.identity) - irradiance
        distances.append(float(np.sqrt(np.mean(away**2))))

    falls = np.diff(distances) <= 1e-9
    if family == "emor":
        assert np.all(falls)
    assert distances[-1] < 0.1 * distances[0]
    assert distances[-1] < 0.005


# -- extremes --


@pytest.mark.slow
@each_by_family("model", SAMPLE)
@each("size", [1e-300, 1e-12, 1e3, 1e6])
def test_extreme_parameters_give_numbers_or_a_refusal(model: AbstractModel, size: float):
    for signs in ([1.0], [-1.0], [1.0, -1.0], [-1.0, 1.0]):
        parameters = size * np.resize(signs, model.n_parameters)

        for method in METHODS:
            with suppress(ParameterError):
                result = getattr(model, method)(GRID[::4], parameters)
                assert not np.isnan(result).any(), method
                if method in {"response", "inverse"}:
                    assert np.isfinite(result).all(), method


@pytest.mark.slow
@each_by_family("model", SAMPLE)
@examples(8)
@given(data=st.data())
def test_no_member_gives_nan(model: AbstractModel, data: st.DataObject):
    parameters = data.draw(anything(model))

    for method in METHODS:
        result = getattr(model, method)(GRID[::8], parameters)
        assert not np.isnan(result).any(), method


# -- refusals --


@each_by_family("model", SAMPLE)
@each("wrong", ["none", "too few", "too many", "nan", "infinite"])
def test_unusable_parameters_are_refused_by_name(model: AbstractModel, wrong: str):
    good = model.identity
    parameters = {
        "none": [],
        "too few": good[:-1],
        "too many": [*good, 1.0],
        "nan": [*good[:-1], np.nan],
        "infinite": [*good[:-1], np.inf],
    }[wrong]

    for method in METHODS:
        with pytest.raises(ParameterError) as refusal:
            getattr(model, method)(0.5, parameters)

        sentence, n = str(refusal.value), model.n_parameters
        assert sentence.startswith(f"{model.name} takes {n} finite parameter{'s' * (n > 1)} ")
        assert all(name in sentence for name in model.parameter_names[:8])


@each("model", SAMPLE)
@each("method", ["inverse", "derivative"])
def test_several_members_are_refused_where_one_is_asked_for(model: AbstractModel, method: str):
    with pytest.raises(ParameterError, match="not sets of them"):
        getattr(model, method)(0.5, [model.identity, model.identity])


@each(
    "model, parameters, message",
    [
        (Gamma(), [0.0], r"gamma takes 1 finite parameter \(gamma > 0\), not 0$"),
        (Gamma(), [-1.0], r"\(gamma > 0\), not -1$"),
        (Ggc(order=0), [0.0], r"ggc0 .*\(gamma > 0\)"),
        (Ggc(order=2), [0.0, -1.0, 1.0], r"ggc2 .*\(alpha, beta > 0, gamma > 0\), not 0, -1, 1$"),
        (Pegc(order=1), [-0.1, 2.0], r"pegc1 .*\(a0 > 0, a1\), not -0.1, 2$"),
        (AmeegcExact(), [0.0, 1.0, 100.0], r"ameegc2-exact .*\(a, s, -100 < c < 100\)"),
        (Meegc(order=1), [0.0, 3.0], r"meegc1 .*\(a0, a1\) of a curve that never decreases, not"),
        (MODELS["emor0-monotone"], [99.0], r"emor0-monotone .*\(c1\) of a curve that never dec"),
        (Gumbel(order=1), [0.0, 50.0], r"gumbel1 .*\(a, q0\) with \|t ln t q\(t\)\| of 6 at most"),
        (Table(order=1), [-1.0, 0.5], r"table .*\(t1, t2\) that never decrease and end at 0 or b"),
        (Table(order=1), [-1.0, -2.0], r"not -1, -2$"),
        (Eegc(order=1), [[0.0, 1.0], [2.0, np.nan]], r"eegc1 .*\(a0, a1\), not 2, nan$"),
        (Table(), np.full(254, np.nan), r"t7, t8, …\) .* not nan, .*nan, …$"),
    ],
)
def test_refusals_name_the_family_the_limit_and_what_was_given(
    model: AbstractModel, parameters: list[float], message: str
):
    with pytest.raises(ParameterError, match=message):
        model.response(0.5, parameters)


@each(
    "make, message",
    [
        (lambda: Ameegc(order=-1), "orders 0, 1 and 2, not -1"),
        (lambda: Ameegc(order=3), "orders 0, 1 and 2, not 3"),
        (lambda: Ggc(order=1), "GGC has the orders 0 and 2, not 1"),
        (lambda: Gamma(order=1), "gamma has the order 0 only, not 1"),
        (lambda: AmeegcExact(order=3), "order 2 only, not 3"),
        (lambda: Eegc(order=-1), "eegc has the orders 0, 1, 2 …, not -1"),
        (lambda: Poly(order=-1), "poly has the orders"),
        (lambda: Gumbel(order=-2), "gumbel has the orders"),
        (lambda: LogEmor(25), "logemor has the orders 0 to 24, not 25"),
        (lambda: LogEmor(-1), "logemor has the orders 0 to 24, not -1"),
        (lambda: Table(order=0), "two inner levels or more, not 1"),
        (lambda: Table(smoothness=0.0), "smoothness must be above 0, not 0"),
    ],
)
def test_orders_that_a_family_does_not_have_are_refused(make, message: str):
    with pytest.raises(ParameterError, match=message):
        make()


# -- the registry --


def test_unknown_name_suggests_the_closest():
    with pytest.raises(UnknownNameError, match=r"'ameegc2-exat'\. Did you mean 'ameegc2-exact'\?"):
        MODELS["ameegc2-exat"]


@each("name", MODELS)
def test_names_and_numbers_of_parameters_are_consistent(name: str):
    model = MODELS[name]

    assert model.name == name
    assert model.n_parameters == model.order + 1
    assert len(set(model.parameter_names)) == model.n_parameters
    assert model.identity.shape == (model.n_parameters,)
    assert all(bound.shape == (model.n_parameters,) for bound in model.bounds)
    assert model.admits(model.identity)
    assert model.formula
    assert model.always_monotone == (Property.MONOTONE in model.properties)


@each("model", SAMPLE)
def test_side_constraints_belong_to_constrained_families(model: AbstractModel):
    rows, limit = model.inequalities(model.identity)

    assert rows.shape == (limit.size, model.n_parameters)
    assert (limit.size > 0) == model.constrained
    assert np.all(rows @ model.identity <= limit + 1e-6)


@each_by_family("model", SAMPLE)
def test_starts_are_admitted_for_every_curve(model: AbstractModel):
    irradiance = np.linspace(0, 1, 65)
    brightness = irradiance ** np.array([[0.3], [1.0], [2.5]])

    starts = model.starts(irradiance, brightness)

    assert starts.ndim == 3
    assert starts.shape[::2] == (3, model.n_parameters)
    assert np.all(model.admits(starts))
