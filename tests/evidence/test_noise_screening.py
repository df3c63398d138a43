"""Whether frames are fit: measures with known answers, then verdicts."""

from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from scipy.ndimage import shift as displaced
from skimage.data import astronaut, camera
from slow_cases import slow_but

from chartless import AffineNoise, Cooccurrence, named_curve
from chartless.errors import UnfitFramesError
from chartless.evidence._limits import SUSPICIOUS
from chartless.evidence._pair_check import PairCheck, channel_correlation, check_pair
from chartless.evidence.noise.drift import drift_share, estimated_drift
from chartless.evidence.noise.outliers import outlying
from chartless.evidence.noise.screening import (
    covered_levels,
    empty_share,
    resemblance,
    screen,
    unfit,
)
from chartless.flags import Flag
from chartless.simulate import simulate_frames

Levels = npt.NDArray[Any]

FRAME_FLAGS = {
    Flag.MOTION,
    Flag.STRUCTURED_DIFFERENCE,
    Flag.CORRELATED_NOISE,
    Flag.BRIGHTNESS_DRIFT,
    Flag.LOW_NOISE,
    Flag.EMPTY_LEVELS,
    Flag.MOVERS,
}


def photograph() -> Levels:
    light = named_curve("srgb").inverse(camera() / 255)
    return 0.8 * light


def soft(sigma: float = 6.0, shape: tuple[int, int] = (256, 256)) -> Levels:
    """Blobs, every irradiance equally frequent."""
    blobs = gaussian_filter(np.random.default_rng(1).standard_normal(shape), sigma, mode="wrap")
    return blobs.ravel().argsort().argsort().reshape(shape) / blobs.size


def pair(
    first: Levels,
    second: Levels,
    *,
    slope: float = 0.03,
    floor: float = 16.0,
    response: str = "srgb",
) -> tuple[Levels, Levels]:
    noise = AffineNoise.from_8bit(slope, floor)
    one, other = (
        next(simulate_frames(scene, named_curve(response), noise, n_frames=1, seed=seed))
        for seed, scene in ((1, first), (2, second))
    )
    return one, other


def verdict(first: Levels, second: Levels) -> set[Flag]:
    table = Cooccurrence.of_pair(first, second)
    return set(screen({"Y": table}, [check_pair(first, second)])["Y"])


# Measures


def test_pixel_noise_has_nothing_else_in_it() -> None:
    check = check_pair(*pair(soft(), soft()))

    assert check.displacement < 0.05
    assert check.displacement_share < 0.001
    assert check.patch_share < 0.005
    assert abs(check.neighbour_correlation) < 0.02


@pytest.mark.parametrize("shift", [(0, 0.25), (0.5, 0), (0, 1), (1, 0), (-1, 1), (0, -2), (2, 1)])
def test_the_displacement_is_measured_in_pixels(shift: tuple[float, float]) -> None:
    scene = soft(6.0)
    moved = displaced(scene, shift, mode="wrap").clip(0, 1)

    check = check_pair(*pair(scene, moved, slope=0.01, floor=1.0))

    assert check.displacement == pytest.approx(np.hypot(*shift), rel=0.15)
    assert check.displacement_share > SUSPICIOUS


def test_a_still_scene_of_stripes_has_no_displacement() -> None:
    """Along the stripes any shift explains as much: the normal equations are singular."""
    stripes = np.broadcast_to(0.5 + 0.4 * np.sin(np.arange(256) / 5), (256, 256))

    check = check_pair(*pair(stripes, stripes))

    assert check.displacement < 0.1
    assert check.displacement_share < 0.001


def test_correlation_of_neighbours_is_measured() -> None:
    rng = np.random.default_rng(2)
    base = np.full((256, 256), 120.0)
    frames = []
    for _ in "ab":
        noise = rng.normal(0, 5, base.shape)
        shared = (noise + np.roll(noise, 1, axis=0)) / np.sqrt(2)  # 0.5 down, 0 across
        frames.append(np.rint(base + shared).astype(np.uint8))

    assert check_pair(*frames).neighbour_correlation == pytest.approx(0.25, abs=0.02)


def test_a_patch_has_its_share_of_the_difference() -> None:
    rng = np.random.default_rng(3)
    first, second = (np.rint(rng.normal(100, 4, (256, 256))) for _ in "ab")
    second[64:128, 64:128] += 8  # energy 64 · 1/16 = 4 beside 2 · 16

    share = check_pair(first.astype(np.uint8), second.astype(np.uint8)).patch_share

    assert share == pytest.approx(4 / 36, abs=0.01)


