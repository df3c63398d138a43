"""Displacement and sameness of scenes: found whatever the exposure, the curve and the noise."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter, rotate
from slow_cases import slow_but

from chartless.errors import UnfitFramesError
from chartless.evidence.bracket.gather import bracket_evidence
from chartless.evidence.bracket.screening import exposure_rows, screen_bracket
from chartless.flags import Flag
from chartless.frames.frame import Frame
from chartless.frames.same_scene import SceneMatch, chained, compare_scenes, glimpse
from chartless.images import read_frame

Pixels = npt.NDArray[Any]
CURVES = {
    "gamma": lambda x: x**0.45,
    "linear": lambda x: x,
    "shoulder": lambda x: np.log1p(20 * x) / np.log(21),
    "toe": lambda x: x**0.7 * (1 - np.exp(-8 * x)) / (1 - np.exp(-8)),
}


def scene(seed: int = 0, shape: tuple[int, int] = (360, 520)) -> Pixels:
    """Light with detail of all sizes, 0 … 1."""
    rng = np.random.default_rng(seed)
    parts = [
        size * gaussian_filter(rng.standard_normal(shape), size, mode="wrap")
        for size in (1, 3, 9, 27)
    ]
    return np.asarray(np.exp(1.5 * np.sum(parts, axis=0)).clip(0, 60) / 60)


def shot(light: Pixels, exposure: float = 1.0, curve: str = "gamma", noise: float = 1.0) -> Pixels:
    rng = np.random.default_rng(int(1000 * exposure))
    levels = 255 * CURVES[curve]((exposure * light).clip(0, 1))
    return np.rint(levels + rng.normal(0, noise, light.shape)).clip(0, 255).astype(np.uint8)


def match(first: Pixels, second: Pixels, mask: Pixels | None = None) -> SceneMatch:
    return compare_scenes(glimpse(first, 255, mask), glimpse(second, 255, mask))


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize(("down", "right"), [(0, 0), (1, 0), (0, -3), (-7, 6), (20, -17)])
def test_a_displacement_is_found_through_any_curve(curve: str, down: int, right: int) -> None:
    light = scene()
    moved = np.roll(light, (down, right), axis=(0, 1))
    inner = np.s_[30:-30, 30:-30]

    found = match(shot(light[inner], 2, curve), shot(moved[inner], 8, curve))

    assert found.one_scene
    assert (found.down, found.right) == pytest.approx((down, right), abs=0.35)
    assert found.displacement == pytest.approx(np.hypot(down, right), abs=0.4)
    assert found.turn == 0


def test_swapping_frames_turns_the_displacement_round() -> None:
    light = scene()
    first, second = shot(light[:-8, 5:], 2), shot(light[8:, :-5], 8)

    there, back = match(first, second), match(second, first)

    assert (there.down, there.right) == pytest.approx((-8, 5), abs=0.3)
    assert (back.down, back.right) == pytest.approx((-there.down, -there.right), abs=0.3)


def test_displacements_are_in_pixels_of_the_frame() -> None:
    large = np.kron(scene(1, (300, 450)), np.ones((4, 4)))
    first, second = shot(large[:-12, 40:], 2), shot(large[12:, :-40], 8)

    found = match(first, second)

    assert (found.down, found.right) == pytest.approx((-12, 40), abs=0.8)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-3.0, -0.5, 0.5, 1.0, 3.0])
def test_a_turn_is_found(degrees: float) -> None:
    light = scene(2)
    turned = rotate(light, -degrees, reshape=False, order=1, mode="wrap")
    inner = np.s_[40:-40, 40:-40]

    found = match(shot(light[inner], 2), shot(turned[inner], 8))

    assert found.one_scene
    assert found.turn == pytest.approx(degrees, abs=0.15)
    radius = np.hypot(280, 440) / 12**0.5
    assert found.displacement == pytest.approx(abs(np.radians(degrees)) * radius, rel=0.3)


@pytest.mark.parametrize("exposure", [1, 2, 4, 16, 64])
def test_one_scene_is_one_at_any_exposure(exposure: float) -> None:
    found = match(shot(scene(), 1), shot(scene(), exposure * 1.001))

    assert found.one_scene
    assert found.displacement < 0.3


@pytest.mark.slow
def test_different_scenes_are_told_apart() -> None:
    levels = [shot(scene(seed), 4) for seed in range(8)]

    for place, first in enumerate(levels):
        for second in levels[place + 1 :]:
            assert not match(first, second).one_scene


def test_independent_noise_is_no_scene() -> None:
    rng = np.random.default_rng(3)
    first, second = rng.integers(0, 256, (2, 300, 400), dtype=np.uint8)

    assert not match(first, second).one_scene
    assert match(first, (first // 2).astype(np.uint8)).one_scene


def test_a_smooth_sky_is_one_scene() -> None:
    light = np.linspace(0.05, 0.5, 300)[:, np.newaxis] * np.linspace(0.8, 1, 400)

    assert match(shot(light, 0.5, noise=3), shot(light, 2, noise=3)).one_scene


@pytest.mark.parametrize("noise", [0.5, 2.0, 8.0])
def test_a_flat_wall_is_one_scene(noise: float) -> None:
    light = np.full((300, 400), 0.1)

    assert match(shot(light, 1, noise=noise), shot(light, 4, noise=noise)).one_scene


@pytest.mark.slow
@pytest.mark.parametrize("share", slow_but([0.05, 0.1, 0.2, 0.3], 0.3))
def test_what_moves_does_not_make_another_scene(share: float) -> None:
    light, changed = scene(4, (700, 1000)), scene(4, (700, 1000))
    rows, columns = (round(length * share**0.5) for length in light.shape)
    changed[50 : 50 + rows, 100 : 100 + columns] = scene(5, (700, 1000))[:rows, :columns]

    found = match(shot(light, 2), shot(changed, 6))

    assert found.one_scene
    assert found.displacement < 0.2
    if share >= 0.3:  # whole blocks are in it, wherever it lies
        assert found.moved > 0.03
    assert match(shot(light, 2), shot(light, 6)).moved == 0


def test_what_the_mask_leaves_out_is_not_compared() -> None:
    light, changed = scene(6), scene(6)
    changed[:, :260] = np.roll(changed[:, :260], 9, axis=0)
    mask = np.arange(520) >= np.full((360, 1), 264)

    assert match(shot(light, 2), shot(changed, 6), mask).moved == 0
    assert match(shot(light, 2), shot(changed, 6), mask).displacement < 0.2


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (7, 300), (8, 8), (20, 30)])
def test_small_frames_are_compared_or_let_pass(shape: tuple[int, int]) -> None:
    levels = np.random.default_rng(7).integers(0, 256, shape, dtype=np.uint8)

    assert match(levels, levels).one_scene
    assert match(levels, np.full_like(levels, 255)).one_scene


def test_frames_are_compared_in_order_of_brightness() -> None:
    light = scene(8)
    moved = [light[20 - k : -20 - k, 20:-20] for k in (0, 4, 7)]
    frames = [shot(moved[place], 2.0**place) for place in (1, 2, 0)]

    chain = chained([glimpse(levels, 255) for levels in frames])

    assert chain.order == (2, 0, 1)
    assert chain.mismatched() is None
    assert chain.displacement(0, 1) == pytest.approx(3, abs=0.3)
    assert chain.displacement(2, 1) == chain.displacement(1, 2) == pytest.approx(7, abs=0.4)


# Brackets


def framed(*levels: Pixels) -> list[Frame]:
    return [
        Frame(Path(f"{name}.png"), own[..., np.newaxis].copy())
        for name, own in zip("abcdefgh", levels, strict=False)
    ]


TIMES = np.log([1.0, 4.0, 16.0])


@pytest.mark.parametrize("aligned", [True, False])
def test_a_bracket_of_another_scene_is_refused(aligned: bool) -> None:
    frames = framed(shot(scene(1), 0.5), shot(scene(1), 2), shot(scene(2), 8))

    with pytest.raises(UnfitFramesError, match=r"^b\.png and c\.png do not show the same scene: "):
        screen_bracket(bracket_evidence(frames, TIMES, aligned=aligned))


def displaced(pixels: int) -> list[Frame]:
    light = scene(9)
    parts = (light[:, 60 - k * pixels : 460 - k * pixels] for k in range(3))
    return framed(*(shot(part, 0.5 * 4.0**k) for k, part in enumerate(parts)))


@pytest.mark.slow
@pytest.mark.parametrize(("pixels", "flagged"), [(0, False), (1, False), (3, True), (9, True)])
def test_displaced_exposures_are_flagged_with_their_pixels(pixels: int, flagged: bool) -> None:
    evidence = bracket_evidence(displaced(pixels), TIMES)
    rows = exposure_rows(evidence)

    assert [row["displacement"] for row in rows[:2]] == pytest.approx([pixels] * 2, abs=0.3)
    assert rows[2]["displacement"] is None
    if not flagged:
        assert evidence.scenes is not None
        return
    assert Flag.MOTION in screen_bracket(evidence)["Y"]


def test_exposures_displaced_far_are_refused_if_pixels_are_compared() -> None:
    with pytest.raises(UnfitFramesError, match=r"displaced by 20 pixels: use a tripod.*aligned"):
        screen_bracket(bracket_evidence(displaced(20), TIMES))

    flags = screen_bracket(bracket_evidence(displaced(30), TIMES, aligned=False))
    assert Flag.MOTION in flags["Y"]


def test_views_that_share_a_part_only_are_refused_unaligned() -> None:
    light = scene(9)
    frames = framed(shot(light[:, :400], 0.5), shot(light[:, 50:450], 2))

    with pytest.raises(UnfitFramesError, match="displaced by 50 pixels: give exposures that show"):
        screen_bracket(bracket_evidence(frames, TIMES[:2], aligned=False))


@pytest.mark.parametrize("quality", [80, 95])
def test_a_long_exposure_that_is_mostly_white_is_not_darker(quality: int, tmp_path: Path) -> None:
    """Lossy files lose what lies near white, and with it their brightest pixels."""
    frames = []
    for place in range(3):
        path = tmp_path / f"{place}.jpg"
        levels = np.repeat(shot(scene(10), 4.0 ** (place + 2))[..., np.newaxis], 3, axis=2)
        Image.fromarray(levels).save(path, quality=quality, subsampling=2)
        frames.append(read_frame(path))

    screen_bracket(bracket_evidence(frames, TIMES))


# Real pictures


@pytest.mark.slow
def test_real_brackets_show_one_scene(data_path: Path) -> None:
    folders = sorted(path for path in (data_path / "middlebury").glob("*") if path.is_dir())
    brackets = [sorted(path.glob("wb1i1e?-jpg.png")) for path in folders]
    brackets.append(sorted((data_path / "bracket_canon_t2i_room").glob("*.jpg")))
    for paths in brackets:
        if not paths:
            pytest.skip("no brackets among the data")
        seen = [glimpse(read_frame(path).levels[..., 1], 255) for path in paths]
        chain = chained(seen)
        assert chain.mismatched() is None, paths[0]
        moved = [chain.displacement(k, k + 1) for k in range(len(paths) - 1)]
        assert max(moved) < 1.5, paths[0]


@pytest.mark.slow
def test_different_photographs_are_told_apart(data_path: Path) -> None:
    paths = sorted((data_path / "scenery_1600x900").glob("*.jpg"))[:8]
    if len(paths) < 8:
        pytest.skip("no scenery among the data")
    seen = [glimpse(read_frame(path).levels[..., 1], 255) for path in paths]
    for place, first in enumerate(seen):
        for second in seen[place + 1 :]:
            assert not compare_scenes(first, second).one_scene


def test_views_of_a_panorama_are_no_bracket(data_path: Path) -> None:
    paths = sorted((data_path / "pano_rotating" / "parrington").glob("*.jpg"))
    if not paths:
        pytest.skip("no panorama among the data")
    seen = [glimpse(read_frame(path).levels[..., 1], 255) for path in paths[:6]]
    assert not any(compare_scenes(a, b).one_scene for a, b in pairwise(seen))
