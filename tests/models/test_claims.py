"""Each property that a family claims holds, and each that it does not claim fails somewhere."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import FAMILIES, GRID, SAMPLE, anything, each, each_by_family, examples, typical

from chartless.curves.fitting import fit_many
from chartless.datasets import Dorf, load_dorf
from chartless.errors import ParameterError
from chartless.models import MODELS, AbstractModel, Property, Table
from chartless.types import Floats

LEVEL = np.arange(256) / 255
INSIDE = np.linspace(0.45, 0.48, 2**11 + 1)  # holds thirty points of a measured basis


class Fails(NamedTuple):
    """First parameters of a member without the property; the others are 0."""

    parameters: tuple[float, ...]
    from_order: int = 0


# One line for each property that a family lacks. Those of the family as a whole follow below.
COUNTEREXAMPLES: dict[str, dict[Property, Fails]] = {
    "gamma": {},
    "eegc": {Property.MONOTONE: Fails((0.0, 10.0), from_order=1)},
    "meegc": {},
    "ameegc": {Property.MONOTONE: Fails((0.0, 3.0, 0.0), from_order=2)},
    "ameegc-exact": {},
    "gumbel": {},
    "ppisp": {},
    "pegc": {
        Property.MONOTONE: Fails((0.5, 10.0), from_order=1),
        Property.BOUNDED: Fails((0.5, -1.0), from_order=1),
    },
    "ggc": {
        Property.ENDS: Fails((0.1, 0.8, 0.5), from_order=2),
        Property.BOUNDED: Fails((0.5, 1.0, 1.0), from_order=2),
    },
    "poly": {
        Property.ENDS: Fails((0.5,)),
        Property.MONOTONE: Fails((-1.0,)),
        Property.BOUNDED: Fails((2.0,)),
    },
    "conpoly": {Property.MONOTONE: Fails((-2.0,)), Property.BOUNDED: Fails((-2.0,))},
    "emor": {
        Property.MONOTONE: Fails((100.0,)),
        Property.BOUNDED: Fails((100.0,)),
        Property.SMOOTH: Fails((0.0,)),
    },
    "emor-monotone": {Property.SMOOTH: Fails((0.0,))},
    "inverse-emor": {Property.MONOTONE: Fails((-4.0,)), Property.SMOOTH: Fails((0.0,))},
    "logemor": {
        Property.MONOTONE: Fails((100.0,)),
        Property.BOUNDED: Fails((100.0,)),
        Property.SMOOTH: Fails((0.0,)),
    },
    "table": {Property.SMOOTH: Fails(tuple(-0.02 * (254 - level) for level in range(254)))},
}
OF_ONE_MEMBER = {Property.ENDS, Property.MONOTONE, Property.BOUNDED, Property.SMOOTH}


def slope_jump(curve: Callable[[Floats], Floats], step: float) -> float:
    """Greatest change of f' over a step, in the middle of [0, 1]."""
    before, here, after = (curve(INSIDE + move) for move in (-step, 0.0, step))
    return float(np.abs(after - 2 * here + before).max() / step)


def misses_the_ends(model: AbstractModel, parameters: Floats) -> bool:
    black, white = model.response([0, 1], parameters)
    return black != 0 or white != 1


def decreases(model: AbstractModel, parameters: Floats) -> bool:
    curve = model.response(GRID, parameters)
    # Of a gain of 10⁶ the last bit is more than 1e-12.
    tolerance = 1e-12 * max(1.0, float(np.abs(curve).max()))
    return not bool(np.all(np.diff(curve) >= -tolerance))


def leaves_the_range(model: AbstractModel, parameters: Floats) -> bool:
    curve = model.response(GRID, parameters)
    return not bool(np.all((curve >= 0) & (curve <= 1)))


def has_kinks(model: AbstractModel, parameters: Floats) -> bool:
    def curve(irradiance: Floats) -> Floats:
        return model.response(irradiance, parameters)

    coarse, fine = slope_jump(curve, 2**-11), slope_jump(curve, 2**-16)
    return fine > 0.25 * coarse and fine > 1e-6  # of a smooth curve one 32nd remains


DISPROOF: dict[Property, Callable[[AbstractModel, Floats], bool]] = {
    Property.ENDS: misses_the_ends,
    Property.MONOTONE: lambda model, parameters: (
        decreases(model, parameters) or not model.increases(parameters)
    ),
    Property.BOUNDED: leaves_the_range,
    Property.SMOOTH: has_kinks,
}


def claiming(claim: Property) -> list[AbstractModel]:
    return [model for model in SAMPLE if claim in model.properties]


def test_every_family_of_the_registry_is_looked_at():
    assert {model.family for model in SAMPLE} == {model.family for model in MODELS.values()}
    assert sum(len(models) for models in FAMILIES.values()) == len(MODELS)
    assert set(COUNTEREXAMPLES) == set(FAMILIES)


