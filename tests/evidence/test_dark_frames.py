"""Frames taken with the lens covered: counted, checked, and used by a calibration."""

from collections.abc import Callable, Iterator
from pathlib import Path

import gamma_camera
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

import chartless
from chartless import AffineNoise, Calibration, named_curve, simulate_frames
from chartless.curves.space import AbstractCurveSpace
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.noise.dark import std_with_dark
from chartless.evidence.noise.gather import dark_histograms
from chartless.evidence.noise.likelihood import DARK_PIXELS, PairModel
from chartless.evidence.noise.term import ridge_share
from chartless.frames.frame import Frame
from chartless.frames.levels import level_table
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import at_levels, at_mode, integrated
from chartless.noise import CAMERAS_OF_2008
from chartless.result.response import Response, rmse
from chartless.types import Counts, Floats, Levels

NOISE = AffineNoise.from_8bit(0.03, 16)


def dark_levels(seed: int, shape: tuple[int, ...] = (60, 80, 3)) -> Levels:
    levels = np.abs(np.random.default_rng(seed).normal(0, 4, shape))
    return np.rint(levels).astype(np.uint8)


def frame_of(levels: Levels, name: str = "dark.png") -> Frame:
    return Frame(Path(name), levels)


def counted(levels: Levels, n_levels: int = 256) -> Counts:
    """Level by level, by the most literal code."""
    return np.array([np.count_nonzero(levels == level) for level in range(n_levels)])


# Counting


def test_levels_are_counted_channel_by_channel() -> None:
    levels = dark_levels(1)

    histograms = dark_histograms([frame_of(levels)], ["R", "G", "B"], "auto", 256)

    assert list(histograms) == ["R", "G", "B"]
    for place, histogram in enumerate(histograms.values()):
        np.testing.assert_array_equal(histogram, counted(levels[..., place]))
        assert histogram.dtype == np.int64


@given(
    seed=st.integers(0, 2**32 - 1),
    sizes=st.lists(st.tuples(st.integers(1, 30), st.integers(1, 30)), min_size=1, max_size=5),
)
def test_counts_add_up_over_frames_of_any_size(seed: int, sizes: list[tuple[int, int]]) -> None:
    frames = [dark_levels(seed + place, (*size, 1)) for place, size in enumerate(sizes)]

    together = dark_histograms(map(frame_of, frames), ["Y"], "auto", 256)["Y"]

    alone = [dark_histograms([frame_of(each)], ["Y"], "auto", 256)["Y"] for each in frames]
    np.testing.assert_array_equal(together, np.sum(alone, axis=0))
    assert together.sum() == sum(height * width for height, width in sizes)


def test_no_frames_give_no_histograms() -> None:
    assert dark_histograms([], ["Y"], "auto", 256) == {}


def test_frames_are_read_one_by_one() -> None:
    read: list[int] = []

    def shoot() -> Iterator[Frame]:
        for number in range(3):
            read.append(number)
            yield frame_of(dark_levels(number) if number < 2 else np.full_like(dark_levels(2), 250))

    with pytest.raises(UnfitFramesError):
        dark_histograms(shoot(), "RGB", "auto", 256)
    assert read == [0, 1, 2]


def test_luma_is_that_of_the_three_channels() -> None:
    levels = dark_levels(3)

    histogram = dark_histograms([frame_of(levels)], ["Y"], "luma", 256)["Y"]

    luma = np.rint(levels @ np.array([0.299, 0.587, 0.114]))
    np.testing.assert_array_equal(histogram, counted(luma.astype(np.uint8)))


@pytest.mark.parametrize("n_levels", [16, 64, 256])
def test_levels_of_deep_frames_are_reduced_as_those_of_the_lit_ones(n_levels: int) -> None:
    levels = (257 * dark_levels(4, (60, 80, 1)).astype(np.uint16)).astype(np.uint16)

    histogram = dark_histograms([frame_of(levels)], ["Y"], "auto", n_levels)["Y"]

    np.testing.assert_array_equal(
        histogram, counted(level_table(65535, n_levels)[levels], n_levels)
    )
    assert histogram.shape == (n_levels,)


def test_a_model_of_the_sensor_predicts_the_counts() -> None:
    """Simulated, as `simulate_frames` does, against the normal distribution cut at black."""
    curve, n_pixels = named_curve("gamma:0.5"), 400_000
    (levels,) = simulate_frames(np.zeros((n_pixels, 1, 1)), curve, NOISE, n_frames=1, seed=2)
    edges = ((np.arange(255) + 0.5) / 255) ** 2
    below = np.concatenate([[0], ndtr(edges / np.sqrt(NOISE.floor)), [1]])
    expected = n_pixels * np.diff(below)

    histogram = dark_histograms([frame_of(levels)], ["Y"], "auto", 256)["Y"]

    common = expected > 20
    pulls = (histogram - expected)[common] / np.sqrt(expected[common])
    assert common.sum() > 40
    assert np.sum(pulls**2) == pytest.approx(common.sum(), abs=4 * np.sqrt(2 * common.sum()))


