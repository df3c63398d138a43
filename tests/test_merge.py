"""Merging exposures: against the truth, the Cramér–Rao bound and a plain loop over pixels."""

import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve, SrgbCurve
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.exposures import LEAST_EXPOSURE, MOST_EXPOSURE, MOST_RATIO
from chartless.frames.frame import CameraSettings, Frame
from chartless.merge import DEFAULT_NOISE, DEVIATIONS, RadianceMap, grey_factors, merge_frames
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.simulate import simulate_frames

Pixels = npt.NDArray[Any]
SRGB, LINEAR = SrgbCurve(), ModelCurve("gamma", (1.0,))
NOISE = AffineNoise.from_8bit(0.03, 4)
TIMES = (0.25, 0.25, 1.0, 4.0)
PATCH = 40_000


def camera(
    *names: str,
    curve: AbstractCurve = SRGB,
    noise: AffineNoise | None = NOISE,
    std: Pixels | None = None,
) -> Calibration:
    channels = tuple(
        Response(
            name=name,
            curve=curve,
            noise=noise,
            n_levels=256,
            observed_levels=(0, 255),
            n_pairs=0,
            method="known",
            status=Status.CONVERGED,
            inverse_lut_std=std,
        )
        for name in names or ("Y",)
    )
    return Calibration(channels=channels, bit_depth=8)


def frame(levels: Any, dtype: type = np.uint8) -> Frame:
    """Of levels of shape (M, N) or (M, N, C)."""
    array = np.atleast_2d(np.asarray(levels, dtype=dtype))
    return Frame(Path("frame.png"), np.ascontiguousarray(array.reshape(*array.shape[:2], -1)))


def shots(
    scene: Pixels, times: Sequence[float], noise: AffineNoise = NOISE, **how: Any
) -> list[Frame]:
    return [
        Frame(Path(f"{k}.png"), next(simulate_frames(scene * t, SRGB, noise, seed=k, **how)))
        for k, t in enumerate(times)
    ]


def colours(*rows: Sequence[float]) -> Pixels:
    """One pixel for each row of red, green and blue, shape (1, N, 3)."""
    return np.array([rows], dtype=np.float64)


@pytest.fixture(scope="module")
def radiance() -> Pixels:
    """Of patches, from three deviations above black in the longest exposure."""
    dark = DEVIATIONS * float(NOISE.std(0)) / max(TIMES)
    return np.geomspace(1.5 * dark, 3.6, 40)


@pytest.fixture(scope="module")
def bracket(radiance: Pixels) -> list[Frame]:
    return shots(np.repeat(radiance[:, np.newaxis], PATCH, axis=1)[..., np.newaxis], TIMES)


@pytest.fixture(scope="module")
def merged(bracket: list[Frame]) -> RadianceMap:
    return merge_frames(bracket, TIMES, camera())


def pulls(found: RadianceMap, radiance: Pixels) -> Pixels:
    """Error of the mean of each patch in deviations of that mean."""
    values = found.values[..., 0].astype(np.float64)
    return (values.mean(axis=1) - radiance) / (values.std(axis=1) / np.sqrt(PATCH))


# Against the truth


@pytest.mark.slow
def test_patches_are_unbiased_within_the_error_of_their_mean(
    merged: RadianceMap, radiance: Pixels
) -> None:
    z = pulls(merged, radiance)

    assert np.abs(z).max() < 4
    assert chi2.sf(np.sum(z**2), z.size) > 1e-3


def test_one_sweep_is_biased_near_white_of_a_long_exposure(
    bracket: list[Frame], merged: RadianceMap, radiance: Pixels
) -> None:
    """Noise makes half of the pixels there saturate; those that remain are too dark."""
    scene = np.full((1, PATCH, 1), 1.01)
    frames = shots(scene, TIMES)

    once, twice = (merge_frames(frames, TIMES, camera(), sweeps=n) for n in (1, 2))

    assert pulls(once, np.array([1.01]))[0] < -8
    assert abs(pulls(twice, np.array([1.01]))[0]) < 4


