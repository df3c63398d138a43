from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from handmade import Pixels, png_chunk, png_of, tiff_bytes
from hypothesis import given
from hypothesis import strategies as st

from chartless.errors import ImageError
from chartless.images import read_frame, read_values
from chartless.images._depth import narrowed, significant_bits

WAYS = {
    "zeros": lambda level, bits: level << (16 - bits),
    "repeated": lambda level, bits: (
        (level << (16 - bits)) | (level >> max(0, 2 * bits - 16)) if bits > 8 else level * 257
    ),
    "rounded": lambda level, bits: np.rint(level * 65535 / (2**bits - 1)).astype(int),
    "floor": lambda level, bits: level * 65535 // (2**bits - 1),
}


def packed(levels: Pixels, bits: int) -> bytes:
    """Samples one after the other, the highest bit first; rows begin with a byte."""
    digits = (levels.reshape(len(levels), -1, 1) >> np.arange(bits)[::-1]) & 1
    return np.packbits(digits.reshape(len(levels), -1).astype(np.uint8), axis=1).tobytes()


def exr_of(path: Path, pixels: Pixels) -> Path:
    height, width, n_channels = pixels.shape
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), oiio.ImageSpec(width, height, n_channels, "uint"))
    target.write_image(pixels)
    target.close()
    assert not target.geterror()
    return path


@pytest.mark.parametrize("bits", [10, 12, 14])
@pytest.mark.parametrize("photometric", [0, 1])
def test_every_level_of_a_tiff_comes_back(bits: int, photometric: int, tmp_path: Path) -> None:
    white = 2**bits - 1
    stored = np.arange(white + 1).reshape(-1, 64)
    path = tmp_path / "a.tif"
    path.write_bytes(
        tiff_bytes(packed(stored, bits), 64, len(stored), bits=bits, photometric=photometric)
    )

    frame = read_frame(path)

    assert np.array_equal(frame.levels[..., 0], stored if photometric else white - stored)
    assert (frame.white, frame.bit_depth) == (white, bits)
    assert len(frame.remarks) == (photometric == 0)
    if photometric:
        assert np.array_equal(read_values(path).values[..., 0], (stored / white).astype(np.float32))


def test_white_as_zero_is_inverted_at_16_bits(tmp_path: Path) -> None:
    stored = np.arange(0, 65536, 9, dtype="<u2")[:7200].reshape(90, 80)
    path = tmp_path / "a.tif"
    path.write_bytes(tiff_bytes(stored.tobytes(), 80, 90, bits=16, photometric=0))

    assert np.array_equal(read_frame(path).levels[..., 0], 65535 - stored)


def test_white_as_zero_is_inverted_at_8_bits_in_a_file_of_16(tmp_path: Path) -> None:
    stored = np.arange(256, dtype="<u2").reshape(16, 16)
    path = tmp_path / "a.tif"
    path.write_bytes(tiff_bytes((stored * 257).tobytes(), 16, 16, bits=16, photometric=0))

    assert np.array_equal(read_frame(path).levels[..., 0], 255 - stored)


@pytest.mark.parametrize("bits", [10, 12, 14])
def test_colours_of_a_tiff_come_back(bits: int, tmp_path: Path, rng: np.random.Generator) -> None:
    stored = rng.integers(0, 2**bits, (6, 7, 3))
    path = tmp_path / "a.tif"
    data = tiff_bytes(packed(stored, bits), 7, 6, bits=bits, n_channels=3, photometric=2)
    path.write_bytes(data)

    assert np.array_equal(read_frame(path).levels, stored)


@given(
    bits=st.integers(8, 15),
    way=st.sampled_from(sorted(WAYS)),
    seed=st.integers(0, 2**32 - 1),
)
def test_bits_are_found_however_they_were_widened(bits: int, way: str, seed: int) -> None:
    # All odd levels of the range: fewer bits would not explain them.
    level = np.random.default_rng(seed).permutation(np.arange(1, 2**bits, 2))
    samples = WAYS[way](level, bits).astype(np.uint16)

    assert significant_bits(samples) == bits
    assert np.array_equal(narrowed(samples, bits), level)
    assert narrowed(samples, bits).dtype == (np.uint8 if bits == 8 else np.uint16)