# Frames that are no dark frames of this camera


def one_line(error: pytest.ExceptionInfo[Exception]) -> str:
    text = str(error.value)
    assert "\n" not in text
    assert len(text) < 200
    return text


def test_a_grey_frame_for_a_colour_camera_is_refused() -> None:
    grey = frame_of(dark_levels(5, (60, 80, 1)), "cap.png")

    with pytest.raises(UnfitFramesError) as error:
        dark_histograms([grey], ["R", "G", "B"], "auto", 256)

    assert one_line(error) == (
        "cap.png has the channels Y, the lit frames R, G, B: give dark frames of the same camera "
        "and settings"
    )


def test_a_colour_frame_for_a_grey_camera_is_refused() -> None:
    with pytest.raises(UnfitFramesError, match="has the channels R, G, B, the lit frames Y: give"):
        dark_histograms([frame_of(dark_levels(6))], ["Y"], "auto", 256)


def test_a_frame_of_another_kind_is_refused_wherever_it_stands() -> None:
    frames = [frame_of(dark_levels(7)), frame_of(dark_levels(8, (60, 80, 1)), "second.png")]

    with pytest.raises(UnfitFramesError, match=r"^second\.png has the channels Y"):
        dark_histograms(frames, ["R", "G", "B"], "auto", 256)


@pytest.mark.parametrize("n_levels", [64, 256])
def test_a_bright_frame_is_refused(n_levels: int) -> None:
    levels = np.random.default_rng(9).integers(90, 120, (60, 80, 3)).astype(np.uint8)
    median = np.median(level_table(255, n_levels)[levels[..., 0]])

    with pytest.raises(UnfitFramesError) as error:
        dark_histograms([frame_of(levels, "day.png")], ["R", "G", "B"], "auto", n_levels)

    assert one_line(error) == (
        f"day.png is not dark (median level {median:.0f} of {n_levels - 1}): cover the lens"
    )


def test_one_bright_channel_is_enough_to_refuse_a_frame() -> None:
    levels = dark_levels(10)
    levels[..., 2] = 200  # a blue light leaks in

    with pytest.raises(UnfitFramesError, match="is not dark"):
        dark_histograms([frame_of(levels)], ["R", "G", "B"], "auto", 256)


def test_hot_pixels_and_lifted_noise_are_still_dark() -> None:
    levels = dark_levels(11) + np.uint8(40)
    levels[::10, ::10] = 255

    histograms = dark_histograms([frame_of(levels)], ["R", "G", "B"], "auto", 256)

    assert histograms["R"][255] == 48


# From frames to a calibration


def lit_scene() -> Floats:
    white = np.random.default_rng(0).standard_normal((240, 320))
    smooth = gaussian_filter(white, 8, mode="wrap")
    return np.asarray(smooth.ravel().argsort().argsort().reshape(smooth.shape) / (smooth.size - 1))


@pytest.fixture(scope="module")
def lit() -> list[Levels]:
    return list(simulate_frames(lit_scene(), named_curve("linear"), NOISE, seed=1))


@pytest.fixture(scope="module")
def covered() -> list[Levels]:
    """Of another size than the lit ones, which is no matter."""
    scene = np.zeros((400, 500))
    return list(simulate_frames(scene, named_curve("linear"), NOISE, n_frames=2, seed=2))


@pytest.fixture(scope="module")
def without(lit: list[Levels]) -> Calibration:
    return chartless.calibrate(lit, noise_prior=CAMERAS_OF_2008)


@pytest.fixture(scope="module")
def with_dark(lit: list[Levels], covered: list[Levels]) -> Calibration:
    return chartless.calibrate(lit, dark=covered, noise_prior=CAMERAS_OF_2008)


@pytest.mark.slow
def test_dark_frames_narrow_what_is_known_of_the_noise(
    without: Calibration, with_dark: Calibration
) -> None:
    plain, dark = (each.channel("Y") for each in (without, with_dark))

    assert plain.noise_error is not None
    assert dark.noise_error is not None
    assert dark.noise_error.log_floor < 0.9 * plain.noise_error.log_floor
    assert abs(np.log(dark.noise.floor / NOISE.floor)) < 2.5 * dark.noise_error.log_floor
    assert rmse(dark.curve, named_curve("linear")) < 0.03
    # They are no pairs of the scene.
    assert dark.n_pairs == plain.n_pairs == 240 * 320
    assert dark.observed_levels == plain.observed_levels


@pytest.mark.slow
def test_the_calibration_tells_of_its_dark_frames(
    without: Calibration, with_dark: Calibration, lit: list[Levels]
) -> None:
    assert with_dark.provenance["settings"]["dark"] == ["array", "array"]
    assert "dark" not in without.provenance["settings"]
    assert len(with_dark.provenance["inputs"]) == len(lit)


