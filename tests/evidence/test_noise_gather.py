"""Frames in, tables out."""

import weakref
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.noise.gather import noise_evidence
from chartless.frames.frame import Frame
from chartless.frames.levels import MAX_LEVELS, level_table

Levels = npt.NDArray[Any]


def levels_of(seed: int, shape: tuple[int, int, int] = (40, 50, 3)) -> Levels:
    """A ramp with noise."""
    rng = np.random.default_rng(seed)
    ramp = np.linspace(10, 240, shape[0] * shape[1]).reshape(*shape[:2], 1)
    return np.rint(ramp + rng.normal(0, 3, shape)).astype(np.uint8)


def frame_of(number: int, levels: Levels | None = None) -> Frame:
    return Frame(Path(f"{number}.png"), levels_of(number) if levels is None else levels)


def counted(first: Levels, second: Levels, n_levels: int = 256) -> Levels:
    """Co-occurrences by the most literal code."""
    counts = np.zeros((n_levels, n_levels), dtype=np.int64)
    for a, b in zip(first.ravel(), second.ravel(), strict=True):
        counts[a, b] += 1
    return counts


# Counting


def test_a_pair_is_counted_channel_by_channel() -> None:
    a, b = frame_of(1), frame_of(2)

    evidence = noise_evidence([a, b])

    assert list(evidence.tables) == ["R", "G", "B"]
    assert (evidence.bit_depth, evidence.n_frames, len(evidence.checks)) == (8, 2, 1)
    for c, table in enumerate(evidence.tables.values()):
        assert np.array_equal(table.counts, counted(a.levels[..., c], b.levels[..., c]))


def test_evidence_is_additive() -> None:
    frames = [frame_of(number) for number in (1, 2, 3, 4)]

    together = noise_evidence(frames)
    pairs = [noise_evidence(pair) for pair in pairwise(frames)]

    assert (together.n_frames, len(together.checks)) == (4, 3)
    for name, table in together.tables.items():
        added = pairs[0].tables[name] + pairs[1].tables[name] + pairs[2].tables[name]
        assert np.array_equal(table.counts, added.counts)
        assert table.n_pairs == 3 * 40 * 50
    assert together.checks == tuple(pair.checks[0] for pair in pairs)


def test_never_more_than_two_frames_are_held() -> None:
    alive: list[weakref.ref[Any]] = []
    most = 0

    class Tracked(Frame):
        """A frame that can be watched."""

    def note() -> None:
        nonlocal most
        most = max(most, sum(reference() is not None for reference in alive))

    def shoot() -> Iterator[Frame]:
        for number in range(8):
            yield make(number)

    def make(number: int) -> Frame:
        frame = Tracked(Path(f"{number}.png"), levels_of(number))
        alive.append(weakref.ref(frame))
        note()
        return frame

    evidence = noise_evidence(shoot(), on_frame=lambda _: note())

    assert evidence.n_frames == 8
    assert most == 2
    assert not any(reference() is not None for reference in alive)


@pytest.mark.parametrize("channels", ["auto", "luma"])
@pytest.mark.parametrize("n_levels", [256, 64])
def test_never_more_than_two_pictures_are_held(channels: str, n_levels: int) -> None:
    alive: list[weakref.ref[Levels]] = []
    most = 0

    def make(number: int) -> Frame:
        nonlocal most
        levels = levels_of(number)
        alive.append(weakref.ref(levels))
        most = max(most, sum(reference() is not None for reference in alive))
        return frame_of(number, levels)

    noise_evidence(map(make, range(6)), channels=channels, n_levels=n_levels)

    assert most == 2


def test_each_frame_is_told_once_in_order() -> None:
    told: list[Frame] = []
    frames = [frame_of(number) for number in (1, 2, 3)]

    noise_evidence(iter(frames), on_frame=told.append)

    assert told == frames


def shot(number: int, *, light: float = 1.0) -> Frame:
    """A linear camera's grey ramp under more or less light."""
    rng = np.random.default_rng(number)
    ramp = np.linspace(20, 230, 60_000).reshape(200, 300, 1)
    return frame_of(number, np.rint(light * ramp + rng.normal(0, 3, ramp.shape)).astype(np.uint8))


def mean_squared_difference(counts: Levels) -> float:
    earlier, later = np.nonzero(counts)
    return float(np.average((earlier - later) ** 2.0, weights=counts[earlier, later]))


