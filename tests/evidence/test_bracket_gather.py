"""Comparagrams against counting pixel by pixel, and what else is read off a bracket."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, permutations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from chartless.curves import named_curve
from chartless.curves.populations import measured_prior
from chartless.curves.prior import irradiance_at_edges
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.bracket import gather as exposures
from chartless.evidence.bracket.gather import BracketEvidence, bracket_evidence
from chartless.evidence.bracket.transfer import brightness_transfer
from chartless.frames.compression import Blocks
from chartless.frames.frame import CameraSettings, Frame
from chartless.frames.levels import level_table
from chartless.types import Floats

Levels = npt.NDArray[Any]
Bools = npt.NDArray[np.bool_]
EXPOSURES = np.log([1.0, 2.0, 4.0, 8.0])


def frame_of(levels: Levels, name: str = "shot", **settings: Any) -> Frame:
    levels = levels[..., np.newaxis] if levels.ndim == 2 else levels
    return Frame(Path(f"{name}.png"), levels.copy(), CameraSettings(**settings))


def picture(light: Floats, response: str = "srgb", top: int = 255) -> Levels:
    """Levels without noise."""
    dtype = np.uint8 if top == 255 else np.uint16
    return np.rint(top * named_curve(response).response(light.clip(0, 1))).astype(dtype)


def colourful(height: int = 16, width: int = 20, seed: int = 0) -> Floats:
    """Light of which some is grey, some nearly grey and some coloured."""
    rng = np.random.default_rng(seed)
    grey = np.repeat(rng.uniform(0.01, 1, (height, width, 1)), 3, axis=2)
    grey[: height // 2] *= rng.uniform(0.8, 1, (height // 2, width, 3))
    grey[height // 2 :: 2] = np.rint(4 * grey[height // 2 :: 2]) / 4 * rng.uniform(0.5, 1, 3)
    return np.asarray(0.4 * grey * [1.0, 0.8, 0.6])


def bracket(light: Floats, log_exposures: Floats = EXPOSURES, **how: Any) -> list[Frame]:
    return [
        frame_of(picture(light * math.exp(each), **how), f"{number}")
        for number, each in enumerate(log_exposures)
    ]


# Counting


def chroma(levels: Levels, top: int = 255) -> Floats:
    """How far each pixel is from grey, the cast of the light removed."""
    colours = levels.reshape(-1, levels.shape[-1]).astype(np.float64)
    shown = [c for c in colours if min(c) > 0.08 * top and max(c) < 0.96 * top]
    cast = np.ones(colours.shape[1])
    if colours.shape[1] == 1:
        return np.zeros(levels.shape[:2])
    if len(shown) >= 100:
        cast = np.median([c / c[1] for c in shown], axis=0)
    found = [(max(c / cast) - min(c / cast)) / max(*(c / cast), 1) for c in colours]
    return np.array(found).reshape(levels.shape[:2])


def blooming(levels: Levels, radius: int, top: int = 255) -> Bools:
    """Pixels within a distance of any that is saturated in some channel."""
    near = np.zeros(levels.shape[:2], dtype=bool)
    for row, column in np.argwhere((levels == top).any(axis=2)):
        for y, x in np.ndindex(*near.shape):
            near[y, x] |= (y - row) ** 2 + (x - column) ** 2 <= radius**2
    return near if radius else np.zeros_like(near)


def counted(
    shorter: Levels,
    longer: Levels,
    channel: int,
    *,
    most: tuple[float, float],
    mask: Bools | None = None,
    bloom_radius: int = 0,
    n_levels: int = 256,
) -> tuple[Floats, Floats]:
    """Comparagram and trust of two exposures, pixel by pixel."""
    tables = {grey: np.zeros((n_levels, n_levels)) for grey in (True, False)}
    middle = (chroma(shorter, n_levels - 1) + chroma(longer, n_levels - 1)) / 2
    left_out = np.zeros(middle.shape, dtype=bool) if mask is None else ~mask
    for levels in (shorter, longer):
        left_out |= blooming(levels, bloom_radius, n_levels - 1)
    for place in np.argwhere(~left_out):
        y, x = place
        is_grey = shorter.shape[2] == 1 or middle[y, x] <= 0.12
        tables[is_grey][longer[y, x, channel], shorter[y, x, channel]] += 1
    for grey, limit in zip((True, False), most, strict=True):
        for level, row in enumerate(tables[grey]):
            if row.sum() > limit:
                tables[grey][level] *= limit / row.sum()
    total = tables[True] + tables[False]
    trust = np.full(n_levels, 0.1)
    for level, row in enumerate(total):
        if row.sum():
            share = tables[True][level].sum() / row.sum()
            trust[level] = share + 0.1 * (1 - share)
    return total, trust


@pytest.mark.parametrize(
    ("bloom_radius", "masked"), [pytest.param(0, False, marks=pytest.mark.slow), (2, True)]
)
def test_comparagrams_are_those_of_counting(
    bloom_radius: int, masked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exposures, "GREY_PIXELS", 6.0)
    monkeypatch.setattr(exposures, "COLOURED_PIXELS", 2.0)
    frames = bracket(colourful())
    mask = np.random.default_rng(1).uniform(size=(16, 20)) < 0.8 if masked else None
    order = {(0, 1), (1, 2), (2, 3), (0, 2), (1, 3), (0, 3)}

    evidence = bracket_evidence(
        frames, EXPOSURES, exposure_error=0.01, mask=mask, bloom_radius=bloom_radius
    )

    assert list(evidence.tables) == ["R", "G", "B"]
    trusts = []
    for channel, tables in enumerate(evidence.tables.values()):
        assert {(table.shorter, table.longer) for table in tables} == order
        for table in tables:
            counts, trust = counted(
                frames[table.shorter].levels,
                frames[table.longer].levels,
                channel,
                most=(6.0, 2.0),
                mask=mask,
                bloom_radius=bloom_radius,
            )
            np.testing.assert_allclose(table.counts, counts, rtol=1e-12)
            seen = counts.any(axis=1)
            np.testing.assert_allclose(table.trust[seen], trust[seen], rtol=1e-12)
            trusts.extend(trust[seen])
    # Grey, coloured and mixed rows have all been there.
    assert min(trusts) == pytest.approx(0.1)
    assert max(trusts) == 1
    assert any(0.2 < trust < 0.9 for trust in trusts)


def test_rows_count_as_no_more_than_a_thousand_greys() -> None:
    light = np.full((60, 60), 0.1)

    (table,) = bracket_evidence(bracket(light, EXPOSURES[:2]), EXPOSURES[:2]).tables["Y"]

    assert table.counts.sum() == pytest.approx(1000)
    assert np.count_nonzero(table.counts) == 1
    assert table.trust[table.counts.any(axis=1)] == [1]


def test_a_frame_without_colours_is_grey() -> None:
    frames = bracket(colourful()[..., 0])
    evidence = bracket_evidence(frames, EXPOSURES, exposure_error=0.01)

    for table in evidence.tables["Y"]:
        counts, trust = counted(
            frames[table.shorter].levels, frames[table.longer].levels, 0, most=(1000, 100)
        )
        np.testing.assert_allclose(table.counts, counts)
        np.testing.assert_array_equal(table.trust[counts.any(axis=1)], 1)
        assert np.all(trust[counts.any(axis=1)] == 1)


def test_sixteen_bits_are_reduced_first() -> None:
    deep = bracket(colourful(), top=65535)
    reduce = level_table(65535, 256)
    shallow = [frame_of(reduce[frame.levels].astype(np.uint8)) for frame in deep]

    of_deep, of_shallow = (bracket_evidence(each, EXPOSURES) for each in (deep, shallow))

    assert (of_deep.bit_depth, of_shallow.bit_depth) == (16, 8)
    assert same(of_deep, of_shallow)


def test_more_levels_than_256_are_reduced_to_them() -> None:
    frames = bracket(colourful(), top=65535)

    assert same(
        bracket_evidence(frames, EXPOSURES, n_levels=1024), bracket_evidence(frames, EXPOSURES)
    )
    assert bracket_evidence(frames, EXPOSURES, n_levels=64).counts("G").n_levels == 64


def test_luma_of_colours_is_no_curve() -> None:
    with pytest.raises(
        ParameterError, match=r"is a colour picture, and luma .* not a single function of light"
    ):
        bracket_evidence(bracket(colourful()), EXPOSURES, channels="luma")


def test_luma_of_grey_pixels_is_counted_as_one_channel() -> None:
    grey = [frame.levels[..., 1] for frame in bracket(colourful())]
    in_three = [frame_of(np.repeat(levels[..., np.newaxis], 3, axis=2)) for levels in grey]

    of_three = bracket_evidence(in_three, EXPOSURES, channels="luma")

    assert list(of_three.tables) == ["Y"]
    assert same(of_three, bracket_evidence([frame_of(levels) for levels in grey], EXPOSURES))


def same(one: BracketEvidence, other: BracketEvidence) -> bool:
    return all(
        np.array_equal(one.histograms[name], other.histograms[name])
        and all(
            (a.shorter, a.longer) == (b.shorter, b.longer)
            and np.array_equal(a.counts, b.counts)
            and np.array_equal(a.trust, b.trust)
            for a, b in zip(one.tables[name], other.tables[name], strict=True)
        )
        for name in one.tables
    )


def test_histograms_hold_the_pixels_of_the_mask() -> None:
    frames = bracket(colourful())
    mask = np.random.default_rng(1).uniform(size=(16, 20)) < 0.5

    evidence = bracket_evidence(frames, EXPOSURES, mask=mask)

    for channel, rows in enumerate(evidence.histograms.values()):
        for frame, row in zip(frames, rows, strict=True):
            expected = np.bincount(frame.levels[..., channel][mask], minlength=256)
            np.testing.assert_array_equal(row, expected)


def test_white_is_counted_where_lossy_blocks_that_hold_it_are_not_compared() -> None:
    light = np.full((16, 32), 0.1)
    light[:8, :8] = 2.0  # a block and a pixel of another
    light[8, 8] = 2.0
    frames = [replace(frame, blocks=Blocks(8, 8)) for frame in bracket(light, EXPOSURES[:2])]

    evidence = bracket_evidence(frames, EXPOSURES[:2])

    np.testing.assert_allclose(evidence.clipped[:, 1], [np.mean(f.levels == 255) for f in frames])
    assert evidence.clipped[-1, 1] > 0.1
    assert evidence.histograms["Y"][-1].sum() == light.size - 2 * 64


def test_a_sample_is_of_single_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    """A board of two levels: means of pixels would show others."""
    monkeypatch.setattr(exposures, "SAMPLE", 400)
    board = np.random.default_rng(2).permutation(np.tile([0.05, 0.4], 5000)).reshape(100, 100)
    frames = bracket(board, EXPOSURES[:2])

    (table,) = bracket_evidence(frames, EXPOSURES[:2]).tables["Y"]

    assert 200 < table.counts.sum() <= 400
    seen = [(int(j), int(i)) for j, i in np.argwhere(table.counts)]
    shown = {(int(b), int(a)) for a, b in zip(*(np.unique(f.levels) for f in frames), strict=True)}
    assert set(seen) == shown


def test_exposures_that_are_as_good_as_one_are_not_compared() -> None:
    log_exposures = np.log([1.0, 1.04, 2.0])

    evidence = bracket_evidence(bracket(colourful(), log_exposures), log_exposures)

    pairs = {(table.shorter, table.longer) for table in evidence.tables["G"]}
    assert pairs == {(1, 2), (0, 2)}


@pytest.mark.slow
@pytest.mark.parametrize("order", list(permutations(range(4)))[1::5], ids=str)
def test_the_order_of_the_frames_makes_no_difference(order: tuple[int, ...]) -> None:
    frames = bracket(colourful())
    plain = bracket_evidence(frames, EXPOSURES)

    mixed = bracket_evidence([frames[place] for place in order], EXPOSURES[list(order)])

    for name, tables in plain.tables.items():
        of_mixed = {(order[t.shorter], order[t.longer]): t for t in mixed.tables[name]}
        for table in tables:
            other = of_mixed.pop((table.shorter, table.longer))
            np.testing.assert_array_equal(other.counts, table.counts)
            np.testing.assert_array_equal(other.trust, table.trust)
        assert not of_mixed
        np.testing.assert_array_equal(mixed.histograms[name], plain.histograms[name][list(order)])


# Frames that do not lie on each other


def test_levels_are_matched_by_their_rank() -> None:
    """Pixels in any order tell the transfer that those on each other do."""
    rng = np.random.default_rng(3)
    light = rng.uniform(0, 1, (200, 200)) ** 2
    first, second = bracket(light, EXPOSURES[:2])
    shuffled = frame_of(rng.permutation(second.levels.ravel()).reshape(200, 200))

    evidence = bracket_evidence([first, shuffled], EXPOSURES[:2], aligned=False)

    assert evidence.checks == ()
    (table,) = evidence.tables["Y"]
    level, lower = brightness_transfer(table.counts)
    curve = named_curve("srgb")
    inner = (level > 10) & (level < 250)
    expected = 255 * curve.response(curve.inverse(level[inner] / 255) / 2)
    assert np.count_nonzero(inner) > 200
    # 150 pixels of each level, their ranks as they fall.
    assert np.abs(lower[inner] - expected).max() < 0.75
    np.testing.assert_array_equal(table.trust, 0.1)


def test_matched_levels_have_the_histograms_as_margins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exposures, "COLOURED_PIXELS", 1e9)
    frames = bracket(colourful()[..., 0])

    evidence = bracket_evidence(frames, EXPOSURES, exposure_error=0.01, aligned=False)

    histograms = evidence.histograms["Y"]
    for table in evidence.tables["Y"]:
        np.testing.assert_allclose(table.counts.sum(axis=1), histograms[table.longer], atol=1e-9)
        np.testing.assert_allclose(table.counts.sum(axis=0), histograms[table.shorter], atol=1e-9)
        # The brighter in one, the brighter in the other.
        cells = np.argwhere(table.counts > 1e-9)
        assert np.all(np.diff(cells[:, 1]) >= 0)


# Exposures unknown


@pytest.mark.slow
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 0, 2, 3)], ids=str)
def test_exposures_are_guessed_as_the_mean_camera_would_have_them(order: tuple[int, ...]) -> None:
    edges = irradiance_at_edges(measured_prior(256).mean)[1:-1]
    light = np.random.default_rng(4).uniform(0, 0.5, (100, 100, 3))
    steps = np.array([0.0, 0.7, 1.6, 2.0])
    frames = [
        frame_of(np.searchsorted(edges, light * math.exp(steps[place])).astype(np.uint8))
        for place in order
    ]

    evidence = bracket_evidence(frames, None, exposure_error=1.5)

    found = evidence.log_exposures - evidence.log_exposures[order.index(0)]
    np.testing.assert_allclose(found, steps[list(order)], atol=0.02)
    assert evidence.counts("R").exposure_error == 1.5


# What goes with it


def test_overlaps_are_of_pixels_between_black_and_white_in_both() -> None:
    frames = bracket(colourful(), np.log([1.0, 4.0, 16.0]))
    inner = [((f.levels > 0) & (f.levels < 255)).all(axis=2) for f in frames]

    evidence = bracket_evidence(frames, np.log([1.0, 4.0, 16.0]))

    expected = [float(np.mean(a & b)) for a, b in pairwise(inner)]
    assert evidence.overlaps == pytest.approx(expected)
    assert 0 < expected[1] < expected[0] < 1


@pytest.mark.slow
@pytest.mark.parametrize("stops", [0.3, 1.0, 4.0, -1.0])
@pytest.mark.parametrize("response", ["srgb", "ameegc2-exact:0.48,-2.26,0.37"])
def test_a_longer_exposure_is_brighter_where_it_differs_most(stops: float, response: str) -> None:
    rng = np.random.default_rng(8)
    light = np.exp(rng.uniform(-7, 0, (200, 200)))
    log_exposures = np.log(2.0) * stops * np.array([0.0, 1.0])

    (rise,) = bracket_evidence(
        bracket(light, log_exposures, response=response), log_exposures
    ).brightenings

    assert 0.35 < rise / (log_exposures[1] - log_exposures[0]) < 2.5


def test_frames_of_one_exposure_are_not_brighter() -> None:
    rng = np.random.default_rng(9)
    light = np.exp(rng.uniform(-7, 0, (200, 200)))
    frames = [
        frame_of((picture(light) + rng.normal(0, 3, light.shape)).clip(0, 255).astype(np.uint8))
        for _ in range(2)
    ]

    (rise,) = bracket_evidence(frames, np.log([1.0, 2.0])).brightenings

    assert abs(rise) < 0.02


def test_shadows_and_few_pixels_say_nothing_about_brightness() -> None:
    dark = np.random.default_rng(10).integers(1, 4, (2, 100, 100), dtype=np.uint8)
    few = np.zeros((100, 100), np.uint8)
    few[:9, :9] = 100

    for first, second in (dark, (few, few)):
        (rise,) = bracket_evidence(
            [frame_of(first), frame_of(second)], np.log([1.0, 2.0])
        ).brightenings
        assert math.isnan(rise)


def photograph() -> Floats:
    from scipy.ndimage import gaussian_filter

    soft = gaussian_filter(np.random.default_rng(5).standard_normal((120, 160)), 6, mode="wrap")
    return np.asarray(0.2 * soft.ravel().argsort().argsort().reshape(soft.shape) / soft.size)


def test_a_displaced_exposure_is_told_by_the_checks() -> None:
    rng = np.random.default_rng(6)
    light = photograph() + 1e-3 * rng.uniform(size=(120, 160))
    first, second, third = bracket(light, EXPOSURES[:3])
    moved = frame_of(np.roll(second.levels[..., 0], 3, axis=1))

    still = bracket_evidence([first, second, third], EXPOSURES[:3])
    shifted = bracket_evidence([first, moved, third], EXPOSURES[:3])

    assert len(still.checks) == 2
    assert max(check.displacement for check in still.checks) < 0.2
    assert min(check.displacement for check in shifted.checks) > 1.5


def test_what_the_mask_leaves_out_is_not_checked() -> None:
    first, second = bracket(photograph(), EXPOSURES[:2])
    moved = second.levels.copy()
    moved[60:] = np.roll(moved[60:], 5, axis=1)
    mask = np.arange(120)[:, np.newaxis] < np.full((1, 160), 58)

    (seen,) = bracket_evidence([first, frame_of(moved)], EXPOSURES[:2]).checks
    (masked,) = bracket_evidence([first, frame_of(moved)], EXPOSURES[:2], mask=mask).checks

    assert seen.displacement > 0.5
    assert masked.displacement < 0.1


def test_sources_and_progress_are_those_of_the_frames() -> None:
    told: list[Frame] = []
    frames = bracket(colourful())

    evidence = bracket_evidence(iter(frames), EXPOSURES, exposure_error=0.1, on_frame=told.append)

    assert told == frames
    assert [source.path for source in evidence.sources] == [frame.path for frame in frames]
    counts = evidence.counts("B")
    assert counts.tables is evidence.tables["B"]
    assert counts.exposure_error == 0.1
    np.testing.assert_array_equal(counts.log_exposures, EXPOSURES)
    for table in counts.tables:
        seen = evidence.histograms["B"][table.longer]
        np.testing.assert_array_equal(table.histogram, seen)


Frames = Callable[[], list[Frame]]


@pytest.mark.parametrize(
    ("frames", "settings", "error", "message"),
    [
        (list, {}, UnfitFramesError, "a bracket needs two or more frames"),
        (lambda: bracket(colourful())[:1], {}, UnfitFramesError, "a bracket needs two or more"),
        (
            lambda: [frame_of(np.zeros((4, 5), np.uint8)), frame_of(np.zeros((4, 6), np.uint8))],
            {},
            UnfitFramesError,
            r"differ in size: shot.png has 5 × 4, shot.png has 6 × 4",
        ),
        (
            lambda: [frame_of(np.zeros((4, 5), t)) for t in (np.uint8, np.uint16)],
            {},
            UnfitFramesError,
            "differ in bit depth",
        ),
        (
            lambda: [
                frame_of(np.zeros((4, 5), np.uint8), name, camera=name) for name in ("A1", "B2")
            ],
            {},
            UnfitFramesError,
            "differ in camera: A1.png has A1, B2.png has B2; .* differ in exposure alone",
        ),
        (lambda: bracket(colourful()), {"channels": "cmyk"}, ParameterError, "channels"),
        (lambda: bracket(colourful()), {"n_levels": 3}, ParameterError, "levels must lie"),
        (
            lambda: bracket(colourful()),
            {"mask": np.ones((3, 3), bool)},
            ParameterError,
            "the mask is 3 × 3",
        ),
    ],
)
def test_frames_that_are_no_bracket(
    frames: Frames, settings: dict[str, Any], error: type[Exception], message: str
) -> None:
    given = frames()

    with pytest.raises(error, match=message):
        bracket_evidence(given, EXPOSURES[: len(given)], **settings)


def test_a_camera_that_one_file_does_not_name_may_be_the_other() -> None:
    first, second = (picture(colourful()[..., 0] * t) for t in (1, 2))

    evidence = bracket_evidence(
        [frame_of(first, camera="A1"), frame_of(second)], np.log([1.0, 2.0])
    )

    assert len(evidence.sources) == 2