def test_weights_at_the_shown_level_pull_dark_patches_down() -> None:
    noise = AffineNoise(0.01, 1e-6)  # photons alone: relative noise 0.2 at 0.25
    scene, times = np.full((1, PATCH, 1), 0.25), (1.0, 1.001)
    frames = shots(scene, times, noise, bit_depth=16)

    once, twice = (
        float(merge_frames(frames, times, camera(noise=noise), sweeps=n).values.mean()) / 0.25 - 1
        for n in (1, 2)
    )

    assert once == pytest.approx(-(0.2**2) / 2, rel=0.2)
    assert abs(twice) < 4 * 0.2 / np.sqrt(2 * PATCH)


def cramer_rao(radiance: Pixels) -> Pixels:
    """Deviation that no unbiased estimate can fall below, levels taken as Gaussian."""
    information = np.zeros_like(radiance)
    edges = SRGB.inverse((np.arange(257) - 0.5).clip(0, 255) / 255)
    for t in TIMES:
        light = radiance * t
        step = np.diff(edges)[np.rint(255 * SRGB.response(light)).astype(int)]
        seen = light < 1
        information[seen] += (t**2 / (NOISE.variance(light) + step**2 / 12))[seen]
    return 1 / np.sqrt(information)


def test_variance_is_close_to_the_bound(merged: RadianceMap, radiance: Pixels) -> None:
    spread = merged.values[..., 0].astype(np.float64).std(axis=1)
    over_the_bound = spread / cramer_rao(radiance)
    near_white = np.any([abs(radiance * t - 1) < 0.06 for t in TIMES], axis=0)

    assert over_the_bound[~near_white].min() > 0.97
    assert over_the_bound[~near_white].max() < 1.1
    assert (over_the_bound**2).mean() < 1.2


def test_the_deviation_that_is_told_is_the_one_that_is_seen(
    merged: RadianceMap, radiance: Pixels
) -> None:
    seen = merged.values[..., 0].std(axis=1)

    assert np.median(merged.std[..., 0], axis=1) == pytest.approx(seen, rel=0.04)


def test_the_order_of_frames_does_not_matter(bracket: list[Frame], merged: RadianceMap) -> None:
    order = [3, 1, 0, 2]

    again = merge_frames([bracket[k] for k in order], [TIMES[k] for k in order], camera())

    assert np.allclose(again.values, merged.values, rtol=1e-6, atol=0)
    assert np.allclose(again.std, merged.std, rtol=1e-6, atol=0)


def test_the_unit_of_exposures_is_that_of_radiance(
    bracket: list[Frame], merged: RadianceMap
) -> None:
    again = merge_frames(bracket, np.array(TIMES) * 1e-5, camera())

    assert np.allclose(again.values, merged.values * 1e5, rtol=1e-6, atol=0)
    assert np.allclose(again.std, merged.std * 1e5, rtol=1e-6, atol=0)


# Against a plain loop


