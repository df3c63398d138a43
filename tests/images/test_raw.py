"""Raw files, written here with tifffile: what the sensor stored is what is read."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from raw_cameras import BAYER, XTRANS, Pixels, write_dng

from chartless.errors import ImageError
from chartless.images import is_raw, read_frame, read_raw, read_settings, read_values

SPAN = 4095 - 256


@pytest.fixture
def mosaic() -> Pixels:
    return np.random.default_rng(0).integers(200, 4300, (24, 36)).astype(np.uint16)


def spread(levels: Pixels, black: int = 256) -> Pixels:
    return np.rint(((levels - float(black)) * 65535 / (4095 - black)).clip(0, 65535))


def sites(mosaic: Pixels, pattern: Any) -> dict[int, Pixels]:
    """Of each colour, all its sites of a repeat: shape (rows, columns, sites)."""
    height, width = len(pattern), len(pattern[0])
    repeats = mosaic.reshape(mosaic.shape[0] // height, height, mosaic.shape[1] // width, width)
    repeats = repeats.swapaxes(1, 2).reshape(repeats.shape[0], repeats.shape[2], -1)
    return {colour: repeats[..., np.ravel(pattern) == colour] for colour in (0, 1, 2)}


PATTERNS = {"rggb": BAYER, "bggr": ((2, 1), (1, 0)), "gbrg": ((1, 2), (0, 1)), "x-trans": XTRANS}


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=list(PATTERNS))
def test_a_frame_has_one_site_of_each_colour(tmp_path: Path, mosaic: Pixels, pattern: Any) -> None:
    frame = read_frame(write_dng(tmp_path / "a.dng", mosaic, pattern=pattern), raw=True)

    first = {colour: each[..., 0] for colour, each in sites(mosaic, pattern).items()}
    expected = np.stack([spread(first[colour]) for colour in (0, 1, 2)], axis=-1)
    np.testing.assert_array_equal(frame.levels, expected)
    assert frame.levels.dtype == np.uint16
    assert frame.levels.flags.c_contiguous
    size = f"{len(pattern)} × {len(pattern)}"
    assert frame.remarks == (
        f"read levels 256 to 4095 of the sensor as 0 to 65535, one site of each colour in {size}",
    )
    assert len(frame.sha256) == 64


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=list(PATTERNS))
def test_light_is_the_mean_of_all_sites_of_a_colour(
    tmp_path: Path, mosaic: Pixels, pattern: Any
) -> None:
    raw = read_raw(write_dng(tmp_path / "a.dng", mosaic, pattern=pattern))

    groups = sites(mosaic, pattern)
    expected = [(groups[colour].mean(axis=-1) - 256) / SPAN for colour in (0, 1, 2)]
    np.testing.assert_allclose(raw.light, np.stack(expected, axis=-1), atol=1e-6)
    near = np.any([(groups[c] >= 256 + 0.95 * SPAN).any(axis=-1) for c in (0, 1, 2)], axis=0)
    np.testing.assert_array_equal(raw.saturated, near)
    assert raw.cell == (len(pattern), len(pattern))
    np.testing.assert_allclose(raw.white_balance, [2, 1, 1.6], rtol=1e-5)
    assert raw.error == pytest.approx(12**-0.5 / SPAN)


def test_a_sensor_without_colours_is_grey(tmp_path: Path, mosaic: Pixels) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic, pattern=None, neutral=(1, 1, 1))
    frame, raw = read_frame(path, raw=True), read_raw(path)

    np.testing.assert_array_equal(frame.levels[..., 0], spread(mosaic))
    assert frame.channel_names == ("Y",)
    means = mosaic.reshape(12, 2, 18, 2).mean(axis=(1, 3))
    expected = ((means - 256) / SPAN)[..., np.newaxis].repeat(3, axis=-1)
    np.testing.assert_allclose(raw.light, expected, atol=1e-6)
    np.testing.assert_array_equal(raw.white_balance, [1, 1, 1])


def test_odd_rows_and_columns_are_left_out(tmp_path: Path, mosaic: Pixels) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic[:23, :35])

    assert read_frame(path, raw=True).levels.shape == (11, 17, 3)
    assert read_raw(path).light.shape == (11, 17, 3)


def test_each_colour_has_its_own_black(tmp_path: Path, mosaic: Pixels) -> None:
    tags = [(50713, "H", 2, (2, 2), True)]
    path = write_dng(tmp_path / "a.dng", mosaic, black=(300, 256, 256, 128), tags=tags)
    frame = read_frame(path, raw=True)

    for channel, (row, column, black) in enumerate([(0, 0, 300), (0, 1, 256), (1, 1, 128)]):
        np.testing.assert_array_equal(
            frame.levels[..., channel], spread(mosaic[row::2, column::2], black)
        )


def test_libraw_applies_the_linearization_table(tmp_path: Path) -> None:
    table = np.rint(np.linspace(0, 1, 256) ** 2 * 4095).astype(np.uint16)
    stored = np.random.default_rng(1).integers(0, 256, (32, 32)).astype(np.uint16)
    tags = [(50712, "H", 256, tuple(table.tolist()), True)]
    path = write_dng(tmp_path / "a.dng", stored, black=0, tags=tags)

    levels = read_frame(path, raw=True).levels[..., 0]
    np.testing.assert_array_equal(levels, spread(table[stored[::2, ::2]], 0))


def test_a_table_of_another_program(data_path: Path) -> None:
    path = data_path / "format_samples" / "gamma_t.dng"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        table = np.array(page.tags[50712].value)
        stored = page.asarray()

    levels = read_frame(path, raw=True).levels
    np.testing.assert_array_equal(levels[..., 0], table[stored[::2, ::2]])


@pytest.mark.parametrize(("stored", "expected"), [(1, 1), (3, 3), (6, 6), (8, 8)])
def test_orientation_is_kept_and_pixels_are_not_turned(
    tmp_path: Path, mosaic: Pixels, stored: int, expected: int
) -> None:
    frame = read_frame(write_dng(tmp_path / "a.dng", mosaic, orientation=stored), raw=True)

    assert frame.orientation == expected
    assert frame.levels.shape == (12, 18, 3)


def test_exposure_is_read(tmp_path: Path, mosaic: Pixels) -> None:
    tags = [
        (33434, "2I", 1, (1, 50), True),
        (33437, "2I", 1, (28, 10), True),
    ]
    path = write_dng(tmp_path / "a.dng", mosaic, tags=tags)

    for settings in (read_settings(path, raw=True), read_frame(path, raw=True).settings):
        assert settings.exposure_time == pytest.approx(0.02)
        assert settings.f_number == pytest.approx(2.8)
        assert settings.iso is None
    plain = read_settings(write_dng(tmp_path / "b.dng", mosaic), raw=True)
    assert (plain.exposure_time, plain.f_number, plain.iso) == (None, None, None)


def test_a_file_without_white_balance_has_none(tmp_path: Path, mosaic: Pixels) -> None:
    raw = read_raw(write_dng(tmp_path / "a.dng", mosaic, neutral=(1, 1, 1)))

    np.testing.assert_allclose(raw.white_balance, [1, 1, 1], rtol=1e-5)


# What is refused


def refusal(path: Path, capfd: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(ImageError) as caught:
        read_raw(path)
    assert caught.value.args[0] == str(path)
    assert capfd.readouterr().err == ""
    return str(caught.value.args[1])


def test_half_a_file_is_refused_in_one_line(
    tmp_path: Path, mosaic: Pixels, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic)
    path.write_bytes(path.read_bytes()[:-400])

    assert refusal(path, capfd).startswith("is damaged or cut short")


def test_what_is_no_raw_file_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.CR2"
    path.write_bytes(b"no picture at all" * 50)

    assert refusal(path, capfd).startswith("is not a raw file that LibRaw ")


def test_a_finished_picture_is_no_raw_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((8, 8, 3), np.uint8), photometric="rgb")

    assert refusal(path, capfd).startswith("is not a raw file that LibRaw ")


def test_a_demosaiced_dng_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.dng"
    tags = [
        (50706, "B", 4, bytes([1, 4, 0, 0]), True),
        (50708, "s", 0, "simulated", True),
        (50717, "H", 3, (4095,) * 3, True),
        (50728, "2I", 3, (1, 1) * 3, True),
    ]
    pixels = np.full((32, 32, 3), 100, np.uint16)
    tifffile.imwrite(path, pixels, photometric=34892, extratags=tags, metadata=None)

    assert refusal(path, capfd).startswith("holds pixels that its maker or a converter made")


def test_black_above_white_is_refused(
    tmp_path: Path, mosaic: Pixels, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic, black=4095, white=4095)

    assert refusal(path, capfd) == "has black at 4095 and white at 4095: no levels between"


def test_missing_files_and_folders_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert refusal(tmp_path / "none.dng", capfd) == "does not exist: check the name"
    assert refusal(tmp_path, capfd) == "is a folder: name the pictures in it"


def test_without_rawpy_the_line_says_how_to_get_it(
    tmp_path: Path, mosaic: Pixels, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic)
    monkeypatch.setitem(sys.modules, "rawpy", None)

    with pytest.raises(ImageError, match=r"a\.dng: .* pip install '\.\[raw\]'$"):
        read_raw(path)
    with pytest.raises(ImageError, match=r"a\.dng: .* pip install '\.\[raw\]'$"):
        read_frame(path, raw=True)


def test_raw_files_are_not_taken_for_finished_pictures(tmp_path: Path, mosaic: Pixels) -> None:
    path = write_dng(tmp_path / "a.dng", mosaic)

    for read in (read_frame, read_settings, read_values):
        with pytest.raises(ImageError, match="is a raw file, whose levels are linear already"):
            read(path)


def test_raw_files_are_known_by_name() -> None:
    assert is_raw(Path("a.CR2"))
    assert not is_raw(Path("a.jpg"))