def test_equal_frames_have_nothing() -> None:
    frame = np.arange(256, dtype=np.uint8).reshape(16, 16)

    assert check_pair(frame, frame) == PairCheck(0.0, 0.0, 0.0, 0.0)


def test_pixels_outside_the_mask_do_not_count() -> None:
    first, second = pair(soft(), soft())
    second[:100] = 255 - second[:100]
    mask = np.ones(first.shape, bool)
    mask[:100] = False

    assert check_pair(first, second).patch_share > 0.5
    check = check_pair(first, second, mask)
    assert check.patch_share < 0.005
    assert check.displacement_share < 0.005
    assert abs(check.neighbour_correlation) < 0.02


@given(
    height=st.integers(1, 40),
    width=st.integers(1, 40),
    seed=st.integers(0, 10),
    dtype=st.sampled_from([np.uint8, np.uint16]),
)
def test_frames_of_any_size_are_measured(height: int, width: int, seed: int, dtype: type) -> None:
    rng = np.random.default_rng(seed)
    first, second = (
        rng.integers(0, np.iinfo(dtype).max, (height, width), dtype, endpoint=True) for _ in "ab"
    )
    check = check_pair(first, second)

    assert 0 <= check.displacement < np.inf
    assert -1e-3 <= check.displacement_share <= 1 + 1e-3
    assert 0 <= check.patch_share <= 1 + 1e-3
    assert -1.001 <= check.neighbour_correlation <= 1.001


def test_drift_is_the_share_that_a_gain_explains() -> None:
    first, second = pair(0.7 * soft(), 0.7 * soft())
    brighter = pair(0.7 * soft(), 0.7 * 1.3 * soft())
    clean, drifted = (Cooccurrence.of_pair(*each) for each in ((first, second), brighter))

    assert drift_share(clean) < 0.02
    assert drift_share(drifted) > 0.3
    backwards = Cooccurrence(drifted.counts.T)
    assert drift_share(backwards) == pytest.approx(drift_share(drifted))
    assert drift_share(Cooccurrence(drifted.symmetric)) < 1e-3


def test_a_table_of_equal_frames_has_no_drift() -> None:
    assert drift_share(Cooccurrence(np.diag(np.arange(256)))) == 0
    assert drift_share(Cooccurrence.zeros()) == 0


def test_covered_levels_leave_out_the_rarest() -> None:
    counts = np.zeros((256, 256), np.int64)
    counts[np.arange(50, 201), np.arange(50, 201)] = 1000
    assert covered_levels(Cooccurrence(counts)) == (50, 200)

    counts[0, 0] = counts[255, 255] = 50  # of 151000
    assert covered_levels(Cooccurrence(counts)) == (50, 200)

    counts[255, 255] = 1000
    assert covered_levels(Cooccurrence(counts)) == (50, 255)


# Verdicts


@pytest.mark.slow
@pytest.mark.parametrize("response", ["srgb", "linear", "gamma:0.35"])
@pytest.mark.parametrize(("slope", "floor"), [(0.01, 9), (0.03, 16), (0.06, 25)])
@pytest.mark.parametrize("subject", slow_but(["photograph", "soft", "colours"], "soft"))
def test_clean_pairs_raise_no_doubt_about_the_frames(
    subject: str, slope: float, floor: float, response: str
) -> None:
    scenes = {
        "photograph": [photograph()],
        "soft": [soft()],
        "colours": list(np.moveaxis(named_curve("srgb").inverse(astronaut() / 255), 2, 0)),
    }
    for scene in scenes[subject]:
        frames = pair(scene, scene, slope=slope, floor=floor, response=response)
        assert not verdict(*frames) & FRAME_FLAGS


@pytest.mark.slow
@pytest.mark.parametrize("shift", [(0, 1), (1, 0), (0, 2), (2, 2)])
@pytest.mark.parametrize(("slope", "floor"), [(0.01, 9), (0.06, 25)])
def test_a_moved_photograph_is_refused_or_flagged(
    slope: float, floor: float, shift: tuple[int, int]
) -> None:
    scene = photograph()
    first, second = pair(scene, np.roll(scene, shift, axis=(0, 1)), slope=slope, floor=floor)

    with suppress(UnfitFramesError):
        flags = verdict(first, second)
        assert flags & {Flag.MOTION, Flag.CORRELATED_NOISE}, flags


