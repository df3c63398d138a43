import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from struct import pack

import numpy as np
import pytest
from handmade import Pixels, png_bytes, png_chunk, png_of, tiff_bytes

from chartless.errors import ChartlessError, ImageError
from chartless.images import read_frame

Write = Callable[[str, bytes], Path]
Save = Callable[..., Path]

CUT_SHORT = "is damaged or cut short: copy it again"
FLOATING = "is floating point: it holds light, not levels; calibrate from the camera's own"
PALETTE = "has a palette, which hides the levels: convert it to grey or RGB"
TOO_LARGE = "claims to be larger than any photograph"


def refusal(path: Path, capfd: pytest.CaptureFixture[str] | None = None) -> str:
    """Message of the refusal, after the path; one line, and nothing printed."""
    with pytest.raises(ImageError) as caught:
        read_frame(path)
    message = str(caught.value)
    assert isinstance(caught.value, ChartlessError)
    assert isinstance(caught.value, OSError)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    if capfd is not None:
        assert capfd.readouterr() == ("", "")
    return message.removeprefix(f"{path}: ")


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write_bytes(name: str, data: bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write_bytes


# Levels


@pytest.mark.parametrize("n_channels", [1, 3])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("suffix", ["png", "tif", "pnm"])
def test_levels_come_back_as_stored(
    suffix: str, dtype: type, n_channels: int, save: Save, rng: np.random.Generator
) -> None:
    stored = rng.integers(0, np.iinfo(dtype).max, (7, 5, n_channels), dtype, endpoint=True)

    frame = read_frame(save(f"frame.{suffix}", stored))

    assert frame.levels.dtype == dtype
    assert frame.levels.flags.c_contiguous
    assert np.array_equal(frame.levels, stored)
    assert frame.bit_depth == 8 * np.dtype(dtype).itemsize
    assert frame.channel_names == (("Y",) if n_channels == 1 else ("R", "G", "B"))
    assert (frame.orientation, frame.remarks, frame.settings.camera) == (1, (), None)


@pytest.mark.parametrize("suffix", ["bmp", "webp"])
def test_levels_of_lossless_formats_come_back_as_stored(
    suffix: str, save: Save, rgb: Pixels
) -> None:
    path = save(f"frame.{suffix}", rgb, compression="lossless")

    assert np.array_equal(read_frame(path).levels, rgb)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_levels_agree_with_bytes_written_by_hand(
    dtype: type, write: Write, rng: np.random.Generator
) -> None:
    stored = rng.integers(0, np.iinfo(dtype).max, (7, 5, 3), dtype, endpoint=True)
    linear_light = png_chunk(b"gAMA", pack(">I", 100_000))

    frame = read_frame(write("frame.png", png_of(stored, linear_light)))

    assert np.array_equal(frame.levels, stored)


def test_jpeg_levels_are_near_a_smooth_scene(save: Save) -> None:
    scene = np.broadcast_to(np.arange(64, 192, 2, dtype=np.uint8)[:, None], (64, 64, 3))[...]

    levels = read_frame(save("frame.jpg", np.ascontiguousarray(scene), Compression="jpeg:98"))

    assert levels.bit_depth == 8
    assert np.abs(levels.levels.astype(int) - scene).max() <= 3


def test_content_counts_not_the_extension(write: Write, rgb: Pixels) -> None:
    assert np.array_equal(read_frame(write("really-a-png.jpg", png_of(rgb))).levels, rgb)


def test_white_as_zero_is_inverted_with_a_remark(write: Write) -> None:
    stored = np.arange(12, dtype=np.uint8)

    frame = read_frame(write("white.tif", tiff_bytes(stored.tobytes(), 4, 3, photometric=0)))

    assert np.array_equal(frame.levels.ravel(), 255 - stored)
    assert frame.remarks == ("inverted the levels: the file stores white as 0",)


# Alpha


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("n_channels", [2, 4])
def test_alpha_is_dropped_and_colours_stay_unmultiplied(
    n_channels: int, dtype: type, write: Write, rng: np.random.Generator
) -> None:
    stored = rng.integers(0, np.iinfo(dtype).max, (7, 5, n_channels), dtype, endpoint=True)
    stored[:3, :, -1] = 0  # transparent

    frame = read_frame(write("frame.png", png_of(stored)))

    assert np.array_equal(frame.levels, stored[..., :-1])
    assert frame.levels.flags.c_contiguous
    assert frame.remarks == ("dropped the alpha channel",)


@pytest.mark.parametrize(
    ("alpha", "remark"),
    [
        (0, "dropped the channel channel3"),
        (1, "dropped the alpha channel, by which the file stores its colours multiplied"),
        (2, "dropped the alpha channel"),
    ],
    ids=["unspecified", "associated", "unassociated"],
)
def test_tiff_alpha_is_dropped(
    alpha: int, remark: str, write: Write, rng: np.random.Generator
) -> None:
    stored = rng.integers(0, 256, (7, 5, 4), dtype=np.uint8)
    data = tiff_bytes(stored.tobytes(), 5, 7, n_channels=4, photometric=2, alpha=alpha)

    frame = read_frame(write("frame.tif", data))

    assert np.array_equal(frame.levels, stored[..., :3])
    assert frame.remarks == (remark,)


# Pages


def test_first_frame_of_an_animation_is_read_with_a_remark(write: Write, rgb: Pixels) -> None:
    animation = png_chunk(b"acTL", pack(">II", 1, 0)) + png_chunk(
        b"fcTL", pack(">IIIIIHHBB", 0, rgb.shape[1], rgb.shape[0], 0, 0, 1, 10, 0, 0)
    )

    frame = read_frame(write("animated.png", png_of(rgb, animation)))

    assert np.array_equal(frame.levels, rgb)
    assert frame.remarks == ("read the first of several pages",)


def test_first_page_of_a_tiff_is_read_with_a_remark(write: Write) -> None:
    one = tiff_bytes(bytes(range(12)), 4, 3)
    directory = one[int.from_bytes(one[4:8], "little") : -4]
    both = one[:-4] + pack("<I", len(one)) + directory + bytes(4)

    frame = read_frame(write("pages.tif", both))

    assert frame.levels.ravel().tolist() == list(range(12))
    assert frame.remarks == ("read the first of several pages",)


# EXIF


@pytest.mark.parametrize("suffix", ["jpg", "png"])
def test_exposure_camera_and_orientation_come_from_exif(
    suffix: str, save: Save, rgb: Pixels
) -> None:
    path = save(
        f"frame.{suffix}",
        rgb,
        Make="Leica ",
        Model="M11",
        Orientation=6,
        ExposureTime=1 / 125,
        FNumber=2.8,
        Exif__PhotographicSensitivity=400,
    )

    frame = read_frame(path)

    assert frame.settings.exposure_time == pytest.approx(1 / 125, rel=1e-3)
    assert frame.settings.f_number == pytest.approx(2.8, rel=1e-3)
    assert frame.settings.iso == 400
    assert frame.settings.camera == "Leica M11"
    assert frame.orientation == 6
    assert frame.levels.shape == rgb.shape, "not rotated"


def test_exif_of_a_tiff_is_read(save: Save, rgb: Pixels) -> None:
    frame = read_frame(save("frame.tif", rgb, ExposureTime=0.5, FNumber=8.0, Orientation=3))

    assert (frame.settings.exposure_time, frame.settings.f_number, frame.settings.iso) == (
        0.5,
        8.0,
        None,
    )
    assert frame.orientation == 3


@pytest.mark.parametrize(
    ("maker", "model", "camera"),
    [("Canon", "Canon EOS 5D", "Canon EOS 5D"), ("", "M11", "M11"), ("Leica", "", "Leica")],
)
def test_maker_is_not_named_twice(
    maker: str, model: str, camera: str, save: Save, rgb: Pixels
) -> None:
    assert read_frame(save("frame.jpg", rgb, Make=maker, Model=model)).settings.camera == camera


def test_foreign_bytes_in_exif_do_no_harm(save: Save, rgb: Pixels) -> None:
    path = save("frame.jpg", rgb, Make="MAKERX", Orientation=1)
    path.write_bytes(path.read_bytes().replace(b"MAKERX", b"\xff\xfe\nK\x80X"))

    camera = read_frame(path).settings.camera

    assert camera is not None
    assert camera.isprintable()
    assert camera.encode()


def test_nonsense_orientation_means_as_stored(save: Save, rgb: Pixels) -> None:
    assert read_frame(save("frame.jpg", rgb, Orientation=42)).orientation == 1


# Refusals


def test_missing_file_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.png") == "does not exist: check the name"


def test_path_through_a_file_is_refused(write: Write) -> None:
    assert refusal(write("file", b"x") / "a.png") == "does not exist: check the name"


def test_folder_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path) == "is a folder: name the pictures in it"