def by_the_rules(  # noqa: C901 - one loop, as the docstring reads
    frames: list[Pixels], times: Sequence[float], gamma: float, noise: AffineNoise, std: Pixels
) -> Pixels:
    """Radiance pixel by pixel in plain Python, from the documentation alone."""

    def light(level: float) -> float:
        return min(max(level / 255, 0.0), 1.0) ** gamma

    def covers(level: int) -> tuple[float, float]:
        return light(level - 0.5), light(level + 0.5)

    height, width, n_channels = frames[0].shape
    longest, shortest = max(times), min(times)
    result = np.zeros(frames[0].shape)
    for y, x in np.ndindex(height, width):
        pixels = [[int(each[y, x, c]) for c in range(n_channels)] for each in frames]
        since = [
            min((t for p, t in zip(pixels, times, strict=True) if p[c] == 255), default=1e9)
            for c in range(n_channels)
        ]
        expected = [0.0] * n_channels
        for sweep in (1, 2):
            found = []
            for c in range(n_channels):
                ranked: dict[int, list[tuple[float, float]]] = {}
                for pixel, t in zip(pixels, times, strict=True):
                    clipped = [
                        level == 255 or t >= 1.25 * s for level, s in zip(pixel, since, strict=True)
                    ]
                    if clipped[c]:
                        continue
                    low, high = covers(pixel[c])
                    middle = (low + high) / 2
                    rank = 1 if any(clipped) else 2
                    if rank == 2 and sweep == 2:
                        white = light(254.5) - 3 * noise.std(1.0)
                        black = 3 * noise.std(0.0)
                        bright = any(e * t > white for e in expected)
                        dark = expected[c] * t < black and middle < 2 * black
                        rank += not (bright or dark)
                    at = middle if sweep == 1 else expected[c] * t
                    variance = (
                        noise.slope * at + noise.floor + (high - low) ** 2 / 12 + std[pixel[c]] ** 2
                    )
                    ranked.setdefault(rank, []).append((t**2 / variance, middle / t))
                if not ranked:
                    found.append(np.inf)
                    continue
                best = ranked[max(ranked)]
                found.append(sum(w * v for w, v in best) / sum(w for w, _ in best))
            expected = found
        for c in range(n_channels):
            result[y, x, c] = expected[c] if np.isfinite(expected[c]) else 1 / shortest
            if all(pixel[c] == 0 for pixel in pixels):
                result[y, x, c] = covers(0)[1] / 2 / longest
    return result


@pytest.mark.parametrize("n_channels", [1, 3])
def test_every_pixel_agrees_with_a_plain_loop(n_channels: int) -> None:
    rng = np.random.default_rng(5)
    times = [0.3, 0.01, 1.1, 0.05, 0.06, 0.29, 4.0]
    noise = AffineNoise(2e-4, 3e-5)
    std = 0.001 + 0.02 * rng.random(256)
    scene = np.exp(rng.uniform(-15, 5, (40, 30, n_channels)))
    noisy = [scene * t * rng.lognormal(0, 0.2, scene.shape) for t in times]
    levels = [
        np.rint(255 * LINEAR.response(each.clip(0, 1)) ** (1 / 2.0)).astype(np.uint8)
        for each in noisy
    ]
    for each in levels:  # what no camera shows
        each[rng.random(each.shape) < 0.03] = 255
        each[rng.random(each.shape) < 0.03] = 250
    known = camera(
        *("RGB" if n_channels == 3 else "Y"),
        curve=ModelCurve("gamma", (0.5,)),
        noise=noise,
        std=std,
    )

    found = merge_frames([frame(each) for each in levels], times, known)

    wanted = by_the_rules(levels, times, 2.0, noise, std)
    assert np.allclose(found.values, wanted, rtol=2e-5, atol=0)
    assert found.saturated.any()
    assert found.black.any()


def test_large_frames_are_worked_on_in_strips() -> None:
    rng = np.random.default_rng(6)
    scene, noise = rng.integers(0, 200, (300, 200, 3)), rng.integers(0, 20, (3, 300, 200, 3))
    levels = [(scene * t + own).clip(0, 255) for t, own in zip((1, 3, 9), noise, strict=True)]

    whole = merge_frames([frame(each) for each in levels], (1, 3, 9), camera())
    part = merge_frames([frame(each[120:140]) for each in levels], (1, 3, 9), camera())

    assert np.array_equal(whole.values[120:140], part.values)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_frames() -> None:
    levels = np.random.default_rng(7).integers(0, 256, (400, 500, 3), dtype=np.uint8)

    class Many(Sequence[Frame]):
        def __init__(self, n: int) -> None:
            self.n = n

        def __len__(self) -> int:
            return self.n

        def __getitem__(self, place: Any) -> Any:
            return frame(levels.copy())

    def peak(n: int) -> float:
        tracemalloc.start()
        merge_frames(Many(n), [2.0**k for k in range(n)], camera())
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most / levels.size

    few, many = peak(2), peak(12)

    assert many < few + 0.5  # bytes for each sample; a frame more would be 1
    assert many < 25