def test_a_camera_that_moved_far_is_refused_with_the_distance() -> None:
    scene = soft()
    first, second = pair(scene, np.roll(scene, 2, axis=1), floor=4.0)

    with pytest.raises(
        UnfitFramesError,
        match=r"frames 1 and 2 are displaced by about (1\.[89]|2\.[0-2]) pixels.*tripod",
    ):
        verdict(first, second)


@pytest.mark.parametrize("gain", [1.3, 0.7])
def test_a_gross_change_of_brightness_is_refused_as_such(gain: float) -> None:
    scene = 0.75 * soft()
    first, second = pair(scene, gain * scene, floor=4.0)

    with pytest.raises(UnfitFramesError, match=r"brightness changed|light changed"):
        verdict(first, second)


def test_frames_of_black_and_white_alone_are_refused() -> None:
    rng = np.random.default_rng(8)
    first = np.where(rng.uniform(size=(99, 99)) < 0.5, 0, 255).astype(np.uint8)
    second = first.copy()
    second[:5] = 128

    with pytest.raises(UnfitFramesError, match="clipped"):
        screen({"Y": Cooccurrence.of_pair(first, second)}, [PairCheck(0, 0, 0, 0)])


def test_a_channel_that_is_identical_is_named() -> None:
    """Pictures may differ in one channel and still be equal in another."""
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16)

    with pytest.raises(UnfitFramesError, match="channel B: the frames are identical"):
        screen({"B": Cooccurrence.of_pair(ramp, ramp)}, [PairCheck(0, 0, 0, 0)])


def test_an_empty_table_is_refused() -> None:
    with pytest.raises(UnfitFramesError, match="leaves no pixels"):
        screen({"Y": Cooccurrence.zeros()}, [PairCheck(0, 0, 0, 0)])


@pytest.mark.parametrize(
    ("check", "flag"),
    [
        (PairCheck(0.2, 0.1, 0, 0), Flag.MOTION),
        (PairCheck(0, 0, 0.1, 0), Flag.STRUCTURED_DIFFERENCE),
        (PairCheck(0, 0, 0, 0.2), Flag.CORRELATED_NOISE),
        (PairCheck(0, 0, 0, 0, channel_correlation=0.2), Flag.CORRELATED_CHANNELS),
        (PairCheck(0, 0, 0, 0, outliers=0.01), Flag.MOVERS),
        (PairCheck(0, 0, 0, 0, drift=0.02, drift_share=0.1), Flag.BRIGHTNESS_DRIFT),
    ],
)
def test_one_suspicious_pair_of_many_is_enough(check: PairCheck, flag: Flag) -> None:
    table = Cooccurrence.of_pair(*pair(soft(), soft()))
    clean = PairCheck(0, 0, 0, 0)

    found = screen({"R": table, "G": table}, [clean, check, clean])

    assert found == {"R": (flag,), "G": (flag,)}


@pytest.mark.parametrize(
    ("check", "words"),
    [
        (PairCheck(1.5, 0.2, 0, 0), "frames 2 and 3 are displaced by about 1.5 pixels"),
        (PairCheck(0.1, 0.6, 0, 0), "frames 2 and 3 are displaced"),
        (PairCheck(0, 0, 0.6, 0), "frames 2 and 3 differ in large patches"),
        (PairCheck(0, 0, 0, 0, outliers=0.4), "frames 2 and 3: 40% of the pixels changed far"),
        (
            PairCheck(0, 0, 0, 0, drift=0.1, drift_share=0.6),
            "frames 2 and 3: the brightness changed .10% of the levels.*steady light",
        ),
    ],
)
def test_a_gross_pair_is_named(check: PairCheck, words: str) -> None:
    table = Cooccurrence.of_pair(*pair(soft(), soft()))

    with pytest.raises(UnfitFramesError, match=words):
        screen({"Y": table}, [PairCheck(0, 0, 0, 0), check])


def test_part_of_the_range_is_flagged_and_little_of_it_refused() -> None:
    middle = 0.2 + 0.3 * soft()
    assert Flag.LEVELS_UNSEEN in verdict(*pair(middle, middle, response="linear"))

    little = 0.4 + 0.05 * soft()
    with pytest.raises(UnfitFramesError, match=r"cover 1?[0-9]% of the range, too little"):
        verdict(*pair(little, little, floor=4.0, response="linear"))


