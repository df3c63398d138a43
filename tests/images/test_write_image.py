import os
import struct
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from handmade import Pixels

from chartless._files import atomic_path
from chartless.errors import ChartlessError, ImageError, OutputError, ParameterError
from chartless.images import DataType, read_frame, write_image


def stored(path: Path) -> tuple[Pixels, oiio.ImageSpec]:
    source = oiio.ImageInput.open(str(path))
    assert source is not None
    pixels = source.read_image("unknown")
    assert pixels is not None
    return pixels, source.spec()


@pytest.mark.parametrize("n_channels", [1, 3])
@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("suffix", [".exr", ".tif", ".TIFF"])
def test_floats_come_back_bit_for_bit(
    suffix: str, linear: bool, n_channels: int, tmp_path: Path, rng: np.random.Generator
) -> None:
    values = rng.normal(0.5, 1, (9, 7, n_channels)).astype(np.float32)  # beyond 0 … 1, too

    write_image(tmp_path / f"out{suffix}", values, linear=linear)

    pixels, _ = stored(tmp_path / f"out{suffix}")
    assert pixels.dtype == np.float32
    assert np.array_equal(pixels, values)


@pytest.mark.parametrize("n_channels", [1, 3])
@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("data_type", ["uint8", "uint16"])
@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_integers_come_back_exactly(  # noqa: PLR0917 - fixtures
    suffix: str,
    data_type: DataType,
    linear: bool,
    n_channels: int,
    tmp_path: Path,
    rng: np.random.Generator,
) -> None:
    top = np.iinfo(data_type).max
    levels = rng.integers(0, top, (9, 7, n_channels), dtype=data_type, endpoint=True)

    write_image(tmp_path / f"out{suffix}", levels / top, data_type=data_type, linear=linear)

    assert np.array_equal(read_frame(tmp_path / f"out{suffix}").levels, levels)


def test_png_takes_16_bits_unless_told(tmp_path: Path) -> None:
    write_image(tmp_path / "out.png", np.full((2, 2, 3), 0.25))

    assert (read_frame(tmp_path / "out.png").levels == 16384).all()