# One scene


def detailed(seed: int) -> Pixels:
    """Light with detail, shape (200, 300)."""
    rng = np.random.default_rng(seed)
    soft = gaussian_filter(rng.standard_normal((200, 300)), 2, mode="wrap")
    return np.asarray(0.05 * np.exp(soft / soft.std()))


def shown(light: Pixels, name: str) -> Frame:
    levels = np.rint(255 * SRGB.response(light.clip(0, 1))).astype(np.uint8)
    return Frame(Path(name), levels[..., np.newaxis].copy())


def test_different_scenes_are_not_merged() -> None:
    frames = [shown(detailed(1), "a.png"), shown(4 * detailed(2), "b.png")]

    with pytest.raises(UnfitFramesError, match=r"^a\.png and b\.png do not show the same scene: "):
        merge_frames(frames, (1, 4), camera())


def test_frames_that_moved_are_named() -> None:
    light = detailed(3)
    still, moved = shown(4 * light[:-3], "b.png"), shown(16 * light[3:], "c.png")

    (text,) = merge_frames([shown(light[:-3], "a.png"), still, moved], (1, 4, 16), camera()).remarks

    assert text.startswith("c.png is displaced by 3.0 pixels against b.png: edges are doubled")
    assert "\n" not in text


# What is clipped


def test_what_is_saturated_in_all_exposures_gets_the_largest_lower_bound() -> None:
    frames = [frame([[255, 100]]), frame([[255, 200]]), frame([[255, 255]])]

    found = merge_frames(frames, (0.1, 0.4, 1.6), camera())

    assert found.values[0, 0, 0] == pytest.approx(10)
    assert found.saturated.tolist() == [[True, False]]
    assert not found.black.any()
    assert np.isinf(found.std[0, 0, 0])
    assert found.values.max() == found.values[0, 0, 0]


def test_what_is_black_in_all_exposures_gets_half_the_upper_bound() -> None:
    frames = [frame([[0, 0]]), frame([[0, 9]])]

    found = merge_frames(frames, (1, 4), camera(curve=LINEAR))

    assert found.values[0, 0, 0] == pytest.approx(0.5 / 255 / 2 / 4)
    assert found.black.tolist() == [[True, False]]
    assert not found.saturated.any()


@pytest.mark.slow
def test_nothing_is_ever_other_than_a_number() -> None:
    every = np.stack(np.meshgrid(np.arange(256), np.arange(256)))
    for curve in (SRGB, LINEAR, SampledCurve((0.0, 0.9, 0.95, 1.0), (0.0, 0.0, 1.0, 1.0))):
        for noise in (None, AffineNoise(0.0, 1e-12)):
            frames = [frame(each) for each in every]

            found = merge_frames(frames, (1e-6, 1e6), camera(curve=curve, noise=noise))

            assert np.isfinite(found.values).all()
            assert (found.values >= 0).all()


def test_ripples_of_compression_in_what_is_saturated_do_not_count() -> None:
    """In the longest exposure the pixel shows 253 though it saturates in a shorter one."""
    frames = [frame([[30]]), frame([[255]]), frame([[253]])]

    found = merge_frames(frames, (0.002, 0.25, 1), camera())

    assert found.values[0, 0, 0] == pytest.approx(float(SRGB.inverse(30 / 255)) / 0.002, rel=0.01)


def test_a_frame_that_shows_white_where_a_shorter_one_denies_it_does_not_count() -> None:
    frames = [frame([[120]]), frame([[253]])]

    found = merge_frames(frames, (0.001, 1), camera())

    assert found.values[0, 0, 0] == pytest.approx(float(SRGB.inverse(120 / 255)) / 0.001, rel=1e-3)


