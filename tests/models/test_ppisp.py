"""PPISP's response: where its parts meet, its ends, and how near it comes to cameras."""

from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from members import each

from chartless.curves.fitting import fit_many
from chartless.curves.whitening import whitening
from chartless.datasets import load_dorf
from chartless.models import Ppisp
from chartless.types import Floats

MODEL = Ppisp()
RAW = st.tuples(st.floats(-8, 8), st.floats(-8, 8), st.floats(-8, 8), st.floats(-8, 8))
STEEP = [
    (-8.0, 8.0, 8.0, -8.0),
    (8.0, -8.0, -8.0, 8.0),
    (5.0, 5.0, -3.0, 0.0),
    (0.0, 1e3, 0.0, 0.0),
]


def trained(x: Floats, raw: tuple[float, ...]) -> Floats:
    """Brightness as the shader computes it: softplus, sigmoid, lerp, two powers and a third."""
    x = np.clip(x, 0, 1)
    toe, shoulder, gamma = np.array([0.3, 0.3, 0.1]) + np.log1p(np.exp(raw[:3]))
    center = 1 / (1 + np.exp(-raw[3]))
    a = shoulder * center / (toe + center * (shoulder - toe))
    lower = a * (np.minimum(x, center) / center) ** toe
    upper = 1 - (1 - a) * ((1 - np.maximum(x, center)) / (1 - center)) ** shoulder
    return np.where(x <= center, lower, upper) ** gamma


@given(raw=RAW)
def test_it_is_what_ppisp_computes(raw: tuple[float, ...]) -> None:
    irradiance = np.linspace(-0.1, 1.1, 121)

    assert MODEL.response(irradiance, raw) == pytest.approx(trained(irradiance, raw), abs=1e-9)


@given(raw=RAW)
def test_value_and_slope_are_continuous_where_the_parts_meet(raw: tuple[float, ...]) -> None:
    center = 1 / (1 + np.exp(-raw[3]))
    around = center + 1e-7 * min(center, 1 - center) * np.array([-1, 0, 1])

    before, here, after = MODEL.response(around, raw)
    slope_before, slope, slope_after = MODEL.derivative(around, raw)

    assert 0 <= here - before <= 1.01 * slope * (around[1] - around[0]) + 1e-15
    assert 0 <= after - here <= 1.01 * slope * (around[2] - around[1]) + 1e-15
    exponents = 1 + float(np.abs(np.logaddexp(0, raw[:3])).sum())
    assert slope_before == pytest.approx(slope, rel=1e-6 * exponents**2)
    assert slope_after == pytest.approx(slope, rel=1e-6 * exponents**2)


@each("raw", STEEP)
def test_digits_remain_where_one_part_is_small(raw: tuple[float, ...]) -> None:
    center = float(1 / (1 + np.exp(-raw[3])))
    irradiance = np.unique(
        [*np.geomspace(1e-12, 1, 40), *(center * (1 + np.geomspace(1e-9, 1, 20)))]
    )
    irradiance = irradiance[irradiance < 1]

    expected = [float(exact(x, raw)) for x in irradiance]

    assert MODEL.response(irradiance, raw) == pytest.approx(expected, rel=2e-11, abs=1e-300)


def exact(irradiance: float, raw: tuple[float, ...]) -> mp.mpf:
    with mp.workdps(50):
        toe, shoulder, gamma = (
            mp.mpf(least) + mp.log1p(mp.exp(mp.mpf(value)))
            for least, value in zip(("0.3", "0.3", "0.1"), raw, strict=False)
        )
        c, x = 1 / (1 + mp.exp(-mp.mpf(raw[3]))), mp.mpf(float(irradiance))
        a = shoulder * c / (toe + c * (shoulder - toe))
        beyond = 1 - (1 - a) * ((1 - x) / (1 - c)) ** shoulder
        return (a * (x / c) ** toe if x <= c else beyond) ** gamma


@given(raw=RAW)
def test_inverse_comes_back_to_the_level(raw: tuple[float, ...]) -> None:
    level = np.arange(256) / 255

    irradiance = MODEL.inverse(level, raw)

    assert np.all(np.diff(irradiance) >= 0)
    near = np.stack([np.nextafter(irradiance, 0), irradiance, np.nextafter(irradiance, 1)])
    below, again, above = MODEL.response(near, raw)
    assert np.all(np.abs(again - level) <= 1e-12 + 4 * (above - below))


@each("center", [-1e6, -800.0, -40.0, 40.0, 800.0, 1e6])
def test_a_center_that_rounds_to_an_end_leaves_one_part(center: float) -> None:
    raw = np.array([0.5, 1.0, -1.0, center])
    toe, shoulder, gamma = np.array([0.3, 0.3, 0.1]) + np.logaddexp(0, raw[:3])
    x = np.linspace(0, 1, 33)

    curve = MODEL.response(x, raw)

    part = x**toe if center > 0 else 1 - (1 - x) ** shoulder
    assert curve == pytest.approx(part**gamma, abs=1e-5)
    assert np.all(np.isfinite(MODEL.gradient(x, raw)))
    assert MODEL.inverse(curve, raw) == pytest.approx(x, abs=1e-9)


def test_training_begins_with_the_linear_camera() -> None:
    x = np.linspace(0, 1, 101)

    assert MODEL.identity[3] == 0
    assert MODEL.response(x, MODEL.identity) == pytest.approx(x, abs=1e-15)
    assert MODEL.derivative(x, MODEL.identity) == pytest.approx(1, abs=1e-14)


def test_a_fit_finds_cameras_of_the_family_again() -> None:
    rng, x = np.random.default_rng(5), np.linspace(0, 1, 65)
    raw = np.array([whitening(MODEL).colour(each) for each in rng.normal(size=(10, 4))])

    rmse = [each.rmse for each in fit_many(MODEL, x, MODEL.response(x, raw))]

    assert np.median(rmse) < 1e-8
    assert max(rmse) < 1e-3


def test_whitened_parameters_are_those_of_cameras() -> None:
    whitened = whitening(MODEL)

    middle = MODEL.response(0.18, whitened.colour(np.zeros(4)))

    assert middle == pytest.approx(0.445, abs=0.01)  # the median of the cameras is 0.437
    assert np.linalg.cond(whitened.matrix) < 10


@pytest.fixture(scope="module")
def dorf_rmse(data_path: Path) -> Floats:
    dorf = load_dorf(data_path / "dorf")
    curves = dorf.curves[list(dorf.distinct)]
    return np.array([each.rmse for each in fit_many(MODEL, dorf.irradiance, curves)])


@pytest.mark.slow
def test_errors_on_measured_cameras(dorf_rmse: Floats) -> None:
    """Those of 84 starts for each curve are .00245, .00805 and .01298."""
    assert np.median(dorf_rmse) == pytest.approx(0.00245, abs=2e-5)
    assert np.quantile(dorf_rmse, 0.9) == pytest.approx(0.00805, abs=5e-5)
    assert dorf_rmse.max() == pytest.approx(0.01298, abs=5e-5)


@pytest.mark.slow
def test_errors_on_digital_cameras(data_path: Path) -> None:
    path = data_path / "modern_curves" / "responses_1024.npz"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    stored = np.load(path)

    rmse = np.array([each.rmse for each in fit_many(MODEL, stored["E"], stored["f"])])

    assert np.median(rmse) < 0.0038
    assert rmse.max() < 0.0077
