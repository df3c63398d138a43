"""The families that stand on principal components of measured curves."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import GRID, anything, each, examples, typical
from scipy.linalg import subspace_angles

from chartless.datasets import Dorf, load_dorf
from chartless.errors import ParameterError
from chartless.models import (
    MODELS,
    N_COMPONENTS,
    AbstractModel,
    Basis,
    Emor,
    EmorMonotone,
    InverseEmor,
    LogEmor,
    measured_basis,
    principal_basis,
)
from chartless.types import Floats

SCRIPT = Path(__file__).parents[2] / "scripts" / "fit_emor.py"
KINDS = ("response", "inverse", "log_response")
PUBLISHED = {"response": "emor.txt", "inverse": "invemor.txt"}
POINTS = 129
LEVEL = np.linspace(0, 1, POINTS)


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fit_emor", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def dorf(data_path: Path) -> Dorf:
    path = data_path / "dorf"
    if not path.is_dir():
        pytest.skip(f"{path} is not there")
    return load_dorf(path)


@pytest.fixture(scope="module")
def computed(script: ModuleType, dorf: Dorf) -> dict[str, tuple[Basis, Floats]]:
    return script.bases(dorf.irradiance, dorf.curves)


# -- the basis of the package --


@each("kind", KINDS)
def test_packaged_components_are_orthonormal_and_in_order(kind: str):
    basis = measured_basis(kind)

    assert basis.components.shape == (N_COMPONENTS, basis.mean.size)
    products = basis.components @ basis.components.T
    np.testing.assert_allclose(products, np.eye(N_COMPONENTS), rtol=0, atol=1e-6)
    assert np.all(basis.deviations > 0)
    assert np.all(np.diff(basis.deviations) < 0)


@each("kind", ["response", "inverse"])
def test_packaged_basis_goes_through_both_ends_exactly(kind: str):
    basis = measured_basis(kind)

    assert basis.mean[[0, -1]].tolist() == [0.0, 1.0]
    assert not np.any(basis.components[:, [0, -1]])
    assert np.all(np.diff(basis.mean) > 0)


def test_packaged_logarithms_end_at_white_exactly():
    basis = measured_basis("log_response")

    assert basis.mean[-1] == 0
    assert not np.any(basis.components[:, -1])
    assert np.all(np.diff(basis.mean) > 0)


def test_largest_entry_of_every_component_is_positive():
    for kind in KINDS:
        components = measured_basis(kind).components
        largest = components[range(N_COMPONENTS), np.abs(components).argmax(axis=1)]
        assert np.all(largest > 0)


@each("kind", KINDS)
def test_packaged_basis_comes_out_of_its_script(
    kind: str, computed: dict[str, tuple[Basis, Floats]]
):
    expected, _ = computed[kind]
    packaged = measured_basis(kind)

    assert packaged.deviations == pytest.approx(expected.deviations, rel=1e-6)
    np.testing.assert_allclose(packaged.mean, expected.mean, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(packaged.components, expected.components, rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", PUBLISHED)
def test_packaged_basis_agrees_with_the_published_one(
    kind: str, script: ModuleType, computed: dict[str, tuple[Basis, Floats]], data_path: Path
):
    path = data_path / "emor" / PUBLISHED[kind]
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    theirs, ours = script.published(path), measured_basis(kind)
    _, samples = computed[kind]

    assert theirs.components.shape == ours.components.shape
    assert ours.mean == pytest.approx(theirs.mean, abs=0.007)
    angles = subspace_angles(theirs.components[:3].T, ours.components[:3].T)
    assert np.degrees(angles.max()) < 2
    for n in (3, 5, 11):
        shares = [script.explained(basis, samples, n) for basis in (theirs, ours)]
        assert shares[1] == pytest.approx(shares[0], abs=1e-4)
        assert shares[1] >= shares[0]  # of these samples no subspace explains more
        assert shares[1] > {3: 0.995, 5: 0.999, 11: 0.9999}[n]


# -- a basis of one's own --


def synthetic(n_curves: int = 40) -> tuple[Floats, Floats]:
    """Curves of two components and a mean, and the two components."""
    rng = np.random.default_rng(3)
    components = np.array([np.sin(np.pi * LEVEL), np.sin(2 * np.pi * LEVEL)])
    components /= np.linalg.norm(components, axis=1)[:, np.newaxis]
    amounts = rng.normal(size=(n_curves, 2)) * [0.4, 0.1]
    amounts -= amounts.mean(axis=0)
    return LEVEL**0.6 + amounts @ components, components


def test_principal_basis_recovers_the_components_that_curves_were_made_of():
    curves, components = synthetic()

    basis = principal_basis(curves, n_components=3)

    assert basis.mean == pytest.approx(LEVEL**0.6, abs=1e-12)
    assert basis.deviations[:2] == pytest.approx([0.4, 0.1], rel=0.3)
    assert basis.deviations[2] < 1e-12
    angles = subspace_angles(basis.components[:2].T, components.T)
    assert np.degrees(angles.max()) < 1e-5
    amounts = (curves - basis.mean) @ basis.components[:2].T
    assert basis.deviations[:2] == pytest.approx(amounts.std(axis=0), rel=1e-10)
    assert amounts @ basis.components[:2] + basis.mean == pytest.approx(curves, abs=1e-12)


def test_principal_basis_does_not_depend_on_the_order_of_the_curves():
    curves, _ = synthetic()

    one, other = principal_basis(curves, 2), principal_basis(curves[::-1], 2)

    assert other.mean == pytest.approx(one.mean, abs=1e-14)
    assert other.components == pytest.approx(one.components, abs=1e-11)


def own_basis(family: type[AbstractModel]) -> Basis:
    curves, _ = synthetic()
    curves[:, [0, -1]] = [0, 1]
    if family is LogEmor:
        return principal_basis(np.log(np.maximum(curves[:, 1:], 1e-3)), 2)
    return principal_basis(curves, 2)


BASED = (Emor, EmorMonotone, InverseEmor, LogEmor)


@each("family", BASED)
def test_a_basis_of_ones_own_changes_the_curve_and_nothing_else(family: type[AbstractModel]):
    packaged, own = family(1), family(1, own_basis(family))
    parameters = np.array([0.02, -0.01])

    for attribute in ("name", "family", "formula", "properties", "parameter_names", "constrained"):
        assert getattr(own, attribute) == getattr(packaged, attribute), attribute
    assert own.lower.basis is own.basis
    assert own.lower.order == 0
    assert own.admits(parameters)
    for method in ("response", "inverse", "derivative", "gradient"):
        mine, theirs = (getattr(each, method)(LEVEL, parameters) for each in (own, packaged))
        assert mine.shape == theirs.shape
    assert own.response([0.0, 1.0], parameters) == pytest.approx([0.0, 1.0], abs=1e-12)
    theirs = packaged.response(LEVEL, parameters)
    assert np.abs(own.response(LEVEL, parameters) - theirs).max() > 0.01
    # The registered model has not noticed.
    assert np.array_equal(MODELS[packaged.name].response(LEVEL, parameters), theirs)


@each("family", BASED)
def test_a_basis_has_no_more_orders_than_components(family: type[AbstractModel]):
    with pytest.raises(ParameterError, match="has the orders 0 to 1, not 2"):
        family(2, own_basis(family))


def test_members_are_the_mean_and_the_components_on_the_points_of_the_basis():
    own = own_basis(Emor)
    parameters = np.array([0.3, -0.2])
    expected = own.mean + 0.3 * own.components[0] - 0.2 * own.components[1]

    assert Emor(1, own).response(LEVEL, parameters) == pytest.approx(expected, abs=1e-14)
    middle = (LEVEL[1:] + LEVEL[:-1]) / 2
    assert Emor(1, own).response(middle, parameters) == pytest.approx(
        (expected[1:] + expected[:-1]) / 2, abs=1e-14
    )


def test_inverse_members_are_the_mean_and_the_components_of_the_inverse():
    own = own_basis(InverseEmor)
    parameters = np.array([0.03, -0.02])
    expected = own.mean + 0.03 * own.components[0] - 0.02 * own.components[1]
    assert np.all(np.diff(expected) > 0)

    model = InverseEmor(1, own)
    assert model.inverse(LEVEL, parameters) == pytest.approx(expected, abs=1e-14)
    assert model.response(expected, parameters) == pytest.approx(LEVEL, abs=1e-14)


def test_members_of_logarithms_are_exponentials_of_mean_and_components():
    own = own_basis(LogEmor)
    parameters = np.array([0.3, -0.2])
    expected = np.exp(own.mean + 0.3 * own.components[0] - 0.2 * own.components[1])

    assert LogEmor(1, own).response(LEVEL[1:], parameters) == pytest.approx(expected, rel=1e-12)
    # From black to the first point a straight line.
    first = LogEmor(1, own).response(LEVEL[1] / 4, parameters)
    assert first == pytest.approx(expected[0] / 4, rel=1e-12)


@each("family", [Emor, InverseEmor, LogEmor])
def test_identity_is_nearer_to_the_linear_camera_than_its_neighbours(family: type[AbstractModel]):
    model = family(4)
    points = np.linspace(0, 1, 1024)

    def distance(parameters: Floats) -> float:
        if family is LogEmor:
            values, linear = model._nodes(parameters)[1:], np.linspace(0, 1, 1024)[1:]
            return float(np.linalg.norm(np.log(values) - np.log(linear)))
        if family is InverseEmor:
            return float(np.linalg.norm(model._nodes(parameters) - points))
        return float(np.linalg.norm(model.response(points, parameters) - points))

    least = distance(model.identity)
    for j in range(5):
        for step in (-0.01, 0.01):
            moved = model.identity + step * np.eye(5)[j]
            assert distance(moved) > least


# -- where g does not increase --


@examples(60)
@given(parameters=anything(InverseEmor(4)))
def test_response_of_an_inverse_that_falls_is_that_of_its_running_maximum(parameters: Floats):
    model = InverseEmor(4)
    basis = measured_basis("inverse")
    g = np.maximum.accumulate(basis.mean + parameters @ basis.components[:5])
    irradiance = np.linspace(0.001, 0.999, 57)

    brightness = model.response(irradiance, parameters)

    # The first brightness at which g is as great, between two points of the basis.
    first = np.array([np.flatnonzero(g >= x)[0] for x in irradiance])
    assert np.all(brightness <= first / 1023 + 1e-12)
    assert np.all(brightness >= (first - 1) / 1023 - 1e-12)


def test_ends_hold_where_the_inverse_leaves_the_range():
    model = InverseEmor(0)
    for amount in (-30.0, 30.0):
        nodes = model._nodes(np.array([amount]))
        assert nodes.min() < 0 or nodes.max() > 1

        assert model.response([0, 1], [amount]).tolist() == [0.0, 1.0]
        assert model.inverse([0, 1], [amount]).tolist() == [0.0, 1.0]


# -- the monotone members --


@each("order", [0, 2, 10, 24])
def test_monotone_members_are_those_of_emor_that_increase(order: int):
    emor, monotone = Emor(order), EmorMonotone(order)
    rng = np.random.default_rng(order)
    deviations = measured_basis("response").deviations[: order + 1]
    admitted = 0
    for _ in range(100):
        parameters = rng.normal(size=order + 1) * deviations * rng.choice([0.2, 1.0])
        slopes = np.diff(emor.response(np.linspace(0, 1, 1024), parameters)) * 1023

        assert bool(monotone.admits(parameters)) == bool(slopes.min() >= 5e-7)
        if monotone.admits(parameters):
            admitted += 1
            assert np.array_equal(
                monotone.response(GRID, parameters), emor.response(GRID, parameters)
            )
    assert 5 < admitted < 100


@each("order", [0, 2, 24])
@examples(30)
@given(data=st.data())
def test_inequalities_leave_exactly_the_monotone_members(order: int, data: st.DataObject):
    model = EmorMonotone(order)
    direction = data.draw(
        st.lists(st.floats(-1, 1), min_size=order + 1, max_size=order + 1).map(np.array)
    )
    size = data.draw(st.floats(-2, 2))
    parameters = 10**size * direction
    rows, limit = model.inequalities(parameters)
    slack = limit - rows @ parameters

    increase = np.diff(Emor(order).response(np.linspace(0, 1, 1024), parameters))

    assert slack == pytest.approx(increase - 1e-6 / 1023, abs=1e-13)
    if slack.min() >= 0:
        assert model.admits(parameters)


def test_a_member_that_decreases_by_the_least_is_refused():
    basis = measured_basis("response")
    for order in (0, 4, 24):
        model = EmorMonotone(order)
        for sign in (-1, 1):
            falling = -sign * np.diff(basis.components[order])
            steps = np.diff(basis.mean)
            level = np.min((steps / falling)[falling > 0])  # one line becomes level here
            parameters = sign * level * np.eye(order + 1)[order]

            assert model.admits((1 - 1e-2) * parameters)
            assert not model.admits((1 + 1e-7) * parameters)
            assert not model.admits(parameters)  # a share of the least slope is asked for


def test_identity_of_the_monotone_family_is_admitted_and_near_the_linear_camera():
    points = np.linspace(0, 1, 1024)
    for order in (0, 2, 5, 24):
        model, emor = EmorMonotone(order), Emor(order)
        away = np.linalg.norm(model.response(points, model.identity) - points)
        of_mean = np.linalg.norm(measured_basis("response").mean - points)

        assert model.admits(model.identity)
        assert away <= of_mean
        assert away >= np.linalg.norm(emor.response(points, emor.identity) - points) - 1e-12


def test_a_slight_violation_is_repaired_by_a_small_move():
    model = EmorMonotone(4)
    for seed in range(10):
        direction = np.random.default_rng(seed).normal(size=5)
        rows, limit = model.inequalities(direction)
        last = np.min((limit / (rows @ direction))[rows @ direction > 0])
        over = last * (1 + 2e-9) * direction

        repaired = model.repaired(over)

        assert model.admits(repaired)
        assert np.abs(repaired - over).max() <= 2e-6 * np.abs(over).max()
    good = typical(model, 0)
    assert np.array_equal(model.repaired(good), good)