def test_saturated_pixels_keep_their_colour() -> None:
    """Exposures that are 10 % off would tint what mixes them."""
    scene = colours((1.6, 0.8, 0.4), (0.3, 0.2, 0.1))
    frames = [
        frame(np.rint(255 * SRGB.response(scene * t * actual)))
        for t, actual in ((0.25, 1.0), (1.0, 1.1))
    ]

    found = merge_frames(frames, (0.25, 1.0), camera("R", "G", "B"))

    assert found.values[0, 0] / found.values[0, 0, 0] == pytest.approx([1, 0.5, 0.25], rel=0.02)
    assert not found.saturated.any()


def test_other_channels_serve_where_one_is_saturated_in_all_exposures() -> None:
    scene = colours((9.0, 0.5, 0.1))
    frames = [frame(np.rint(255 * SRGB.response(scene * t))) for t in (0.25, 1.0)]

    found = merge_frames(frames, (0.25, 1.0), camera("R", "G", "B"))

    assert found.values[0, 0] == pytest.approx([4.0, 0.5, 0.1], rel=0.02)
    assert found.saturated.all()


def test_bloom_around_saturated_pixels_is_left_out_where_another_exposure_serves() -> None:
    short, long = np.full((9, 9), 60), np.full((9, 9), 200)
    short[4, 4], long[4, 4] = 200, 255
    frames = [frame(short), frame(long)]
    pair = [
        float(merge_frames([frame([[a]]), frame([[b]])], (0.01, 1), camera()).values[0, 0, 0])
        for a, b in ((60, 200), (60, 255))
    ]

    found = merge_frames(frames, (0.01, 1), camera(), bloom_radius=2).values[..., 0]

    away = np.hypot(*np.mgrid[-4:5, -4:5])
    assert found[(away > 0) & (away <= 2)] == pytest.approx(pair[1], rel=1e-6)
    assert found[away > 2] == pytest.approx(pair[0], rel=1e-6)


def test_bloom_is_used_where_nothing_else_serves() -> None:
    frames = [frame([[255, 200]] * 6), frame([[255, 255]] * 6)]

    with_bloom = merge_frames(frames, (0.25, 1), camera(), bloom_radius=1)

    assert with_bloom.values[0, 1, 0] == pytest.approx(4 * SRGB.inverse(200 / 255), rel=1e-3)


# White below the highest level


def test_white_may_lie_below_the_highest_level() -> None:
    frames = [frame([[252, 150]]), frame([[252, 252]])]

    found = merge_frames(frames, (0.25, 1), camera(), white=252)

    assert found.saturated.tolist() == [[True, False]]
    assert found.values.ravel() == pytest.approx(
        [4 * SRGB.inverse(252 / 255), 4 * SRGB.inverse(150 / 255)], rel=1e-3
    )


def test_levels_count_from_the_white_of_their_frames() -> None:
    frames = [
        replace(frame(each, np.uint16), white=4095) for each in ([[4000, 1500]], [[4095, 3000]])
    ]

    found = merge_frames(frames, (0.25, 1), camera())

    assert found.values[0, 0, 0] == pytest.approx(4 * SRGB.inverse(4000 / 4095), rel=1e-3)


def test_a_curve_that_reaches_its_end_early_says_where_white_is() -> None:
    lut = np.minimum(np.arange(256) / 240, 1.0) * (1 - 1e-9) + np.arange(256) / 255e9
    curve = SampledCurve.from_inverse(lut)

    found = merge_frames([frame([[239, 245]]), frame([[239, 240]])], (1, 4), camera(curve=curve))

    assert found.saturated.tolist() == [[False, True]]


def test_a_wide_band_of_the_calibration_takes_weight_from_a_level() -> None:
    std = np.where(np.arange(256) > 240, 0.3, 0.001)
    frames = [frame([[100]]), frame([[245]])]

    trusting, doubting = (
        merge_frames(frames, (0.1, 1), camera(std=each), sweeps=1) for each in (None, std)
    )

    short = float(SRGB.inverse(100 / 255)) / 0.1
    assert abs(doubting.values[0, 0, 0] / short - 1) < abs(trusting.values[0, 0, 0] / short - 1) / 3