def test_empty_file_is_refused(write: Write) -> None:
    assert refusal(write("a.jpg", b"")) == "is empty: copy it again from the camera or card"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root reads everything")
def test_unreadable_file_is_refused(write: Write, rgb: Pixels) -> None:
    path = write("a.png", png_of(rgb))
    path.chmod(0)

    assert refusal(path) == "may not be read: change its permissions"


@pytest.mark.skipif(sys.platform != "linux", reason="other systems forbid such names")
def test_name_that_is_not_utf8_is_refused(write: Write, rgb: Pixels) -> None:
    path = write(os.fsdecode(b"a\xff.png"), png_of(rgb))

    with pytest.raises(ImageError, match="has a name that is not valid UTF-8: rename it"):
        read_frame(path)


@pytest.mark.parametrize("name", ["notes.txt", "notes.png", "notes.jpg", "notes.tif", "notes"])
def test_text_is_refused(name: str, write: Write, capfd: pytest.CaptureFixture[str]) -> None:
    message = refusal(write(name, b"Dear diary,\n" * 50), capfd)

    assert message == "is not a picture in a known format: use PNG, TIFF or JPEG files"


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9], ids="cut at {}".format)
@pytest.mark.parametrize(
    ("name", "attributes"),
    [
        ("a.png", {}),
        ("a.jpg", {}),
        ("progressive.jpg", {"jpeg__progressive": 1}),
        ("a.tif", {"compression": "none"}),
        ("zip.tif", {"compression": "zip"}),
        ("a.bmp", {}),
        ("a.webp", {}),
        ("a.ppm", {}),
    ],
)
def test_truncated_file_is_refused(  # noqa: PLR0917 - fixtures
    name: str,
    attributes: dict[str, object],
    share: float,
    save: Save,
    rng: np.random.Generator,
    capfd: pytest.CaptureFixture[str],
) -> None:
    path = save(name, rng.integers(0, 256, (120, 160, 3), dtype=np.uint8), **attributes)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])

    assert refusal(path, capfd).startswith(CUT_SHORT)


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.webp", "a.ppm"])
def test_loss_of_the_last_two_bytes_is_noticed(name: str, save: Save, rgb: Pixels) -> None:
    path = save(name, rgb)
    path.write_bytes(path.read_bytes()[:-2])

    assert refusal(path).startswith(CUT_SHORT)


