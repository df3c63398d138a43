"""Which blocks of a shot are compared, and with what light, against counting one by one."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from raw_cameras import Pixels, patches

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.raw import gather as raw_blocks
from chartless.evidence.raw.blocks import RawBlocks
from chartless.evidence.raw.gather import RawEvidence, raw_evidence
from chartless.evidence.raw.screening import screen_raw
from chartless.flags import Flag
from chartless.frames.frame import Frame, RawPicture


def raw_of(light: Pixels, **changes: Any) -> RawPicture:
    """Raw file that saw this light in cells of 2 × 2."""
    values: dict[str, Any] = {
        "path": Path("a.dng"),
        "light": light.astype(np.float32),
        "saturated": (light >= 1).any(axis=-1),
        "cell": (2, 2),
        "white_balance": np.ones(3),
        "error": 1e-4,
    }
    return RawPicture(**{**values, **changes})


def frame_of(light: Pixels, name: str = "a.jpg") -> Frame:
    """Picture of twice the size, with levels 255 √light."""
    levels = np.rint(255 * np.sqrt(light.clip(0, 1))).astype(np.uint8)
    return Frame(Path(name), levels.repeat(2, axis=0).repeat(2, axis=1))


def plain() -> Pixels:
    """Even light with some objects to register by."""
    light = np.full((64, 96, 3), 0.2)
    for row, column in np.random.default_rng(5).integers(1, (8, 12), (20, 2)):
        light[8 * row + 2 : 8 * row + 6, 8 * column + 2 : 8 * column + 6] = 0.4
    return light


def shot(height: int = 64, width: int = 96, **how: Any) -> tuple[RawPicture, Frame]:
    light = patches(height, width, **how)
    return raw_of(light), frame_of(light)


def test_blocks_are_means_of_what_both_files_show() -> None:
    light = patches(64, 96)
    raw = raw_of(light, white_balance=np.array([2.0, 1.0, 1.5]))
    frame = frame_of(light)

    blocks = raw_evidence([(raw, frame)]).blocks["G"]

    expected = []
    for top in range(0, 128, 8):
        for left in range(0, 192, 8):
            tile = frame.levels[top : top + 8, left : left + 8].astype(float).reshape(-1, 3)
            seen = light[top // 2 : top // 2 + 4, left // 2 : left // 2 + 4].reshape(-1, 3)
            even = (tile.std(axis=0) <= 0.03 * 255).all()
            if even and tile[:, 1].min() > 0 and tile[:, 1].max() < 255 and (seen < 1).all():
                colour = tile.mean(axis=0)
                away = np.hypot(top + 4 - 64, left + 4 - 96) / np.hypot(64, 96)
                chroma = (colour.max() - colour.min()) / max(colour.max(), 1)
                expected.append([colour[1], *seen.mean(axis=0) * [2, 1, 1.5], chroma, away])
    found = np.column_stack([blocks.level, blocks.light, blocks.chroma, blocks.radius])
    assert len(expected) > 150
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(blocks.base, [0, 1, 0])


def test_a_cropped_picture_is_laid_over_its_raw_file() -> None:
    light = patches(72, 104)
    whole, part = raw_of(light), frame_of(light[3:67, 6:102])

    blocks = raw_evidence([(whole, part)]).blocks["R"]

    assert blocks.level.size > 100
    np.testing.assert_allclose(blocks.level, 255 * np.sqrt(blocks.light[:, 0]), atol=1.0)


def test_saturated_clipped_masked_and_uneven_blocks_are_left_out() -> None:
    light = plain()
    whole = raw_evidence([(raw_of(light), frame_of(light))]).blocks["R"]

    def left(**changes: Any) -> int:
        given = {"raw": raw_of(light), "frame": frame_of(light), "mask": None, **changes}
        pair = [(given["raw"], given["frame"])]
        return raw_evidence(pair, mask=given["mask"]).blocks["R"].level.size

    saturated = np.zeros((64, 96), dtype=bool)
    saturated[0, 0] = True
    assert left(raw=raw_of(light, saturated=saturated)) == whole.level.size - 1
    masked = np.ones((128, 192), dtype=bool)
    masked[0, :16] = False
    assert left(mask=masked) == whole.level.size - 2
    for level in (0, 255):
        frame = frame_of(light)
        frame.levels[:8, :8] = level
        frame.levels[1, 1] = 99
        assert left(frame=frame) == whole.level.size - 1


def test_a_clipped_channel_is_no_loss_to_the_others() -> None:
    light = plain()
    frame = frame_of(light)
    frame.levels[:8, :64, 0] = 255
    evidence = raw_evidence([(raw_of(light), frame)])

    n_red, n_green = (evidence.blocks[name].level.size for name in "RG")
    assert 0 < n_green - n_red <= 8
    assert evidence.clipped["R"] == pytest.approx(1 - n_red / n_green)
    assert evidence.clipped["G"] == 0


def test_large_pictures_have_larger_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw_blocks, "MOST_BLOCKS", 50)
    light = plain()

    blocks = raw_evidence([(raw_of(light), frame_of(light))]).blocks["R"]

    assert 5 < blocks.level.size <= 50


def test_shots_are_numbered_and_named() -> None:
    evidence = raw_evidence([shot(), shot(seed=1)])

    blocks = evidence.blocks["B"]
    assert blocks.n_shots == 2
    assert set(blocks.shot) == {0, 1}
    assert [source.path.name for source in evidence.sources] == ["a.jpg", "a.dng"] * 2


def test_luma_is_weighed_like_that_of_jpeg() -> None:
    blocks = raw_evidence([shot()], channels="luma").blocks["Y"]

    np.testing.assert_allclose(blocks.base, [0.299, 0.587, 0.114], rtol=1e-6)
    assert blocks.chroma.max() > 0.1


@pytest.mark.parametrize(("height", "width"), [(60, 98), (66, 90), (4, 3)])
def test_a_picture_larger_than_its_raw_file_or_tiny_is_refused(height: int, width: int) -> None:
    raw, _ = shot()
    frame = frame_of(patches(max(height, 32), max(width, 32))[:height, :width])

    with pytest.raises(UnfitFramesError, match=rf"^a.jpg is {2 * width} × {2 * height} pixels, "):
        raw_evidence([(raw, frame)])


def test_a_picture_of_something_else_is_refused() -> None:
    raw, _ = shot()
    _, frame = shot(seed=1)

    with pytest.raises(
        UnfitFramesError, match=r"^a.jpg does not show the same scene as a.dng .* same shot"
    ):
        raw_evidence([(raw, frame)])


def test_a_smaller_version_of_the_picture_is_refused() -> None:
    light = patches(192, 256)
    small = Frame(Path("a.jpg"), frame_of(light).levels[::2, ::2].copy())

    with pytest.raises(UnfitFramesError, match=r"256 × 192 pixels, a.dng 512 × 384.* full size"):
        raw_evidence([(raw_of(light), small)])


def test_no_shot_and_a_foreign_mask_are_refused() -> None:
    with pytest.raises(UnfitFramesError, match="none was given"):
        raw_evidence([])
    with pytest.raises(ParameterError, match="the mask is 4 × 4"):
        raw_evidence([shot()], mask=np.ones((4, 4), dtype=bool))


# Screening


def evidence_of(light: Pixels) -> RawEvidence:
    return raw_evidence([(raw_of(light), frame_of(light))])


def first_of(blocks: RawBlocks, n_blocks: int) -> RawBlocks:
    names = ("level", "light", "chroma", "radius", "shot")
    return replace(blocks, **{name: getattr(blocks, name)[:n_blocks] for name in names})


def test_what_covers_the_range_is_not_doubted() -> None:
    evidence = evidence_of(patches(192, 256))

    assert screen_raw(evidence) == {"R": (), "G": (), "B": ()}


def test_few_blocks_are_flagged_and_fewer_refused() -> None:
    assert Flag.FEW_PIXELS in screen_raw(evidence_of(patches(64, 96)))["G"]
    evidence = evidence_of(patches(192, 256))
    few = {name: first_of(blocks, 99) for name, blocks in evidence.blocks.items()}
    with pytest.raises(UnfitFramesError, match=r"^channel R: 99 blocks of pixels are uniform"):
        screen_raw(replace(evidence, blocks=few))


def test_a_narrow_range_is_flagged_and_a_narrower_refused() -> None:
    light = patches(192, 256)
    assert Flag.LEVELS_UNSEEN in screen_raw(evidence_of(0.4 * light))["G"]
    with pytest.raises(UnfitFramesError, match=r"levels \d+ to \d+ of 0 to 255 cover \d+% of"):
        screen_raw(evidence_of(0.02 * light + 0.01))


def test_clipping_is_flagged() -> None:
    light = patches(192, 256)
    raw = raw_of(light)
    frame = frame_of(4 * light)

    assert screen_raw(raw_evidence([(raw, frame)]))["G"] == (Flag.CLIPPED,)