def test_levels_that_end_below_white_are_remarked_on() -> None:
    rng = np.random.default_rng(3)
    levels = [rng.integers(0, 200, (30, 30, 3), dtype=np.uint8) for _ in range(2)]
    levels[1][:20] = [252, 255, 198]

    (remark,) = merge_frames([frame(each) for each in levels], (1, 4), camera()).remarks

    assert remark.startswith("channel R: no level is above 252, where 66.7 % of the longest")
    assert not merge_frames([frame(each) for each in levels], (1, 4), camera(), white=252).remarks


# Calibrations and frames of other kinds


@pytest.mark.slow
def test_without_noise_a_default_is_taken(bracket: list[Frame]) -> None:
    silent, default = (
        merge_frames(bracket, TIMES, camera(noise=noise)) for noise in (None, DEFAULT_NOISE)
    )

    assert np.array_equal(silent.values, default.values)


def test_channels_have_curves_of_their_own() -> None:
    scene = colours((0.5, 0.5, 0.5))
    curves = [ModelCurve("gamma", (1 / gamma,)) for gamma in (1.5, 2.0, 2.5)]
    frames = [
        frame(np.rint([[[255 * float(c.response(0.5 * t)) for c in curves]]])) for t in (0.25, 1.0)
    ]
    known = camera("R", "G", "B")
    known = replace(
        known,
        channels=tuple(
            replace(each, curve=curve) for each, curve in zip(known.channels, curves, strict=True)
        ),
    )

    found = merge_frames(frames, (0.25, 1.0), known, balanced=False)

    assert found.values == pytest.approx(scene, rel=0.01)


def test_what_the_camera_shows_as_middle_grey_is_grey() -> None:
    # Level 128 in all channels, of curves that are there at different shares of saturation.
    known = camera("R", "G", "B")
    curves = [ModelCurve("gamma", (1 / gamma,)) for gamma in (1.5, 2.0, 2.5)]
    channels = tuple(
        replace(each, curve=curve) for each, curve in zip(known.channels, curves, strict=True)
    )
    known = replace(known, channels=channels)
    longer = np.full((1, 1, 3), 128)
    shorter = [[[255 * float(c.response(c.inverse(128 / 255) / 4)) for c in curves]]]

    found = merge_frames([frame(np.rint(shorter)), frame(longer)], (0.25, 1.0), known)

    middle = float(curves[1].inverse(128 / 255))
    assert found.values == pytest.approx(np.full((1, 1, 3), middle), rel=0.02)
    assert grey_factors(known)[1] == 1


def test_sixteen_bits_with_a_calibration_of_eight() -> None:
    scene = np.geomspace(0.01, 3, 50).reshape(1, 50, 1)
    frames = [frame(np.rint(65535 * SRGB.response(scene * t)), np.uint16) for t in (0.25, 1, 4)]

    found = merge_frames(frames, (0.25, 1, 4), camera(std=np.full(256, 1e-4)))

    assert found.values.dtype == np.float32
    assert found.values == pytest.approx(scene, rel=2e-3)


def test_the_dynamic_range_is_that_of_the_middle_of_the_pixels() -> None:
    values = np.geomspace(1, 1024, 100_001, dtype=np.float32).reshape(1, -1, 1)
    nowhere = np.zeros(values.shape[:2], dtype=bool)

    wide = RadianceMap(values, values, nowhere, nowhere)

    assert wide.dynamic_range_stops == pytest.approx(9.98, abs=1e-3)
    assert RadianceMap(values, values, ~nowhere, nowhere).dynamic_range_stops is None


def test_orientation_is_that_of_the_shortest_exposure() -> None:
    turned = Frame(Path("a.jpg"), frame([[9, 9]]).levels, orientation=6)

    assert merge_frames([turned, turned], (1, 2), camera()).orientation == 6