@pytest.mark.slow
@each_by_family("model", SAMPLE)
@examples(25)
@given(data=st.data())
def test_no_member_contradicts_a_claim(model: AbstractModel, data: st.DataObject):
    parameters = data.draw(anything(model))

    for claim in model.properties & {Property.ENDS, Property.MONOTONE, Property.BOUNDED}:
        assert not DISPROOF[claim](model, parameters), claim


@each_by_family("model", claiming(Property.SMOOTH))
def test_slope_of_smooth_families_has_no_jumps(model: AbstractModel):
    for seed in range(4):
        assert not has_kinks(model, typical(model, seed, reach=1.5))


@each_by_family("model", MODELS.values())
def test_a_property_that_is_not_claimed_fails_somewhere(model: AbstractModel):
    missing = OF_ONE_MEMBER - model.properties
    examples = {
        claim: example
        for claim, example in COUNTEREXAMPLES[model.family].items()
        if model.order >= example.from_order
    }
    assert set(examples) == missing

    for claim, example in examples.items():
        parameters = np.zeros(model.n_parameters)
        parameters[: len(example.parameters)] = example.parameters
        assert DISPROOF[claim](model, parameters), claim


@each("model", MODELS.values())
def test_analytical_are_the_families_without_side_constraints_or_measured_curves(
    model: AbstractModel,
):
    plain = not model.constrained and not hasattr(model, "basis")

    assert (Property.ANALYTICAL in model.properties) == plain


@pytest.mark.slow
@each_by_family("model", claiming(Property.EXTENSIBLE))
@examples(15)
@given(data=st.data())
def test_extensible_families_hold_every_curve_of_the_order_below(
    model: AbstractModel, data: st.DataObject
):
    if model.order == 0:
        assert model.lower is None
        return
    assert model.lower is not None
    assert (type(model.lower), model.lower.order) == (type(model), model.order - 1)

    parameters = data.draw(anything(model.lower))
    promoted = model.promoted(parameters)

    assert np.all(model.admits(promoted))
    curve = model.lower.response(LEVEL, parameters)
    size = max(1.0, float(np.abs(curve).max()), float(np.abs(parameters).max()))
    np.testing.assert_allclose(model.response(LEVEL, promoted), curve, rtol=0, atol=1e-12 * size)


@each_by_family("model", [model for model in claiming(Property.EXTENSIBLE) if model.order])
def test_many_curves_are_promoted_at_once(model: AbstractModel):
    several = np.array([[typical(model.lower, 3 * i + j) for j in range(3)] for i in range(2)])

    promoted = model.promoted(several)

    assert promoted.shape == (2, 3, model.n_parameters)
    assert np.array_equal(promoted[1, 2], model.promoted(several[1, 2]))
    assert model.response(LEVEL, promoted) == pytest.approx(
        model.lower.response(LEVEL, several), abs=1e-12
    )


def test_families_that_do_not_extend_have_no_other_order_that_holds_them():
    alone = {name for name, models in FAMILIES.items() if not claims_extension(models)}
    assert alone == {"gamma", "ameegc-exact", "ggc", "ppisp", "table"}

    for name in alone:
        assert all(model.lower is None for model in FAMILIES[name])
    for name in alone - {"table"}:
        highest = FAMILIES[name][-1]
        with pytest.raises(ParameterError, match=r"order"):
            type(highest)(order=highest.order + 1)
    # A table with its kink at another level is no finer table.
    kink = Table(order=2).response(LEVEL, np.log([0.5, 0.6, 0.9]))
    nearest = fit_many(Table(order=3, smoothness=1e-12), LEVEL, kink[np.newaxis])[0]
    assert nearest.rmse > 1e-3


def claims_extension(models: list[AbstractModel]) -> bool:
    claims = {Property.EXTENSIBLE in model.properties for model in models}
    assert len(claims) == 1
    return claims.pop()


@pytest.fixture(scope="module")
def dorf(data_path) -> Dorf:
    path = data_path / "dorf"
    if not path.is_dir():
        pytest.skip(f"{path} is not there")
    return load_dorf(path)


def least_median(family: str, dorf: Dorf, every: int) -> float:
    """Median RMSE of the best order with three parameters or fewer."""
    models = [model for model in FAMILIES[family] if model.n_parameters <= 3]
    if family == "table":
        models = [Table(order=2)]
    if not models:
        return np.inf
    places = np.unique(np.linspace(0, dorf.irradiance.size - 1, 96).astype(int))
    curves = dorf.curves[::every, places]
    fits = fit_many(models[-1], dorf.irradiance[places], curves)
    return float(np.median([each.rmse for each in fits]))


# Of every fourth curve, because it is run often.
@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_compact_are_the_families_that_fit_cameras_with_three_parameters(family: str, dorf: Dorf):
    claims = {Property.COMPACT in model.properties for model in FAMILIES[family]}

    assert claims == {least_median(family, dorf, every=4) <= 0.005}


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_compact_is_decided_by_all_201_cameras(family: str, dorf: Dorf):
    claims = {Property.COMPACT in model.properties for model in FAMILIES[family]}

    assert claims == {least_median(family, dorf, every=1) <= 0.005}
