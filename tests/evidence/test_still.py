"""Segments of videos made as arrays: what is still, what was used, and why not."""

from collections.abc import Callable, Iterator, Sequence
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.gather import noise_evidence
from chartless.evidence.noise.still import ENOUGH, still_evidence
from chartless.frames.frame import Frame, TimedFrame

Pixels = np.ndarray[Any, Any]
CLIP = Path("clip.mp4")


def scene(seed: int = 0) -> Pixels:
    soft = gaussian_filter(np.random.default_rng(seed).standard_normal((96, 128)), 8, mode="wrap")
    return soft.ravel().argsort().argsort().reshape(96, 128) / soft.size * 200 + 10


def noisy(scenes: Sequence[Pixels], seed: int = 1) -> list[Pixels]:
    rng = np.random.default_rng(seed)
    return [
        np.rint(each + 2 * rng.standard_normal(each.shape)).clip(0, 219).astype(np.uint8)
        for each in scenes
    ]


def video(
    frames: Sequence[Pixels], times: Callable[[int], float | None] = lambda number: number / 25
) -> Iterator[TimedFrame]:
    for number, levels in enumerate(frames):
        frame = Frame(CLIP, levels[..., np.newaxis], remarks=("read",), white=219)
        yield TimedFrame(times(number), frame)


def panned(n_frames: int) -> list[Pixels]:
    """The scene passes by, two pixels a frame."""
    return [np.roll(scene(), 2 * number, axis=1) for number in range(n_frames)]


def counted(frames: Sequence[Pixels]) -> Cooccurrence:
    table = Cooccurrence.zeros(220)
    for first, second in pairwise(frames):
        table += Cooccurrence.of_pair(first, second, n_levels=220)
    return table


def test_all_of_a_still_video_is_used_as_frames_would_be() -> None:
    frames = noisy([scene()] * 6)

    found = still_evidence(video(frames), n_levels=220, sha256="abc")

    stills = noise_evidence((timed.frame for timed in video(frames)), n_levels=220)
    assert np.array_equal(found.tables["Y"].counts, stills.tables["Y"].counts)
    assert np.array_equal(found.tables["Y"].counts, counted(frames).counts)
    assert found.checks == stills.checks
    assert (found.n_frames, found.bit_depth) == (6, 8)
    (source,) = found.sources
    assert (source.path, source.sha256, source.span) == (CLIP, "abc", (1, 6))
    assert source.remarks == (
        "read",
        "used 0.00 to 0.20 s (frames 1 to 6), the longest still part of 6 read",
    )


@pytest.mark.parametrize("n_before", [0, 7])
@pytest.mark.parametrize("n_after", [0, 5])
def test_the_still_part_is_found_between_pans(n_before: int, n_after: int) -> None:
    moving = panned(n_before + n_after)
    still = noisy([scene()] * 12)
    frames = [*noisy(moving[:n_before], 2), *still, *noisy(moving[n_before:], 3)]

    found = still_evidence(video(frames), n_levels=220)

    (source,) = found.sources
    # The first moved frame of a pan may be where the still part ends.
    first, last = source.span or (0, 0)
    assert n_before + 1 - (n_before > 0) <= first <= n_before + 1
    assert n_before + 12 <= last <= n_before + 12 + (n_after > 0)
    assert abs(found.tables["Y"].n_pairs - counted(still).n_pairs) <= 96 * 128


def test_of_several_still_parts_the_longest_is_used() -> None:
    parts = [*([scene(1)] * 4), *([scene(2)] * 9), *([scene(3)] * 6)]

    found = still_evidence(video(noisy(parts)), n_levels=220)

    assert found.sources[0].span == (5, 13)
    assert found.n_frames == 9


def test_a_part_without_doubt_is_preferred_to_a_longer_doubtful_one() -> None:
    flicker = [scene() * (1 + 0.03 * (number % 2)) for number in range(20)]

    found = still_evidence(video(noisy([*flicker, *[scene(2)] * 12])), n_levels=220)

    assert found.sources[0].span == (21, 32)


