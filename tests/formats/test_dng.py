"""LinearizationTable of DNG: LibRaw applies ours, exiftool writes and prints it."""

import struct
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import rawpy
import tifffile
from cameras import CURVES, make_camera
from programs import require

from chartless.errors import CalibrationFileError
from chartless.formats import (
    FORMATS,
    ExportSettings,
    export_response,
    import_response,
    is_calibration,
    load_calibration,
)

LEVELS = np.arange(256, dtype=np.uint8)
MOSAIC = np.tile(LEVELS, (64, 1))

# What LibRaw wants of a DNG file: pattern of colours, versions, camera, white and colour matrix.
DNG = [
    (33421, "H", 2, (2, 2), True),
    (33422, "B", 4, (0, 1, 1, 2), True),
    (50706, "B", 4, (1, 4, 0, 0), True),
    (50707, "B", 4, (1, 1, 0, 0), True),
    (50708, "s", 0, "chartless", True),
    (50717, "I", 1, 65535, True),
    (50721, "2i", 9, (1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1), True),
    (50728, "2I", 3, (1, 1, 1, 1, 1, 1), True),
    (50778, "H", 1, 21, True),
]


def write_dng(path: Path, table: list[int] | None = None, byte_order: str = "<") -> None:
    """Raw picture of `MOSAIC`, stored through the table."""
    tags = [*DNG, *([] if table is None else [(50712, "H", len(table), table, True)])]
    with tifffile.TiffWriter(path, byteorder=byte_order) as file:
        file.write(MOSAIC.astype(np.uint16), photometric="CFA", extratags=tags)


def linear(path: Path) -> npt.NDArray[np.uint16]:
    with rawpy.imread(str(path)) as raw:
        return raw.raw_image.copy()


def test_libraw_makes_a_raw_picture_linear(tmp_path: Path) -> None:
    camera = make_camera(CURVES[0])
    export_response(camera, tmp_path / "table.txt", "dng")
    table = [int(line) for line in (tmp_path / "table.txt").read_text().splitlines()]
    write_dng(tmp_path / "raw.dng", table)

    assert np.array_equal(linear(tmp_path / "raw.dng"), np.array(table)[MOSAIC])
    assert linear(tmp_path / "raw.dng") == pytest.approx(65535 * camera.linearize(MOSAIC), abs=0.51)


def test_exiftool_puts_the_table_in_and_prints_it(tmp_path: Path) -> None:
    require("libimage-exiftool-perl", "exiftool")
    camera = make_camera(*CURVES)
    export_response(camera, tmp_path / "table.txt", "dng")
    write_dng(tmp_path / "raw.dng")
    assert np.array_equal(linear(tmp_path / "raw.dng"), MOSAIC)

    put = ["exiftool", "-q", "-IFD0:LinearizationTable<=table.txt", "raw.dng"]
    subprocess.run(put, cwd=tmp_path, check=True)
    printed = subprocess.run(
        ["exiftool", "-b", "-LinearizationTable", "raw.dng"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip

    grey = camera.linearize(np.stack([MOSAIC] * 3, axis=-1)) @ [0.299, 0.587, 0.114]
    assert linear(tmp_path / "raw.dng") == pytest.approx(65535 * grey, abs=0.51)
    (tmp_path / "printed.txt").write_bytes(printed.stdout)
    for name in ("printed.txt", "raw.dng"):
        (response,) = import_response(tmp_path / name).channels
        assert (response.method, response.name) == ("dng", "Y")
        assert response.inverse_lut == pytest.approx(grey[0], abs=1e-5)


def test_a_file_of_tifffile(data_path: Path) -> None:
    (response,) = import_response(data_path / "format_samples" / "gamma_t.dng").channels

    assert response.inverse_lut == pytest.approx((LEVELS / 255) ** 2.2, abs=1e-5)


@pytest.mark.parametrize("byte_order", ["<", ">"])
def test_either_byte_order_and_a_directory_within(byte_order: str, tmp_path: Path) -> None:
    """As cameras write them: a preview first, the raw picture in a directory below."""
    table = np.rint(65535 * (LEVELS / 255) ** 2).astype(int).tolist()
    with tifffile.TiffWriter(tmp_path / "raw.dng", byteorder=byte_order) as file:
        file.write(MOSAIC[:8], photometric="minisblack", subifds=2)
        file.write(MOSAIC, photometric="minisblack")
        file.write(MOSAIC, photometric="minisblack", extratags=[(50712, "H", 256, table, True)])

    (response,) = import_response(tmp_path / "raw.dng").channels

    assert response.inverse_lut == pytest.approx((LEVELS / 255) ** 2, abs=1e-5)


def test_deep_frames_get_a_table_of_all_their_values_and_the_toe_is_told() -> None:
    dng = FORMATS["dng"]
    steep = make_camera(CURVES[1])

    shallow = dng.encode(steep, ExportSettings())
    deep = dng.encode(make_camera(CURVES[1], n_levels=1024), ExportSettings(n_levels=65536))

    values = np.array(deep.content.split()).astype(int)
    assert len(shallow.content.split()) == 256
    assert values.size == 65536
    assert (values[0], values[-1]) == (0, 65535)
    together = values.size - np.unique(values).size
    assert deep.lost == (f"the difference of {together} neighbouring levels",)
    assert shallow.lost == ("the difference of 1 neighbouring levels",) or not shallow.lost


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"1 2 70000", "not all between 0 and 65535"),
        (b"1 2 " * 140_000, "longer than 65536 integers"),
        (b"7", "has 1 entries, not 2 to 65536"),
        (b"0 0 0", "channel Y has no irradiance above 0"),
        (b"1 2 x", "invalid literal"),
        (b"II*\0\x08\0\0\0\0\0\0\0\0\0", "has no LinearizationTable"),
        (b"II*\0\xff\xff\xff\xff", "not a sound DNG LinearizationTable file"),
        (b"MM\0*\0\0\0\x08", "not a sound DNG LinearizationTable file"),
    ],
)
def test_damaged_files_are_refused(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_bytes(content)

    with pytest.raises(CalibrationFileError, match=message):
        import_response(tmp_path / "bad.txt", "dng")


def test_directories_that_point_to_themselves_end(tmp_path: Path) -> None:
    loop = struct.pack("<4sIH2H2II", b"II*\0", 8, 1, 330, 4, 1, 8, 8)
    (tmp_path / "loop.dng").write_bytes(loop)

    with pytest.raises(CalibrationFileError, match="has no LinearizationTable"):
        import_response(tmp_path / "loop.dng", "dng")


def test_a_table_larger_than_its_file_is_refused(tmp_path: Path) -> None:
    huge = struct.pack("<4sIH2H2II", b"II*\0", 8, 1, 50712, 3, 0xFFFFFFFF, 8, 0)
    (tmp_path / "huge.dng").write_bytes(huge)

    with pytest.raises(CalibrationFileError, match="not a sound DNG LinearizationTable file"):
        import_response(tmp_path / "huge.dng", "dng")


@pytest.mark.parametrize("n_bytes", [4, 8, 100, None])
def test_a_picture_without_a_table_is_no_calibration(n_bytes: int | None, tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "photo.tif", MOSAIC)
    content = (tmp_path / "photo.tif").read_bytes()
    (tmp_path / "photo.tif").write_bytes(content[:n_bytes])

    assert not is_calibration(tmp_path / "photo.tif")
    with pytest.raises(CalibrationFileError, match="not a calibration file"):
        load_calibration(tmp_path / "photo.tif")
    with pytest.raises(CalibrationFileError, match="is not in a known format"):
        import_response(tmp_path / "photo.tif")