def test_many_clipped_pixels_are_flagged() -> None:
    bright = 1.8 * soft()

    assert Flag.CLIPPED in verdict(*pair(bright, bright, response="linear"))


def test_noise_below_the_rounding_is_flagged() -> None:
    frames = pair(soft(), soft(), slope=0.0, floor=0.01, response="linear")

    assert Flag.LOW_NOISE in verdict(*frames)


def test_noise_shared_by_channels_is_measured() -> None:
    rng = np.random.default_rng(7)
    common = rng.normal(0, 4, (2, 200, 200))
    own = rng.normal(0, 4, (3, 2, 200, 200))
    shots = [
        [np.rint(120 + common[k] + own[c, k]).astype(np.uint8) for c in range(3)] for k in (0, 1)
    ]
    alone = [[np.rint(120 + own[c, k]).astype(np.uint8) for c in range(3)] for k in (0, 1)]

    assert channel_correlation(*shots) == pytest.approx(0.5, abs=0.03)
    assert channel_correlation(*alone) < 0.02
    assert channel_correlation(shots[0][:1], shots[1][:1]) == 0
    assert channel_correlation(shots[0], shots[0]) == 0


@pytest.mark.parametrize(
    ("levels", "share"),
    [
        (np.arange(256), 0.0),
        (4 * np.arange(64), 0.75),
        (np.arange(256) * 255 // 230, 0.1),
        (np.r_[20:41, 200:221], 0.0),  # two patches, nothing between
    ],
)
def test_empty_levels_are_those_between_the_teeth_of_a_comb(levels: Levels, share: float) -> None:
    counts = np.zeros((256, 256), np.int64)
    used = levels[levels < 256]
    counts[used, used] = 1000

    assert empty_share(Cooccurrence(counts)) == pytest.approx(share, abs=0.03)


def test_few_pixels_are_no_comb() -> None:
    scene = soft(shape=(24, 24))

    assert empty_share(Cooccurrence.of_pair(*pair(scene, scene))) == 0


def test_six_bits_in_eight_are_flagged() -> None:
    few = [(frame >> 2) << 2 for frame in pair(soft(), soft())]
    quiet = [(frame >> 2) << 2 for frame in pair(soft(), soft(), slope=0.001, floor=0.1)]

    assert Flag.EMPTY_LEVELS in verdict(*few)
    assert Flag.LOW_NOISE not in verdict(*few)
    assert {Flag.EMPTY_LEVELS, Flag.LOW_NOISE} <= verdict(*quiet)


def test_what_is_made_up_for_does_not_count_as_patches() -> None:
    scene = 0.9 * soft()
    first, second = pair(scene, 1.03 * scene, floor=1.0, slope=0.01)
    second[64:128, 64:128] = 255 - second[64:128, 64:128]
    table = Cooccurrence.of_pair(first, second)
    drift = estimated_drift(table)
    assert drift is not None

    raw = check_pair(first, second)
    check = check_pair(first, second, drift=drift.levels, outlying=outlying(table))

    assert raw.patch_share > 0.5
    assert check.patch_share < 0.1
    assert check.neighbour_correlation < 0.15


# One scene or two


def test_resemblance_is_the_correlation_of_the_levels() -> None:
    first, second = pair(soft(), np.roll(soft(), 9, axis=1), floor=200.0)
    table = Cooccurrence.of_pair(first, second)

    expected = np.corrcoef(first.ravel().astype(float), second.ravel().astype(float))[0, 1]
    assert 0.3 < expected < 0.9
    assert resemblance(table) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("slope", [0.03, 3.0])
def test_frames_of_one_scene_resemble_each_other_in_any_noise(slope: float) -> None:
    first, second = pair(soft(), soft(), slope=slope, floor=100.0)

    assert resemblance(Cooccurrence.of_pair(first, second)) > 0.7


def test_dark_frames_need_not_resemble_each_other() -> None:
    dark = np.random.default_rng(0).integers(0, 30, (2, 64, 64)).astype(np.uint8)

    assert resemblance(Cooccurrence.of_pair(*dark)) == 1.0


def test_frames_of_two_scenes_are_unfit() -> None:
    check = PairCheck(0.0, 0.0, 0.0, 0.0, resemblance=0.04)

    reason = unfit(check)
    assert reason is not None
    assert reason.startswith(" have hardly anything in common (correlation 0.04)")
