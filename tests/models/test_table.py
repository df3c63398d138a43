"""The free table of ln g over the levels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import each, examples

from chartless.curves.fitting import fit
from chartless.models import Table

LEVEL = np.arange(256) / 255


def test_inverse_is_the_table_itself_between_black_and_white():
    rng = np.random.default_rng(5)
    inverse = np.sort(rng.uniform(0.001, 0.999, 254))

    found = Table().inverse(LEVEL, np.log(inverse))

    assert found[[0, -1]].tolist() == [0.0, 1.0]
    assert found[1:-1] == pytest.approx(inverse, rel=1e-13)


def test_response_goes_through_the_table_in_straight_lines():
    model, inverse = Table(order=2), [0.1, 0.5, 0.8]  # at brightness ¼, ½, ¾

    assert model.response([0.05, 0.1, 0.3, 0.5, 0.8, 0.9], np.log(inverse)) == pytest.approx(
        [0.125, 0.25, 0.375, 0.5, 0.75, 0.875], abs=1e-15
    )
    assert model.derivative([0.05, 0.3, 0.9], np.log(inverse)) == pytest.approx(
        [2.5, 0.625, 1.25], rel=1e-12
    )


@each(
    "parameters, admitted",
    [
        ([-2.0, -1.0, -0.5], True),
        ([-1.0, -1.0, 0.0], True),  # a level that never occurs
        ([0.0, 0.0, 0.0], True),
        ([-1.0, -1.0 - 1e-12, 0.0], False),
        ([-2.0, -1.0, 1e-12], False),
        ([-np.inf, -1.0, 0.0], False),
        ([np.nan, -1.0, 0.0], False),
        ([-2.0, np.nan, 0.0], False),
    ],
)
def test_tables_that_increase_up_to_white_are_admitted(parameters: list[float], admitted: bool):
    assert bool(Table(order=2).admits(np.array(parameters))) == admitted


@examples(40)
@given(parameters=st.lists(st.floats(-5, 0.5), min_size=6, max_size=6).map(np.array))
def test_every_table_can_be_repaired_and_good_ones_are_left_alone(parameters: np.ndarray):
    model = Table(order=5)

    repaired = model.repaired(parameters)

    assert model.admits(repaired)
    if model.admits(parameters):
        assert np.array_equal(repaired, parameters)


def test_a_slight_violation_is_repaired_by_a_slight_move():
    good = Table().identity
    noisy = good.copy()
    noisy[100] = noisy[101] + 1e-9
    noisy[-1] = 1e-9

    assert not Table().admits(noisy)
    assert np.abs(Table().repaired(noisy) - noisy).max() <= 1e-9 + 1e-15


@examples(40)
@given(parameters=st.lists(st.floats(-5, 0.1), min_size=6, max_size=6).map(np.array))
def test_inequalities_are_the_steps_of_the_table(parameters: np.ndarray):
    model = Table(order=5)
    rows, limit = model.inequalities(parameters)

    steps = np.diff([*parameters, 0.0])

    assert limit - rows @ parameters == pytest.approx(steps - 1e-9, abs=1e-12)
    if np.all(rows @ parameters <= limit):
        assert model.admits(parameters)


@each(
    "parameters",
    [np.zeros(254), np.full(254, -1e6), np.linspace(-1e6, 0, 254), np.full(254, -1e-9)],
)
def test_ends_hold_where_levels_never_occur(parameters: np.ndarray):
    assert Table().response([0, 1], parameters).tolist() == [0.0, 1.0]
    assert Table().inverse([0, 1], parameters).tolist() == [0.0, 1.0]


def test_penalty_is_that_of_the_second_differences_of_ln_g():
    model = Table(smoothness=0.01)
    parameters = np.random.default_rng(1).normal(size=254)
    second = np.diff([*parameters, 0.0], n=2)  # up to white, where ln g = 0

    penalised = model.penalty @ parameters

    assert model.penalty.shape == (253, 254)
    assert penalised @ penalised == pytest.approx(0.01 * second @ second, rel=1e-12)


def test_power_laws_have_almost_no_penalty_but_noise_has():
    power_law = 0.45 * Table().identity
    noise = power_law + 0.01 * np.random.default_rng(1).normal(size=254)

    def penalty(parameters: np.ndarray) -> float:
        return float(np.sum((Table().penalty[50:] @ parameters) ** 2))

    assert penalty(power_law) < 1e-3 * penalty(noise)


def test_a_greater_weight_gives_a_smoother_table():
    irradiance = np.linspace(0, 1, 400)
    noise = 0.01 * np.random.default_rng(8).normal(size=400)
    curve = np.clip(irradiance**0.5 + noise, 0, 1)

    roughness = []
    for smoothness in (1e-6, 1e-3, 1e-1):
        table = fit(Table(order=61, smoothness=smoothness), irradiance, curve)
        assert table.model.admits(table.parameters)
        roughness.append(np.abs(np.diff([*table.parameters, 0.0], n=2)[10:]).mean())

    assert roughness[0] > roughness[1] > roughness[2]


def test_tables_of_12_bits_work():
    model = Table(order=4093)
    brightness = np.arange(4096) / 4095

    assert model.n_parameters == 4094
    assert model.inverse(brightness, model.identity) == pytest.approx(brightness, abs=1e-14)
