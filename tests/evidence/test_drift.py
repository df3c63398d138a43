"""Change of brightness: measured, and undone in the table."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import gaussian_filter
from slow_cases import slow_but

from chartless import CALIBRATORS, AffineNoise, Cooccurrence, named_curve
from chartless.curves.populations import PopulationWeights
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.drift import Drift, compensated, drift_share, estimated_drift
from chartless.simulate import simulate_frames

Levels = npt.NDArray[Any]


def soft(shape: tuple[int, int] = (300, 400)) -> Levels:
    """Blobs, every irradiance equally frequent."""
    blobs = gaussian_filter(np.random.default_rng(1).standard_normal(shape), 6, mode="wrap")
    return blobs.ravel().argsort().argsort().reshape(shape) / blobs.size


def table_of(gain: float, response: str = "srgb", floor: float = 6.0) -> Cooccurrence:
    """Of a pair whose second frame gets so much more light."""
    noise, curve = AffineNoise.from_8bit(0.02, floor), named_curve(response)
    first, second = (
        next(simulate_frames(light * soft(), curve, noise, n_frames=1, seed=seed))
        for seed, light in ((11, 0.95), (12, 0.95 * gain))
    )
    return Cooccurrence.of_pair(first, second)


def moments(table: Cooccurrence) -> tuple[float, float]:
    """Mean and variance of the difference, later less earlier."""
    earlier, later = np.nonzero(table.counts)
    weight, difference = table.counts[earlier, later], later - earlier
    mean = np.average(difference, weights=weight)
    return float(mean), float(np.average((difference - mean) ** 2, weights=weight))


@pytest.mark.parametrize("response", ["srgb", "linear"])
def test_equally_bright_frames_have_no_drift(response: str) -> None:
    assert estimated_drift(table_of(1.0, response)) is None
    assert estimated_drift(Cooccurrence.zeros()) is None
    assert estimated_drift(Cooccurrence(np.diag(np.arange(256)))) is None


@pytest.mark.parametrize("gain", [0.97, 0.98, 1.02, 1.03])
def test_drift_of_a_linear_camera_is_its_gain(gain: float) -> None:
    drift = estimated_drift(table_of(gain, "linear"))

    assert drift is not None
    assert drift.is_small
    assert drift.relative == pytest.approx(abs(gain - 1), rel=0.05)
    level = np.arange(511) / 2
    expected = 2 * level * (gain - 1) / (gain + 1)
    assert np.abs(drift.levels - expected)[40:470].max() < 0.1


def test_movers_are_no_drift() -> None:
    """A dark thing leaves: at many sums of levels the difference has a mean of its own."""
    clean = table_of(1.0)
    counts = clean.counts.copy()
    counts[20:40, 180:220] += 10

    assert drift_share(Cooccurrence(counts)) > 0.1
    assert estimated_drift(Cooccurrence(counts)) is None


def test_a_large_change_is_not_called_small() -> None:
    drift = estimated_drift(table_of(0.8, "linear"))

    assert drift is not None
    assert not drift.is_small


@pytest.mark.parametrize("distance", [0.3, -0.3, 1.5, 2.0, -3.4])
def test_moving_changes_the_mean_and_not_the_variance(distance: float) -> None:
    rng = np.random.default_rng(4)
    frames = [np.rint(rng.normal(120, 4, 200_000)).astype(np.uint8) for _ in "ab"]
    table = Cooccurrence.of_pair(*frames)

    moved = compensated(table, Drift(np.full(511, distance), 0.01, 0.1))

    assert moved.counts.dtype == np.int64
    assert moved.n_pairs == table.n_pairs
    assert moved.counts.min() >= 0
    assert moments(moved)[0] == pytest.approx(moments(table)[0] - distance, abs=0.01)
    assert moments(moved)[1] == pytest.approx(moments(table)[1], rel=0.005)


@pytest.mark.parametrize("gain", [0.97, 1.03])
def test_nothing_of_the_drift_is_left(gain: float) -> None:
    table = table_of(gain)
    drift = estimated_drift(table)
    assert drift is not None

    still = compensated(table, drift)

    assert drift_share(table) > 0.1
    assert drift_share(still) < 0.001
    assert np.array_equal(still.counts, compensated(table, drift).counts)


@pytest.mark.slow
@pytest.mark.parametrize("gain", slow_but([0.98, 1.02], 1.02))
def test_the_curve_is_that_of_steady_light(gain: float) -> None:
    calibrator = CALIBRATORS["likelihood"](populations=PopulationWeights(dorf=1.0))
    steady, flickering = table_of(1.0), table_of(gain)
    drift = estimated_drift(flickering)
    assert drift is not None

    curves = [
        calibrator.calibrate(LevelPairs(table)).response_lut
        for table in (steady, compensated(flickering, drift), flickering)
    ]

    assert np.abs(curves[1] - curves[0]).max() < 0.015
    assert np.abs(curves[2] - curves[0]).max() > 0.03