@pytest.mark.parametrize(("data_type", "filter_type"), [("uint8", 3), ("uint16", 0)])
def test_png_rows_have_one_filter(
    data_type: DataType, filter_type: int, tmp_path: Path, rng: np.random.Generator
) -> None:
    """Of the five of the format: means of neighbours for 8 bits, none for 16."""
    path = tmp_path / "picture.png"

    write_image(path, rng.uniform(size=(20, 30, 3)), data_type=data_type)

    content, at, packed = path.read_bytes(), 8, b""
    while at < len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        packed += content[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    rows = zlib.decompress(packed)
    assert set(rows[:: len(rows) // 20]) == {filter_type}


def test_light_of_few_levels_takes_little_room(tmp_path: Path, rng: np.random.Generator) -> None:
    """What a table makes of 8 bits packs to less in a PNG file than filters would leave."""
    levels = np.clip(rng.normal(128, 20, (200, 300, 3)), 0, 255).astype(np.uint8)
    light = (levels / 255) ** 2.2

    write_image(tmp_path / "own.png", light)
    oiio.ImageBuf(np.rint(light * 65535).astype(np.uint16)).write(str(tmp_path / "usual.png"))

    assert np.array_equal(stored(tmp_path / "own.png")[0], stored(tmp_path / "usual.png")[0])
    assert (tmp_path / "own.png").stat().st_size < (tmp_path / "usual.png").stat().st_size


def test_integers_are_clipped_and_rounded(tmp_path: Path) -> None:
    values = np.array([[[-np.inf], [-0.1], [0.4999 / 255], [0.5001 / 255], [1.1], [np.inf]]])

    write_image(tmp_path / "out.png", values, data_type="uint8")

    assert read_frame(tmp_path / "out.png").levels.ravel().tolist() == [0, 0, 0, 1, 255, 255]


def test_values_are_left_alone(tmp_path: Path) -> None:
    values = np.linspace(-1, 2, 12).reshape(2, 2, 3)
    before = values.copy()

    write_image(tmp_path / "out.png", values)

    assert np.array_equal(values, before)


def test_strided_values_are_written_in_order(tmp_path: Path, rng: np.random.Generator) -> None:
    values = rng.random((3, 9, 7), dtype=np.float32).transpose(1, 2, 0)[::-1, ::2]

    write_image(tmp_path / "out.exr", values)

    assert np.array_equal(stored(tmp_path / "out.exr")[0], values)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", [".exr", ".tif"])
def test_orientation_is_kept_as_metadata(suffix: str, orientation: int, tmp_path: Path) -> None:
    values = np.arange(6, dtype=np.float32).reshape(2, 3, 1)

    write_image(tmp_path / f"out{suffix}", values, orientation=orientation)

    pixels, spec = stored(tmp_path / f"out{suffix}")
    assert np.array_equal(pixels, values)
    assert spec.get_int_attribute("Orientation", 1) == orientation


@pytest.mark.parametrize(
    ("orientation", "shown"),
    [  # EXIF 2.32, tag 274: where row 0 and column 0 of the stored picture are seen
        (1, [[0, 1, 2], [3, 4, 5]]),  # top, left
        (2, [[2, 1, 0], [5, 4, 3]]),  # top, right
        (3, [[5, 4, 3], [2, 1, 0]]),  # bottom, right
        (4, [[3, 4, 5], [0, 1, 2]]),  # bottom, left
        (5, [[0, 3], [1, 4], [2, 5]]),  # left, top
        (6, [[3, 0], [4, 1], [5, 2]]),  # right, top
        (7, [[5, 2], [4, 1], [3, 0]]),  # right, bottom
        (8, [[2, 5], [1, 4], [0, 3]]),  # left, bottom
    ],
)
def test_png_pixels_are_turned_upright(
    orientation: int, shown: list[list[int]], tmp_path: Path
) -> None:
    values = np.arange(6).reshape(2, 3, 1) / 255

    write_image(tmp_path / "out.png", values, data_type="uint8", orientation=orientation)

    frame = read_frame(tmp_path / "out.png")
    assert frame.levels[..., 0].tolist() == shown
    assert frame.orientation == 1


def chunks(path: Path) -> dict[bytes, bytes]:
    """Content of the chunks of a PNG file by their names."""
    content, at, found = path.read_bytes(), 8, {}
    while at < len(content):
        size, name = struct.unpack_from(">I4s", content, at)
        found[name] = content[at + 8 : at + 8 + size]
        at += 12 + size
    return found


COLOUR_CHUNKS = {b"sRGB", b"cHRM", b"cICP", b"iCCP"}


def test_linear_light_is_labelled_in_a_png(tmp_path: Path) -> None:
    """As gamma 1, in units of 1/100,000."""
    values = np.full((2, 2, 3), 0.5)

    write_image(tmp_path / "light.png", values)
    write_image(tmp_path / "other.png", values, linear=False)

    assert struct.unpack(">I", chunks(tmp_path / "light.png")[b"gAMA"]) == (100_000,)
    assert b"gAMA" not in chunks(tmp_path / "other.png")


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("suffix", [".exr", ".tif", ".png", ".hdr"])
def test_no_file_claims_primaries(suffix: str, linear: bool, tmp_path: Path) -> None:
    """What the bytes say, and what a reader is told of them."""
    path = tmp_path / f"out{suffix}"

    write_image(path, np.full((2, 2, 3), 0.5), linear=linear)

    content = path.read_bytes().lower()
    for claim in (b"chromaticities", b"rec709", b"srgb", b"colorinteropid", b"primaries="):
        assert claim not in content
    if suffix == ".png":
        assert not COLOUR_CHUNKS & chunks(path).keys()
    elif suffix != ".hdr":  # of PNG and HDR readers suppose something themselves
        assert stored(path)[1].getattribute("oiio:ColorSpace") is None


@pytest.mark.parametrize("n_channels", [1, 3])
def test_exr_says_that_primaries_are_unmeasured(n_channels: int, tmp_path: Path) -> None:
    write_image(tmp_path / "out.exr", np.zeros((2, 3, n_channels)))

    told = stored(tmp_path / "out.exr")[1].getattribute("chartless:primaries")

    assert told == ("those of the camera, not measured" if n_channels == 3 else None)


def test_exr_keeps_any_metadata_and_tiff_what_it_knows(tmp_path: Path) -> None:
    values = np.zeros((2, 3, 3))
    metadata = {"chartless:unit": "1/s", "chartless:times": (0.5, 1.0, 2.0, 4.0), "FNumber": 4.0}

    for name in ("out.exr", "out.tif"):
        write_image(tmp_path / name, values, metadata=metadata)

    _, spec = stored(tmp_path / "out.exr")
    assert {name: spec.getattribute(name) for name in metadata} == metadata
    assert stored(tmp_path / "out.tif")[1].getattribute("FNumber") == 4


@pytest.mark.parametrize("n_channels", [1, 3])
def test_radiance_hdr_keeps_eight_bits_and_an_exponent(
    n_channels: int, tmp_path: Path, rng: np.random.Generator
) -> None:
    values = rng.lognormal(0, 4, (9, 7, n_channels)).astype(np.float32)

    write_image(tmp_path / "out.hdr", values, orientation=6)

    pixels, spec = stored(tmp_path / "out.hdr")
    wanted = np.broadcast_to(np.rot90(values, -1), (7, 9, 3))
    assert np.all(np.abs(pixels - wanted) <= wanted.max(axis=-1, keepdims=True) / 127)
    assert spec.get_int_attribute("Orientation", 1) == 1


# Refusals


@pytest.mark.parametrize("name", ["out.jpg", "out", "out.npy"])
def test_other_formats_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"pictures are written as \.exr, \.tif, \.tiff, \.png"):
        write_image(tmp_path / name, np.zeros((2, 2, 3)))

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "data_type", "message"),
    [
        ("out.png", "float", r"a \.png file does not hold float samples: use \.exr, \.tif"),
        ("out.exr", "uint16", r"a \.exr file does not hold uint16 samples: use \.tif"),
    ],
)
def test_samples_that_a_format_does_not_hold_are_refused(
    name: str, data_type: DataType, message: str, tmp_path: Path
) -> None:
    with pytest.raises(ImageError, match=message):
        write_image(tmp_path / name, np.zeros((2, 2, 3)), data_type=data_type)


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 2), (4, 4, 4), (0, 4, 3), (1, 4, 4, 3)])
def test_arrays_that_are_no_picture_are_refused(shape: tuple[int, ...], tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="a picture has the shape"):
        write_image(tmp_path / "out.exr", np.zeros(shape))


