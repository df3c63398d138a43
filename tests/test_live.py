"""Evidence of a running camera: what is counted, what is left out, what is forgotten and when."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from chartless import AffineNoise, load, named_curve, rmse, save, simulate_frames
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.gather import noise_evidence
from chartless.evidence.noise.still import still_evidence
from chartless.flags import Flag
from chartless.frames.frame import CameraSettings, Frame, TimedFrame
from chartless.live import LEAST, LiveEvidence, Outcome, is_enough, lacking, live_calibration
from chartless.methods import NoiseLevelSearch
from chartless.noise import CAMERAS_OF_2008
from chartless.result.summary import n_frames
from chartless.result.verdict import WORST_BAND, Grade, band, verdict

Pixels = np.ndarray[Any, Any]
CAMERA = Path("camera")
CURVE, NOISE = named_curve("srgb"), AffineNoise.from_8bit(0.03, 16)
SENSOR = AffineNoise.of_sensor(1_500, 5)  # as the curve is expected to have it


def scene(seed: int = 0, shape: tuple[int, int] = (96, 128)) -> Pixels:
    """Soft blobs in which every irradiance is equally frequent."""
    soft = gaussian_filter(np.random.default_rng(seed).standard_normal(shape), 8, mode="wrap")
    return soft.ravel().argsort().argsort().reshape(shape) / soft.size


WIDE = scene(1, (192, 256))


def taken(scenes: Iterable[Pixels], noise: AffineNoise = NOISE, seed: int = 1) -> list[Frame]:
    """A frame of each scene."""
    rng = np.random.default_rng(seed)
    shots = (next(simulate_frames(each, CURVE, noise, n_frames=1, seed=rng)) for each in scenes)
    return [Frame(CAMERA, shot.reshape(*shot.shape[:2], -1)) for shot in shots]


def with_gain(gain: float) -> AffineNoise:
    return AffineNoise(gain * NOISE.slope, gain**2 * NOISE.floor)


def watched(frames: Iterable[Frame], **how: Any) -> tuple[LiveEvidence, list[Outcome]]:
    live = LiveEvidence(**how)
    return live, [live.add(frame) for frame in frames]


def counted(frames: Sequence[Frame], n_levels: int = 256) -> Cooccurrence:
    table = Cooccurrence.zeros(n_levels)
    for first, second in pairwise(frames):
        table += Cooccurrence.of_pair(
            first.levels[..., 0], second.levels[..., 0], n_levels=n_levels
        )
    return table


# What is counted


@pytest.mark.parametrize("n_channels", [1, 3])
def test_evidence_is_that_of_the_same_frames_from_files(n_channels: int) -> None:
    colours = np.stack([scene(each) for each in range(n_channels)], axis=-1)
    frames = taken([colours] * 8)

    live, outcomes = watched(frames)

    stills, found = noise_evidence(frames), live.evidence()
    assert found.tables.keys() == stills.tables.keys()
    for name, table in stills.tables.items():
        assert np.array_equal(found.tables[name].counts, table.counts)
    assert found.checks == stills.checks
    assert (found.n_frames, found.bit_depth) == (8, 8)
    assert outcomes == [Outcome.FIRST, *[Outcome.USED] * 7]
    assert (live.n_frames, live.n_used, live.n_kept) == (8, 7, 7)


def test_evidence_is_that_of_a_still_video() -> None:
    frames = [replace(each, levels=each.levels // 2, white=219) for each in taken([scene()] * 6)]

    live, _ = watched(frames)

    video = [TimedFrame(number / 25, frame) for number, frame in enumerate(frames)]
    still = still_evidence(video, n_levels=220)
    assert live.n_levels == 220
    assert np.array_equal(live.evidence().tables["Y"].counts, still.tables["Y"].counts)


def test_levels_and_channels_are_reduced_on_request() -> None:
    colours = np.stack([scene(each) for each in range(3)], axis=-1)

    live, _ = watched(taken([colours] * 3), channels="luma", n_levels=64)

    (table,) = live.evidence().tables.values()
    assert table.n_levels == 64


# What is forgotten


@pytest.mark.slow
@settings(max_examples=15)
@given(window=st.integers(LEAST, 24), n_frames=st.integers(2, 40))
def test_exactly_the_latest_pairs_are_kept(window: int, n_frames: int) -> None:
    frames = taken([scene()] * n_frames)

    live, _ = watched(frames, window=window)

    block = window // 5
    assert live.n_kept <= min(window, n_frames - 1)
    assert live.n_kept >= min(n_frames - 1, 4 * block + 1)
    latest = frames[-live.n_kept - 1 :]
    found = live.evidence()
    assert np.array_equal(found.tables["Y"].counts, counted(latest).counts)
    assert found.checks == noise_evidence(latest).checks
    (source,) = found.sources
    assert source.span == (n_frames - live.n_kept, n_frames)
    assert live.n_used == n_frames - 1


def test_a_change_of_gain_ends_what_was_before() -> None:
    before, after = taken([WIDE] * 6), taken([WIDE] * 8, with_gain(1.5), seed=2)

    live, outcomes = watched([*before, *after])

    # The pair of both gains is neither of the one nor of the other.
    assert outcomes[6:8] == [Outcome.RESTARTED, Outcome.RESTARTED]
    assert outcomes[8:] == [Outcome.USED] * 6
    assert np.array_equal(live.evidence().tables["Y"].counts, counted(after).counts)
    assert live.evidence().sources[0].span == (7, 14)
    assert "restarted 2 times because the noise changed" in live.account


@pytest.mark.slow
@settings(max_examples=15)
@given(exposure=st.floats(0.35, 2.0), other=st.integers(2, 6))
def test_another_exposure_or_scene_of_the_same_gain_is_kept(exposure: float, other: int) -> None:
    second = exposure * scene(other, WIDE.shape)

    live, outcomes = watched(taken([*[WIDE] * 3, *[second] * 3]))

    assert Outcome.RESTARTED not in outcomes
    assert live.n_kept >= 4


def test_a_change_of_exposure_shows_more_of_the_curve() -> None:
    dim, bright = [0.3 * WIDE] * 6, [WIDE] * 6

    short, _ = watched(taken(dim, SENSOR))
    both, outcomes = watched(taken([*dim, *bright], SENSOR))

    assert outcomes[6] in {Outcome.LIGHT_CHANGED, Outcome.MOVED}
    assert both.n_kept == 10
    bands = [band(live_calibration(live).channels) or np.inf for live in (short, both)]
    assert bands[1] < 0.8 * bands[0]
    assert rmse(live_calibration(both).channel("Y").curve, CURVE) < 2 * bands[1]


@pytest.mark.slow
def test_mixed_gains_would_bend_the_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    dim, bright = taken([0.45 * WIDE] * 10), taken([WIDE] * 10, with_gain(2.0), seed=2)
    search = partial(NoiseLevelSearch, noise_prior=CAMERAS_OF_2008)  # as these frames are
    monkeypatch.setattr("chartless.live.NoiseLevelSearch", search)

    def error(frames: Sequence[Frame]) -> float:
        live, _ = watched(frames)
        return rmse(live_calibration(live).channel("Y").curve, CURVE)

    alone = error([*dim, *bright])
    monkeypatch.setattr("chartless.live._OTHER_GAIN", np.inf)
    assert error([*dim, *bright]) > 2 * alone


# What is left out


def test_what_moved_is_left_out() -> None:
    moving = [np.roll(scene(), 3 * number, axis=1) for number in range(4)]
    still = [scene(2)] * 5

    live, outcomes = watched(taken([*moving, *still]))

    assert outcomes == [Outcome.FIRST, *[Outcome.MOVED] * 4, *[Outcome.USED] * 4]
    assert np.array_equal(
        live.evidence().tables["Y"].counts, counted(taken([*moving, *still])[4:]).counts
    )
    assert live.account == ("9 frames, 4 pairs used; left out: something moved 4×")


def test_a_sudden_change_of_light_is_left_out() -> None:
    _, outcomes = watched(taken([*[WIDE] * 3, *[0.8 * WIDE] * 3]))

    assert outcomes[3] is Outcome.LIGHT_CHANGED
    assert outcomes.count(Outcome.USED) == 4


def test_a_flickering_lamp_is_made_up_for() -> None:
    live, outcomes = watched(
        taken((WIDE * (1 - 0.03 * (number % 2)) for number in range(12)), SENSOR)
    )

    assert outcomes[1:] == [Outcome.USED] * 11
    calibration = live_calibration(live)
    assert Flag.BRIGHTNESS_DRIFT in calibration.flags
    assert rmse(calibration.channel("Y").curve, CURVE) < 0.02


def test_repeated_frames_are_left_out() -> None:
    frames = taken([scene()] * 4)

    live, outcomes = watched([frame for frame in frames for _ in range(3)])

    assert outcomes.count(Outcome.REPEATED) == 8
    assert np.array_equal(live.evidence().tables["Y"].counts, counted(frames).counts)
    assert live.evidence().n_frames == 4


def test_settings_that_name_the_exposure_may_change() -> None:
    frames = [
        replace(each, settings=CameraSettings(1 / (30 + 30 * place), 2.0, 100))
        for place, each in enumerate(taken([scene()] * 3))
    ]

    _, outcomes = watched(frames)

    assert outcomes[1:] == [Outcome.USED] * 2


# What is refused


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (np.zeros((8, 8, 1), np.uint8), "differ in size: camera has 128 × 96, camera has 8 × 8"),
        (np.zeros((96, 128, 3), np.uint8), "differ in channels"),
        (np.zeros((96, 128, 1), np.uint16), "differ in bit depth"),
    ],
)
def test_a_camera_that_changes_its_pictures_is_refused(other: Pixels, says: str) -> None:
    live, _ = watched(taken([scene()] * 3))
    before = live.evidence().tables["Y"].counts

    with pytest.raises(UnfitFramesError, match=says):
        live.add(Frame(CAMERA, other))

    assert np.array_equal(live.evidence().tables["Y"].counts, before)
    assert live.n_frames == 3


@pytest.mark.parametrize(
    ("scenes", "says"),
    [
        ([], "there are no frames yet: connect the camera"),
        ([scene()], r"camera: no two frames are still \(there is only one\): put the camera on a"),
        (
            [np.roll(scene(), 3 * number, axis=1) for number in range(4)],
            r"no two frames are still \(something moved 3×\)",
        ),
        ([0.5 + 0.02 * scene()] * 4, "too little for a curve"),
    ],
)
def test_without_evidence_there_is_no_calibration(scenes: list[Pixels], says: str) -> None:
    live, _ = watched(taken(scenes))

    with pytest.raises(UnfitFramesError, match=says):
        live_calibration(live)


def test_a_window_too_small_is_refused() -> None:
    with pytest.raises(ParameterError, match="must hold 10 pairs of frames or more, not 9"):
        LiveEvidence(window=9)


def test_levels_that_do_not_suit_are_refused() -> None:
    with pytest.raises(ParameterError, match="levels must lie between"):
        watched(taken([scene()]), n_levels=300)


# The calibration


def test_calibration_says_where_it_is_from(tmp_path: Path) -> None:
    moving = [np.roll(scene(), 3 * number, axis=1) for number in range(3)]
    live, _ = watched(taken([*moving, *[scene(2)] * 6]), window=50)

    calibration = live_calibration(live)

    known = calibration.provenance
    assert known["inputs"] == [{"file": "camera", "sha256": "", "frames": [4, 9], "used": 6}]
    assert known["settings"]["method"] == "nlf"
    assert known["settings"]["window"] == 50
    assert known["remarks"] == [f"camera: {live.account}"]
    save(calibration, tmp_path / "camera.json")
    assert n_frames(load(tmp_path / "camera.json")) == 6


def test_frames_used_are_told_from_frames_between_them() -> None:
    still, shaken = scene(), np.roll(scene(), 3, axis=1)
    live, _ = watched(taken([still, still, shaken, still, still]))

    calibration = live_calibration(live)

    assert calibration.provenance["inputs"][0]["frames"] == [1, 5]
    assert n_frames(calibration) == 3


def test_enough_is_a_matter_of_band_and_pairs() -> None:
    frames = taken([WIDE] * (LEAST + 1), SENSOR)
    live, _ = watched(frames[:-1])
    few = live_calibration(live)
    assert not is_enough(live, few)
    assert lacking(live, few) == f"not good enough yet: fewer than {LEAST} pairs"

    live.add(frames[-1])
    calibration = live_calibration(live)

    assert (band(calibration.channels) or 1) < WORST_BAND
    assert is_enough(live, calibration)
    assert lacking(live, calibration) == ""
    assert not is_enough(live, calibration, until=0.005)
    assert lacking(live, calibration, 0.005).endswith("yet: the error is above ± 0.005")


def test_noise_of_another_shape_is_never_enough() -> None:
    rng = np.random.default_rng(2)

    def shot() -> Frame:
        light = WIDE + NOISE.std(WIDE) * rng.laplace(scale=np.sqrt(0.5), size=WIDE.shape)
        levels = np.rint(255 * CURVE.response(light.clip(0, 1))).astype(np.uint8)
        return Frame(CAMERA, levels[..., np.newaxis])

    live, outcomes = watched(shot() for _ in range(12))

    calibration = live_calibration(live)
    assert outcomes[1:] == [Outcome.USED] * 11
    assert Flag.MISFIT in calibration.flags
    assert verdict(calibration.channels).grade is Grade.DISTRUST
    assert not is_enough(live, calibration, until=1.0)
    assert lacking(live, calibration, 1.0) == (
        "not good enough, and more frames will hardly help: misfit"
    )
