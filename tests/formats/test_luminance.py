"""Responses of Luminance HDR: its command line applies ours; a parser stands for older versions."""

import os
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from cameras import CURVES, make_camera
from programs import require

from chartless.curves import AbstractCurve, ModelCurve
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, export_response, import_response
from chartless.images import write_image

SIZE = 4096
LEVELS = np.arange(256, dtype=np.uint8)
PICTURE = np.stack([LEVELS, np.roll(LEVELS, 85), np.roll(LEVELS, 170)], axis=-1)[np.newaxis]


def merged(folder: Path, *options: str) -> npt.NDArray[np.float32]:
    """What the program makes of `PICTURE` alone, shape (256, 3)."""
    write_image(folder / "frame.tif", np.repeat(PICTURE, 16, axis=0) / 255, data_type="uint8")
    subprocess.run(
        ["luminance-hdr-cli", "-e", "0", "--hdrWeight", "flat", "--hdrModel", "robertson",
         *options, "-s", "merged.exr", "frame.tif"],
        cwd=folder, check=True, capture_output=True, timeout=300,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(folder)},
    )  # fmt: skip
    return oiio.ImageInput.open(str(folder / "merged.exr")).read_image("float")[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "curves", [CURVES, CURVES[:1], (ModelCurve("ameegc2-exact", (-1.0, 2.0, -1.0)),)]
)
def test_the_program_makes_a_picture_linear(
    curves: tuple[AbstractCurve, ...], tmp_path: Path
) -> None:
    require("luminance-hdr", "luminance-hdr-cli")
    camera = make_camera(*curves)
    export_response(camera, tmp_path / "camera.csv", "luminance")

    from_file = ("--hdrResponseCurve", "from_file", "--inputCameraResponseCurve", "camera.csv")
    seen = merged(tmp_path, *from_file)

    wanted = camera.linearize(PICTURE)[0]
    light = PICTURE[0] > 0  # black is above 0 in our file, for its logarithm
    assert seen[light] / seen.max() == pytest.approx(wanted[light], abs=1e-6)


@pytest.mark.slow
def test_a_file_of_the_program(tmp_path: Path) -> None:
    """Nine decimals of its own sRGB; black is as bright as the first row."""
    require("luminance-hdr", "luminance-hdr-cli")
    merged(tmp_path, "--hdrResponseCurve", "srgb", "--outputCameraResponseCurve", "theirs.csv")

    camera = import_response(tmp_path / "theirs.csv")

    assert [each.name for each in camera.channels] == ["R", "G", "B"]
    for response in camera.channels:
        assert (response.method, response.n_levels) == ("luminance", SIZE)
        wanted = CURVES[0].inverse(np.linspace(0, 1, SIZE))
        assert response.inverse_lut == pytest.approx(wanted, abs=1e-6)


def luminance(text: str) -> npt.NDArray[np.float32]:
    """Table of the older program, (3, 4096): "# rows:" first, then "# columns:", then the rows."""
    lines = iter(text.split("\n"))
    assert int(next(line for line in lines if line.startswith("# rows: "))[8:]) == SIZE
    assert int(next(line for line in lines if line.startswith("# columns: "))[11:]) == 7
    table = np.full((3, SIZE), np.nan, dtype=np.float32)
    for _ in range(SIZE):
        words = next(lines).split()
        assert len(words) == 7
        table[:, int(words[0])] = [np.float32(word) for word in words[2::2]]
    return table


def text_of(*curves: AbstractCurve) -> str:
    older = ExportSettings(suffix=".m")
    return FORMATS["luminance"].encode(make_camera(*curves), older).content.decode()


@pytest.mark.parametrize("curves", [CURVES, CURVES[:1]])
def test_the_older_program_reads_the_row_nearest_to_each_level(
    curves: tuple[AbstractCurve, ...],
) -> None:
    table = luminance(text_of(*curves))

    row = (LEVELS / 255 * (SIZE - 1) + 0.45).astype(int)
    assert np.all(np.diff(table) > 0)
    for column, curve in zip(table, 3 * curves if len(curves) == 1 else curves, strict=True):
        assert column[row[1:]] == pytest.approx(curve.inverse(LEVELS[1:] / 255), abs=2e-7)


def test_a_file_as_the_older_program_writes_it(tmp_path: Path) -> None:
    """Nine decimals, zeros where it has no more, one line for a row with a blank at its end."""
    irradiance = np.linspace(0, 1, SIZE)[:, np.newaxis] ** [2.2, 2.0, 1.8]
    irradiance[0] = irradiance[1]
    header = "# Camera response curve, channels Ir, Ig, Ib \n# data layout: …\n# type: matrix\n"
    rows = [
        f" {level:4d} " + "".join(f"{-6:15.9f} {value:15.9f} " for value in row) + "\n"
        for level, row in enumerate(irradiance)
    ]
    text = f"{header}# rows: {SIZE}\n# columns: 7\n{''.join(rows)}\n"
    (tmp_path / "luminance.m").write_text(text)

    camera = import_response(tmp_path / "luminance.m")

    assert camera.channels[0].method == "luminance"
    for response, column in zip(camera.channels, irradiance.T, strict=True):
        assert response.n_levels == SIZE
        assert response.inverse_lut[1:] == pytest.approx(column[1:], abs=3e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("# rows: 4096", "# rows: 4097"), "a matrix of 4097 rows ends after 4096"),
        (("# columns: 7", "# columns: 3"), "it has 0 matrices of 7 columns, not one"),
        (("\n   17 ", "\n   18 "), "levels are not 0, 1, 2"),
        (("# columns: 7", "# colours: 7"), "it has 0 matrices of 7 columns, not one"),
    ],
)
def test_damaged_matrices_are_refused(
    change: tuple[str, str], message: str, tmp_path: Path
) -> None:
    text = text_of(*CURVES)
    assert change[0] in text
    (tmp_path / "bad.m").write_text(text.replace(*change, 1))

    with pytest.raises(CalibrationFileError, match=message):
        import_response(tmp_path / "bad.m", "luminance")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("\n", "\n1,1\n"), "invalid column index 3 at row 1 with 2 columns"),
        (("\n", "\n,,,,,\n"), "could not convert string"),
        (("\n", "\n1,1,1,1,1,1\n" * 70_000), "rows, not 2 to 65536"),
    ],
)
def test_damaged_tables_are_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    export_response(make_camera(*CURVES), tmp_path / "bad.csv", "luminance")
    text = (tmp_path / "bad.csv").read_text()
    (tmp_path / "bad.csv").write_text(text.replace(*change, 1))

    with pytest.raises(CalibrationFileError, match=message):
        import_response(tmp_path / "bad.csv")