def test_nan_is_refused_as_an_integer_and_kept_as_a_float(tmp_path: Path) -> None:
    values = np.full((2, 2, 1), np.nan)

    write_image(tmp_path / "out.exr", values)
    with pytest.raises(ParameterError, match="integers cannot hold NaN"):
        write_image(tmp_path / "out.png", values)

    assert np.isnan(stored(tmp_path / "out.exr")[0]).all()


def test_orientation_out_of_range_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="orientation must lie between 1 and 8, not 9"):
        write_image(tmp_path / "out.png", np.zeros((2, 2, 1)), orientation=9)


def test_unknown_data_type_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="unknown data type 'half': use auto, float"):
        write_image(tmp_path / "out.exr", np.zeros((2, 2, 1)), data_type="half")  # type: ignore[arg-type]


# Whole or not at all


@contextmanager
def disk_with_room_for(n_bytes: int) -> Iterator[None]:
    """Let no file of this process grow beyond `n_bytes`; the system's own kind of full disk."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on file sizes")
@pytest.mark.parametrize("room", [10, 20_000], ids="{} bytes".format)
@pytest.mark.parametrize("suffix", [".exr", ".tif", ".png"])
def test_full_disk_is_reported_and_leaves_the_folder_as_it_was(
    suffix: str,
    room: int,
    tmp_path: Path,
    rng: np.random.Generator,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / f"out{suffix}"
    path.write_bytes(b"before")

    with disk_with_room_for(room), pytest.raises(OutputError) as caught:
        write_image(path, rng.random((100, 100, 3)))

    assert str(caught.value) == f"{path}: cannot be written: check that the disk has room"
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == b"before"
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on file sizes")
def test_disk_that_is_full_only_at_the_last_byte_is_reported(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    values = rng.random((100, 100, 3))
    for suffix in (".exr", ".tif", ".png"):
        path = tmp_path / f"out{suffix}"
        write_image(path, values)
        size = path.stat().st_size

        with disk_with_room_for(size - 1), pytest.raises(OutputError, match="cannot be written"):
            write_image(path, values)

        assert path.stat().st_size == size


def test_error_in_the_body_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("before")

    def fail() -> None:
        with atomic_path(path) as temporary:
            temporary.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()

    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "before"


def test_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("before")

    with atomic_path(path) as temporary:
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
        temporary.write_text("after")
        assert path.read_text() == "before"

    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "after"


@pytest.mark.skipif(os.name != "posix", reason="symbolic links need rights elsewhere")
def test_symbolic_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link.txt").symlink_to("file.txt")

    with atomic_path(tmp_path / "link.txt") as temporary:
        temporary.write_text("through")

    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "file.txt").read_text() == "through"


def output_refusal(path: Path) -> str:
    with pytest.raises(OutputError) as caught:
        write_image(path, np.zeros((2, 2, 3)))
    assert isinstance(caught.value, ChartlessError)
    assert isinstance(caught.value, OSError)
    return str(caught.value)


def test_missing_output_folder_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "none" / "out.png"

    message = output_refusal(path)

    assert message == f"{path}: output folder {path.parent} does not exist: create it first"


def test_output_in_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()

    message = output_refusal(tmp_path / "file" / "out.png")

    assert message.endswith("file is a file, not a folder: choose another output")


def test_output_over_a_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out.png").mkdir()

    assert output_refusal(tmp_path / "out.png").endswith("is a folder: name a file in it")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no named pipes")
def test_device_is_never_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "out.png")

    message = output_refusal(tmp_path / "out.png")

    assert message.endswith("is not an ordinary file: choose another output")


def test_unwritable_output_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write anywhere

    message = output_refusal(tmp_path / "out.png")

    assert message.endswith("is not writable: choose another one")
    assert list(tmp_path.iterdir()) == []