def test_flicker_within_a_pair_is_undone() -> None:
    """Up and down by 2 %: the sum of the pairs would show no drift, only more noise."""
    steady = noise_evidence(map(shot, (1, 2, 3)))
    flickering = noise_evidence([shot(1), shot(2, light=0.98), shot(3)])

    counts, found = steady.tables["Y"].counts, flickering.tables["Y"].counts
    assert np.array_equal(
        counts, sum(counted(shot(a).levels, shot(b).levels) for a, b in ((1, 2), (2, 3)))
    )
    assert found.sum() == counts.sum()
    assert mean_squared_difference(counts) == pytest.approx(18, rel=0.02)
    assert mean_squared_difference(found) == pytest.approx(18, rel=0.02)
    assert [check.drift for check in steady.checks] == [0, 0]
    for check in flickering.checks:
        assert check.drift == pytest.approx(0.02, rel=0.1)
        assert check.drift_share > 0.1


def test_a_large_change_of_light_is_left_as_it_is() -> None:
    a, b = shot(1), shot(2, light=0.85)

    evidence = noise_evidence([a, b])

    assert np.array_equal(evidence.tables["Y"].counts, counted(a.levels, b.levels))
    assert evidence.checks[0].drift == pytest.approx(0.15, rel=0.2)


def test_movers_and_shared_noise_are_told() -> None:
    grey = [np.repeat(shot(number).levels, 3, axis=2) for number in (1, 2)]
    grey[1][:20] = 255 - grey[1][:20]

    (check,) = noise_evidence([frame_of(k, levels) for k, levels in enumerate(grey)]).checks

    assert check.channel_correlation == pytest.approx(1)
    assert check.outliers == pytest.approx(0.1, abs=0.01)
    assert check.patch_share < 0.05


# Channels, levels, mask


def test_grey_frames_have_one_channel() -> None:
    frames = [frame_of(seed, levels_of(seed, (40, 50, 1))) for seed in (1, 2)]

    assert list(noise_evidence(frames).tables) == ["Y"]
    assert list(noise_evidence(frames, channels="luma").tables) == ["Y"]


def test_luma_is_that_of_jpeg_files() -> None:
    a, b = frame_of(1), frame_of(2)

    table = noise_evidence([a, b], channels="luma").tables["Y"]

    luma = [np.rint(frame.levels @ [0.299, 0.587, 0.114]).astype(int) for frame in (a, b)]
    # float32 and float64 may round a tie apart
    assert np.abs(table.counts - counted(*luma)).sum() <= 4


def test_luma_of_grey_in_three_channels_is_that_grey() -> None:
    ramp = np.repeat(np.arange(256, dtype=np.uint8).reshape(16, 16, 1), 3, axis=2)

    table = noise_evidence([frame_of(1, ramp), frame_of(2, ramp[::-1].copy())], channels="luma")

    assert np.array_equal(table.tables["Y"].counts, counted(ramp[..., 0], ramp[::-1][..., 0]))


def test_luma_of_white_at_sixteen_bits_is_white() -> None:
    white = np.full((4, 4, 3), 65535, np.uint16)
    less = white - np.uint16(3000)

    evidence = noise_evidence([frame_of(1, white), frame_of(2, less)], channels="luma")

    assert evidence.tables["Y"].observed_levels == (243, 255)


@pytest.mark.parametrize("n_levels", [16, 64, 256, 1000, MAX_LEVELS])
def test_sixteen_bits_are_reduced_to_the_nearest_level(n_levels: int) -> None:
    rng = np.random.default_rng(5)
    a, b = (rng.integers(0, 65536, (30, 30, 1), dtype=np.uint16) for _ in "ab")

    evidence = noise_evidence([frame_of(1, a), frame_of(2, b)], n_levels=n_levels)

    assert evidence.bit_depth == 16
    reduced = (np.rint(x / 65535 * (n_levels - 1)).astype(int) for x in (a, b))
    assert np.array_equal(evidence.tables["Y"].counts, counted(*reduced, n_levels=n_levels))


@pytest.mark.parametrize(
    ("bit_depth", "n_levels"), [(8, 16), (8, 100), (16, 256), (16, MAX_LEVELS - 1)]
)
def test_reduced_levels_keep_their_brightness(bit_depth: int, n_levels: int) -> None:
    table = level_table(2**bit_depth - 1, n_levels)
    brightness = np.linspace(0, 1, 1 << bit_depth)

    assert (table[0], table[-1]) == (0, n_levels - 1)
    assert np.abs(table / (n_levels - 1) - brightness).max() <= 0.5 / (n_levels - 1) + 1e-12


