"""Blocks of lossy compression: found where a picture was a JPEG, nowhere else."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from scipy.ndimage import gaussian_filter

from chartless.frames.compression import Blocks, former_blocks
from chartless.images import read_frame


def textured(seed: int, shape: tuple[int, int] = (240, 320)) -> np.ndarray:
    rng = np.random.default_rng(seed)
    smooth = gaussian_filter(rng.standard_normal((*shape, 3)), (12, 12, 0)) * 300
    fine = gaussian_filter(rng.standard_normal((*shape, 3)), (1, 1, 0)) * 20
    noise = rng.standard_normal((*shape, 3))
    return np.rint(128 + smooth + fine + noise).clip(1, 254).astype(np.uint8)


def through_jpeg(levels: np.ndarray, quality: int, subsampling: int) -> np.ndarray:
    file = io.BytesIO()
    Image.fromarray(levels).save(file, "JPEG", quality=quality, subsampling=subsampling)
    return np.asarray(Image.open(file))


@pytest.mark.slow
@pytest.mark.parametrize("quality", [80, 90, 95])
@pytest.mark.parametrize("subsampling", [0, 2])
@pytest.mark.parametrize(("down", "right"), [(0, 0), (3, 5)])
def test_a_jpeg_shows_its_blocks(quality: int, subsampling: int, down: int, right: int) -> None:
    levels = through_jpeg(textured(0), quality, subsampling)[down:, right:]
    found = former_blocks(np.ascontiguousarray(levels))
    assert found.sure
    assert found.blocks == Blocks(8, 8, -down % 8, -right % 8)


def test_a_grey_jpeg_shows_its_blocks() -> None:
    levels = through_jpeg(textured(1)[..., 1], 90, 0)[..., np.newaxis]
    assert former_blocks(levels).blocks == Blocks(8, 8)


@pytest.mark.parametrize("seed", range(4))
def test_other_pictures_show_none(seed: int) -> None:
    assert former_blocks(textured(seed)) == (None, True)


def test_a_reduced_jpeg_shows_none() -> None:
    large = through_jpeg(textured(2, (480, 640)), 90, 2)
    reduced = np.asarray(Image.fromarray(large).resize((320, 240), Image.Resampling.LANCZOS))
    assert former_blocks(reduced).blocks is None


def test_a_flat_or_tiny_picture_tells_nothing() -> None:
    assert former_blocks(np.full((64, 64, 3), 100, np.uint8)) == (None, False)
    assert former_blocks(textured(0)[:12, :12]) == (None, False)


def test_sixteen_bits_are_no_jpeg() -> None:
    assert former_blocks(textured(0).astype(np.uint16) * 257) == (None, True)


@given(
    rows=st.integers(1, 40),
    columns=st.integers(1, 40),
    height=st.sampled_from([8, 16]),
    width=st.sampled_from([8, 16, 32]),
    seed=st.integers(0, 1000),
)
def test_touched_is_what_shares_a_block(
    rows: int, columns: int, height: int, width: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(size=(rows, columns)) < 0.02
    down, right = int(rng.integers(height)), int(rng.integers(width))
    touched = Blocks(height, width, down, right).touched(pixels)
    row, column = np.indices(pixels.shape)
    block = (row - down) // height * 1000 + (column - right) // width
    assert np.array_equal(touched, np.isin(block, block[pixels]))


@pytest.mark.parametrize(
    ("options", "blocks"),
    [
        ({"format": "JPEG", "subsampling": 0}, Blocks(8, 8)),
        ({"format": "JPEG", "subsampling": 1}, Blocks(8, 16)),
        ({"format": "JPEG", "subsampling": 2}, Blocks(16, 16)),
        ({"format": "PNG"}, None),
        ({"format": "WEBP", "lossless": True}, None),
        ({"format": "WEBP", "quality": 90}, Blocks(16, 16)),
    ],
)
def test_files_tell_their_blocks(tmp_path, options: dict, blocks: Blocks | None) -> None:
    path = tmp_path / "frame"
    Image.fromarray(textured(0)).save(path, **options)
    assert read_frame(path).blocks == blocks


def test_a_grey_jpeg_has_blocks_of_luma(tmp_path) -> None:
    path = tmp_path / "grey.jpg"
    Image.fromarray(textured(0)[..., 0]).save(path, quality=90)
    assert read_frame(path).blocks == Blocks(8, 8)