def test_progress_counts_frames_of_all_sweeps() -> None:
    seen: list[tuple[int, int]] = []

    merge_frames([frame([[9]])] * 3, (1, 2, 3), camera(), on_frame=lambda *done: seen.append(done))

    assert seen == [(n, 6) for n in range(1, 7)]


# Refusals


@pytest.mark.parametrize(
    ("n_frames", "times", "settings", "message"),
    [
        (2, (1,), {}, "1 exposures were given for 2 frames"),
        (2, (1e-40, 2e-40), {}, r"exposure 1 must be between 1e-18 and 1e\+18, not 1e-40"),
        (2, (1, 1e308), {}, r"exposure 2 must be between 1e-18 and 1e\+18, not 1e\+308"),
        (2, (1e-12, 1e12), {}, "more than 64 stops apart"),
        (2, (1, 0), {}, "exposure 2 must be above 0, not 0"),
        (2, (1, np.nan), {}, "exposure 2 must be above 0, not nan"),
        (
            2,
            (1, 2),
            {"bloom_radius": 99_999},
            "bloom_radius must be a whole number between 0 and 0 pixels",
        ),
        (
            2,
            (1, 2),
            {"bloom_radius": -1},
            "bloom_radius must be a whole number between 0 and 0 pixels, .* not -1",
        ),
        (2, (1, 2), {"sweeps": 3}, "one or two sweeps, not 3"),
        (2, (1, 2), {"white": 1}, "white must be a level between 128 and 255, not 1"),
        (2, (1, 2), {"white": 256}, "white must be a level between 128 and 255, not 256"),
    ],
)
def test_settings_without_a_meaning_are_refused(
    n_frames: int, times: Sequence[float], settings: dict[str, Any], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        merge_frames([frame([[1, 2]])] * n_frames, times, camera(), **settings)


@pytest.mark.parametrize("n_frames", [0, 1])
def test_one_frame_alone_is_refused(n_frames: int) -> None:
    with pytest.raises(UnfitFramesError, match=f"{n_frames} frame is not a bracket"):
        merge_frames([frame([[1, 2]])] * n_frames, (1,) * n_frames, camera())


def test_frames_that_differ_in_more_than_exposure_are_refused() -> None:
    here, there = (replace(frame([[1]]), settings=CameraSettings(camera=name)) for name in "ab")

    with pytest.raises(UnfitFramesError, match="differ in size"):
        merge_frames([frame([[1, 2]]), frame([[1]])], (1, 2), camera())
    with pytest.raises(UnfitFramesError, match="differ in camera"):
        merge_frames([here, there], (1, 2), camera())


def test_a_calibration_of_other_channels_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"has the channels R, G, B, frame\.png has 1"):
        merge_frames([frame([[1]])] * 2, (1, 2), camera("R", "G", "B"))


@pytest.mark.parametrize(
    "times",
    [
        (LEAST_EXPOSURE, 2 * LEAST_EXPOSURE),
        (MOST_EXPOSURE / 2, MOST_EXPOSURE),
        (LEAST_EXPOSURE, MOST_RATIO * LEAST_EXPOSURE),
        (MOST_EXPOSURE / MOST_RATIO, MOST_EXPOSURE),
    ],
)
def test_whatever_exposures_are_taken_single_precision_holds_the_radiance(
    times: tuple[float, float],
) -> None:
    """Also a file of RGBE, which writes 0 below 10⁻³²."""
    levels = np.stack([np.arange(256), np.arange(256)[::-1], np.full(256, 255)])
    for shown in (levels, np.zeros_like(levels), np.full_like(levels, 255)):
        merged = merge_frames([frame(levels), frame(shown)], times, camera())

        assert np.isfinite(merged.values).all()
        assert np.all((merged.values > 1e-32) & (merged.values < 1e32))
        assert np.isfinite(merged.std[~merged.saturated]).all()
        assert np.all(merged.std > 0)
