"""Responses of AliceVision, read and applied as its source does."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera

from chartless.curves import AbstractCurve, ModelCurve
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, import_response


def alicevision(text: str) -> npt.NDArray[np.float32]:
    """Table of the program, shape (rows, 3); it stops at numbers below float32's normal ones."""
    lines = text.split("\n")
    assert lines.pop() == ""
    table = np.array([line.split(",")[1:4] for line in lines[1:]]).astype(np.float32)
    assert np.all((table == 0) | (table >= np.finfo(np.float32).tiny))
    return table


def text_of(*curves: AbstractCurve, n_levels: int | None = None) -> str:
    camera = make_camera(*curves)
    return FORMATS["alicevision"].encode(camera, ExportSettings(n_levels=n_levels)).content.decode()


@pytest.mark.parametrize(("n_levels", "n_rows"), [(None, 1024), (4096, 4096), (256, 256)])
def test_lines_between_its_rows_make_every_level_linear(n_levels: int | None, n_rows: int) -> None:
    table = alicevision(text_of(*CURVES, n_levels=n_levels))

    assert table.shape == (n_rows, 3)
    sample = np.arange(256) / 255
    place, fraction = np.divmod(sample * (n_rows - 1), 1)
    low = place.astype(int)
    high = np.minimum(low + 1, n_rows - 1)
    linear = (1 - fraction)[:, np.newaxis] * table[low] + fraction[:, np.newaxis] * table[high]
    levels = np.arange(256, dtype=np.uint8)
    picture = np.stack([levels] * 3, axis=-1)[np.newaxis]
    assert linear == pytest.approx(make_camera(*CURVES).linearize(picture)[0], abs=2e-7)


def test_a_grey_camera_has_three_equal_columns_and_a_steep_one_keeps_its_toe() -> None:
    steep = ModelCurve("gamma", (0.1,))

    table = alicevision(text_of(steep))

    assert np.all(table == table[:, :1])
    assert np.all(np.diff(table, axis=0) > 0)
    assert text_of(steep).split("\n")[0] == "rgbCurve,Red,Green,Blue,"


def test_a_file_as_the_program_writes_it(tmp_path: Path) -> None:
    """Six decimals; the name is that of the curve."""
    irradiance = np.linspace(0, 1, 1024)[:, np.newaxis] ** [2.2, 2.0, 1.8]
    rows = [
        f"{k},{''.join(f'{value:.6f},' for value in row)}\n" for k, row in enumerate(irradiance)
    ]
    path = tmp_path / "response_123.csv"
    path.write_text("response,Red,Green,Blue,\n" + "".join(rows))

    camera = import_response(path)

    assert [each.name for each in camera.channels] == ["R", "G", "B"]
    for response, column in zip(camera.channels, irradiance.T, strict=True):
        assert (response.method, response.n_levels) == ("alicevision", 1024)
        assert response.inverse_lut == pytest.approx(column, abs=6e-7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("\n9,", "\n9\n9,"), "invalid column index 1 at row 10"),
        (("\n9,", "\n9,dark"), "could not convert string 'dark"),
        (("\n", "\n0,0,0,0,\n" * 70_000), "rows, not 2 to 65536"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    text = text_of(*CURVES)
    assert change[0] in text
    (tmp_path / "bad.csv").write_text(text.replace(*change, 1))

    with pytest.raises(CalibrationFileError, match=message):
        import_response(tmp_path / "bad.csv")