def test_only_pixels_in_the_mask_are_counted() -> None:
    a, b = frame_of(1), frame_of(2)
    mask = np.random.default_rng(6).uniform(size=(40, 50)) < 0.3

    evidence = noise_evidence([a, b], mask=mask)

    for c, table in enumerate(evidence.tables.values()):
        assert np.array_equal(table.counts, counted(a.levels[mask, c], b.levels[mask, c]))


def test_frames_are_not_changed() -> None:
    frames = [frame_of(1), frame_of(2)]
    for frame in frames:
        frame.levels.setflags(write=False)

    noise_evidence(frames, n_levels=32, channels="luma")


@pytest.mark.parametrize(("white", "bits"), [(219, 8), (876, 10), (4095, 12), (15871, 14)])
def test_brightness_is_counted_from_white(white: int, bits: int) -> None:
    rng = np.random.default_rng(3)
    first, second = rng.integers(0, white + 1, (2, 40, 50, 1), dtype=np.uint16)

    evidence = noise_evidence(
        [Frame(Path(name), each, white=white) for name, each in (("1", first), ("2", second))],
        n_levels=64,
    )

    a, b = (np.floor(each.astype(int) * 63 / white + 0.5).astype(int) for each in (first, second))
    assert np.array_equal(evidence.tables["Y"].counts, counted(a, b, 64))
    assert evidence.bit_depth == bits


# Refusals


@pytest.mark.parametrize(
    ("frames", "given"), [([], "none was given"), ([frame_of(1)], "only 1.png was given")]
)
def test_fewer_than_two_frames(frames: list[Frame], given: str) -> None:
    with pytest.raises(UnfitFramesError, match=f"two or more frames .* {given}"):
        noise_evidence(frames)


def test_frames_of_another_white_are_refused() -> None:
    frames = [
        Frame(Path(f"{white}.raw"), levels_of(white).astype(np.uint16), white=white)
        for white in (15871, 16383)
    ]

    with pytest.raises(UnfitFramesError, match=r"white level: 15871\.raw has 15871, 16383\.raw"):
        noise_evidence(frames)


def test_identical_pixels() -> None:
    with pytest.raises(UnfitFramesError, match=r"1\.png and 2\.png show identical pixels"):
        noise_evidence([frame_of(1), frame_of(2, levels_of(1))])


@pytest.mark.parametrize(
    ("other", "what"),
    [
        (levels_of(2, (50, 40, 3)), "size: 1.png has 50 × 40, 2.png has 40 × 50"),
        (levels_of(2, (40, 50, 1)), "channels: 1.png has 3, 2.png has 1"),
        (levels_of(2).astype(np.uint16), "bit depth: 1.png has 8 bits, 2.png has 16 bits"),
    ],
)
def test_frames_that_differ(other: Levels, what: str) -> None:
    with pytest.raises(UnfitFramesError) as caught:
        noise_evidence([frame_of(1), frame_of(2, other)])

    assert f"the frames differ in {what}; " in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"channels": "RGB"}, "channels must be one of auto, rgb, luma, not 'RGB'"),
        ({"n_levels": 64.5}, "levels must be a whole number, not 64.5"),
        ({"n_levels": 15}, "levels must lie between 16 and 256 for 8-bit frames, not 15"),
        ({"n_levels": 257}, "levels must lie between 16 and 256 for 8-bit frames, not 257"),
        ({"mask": np.ones((50, 40), bool)}, "the mask is 40 × 50, the frames are 50 × 40"),
    ],
)
def test_settings_without_meaning(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        noise_evidence([frame_of(1), frame_of(2)], **settings)


def test_grey_frames_have_no_red() -> None:
    grey = [frame_of(seed, levels_of(seed, (40, 50, 1))) for seed in (1, 2)]

    with pytest.raises(ParameterError, match=r"1\.png is grey and has no red, green and blue"):
        noise_evidence(grey, channels="rgb")


def test_levels_of_sixteen_bits_have_a_limit() -> None:
    deep = [frame_of(seed, levels_of(seed).astype(np.uint16) * 257) for seed in (1, 2)]

    with pytest.raises(ParameterError, match=f"between 16 and {MAX_LEVELS} for 16-bit frames"):
        noise_evidence(deep, n_levels=65536)