def test_a_doubtful_part_is_used_where_there_is_no_better() -> None:
    flicker = [scene() * (1 + 0.03 * (number % 2)) for number in range(20)]

    found = still_evidence(video(noisy(flicker)), n_levels=220)

    assert found.sources[0].span == (1, 20)


@pytest.mark.slow
def test_reading_stops_when_there_is_enough() -> None:
    frames = noisy([scene()] * 2)
    numbers = count()
    endless = (
        TimedFrame(number / 25, Frame(CLIP, frames[number % 2][..., np.newaxis], white=219))
        for number in numbers
    )

    found = still_evidence(endless, n_levels=220)

    assert found.n_frames == ENOUGH
    assert next(numbers) == ENOUGH


@pytest.mark.slow
def test_reading_stops_where_nothing_is_still(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chartless.evidence.noise.still.MOST", 50)
    numbers = count()
    restless = (
        TimedFrame(None, Frame(CLIP, np.full((32, 32, 1), 10 * (number % 20), np.uint8)))
        for number in numbers
    )

    with pytest.raises(UnfitFramesError):
        still_evidence(restless)

    assert next(numbers) == 50


def test_repeated_frames_are_left_out_with_a_remark() -> None:
    frames = noisy([scene()] * 5)
    doubled = [frame for frame in frames for _ in range(3)]

    found = still_evidence(video(doubled), n_levels=220)

    assert np.array_equal(found.tables["Y"].counts, counted(frames).counts)
    assert found.n_frames == 5
    assert found.sources[0].remarks[-1] == "left out 10 frames that repeat the previous one"


@pytest.mark.parametrize(("white", "n_levels"), [(219, 220), (255, 256), (876, 256)])
def test_levels_are_those_of_the_video_up_to_256(white: int, n_levels: int) -> None:
    rng = np.random.default_rng(5)
    dtype = np.uint8 if white < 256 else np.uint16
    middle = np.linspace(0.1, 0.9, 4096).reshape(64, 64, 1) * white
    frames = [np.rint(middle + rng.normal(0, 3, middle.shape)).astype(dtype) for _ in range(3)]

    found = still_evidence(TimedFrame(None, Frame(CLIP, each, white=white)) for each in frames)

    assert found.n_levels == n_levels


def test_a_video_without_times_names_its_frames() -> None:
    found = still_evidence(video(noisy([scene()] * 3), lambda _: None), n_levels=220)

    assert found.sources[0].remarks[1] == "used frames 1 to 3, the longest still part of 3 read"


def refusal(timed: Iterator[TimedFrame], **how: Any) -> str:
    with pytest.raises(UnfitFramesError) as caught:
        still_evidence(timed, n_levels=220, **how)
    return str(caught.value)


def test_a_frozen_video_is_refused() -> None:
    message = refusal(video(noisy([scene()]) * 9))

    assert message.startswith("clip.mp4: all frames show identical pixels, so there is no noise")


def test_a_video_in_which_all_moves_is_refused() -> None:
    message = refusal(video(noisy(panned(8))))

    assert message.startswith("clip.mp4: no two frames are still; the last two ")


def test_a_single_frame_is_refused() -> None:
    assert (
        refusal(video(noisy([scene()]))) == "clip.mp4: no two frames are still; there is only one"
    )


def test_a_varying_rate_is_refused() -> None:
    message = refusal(video(noisy([scene()] * 9), lambda number: number**2 / 100))

    assert message.startswith(
        "clip.mp4: the frame rate varies (intervals of 10 to 150 ms), and with it perhaps the "
    )


def test_a_lost_frame_and_the_clock_of_the_file_are_no_varying_rate() -> None:
    def times(number: int) -> float:
        return round((number + (number > 20)) / 30, 3)

    assert still_evidence(video(noisy([scene()] * 40), times), n_levels=220).n_frames == 40


def test_frames_that_change_their_size_are_refused() -> None:
    frames = [*noisy([scene()] * 2), np.zeros((8, 8), np.uint8)]

    assert "the frames differ in size" in refusal(video(frames))


def test_a_mask_of_another_size_is_refused() -> None:
    with pytest.raises(ParameterError, match="the mask is 3 × 3"):
        still_evidence(video(noisy([scene()] * 2)), n_levels=220, mask=np.ones((3, 3), bool))