@given(seed=st.integers(0, 2**32 - 1))
def test_16_bits_stay_16(seed: int) -> None:
    samples = np.random.default_rng(seed).integers(0, 65536, 500, dtype=np.uint16)

    assert significant_bits(samples) == 16


def test_few_levels_prove_nothing() -> None:
    samples = np.arange(0, 32 * 16, 16, dtype=np.uint16)

    assert significant_bits(samples) == 16
    assert significant_bits(samples, noted=12) == 12


def test_what_the_file_notes_is_not_believed_against_its_samples() -> None:
    assert significant_bits(np.arange(0, 3000, 7, dtype=np.uint16), noted=12) == 16


@pytest.mark.parametrize("noted", [True, False])
def test_png_of_12_bits_says_so(noted: bool, tmp_path: Path, rng: np.random.Generator) -> None:
    stored = rng.integers(0, 4096, (20, 30, 3))
    path = tmp_path / "a.png"
    chunk = png_chunk(b"sBIT", bytes([12, 12, 12])) if noted else b""
    path.write_bytes(png_of((stored << 4).astype(np.uint16), chunk))

    frame = read_frame(path)

    assert np.array_equal(frame.levels, stored)
    assert frame.white == 4095
    assert frame.remarks == ("read 12 bits of samples that have room for 16",)


def test_bits_of_alpha_do_not_count(tmp_path: Path) -> None:
    stored = np.zeros((4, 4, 2), dtype=np.uint16)
    stored[..., 0] = np.arange(16).reshape(4, 4) << 6
    stored[..., 1] = 65535
    path = tmp_path / "a.png"
    path.write_bytes(png_of(stored, png_chunk(b"sBIT", bytes([10, 16]))))

    assert read_frame(path).white == 1023


@pytest.mark.parametrize("bits", [9, 10, 12, 15])
def test_levels_of_a_pnm_come_back(bits: int, tmp_path: Path) -> None:
    stored = np.arange(2**bits).astype(">u2")
    path = tmp_path / "a.pgm"
    path.write_bytes(b"P5\n%d 1\n%d\n" % (stored.size, stored.size - 1) + stored.tobytes())

    frame = read_frame(path)

    assert np.array_equal(frame.levels.ravel(), stored)
    assert (frame.white, frame.remarks) == (2**bits - 1, ())


def test_integer_exr_is_read(tmp_path: Path, rng: np.random.Generator) -> None:
    stored = rng.integers(0, 65536, (20, 30, 3), dtype=np.uint32)

    frame = read_frame(exr_of(tmp_path / "a.exr", stored))

    assert np.array_equal(frame.levels, stored)
    assert (frame.levels.dtype, frame.white) == (np.uint16, 65535)


def test_integer_exr_of_stretched_levels_is_read(tmp_path: Path, rng: np.random.Generator) -> None:
    stored = rng.integers(0, 65536, (20, 30, 1), dtype=np.uint32)

    frame = read_frame(exr_of(tmp_path / "a.exr", stored * np.uint32(65537)))

    assert np.array_equal(frame.levels, stored)
    assert frame.white == 65535


def test_integer_exr_of_more_bits_is_refused(tmp_path: Path, rng: np.random.Generator) -> None:
    path = exr_of(tmp_path / "a.exr", rng.integers(0, 2**32, (20, 30, 1), dtype=np.uint32))

    with pytest.raises(ImageError, match=r"a\.exr: holds levels of 32 bits: convert it to 8 or"):
        read_frame(path)


def test_8_bits_in_a_file_of_16_are_8(save: Callable[..., Path], rgb: Pixels) -> None:
    frame = read_frame(save("a.png", rgb.astype(np.uint16) * 257))

    assert np.array_equal(frame.levels, rgb)
    assert (frame.levels.dtype, frame.bit_depth) == (np.uint8, 8)