def test_one_dark_frame_is_as_good_as_its_two_halves(
    lit: list[Levels], covered: list[Levels], with_dark: Calibration
) -> None:
    joined = chartless.calibrate(
        lit, dark=[np.concatenate(covered).astype(np.uint8)], noise_prior=CAMERAS_OF_2008
    )

    np.testing.assert_array_equal(
        joined.channel("Y").inverse_lut, with_dark.channel("Y").inverse_lut
    )


@pytest.mark.slow
def test_each_channel_gets_its_own_dark_levels() -> None:
    """Green reads twice as noisily: its dark frames say so, and the others' do not."""
    lit, dark = [], []
    for place in range(3):
        noise = AffineNoise.from_8bit(0.03, 64 if place == 1 else 16)
        curve, scene = named_curve("linear"), lit_scene()
        lit.append(list(simulate_frames(scene, curve, noise, seed=10 + place)))
        dark.append(list(simulate_frames(np.zeros((300, 300)), curve, noise, seed=20 + place)))
    frames, covered = (
        [np.stack([channel[k] for channel in each], axis=-1).astype(np.uint8) for k in range(2)]
        for each in (lit, dark)
    )

    found = chartless.calibrate(frames, dark=covered, noise_prior=CAMERAS_OF_2008)

    floors = {each.name: each.noise.floor_8bit for each in found.channels}
    for name, floor in {"R": 16, "G": 64, "B": 16}.items():
        assert floors[name] == pytest.approx(floor, rel=0.4)
    assert all(sure_of_floor(each) < 0.3 for each in found.channels)


def sure_of_floor(response: Response) -> float:
    assert response.noise_error is not None
    return response.noise_error.log_floor


def test_methods_without_a_use_for_dark_frames_say_so(
    lit: list[Levels], covered: list[Levels]
) -> None:
    for method in ("nlf", "ism-bin"):
        with pytest.raises(ParameterError) as error:
            chartless.calibrate(lit, dark=covered, method=method)

        text = one_line(error)
        assert "dark frames" in text
        assert text.endswith("choose the method likelihood")


def test_lit_frames_given_as_dark_are_refused(lit: list[Levels]) -> None:
    with pytest.raises(UnfitFramesError, match=r"^frame 1 is not dark \(median level 1\d\d of 255"):
        chartless.calibrate(lit, dark=lit[:1])


# What they would leave, asked before they are taken


@pytest.fixture(scope="module", params=gamma_camera.SPACES)
def space(request: pytest.FixtureRequest) -> AbstractCurveSpace:
    return gamma_camera.space_of(request.param)


@pytest.fixture(scope="module")
def found(space: AbstractCurveSpace) -> ChannelMode:
    return gamma_camera.mode_at(gamma_camera.expected_counts(), space, gamma_camera.USUAL_RATIO)


def dark_shown(space: AbstractCurveSpace, values: Values, numbers: Floats) -> Floats:
    """Probability of each level under a covered lens, from coordinates and ln v."""
    noise = AffineNoise(1.0, float(np.exp(numbers[-1])))
    return PairModel(space.edges(numbers[:-1]), noise, gamma_camera.scene_of(values)).dark


def slopes(function: Callable[[Floats], Floats], at: Floats) -> Floats:
    """Derivatives by central differences, one column for each number."""
    steps = 1e-4 * np.eye(at.size)
    return np.stack([(function(at + step) - function(at - step)) / 2e-4 for step in steps], axis=1)


def test_what_dark_frames_would_leave_is_what_their_information_leaves(
    space: AbstractCurveSpace, found: ChannelMode
) -> None:
    """Σ n (∂A)²/A of the levels added to what is known, all by differences and inverses."""
    size, values = space.mean.size, found.mode.values
    at = gamma_camera.unknowns(values)[: size + 1]
    information = found.mode.factor @ found.mode.factor.T
    changes = slopes(lambda numbers: dark_shown(space, values, numbers), at)
    shown = dark_shown(space, values, at)
    information[: size + 1, : size + 1] += DARK_PIXELS * changes.T @ (changes.T / shown).T
    of_levels = slopes(lambda numbers: at_levels(space.edges(numbers)), at[:size])
    left = of_levels @ np.linalg.inv(information)[:size, :size] @ of_levels.T

    std = std_with_dark(at_mode(found, space), space)

    np.testing.assert_allclose(std, np.sqrt(np.diag(left)), rtol=2e-3, atol=1e-9)


def test_dark_frames_would_narrow_the_band_at_each_ratio_and_not_between(
    space: AbstractCurveSpace, found: ChannelMode
) -> None:
    counts = gamma_camera.expected_counts()
    modes = gamma_camera.ridge_of(counts, space, found.mode.values)
    posterior = integrated(modes, space, ridge_share(counts, space))
    best = at_mode(posterior.best, space)

    with_dark, best_with_dark = (std_with_dark(each, space) for each in (posterior, best))

    assert np.all(with_dark <= posterior.inverse_std + 1e-12)
    between = np.maximum(posterior.inverse_std**2 - best.inverse_std**2, 0)
    np.testing.assert_allclose(with_dark**2, best_with_dark**2 + between, rtol=1e-9, atol=1e-15)
