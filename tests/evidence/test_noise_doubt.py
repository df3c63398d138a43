"""Noise that is not the sensor's: its signs, and what becomes of the curve."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from chartless import calibrate
from chartless.curves import SampledCurve
from chartless.curves.populations import Population, population_prior
from chartless.curves.prior import irradiance_at_edges
from chartless.evidence._pair_check import PairCheck
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.doubt import frame_errors, table_errors
from chartless.evidence.noise.misfit import peakedness
from chartless.evidence.trust import NEARLY_NOTHING
from chartless.flags import Flag
from chartless.formats.calibration_file import from_json, to_json
from chartless.inference.posterior import at_levels
from chartless.methods import LikelihoodSearch
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.verdict import Grade, verdict
from chartless.simulate import simulate_frames
from chartless.types import Floats, Levels

STILL = PairCheck(0.0, 0.0, 0.0, 0.0)
NOISE = AffineNoise.of_sensor(1_000, 6)
TYPICAL = at_levels(irradiance_at_edges(population_prior(Population.DIGITAL, 256).mean)[1:-1])
CAMERA = SampledCurve.from_inverse(TYPICAL**1.15)
"""A digital camera, and not the typical one."""


@cache
def frames() -> tuple[Levels, Levels]:
    """Two frames of a smooth scene in colours."""
    rng = np.random.default_rng(2)
    white = gaussian_filter(rng.standard_normal((320, 480, 3)), (9, 9, 0), mode="wrap")
    ranks = white.reshape(-1, 3).argsort(axis=0).argsort(axis=0)
    light = (ranks / ranks.max() * 0.9).reshape(white.shape)
    shown = [
        np.stack(
            [
                tuple(simulate_frames(light[..., c], CAMERA, NOISE, seed=10 + c))[frame]
                for c in range(3)
            ],
            axis=-1,
        )
        for frame in range(2)
    ]
    return shown[0], shown[1]


def saved(folder: Path, form: str, change: Callable[[Levels], Levels] = np.array) -> list[Path]:
    paths = []
    for number, frame in enumerate(frames()):
        path = folder / f"{number}.{form}"
        Image.fromarray(change(frame)).save(path, quality=85, subsampling=0)
        paths.append(path)
    return paths


def bilateral(frame: Levels) -> Levels:
    return np.asarray(cv2.bilateralFilter(frame, 7, 25, 3))


def counts_of(calibration: Calibration) -> list[float]:
    return [channel.account("noise")["counts_as"] for channel in calibration.channels]


# Signs


def test_a_sensor_shows_no_sign() -> None:
    first, second = (frame[..., 1] for frame in frames())

    pairs = LevelPairs(Cooccurrence.of_pair(first, second))

    assert table_errors(pairs.still.table, processed=True) == ()
    assert pairs.counts_as == np.inf


def test_correlation_counts_with_either_sign_and_by_its_size() -> None:
    def errors(neighbour: float, channel: float) -> tuple[float, ...]:
        check = replace(STILL, neighbour_correlation=neighbour, channel_correlation=channel)
        return frame_errors([STILL, check, check], n_pixels=1e6, lossy=False)

    assert errors(0.015, 0.01) == ()
    assert errors(0.01, 0.025) == (0.025,)
    assert errors(-0.3, 0.1) == (0.3,)
    assert errors(0.05, 0.9) == (0.9,)


def test_small_frames_are_correlated_by_chance() -> None:
    check = replace(STILL, neighbour_correlation=0.03)

    assert frame_errors([check], n_pixels=1e4, lossy=False) == ()
    assert frame_errors([check], n_pixels=1e6, lossy=False) == (0.03,)


def test_lossy_files_count_whatever_else_they_show() -> None:
    (error,) = frame_errors([STILL], n_pixels=1e6, lossy=True)

    assert 0.3 < error < 1


@pytest.mark.parametrize("spread", [0.3, 0.6])
def test_a_peak_is_as_high_as_variances_differ(spread: float) -> None:
    """Variances drawn from a gamma distribution of this relative deviation."""
    rng = np.random.default_rng(8)
    variance = rng.gamma(1 / spread**2, spread**2, size=(600, 800))
    level = np.linspace(60, 190, 800)
    first, second = (
        np.rint(level + 9 * np.sqrt(variance) * rng.standard_normal(variance.shape))
        .clip(0, 255)
        .astype(np.uint8)
        for _ in range(2)
    )
    table = Cooccurrence.of_pair(first, second)

    assert peakedness(table.symmetric.astype(np.float64)) == pytest.approx(3 * spread**2, rel=0.25)
    (error,) = table_errors(table, processed=True)
    assert error == pytest.approx(spread, rel=0.15)
    assert table_errors(table, processed=False) == ()


def test_empty_levels_count() -> None:
    stretched = [
        np.rint(1.25 * frame[..., 1].astype(float)).clip(0, 255).astype(np.uint8)
        for frame in frames()
    ]

    (error,) = table_errors(Cooccurrence.of_pair(*stretched), processed=False)

    assert error == pytest.approx(3 * 0.2, rel=0.1)  # a fifth of the levels is empty


# What becomes of the curve


@pytest.fixture(scope="module")
def of_jpeg(tmp_path_factory: pytest.TempPathFactory) -> Calibration:
    return calibrate(saved(tmp_path_factory.mktemp("jpeg"), "jpg"), evidence="noise")


def off(calibration: Calibration, light: Floats) -> list[float]:
    return [
        float(np.sqrt(np.mean((channel.inverse_lut - light) ** 2)))
        for channel in calibration.channels
    ]


def test_lossless_frames_count_in_full(tmp_path: Path) -> None:
    calibration = calibrate(saved(tmp_path, "png"), evidence="noise")

    for channel in calibration.channels:
        assert "counts_as" not in channel.account("noise")
        assert not {Flag.NOISE_DISCOUNTED, Flag.COMPRESSED} & set(channel.flags)


def test_jpegs_count_as_a_few_pairs_and_give_the_typical_curve(of_jpeg: Calibration) -> None:
    assert max(counts_of(of_jpeg)) < 6
    assert max(off(of_jpeg, TYPICAL)) < 0.04
    for channel in of_jpeg.channels:
        assert Flag.NOISE_DISCOUNTED in channel.flags
        assert channel.account("noise").fits == ()
        assert channel.inverse_lut_std is not None
        for light in (TYPICAL, CAMERA.inverse(np.arange(256) / 255)):
            held = np.abs(channel.inverse_lut - light) <= 2 * channel.inverse_lut_std
            assert held[1:-1].mean() > 0.95
    assert verdict(of_jpeg.channels).grade is Grade.DISTRUST


def test_a_denoiser_is_seen_in_lossless_files(tmp_path: Path) -> None:
    calibration = calibrate(saved(tmp_path, "png", bilateral), evidence="noise")

    assert max(counts_of(calibration)) < 20
    assert max(off(calibration, TYPICAL)) < 0.05


def test_a_jpeg_saved_without_loss_is_still_one(tmp_path: Path) -> None:
    jpegs = saved(tmp_path, "jpg")
    paths = []
    for jpeg in jpegs:
        with Image.open(jpeg) as picture:
            picture.save(jpeg.with_suffix(".png"))
        paths.append(jpeg.with_suffix(".png"))

    calibration = calibrate(paths, evidence="noise")

    assert max(counts_of(calibration)) < 6
    assert all(Flag.COMPRESSED in channel.flags for channel in calibration.channels)


@pytest.mark.slow
def test_processes_find_the_same(tmp_path: Path) -> None:
    paths = saved(tmp_path, "jpg")

    one, two = (calibrate(paths, evidence="noise", jobs=jobs) for jobs in (1, 2))

    assert [channel.curve for channel in one.channels] == [each.curve for each in two.channels]
    assert counts_of(one) == counts_of(two)


def test_the_number_is_kept_in_the_file(of_jpeg: Calibration) -> None:
    again = from_json(to_json(of_jpeg))

    assert counts_of(again) == counts_of(of_jpeg)
    assert verdict(again.channels) == verdict(of_jpeg.channels)


def test_a_curve_that_explains_nothing_has_a_band_that_holds_the_typical_one() -> None:
    """Level pairs alone do not show that they were denoised."""
    smooth = [np.ascontiguousarray(bilateral(frame)[..., 1]) for frame in frames()]
    pairs = LevelPairs(Cooccurrence.of_pair(*smooth))
    assert pairs.counts_as > NEARLY_NOTHING

    found = LikelihoodSearch().calibrate(pairs)

    assert found.account("noise").is_unexplained
    assert found.inverse_lut_std is not None
    assert np.all(np.abs(found.inverse_lut - TYPICAL) <= found.inverse_lut_std + 1e-12)
