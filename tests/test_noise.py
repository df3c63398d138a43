import numpy as np
import pytest

from chartless.errors import ParameterError
from chartless.noise import CAMERAS_OF_2008, SENSORS, AffineNoise, NoisePrior


def test_variance_is_affine_in_the_irradiance():
    noise = AffineNoise(slope=2e-4, floor=5e-5)

    assert noise.variance([0.0, 0.25, 1.0]) == pytest.approx([5e-5, 1e-4, 2.5e-4])
    assert noise.std(0.25) == pytest.approx(0.01)


def test_8_bit_units_are_levels():
    noise = AffineNoise.from_8bit(slope=0.06, floor=9.0)

    # 3 levels at black; σ² = 0.06 · 100 + 9 levels² at level 100
    assert 255 * noise.std(0.0) == pytest.approx(3.0)
    assert 255**2 * noise.variance(100 / 255) == pytest.approx(15.0)
    assert (noise.slope_8bit, noise.floor_8bit) == pytest.approx((0.06, 9.0))


def test_noise_may_have_no_slope():
    assert AffineNoise(0.0, 1e-5).std([0.0, 1.0]) == pytest.approx([np.sqrt(1e-5)] * 2)


@pytest.mark.parametrize(
    ("slope", "floor"),
    [(-1e-9, 1e-5), (np.nan, 1e-5), (np.inf, 1e-5), (1e-4, 0.0), (1e-4, -1.0), (1e-4, np.nan)],
)
def test_impossible_noise_is_refused(slope: float, floor: float):
    with pytest.raises(ParameterError, match="slope >= 0 and a floor > 0"):
        AffineNoise(slope, floor)


@pytest.mark.parametrize("shape", [(), (0,), (2, 3)])
def test_shapes_are_kept(shape: tuple[int, ...]):
    noise = AffineNoise(1e-4, 1e-5)

    assert noise.variance(np.zeros(shape)).shape == shape
    assert noise.std(np.zeros(shape)).shape == shape


def test_a_data_sheet_gives_noise():
    """1,000 photons of 1,000 electrons scatter by their root, reading by 6 everywhere."""
    noise = AffineNoise.of_sensor(1_000, 6)

    assert 1_000 * noise.std([0.0, 1.0]) == pytest.approx([6, np.sqrt(1_000 + 36)])
    assert noise.ratio == pytest.approx(1_000 / 36)


@pytest.mark.parametrize(("electrons", "read"), [(0, 5), (-1, 5), (1000, 0), (np.nan, 5)])
def test_an_impossible_sensor_is_refused(electrons: float, read: float):
    with pytest.raises(ParameterError, match="a sensor has electrons and a read noise above 0"):
        AffineNoise.of_sensor(electrons, read)


def test_a_known_sensor_is_the_centre_of_its_prior():
    prior = NoisePrior.of_sensor(10_000, 13, factor=3)

    assert prior.centre == AffineNoise.of_sensor(10_000, 13)
    assert prior.spread[0] == pytest.approx(np.log(3))
    assert prior.ratio_spread == pytest.approx(np.log(3))


def test_a_prior_of_ratios_is_one_of_slopes_and_floors():
    """Against draws of ln u and ln r, which are independent."""
    prior = NoisePrior.of_ratio(slope=1e-4, slope_spread=2.0, ratio=50.0, ratio_spread=1.5)
    rng = np.random.default_rng(0)
    log_slope = np.log(1e-4) + 2.0 * rng.standard_normal(400_000)
    log_floor = log_slope - np.log(50.0) - 1.5 * rng.standard_normal(400_000)
    drawn = np.stack([log_slope, log_floor])

    assert prior.mean == pytest.approx(drawn.mean(axis=1), abs=0.02)
    np.testing.assert_allclose(prior.covariance, np.cov(drawn), atol=0.05)
    np.testing.assert_allclose(prior.precision @ prior.covariance, np.eye(2), atol=1e-12)
    assert prior.centre.ratio == pytest.approx(50.0)
    assert prior.ratio_spread == pytest.approx(1.5)


@pytest.mark.parametrize(("electrons", "read"), [(300, 6), (1_000, 2), (10_000, 5), (60_000, 15)])
def test_sensors_as_they_are_made_are_within_two_deviations(electrons: float, read: float):
    """Of the default; and far from cameras as the paper draws them."""
    sensor = AffineNoise.of_sensor(electrons, read)

    def away(noise: AffineNoise, prior: NoisePrior) -> float:
        return abs(float(np.log(noise.ratio / prior.centre.ratio))) / prior.ratio_spread

    assert away(sensor, SENSORS) < 2
    assert away(sensor, CAMERAS_OF_2008) > 2.5


@pytest.mark.parametrize("numbers", [(0, 1, 1, 1), (1, 0, 1, 1), (1, 1, 0, 1), (1, 1, 1, -2)])
def test_impossible_ratios_are_refused(numbers: tuple[float, float, float, float]):
    with pytest.raises(ParameterError, match="medians and spreads of a noise prior"):
        NoisePrior.of_ratio(*numbers)


@pytest.mark.parametrize("factor", [1, 0.5, np.nan])
def test_a_factor_is_above_one(factor: float):
    with pytest.raises(ParameterError, match="factor of a noise prior lies above 1"):
        NoisePrior.of_sensor(1000, 5, factor=factor)


@pytest.mark.parametrize(
    ("centre", "spread", "correlation"),
    [
        (AffineNoise(1e-4, 1e-5), (0.0, 1.0), 0.0),
        (AffineNoise(1e-4, 1e-5), (1.0, np.nan), 0.0),
        (AffineNoise(1e-4, 1e-5), (1.0, 1.0), 1.0),
        (AffineNoise(0.0, 1e-5), (1.0, 1.0), 0.0),
    ],
)
def test_an_impossible_prior_is_refused(
    centre: AffineNoise, spread: tuple[float, float], correlation: float
):
    with pytest.raises(ParameterError, match="a noise prior needs"):
        NoisePrior(centre, spread, correlation)