def test_loss_of_the_last_pixels_of_a_jpeg_is_noticed(save: Save, rng: np.random.Generator) -> None:
    path = save("a.jpg", rng.integers(0, 256, (120, 160, 3), dtype=np.uint8))
    path.write_bytes(path.read_bytes()[:-20])

    assert refusal(path).startswith(CUT_SHORT)


def test_damaged_png_is_refused(
    write: Write, rgb: Pixels, capfd: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(png_of(rgb))
    data[len(data) // 2] ^= 1

    assert refusal(write("a.png", bytes(data)), capfd).startswith(CUT_SHORT)


@pytest.mark.parametrize("tail", [bytes(512), b"\xff\xd8\xffpreview\xff\xd9", b"vendor block" * 9])
def test_jpeg_with_data_after_its_end_is_read(tail: bytes, save: Save, rgb: Pixels) -> None:
    path = save("frame.jpg", rgb)
    alone = read_frame(path).levels
    path.write_bytes(path.read_bytes() + tail)

    assert np.array_equal(read_frame(path).levels, alone)


@pytest.mark.parametrize(
    ("name", "dtype"),
    [("a.exr", "float16"), ("a.exr", "float32"), ("a.hdr", "float32"), ("a.tif", "float32")],
)
def test_floating_point_is_refused(name: str, dtype: str, save: Save, rgb: Pixels) -> None:
    assert refusal(save(name, rgb.astype(dtype))).startswith(FLOATING)


def test_palette_png_is_refused(write: Write) -> None:
    data = png_bytes(bytes(5 * 4), 3, 5, colour_type=3, extra=png_chunk(b"PLTE", bytes(range(12))))

    assert refusal(write("a.png", data)) == PALETTE


def test_palette_tiff_is_refused(write: Write) -> None:
    data = tiff_bytes(bytes(12), 4, 3, photometric=3, colour_map=True)

    assert refusal(write("a.tif", data)) == PALETTE


def test_gif_is_refused(save: Save, rgb: Pixels) -> None:
    assert refusal(save("a.gif", rgb)) == PALETTE


def bmp_bytes(bits_per_pixel: int, palette: bytes) -> bytes:
    start = 54 + len(palette)
    pixels = bytes(range(64))
    return (
        pack("<2sIHHI", b"BM", start + len(pixels), 0, 0, start)
        + pack("<IiiHHIIiiII", 40, 4, 4, 1, bits_per_pixel, 0, 0, 0, 0, len(palette) // 4, 0)
        + palette
        + pixels
    )


@pytest.mark.parametrize("bits", [1, 4, 8])
def test_palette_bmp_is_refused(bits: int, write: Write) -> None:
    colours = b"".join(bytes([i, 255 - i, 7, 0]) for i in range(1 << bits))

    assert refusal(write("a.bmp", bmp_bytes(bits, colours))) == PALETTE


def test_bmp_of_five_bits_is_refused(write: Write) -> None:
    message = refusal(write("a.bmp", bmp_bytes(16, b"")))

    assert message == "stores 5-bit samples: convert it to 8 or 16 bits"


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_png_of_few_bits_is_refused(bits: int, write: Write) -> None:
    data = png_bytes(bytes(5 * (1 + bits)), 8, 5, bits=bits, colour_type=0)

    assert refusal(write("a.png", data)) == f"stores {bits}-bit samples: convert it to 8 or 16 bits"


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_tiff_of_other_bits_is_refused(bits: int, write: Write) -> None:
    data = tiff_bytes(bytes(5 * bits), 8, 5, bits=bits)

    assert refusal(write("a.tif", data)) == f"stores {bits}-bit samples: convert it to 8 or 16 bits"


@pytest.mark.parametrize("dtype", ["uint32", "int16"])
def test_other_integers_are_refused(dtype: str, save: Save, rgb: Pixels) -> None:
    message = refusal(save("a.tif", rgb.astype(dtype)))

    assert message.endswith("samples: convert it to unsigned 8 or 16 bits")


@pytest.mark.parametrize("bits", [9, 11, 13])
def test_tiff_of_odd_bits_is_refused(bits: int, write: Write) -> None:
    data = tiff_bytes(bytes(5 * bits), 8, 5, bits=bits)

    assert refusal(write("a.tif", data)).endswith("of bits: convert it to 8 or 16 bits")


@pytest.mark.parametrize("maximum", [100, 1000, 127])
def test_pnm_of_another_maximum_is_refused(maximum: int, write: Write) -> None:
    data = b"P5\n# by hand\n2 2\n%d\n" % maximum + bytes(8 if maximum > 255 else 4)

    assert "convert it to 8 or 16 bits" in refusal(write("a.pgm", data))


def test_cmyk_tiff_is_refused(write: Write) -> None:
    data = tiff_bytes(bytes(48), 4, 3, n_channels=4, photometric=5)

    message = refusal(write("a.tif", data))

    assert message == (
        "stores its colours as CMYK: calibrate from the camera's own RGB or grey files"
    )


def test_cmyk_jpeg_is_refused(write: Write) -> None:
    message = refusal(write("a.jpg", cmyk_jpeg()))

    assert message.startswith("stores its colours as CMYK: ")


def cmyk_jpeg() -> bytes:
    """8 by 8 pixels of four constant components, each one Huffman symbol long [ITU T.81]."""
    one_symbol = bytes([1] + [0] * 15) + b"\0"  # code 0 means: no difference, end of block
    return (
        b"\xff\xd8\xff\xdb"
        + pack(">HB", 67, 0)
        + bytes([1] * 64)
        + b"\xff\xc0"
        + pack(">HBHHB", 20, 8, 8, 8, 4)
        + b"".join(bytes([component, 0x11, 0]) for component in (1, 2, 3, 4))
        + b"".join(b"\xff\xc4" + pack(">HB", 20, table) + one_symbol for table in (0x00, 0x10))
        + b"\xff\xda"
        + pack(">HB", 14, 4)
        + b"".join(bytes([component, 0]) for component in (1, 2, 3, 4))
        + b"\0\x3f\0"
        + b"\0"
        + b"\xff\xd9"
    )


def test_more_than_four_channels_are_refused(save: Save, rng: np.random.Generator) -> None:
    message = refusal(save("a.tif", rng.integers(0, 256, (4, 4, 5), dtype=np.uint8)))

    assert message == "has 5 channels: save its red, green and blue alone"


def test_format_with_uncertain_levels_is_refused(save: Save, rgb: Pixels) -> None:
    message = refusal(save("a.tga", rgb))

    assert message == "is a targa file, whose levels are uncertain: use PNG, TIFF or JPEG files"


@pytest.mark.parametrize("suffix", [".dng", ".NEF", ".cr2"])
def test_raw_file_is_refused_rather_than_its_thumbnail_read(suffix: str, write: Write) -> None:
    message = refusal(write(f"a{suffix}", tiff_bytes(bytes(12), 4, 3)))

    assert message.startswith("is a raw file, whose levels are linear already: give the camera's")


def test_png_without_pixels_is_refused(write: Write, capfd: pytest.CaptureFixture[str]) -> None:
    assert refusal(write("a.png", png_bytes(b"", 0, 5)), capfd).startswith("has no pixels")


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.png", png_bytes(b"", 1 << 20, 1 << 20)),
        ("within-libpng-limits.png", png_bytes(b"", 1 << 19, 1 << 19)),
        ("a.pgm", b"P5 1000000 1000000 255\n"),
        ("within-pnm-limits.pgm", b"P5 65000 65000 255\n"),
        ("a.tif", tiff_bytes(bytes(12), 1 << 20, 1 << 20)),
    ],
)
def test_absurdly_large_header_is_refused(
    name: str, data: bytes, write: Write, capfd: pytest.CaptureFixture[str]
) -> None:
    assert refusal(write(name, data), capfd).startswith(TOO_LARGE)


def test_reason_of_the_library_is_kept_as_the_cause(write: Write) -> None:
    with pytest.raises(ImageError) as caught:
        read_frame(write("a.tif", tiff_bytes(bytes(12), 4, 3)[:-20]))

    assert isinstance(caught.value.__cause__, OSError)
    assert str(caught.value.__cause__)


# Manners


def test_nothing_is_printed_when_the_program_ends(write: Write, save: Save, rgb: Pixels) -> None:
    short = save("short.jpg", rgb)
    short.write_bytes(short.read_bytes()[:-40])
    paths = [short, write("notes.png", b"text"), write("cut.tif", tiff_bytes(bytes(9), 4, 3)[:40])]
    program = (
        "import sys\n"
        "from chartless.errors import ImageError\n"
        "from chartless.images import read_frame\n"
        "for path in sys.argv[1:]:\n"
        "    try:\n"
        "        read_frame(path)\n"
        "    except ImageError:\n"
        "        continue\n"
        "    raise SystemExit(path)\n"
    )

    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, paths)], capture_output=True, check=False
    )

    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_chartless_alone_does_not_import_openimageio() -> None:
    program = "import sys, chartless; raise SystemExit('OpenImageIO' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
