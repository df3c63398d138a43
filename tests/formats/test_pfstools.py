"""Responses of pfstools: pfshdrcalibrate itself applies ours, and files that it wrote are read."""

import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera
from programs import require

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.errors import CalibrationFileError
from chartless.flags import Flag
from chartless.formats import FORMATS, ExportSettings, export_response, import_response
from chartless.result.calibration import Calibration

Floats = npt.NDArray[np.float64]
LEVELS = np.arange(255, dtype=np.uint8)
"""All but white, which pfshdrcalibrate takes for overexposed."""


def three_columns(text: str) -> Floats:
    """Column of irradiance in each matrix of three columns, shape (curves, rows)."""
    blocks = [each.split("\n\n")[0] for each in text.split("# columns: ") if each[:2] == "3\n"]
    rows = [
        [line.split() for line in block.split("\n")[1:] if line.startswith(" ")] for block in blocks
    ]
    return np.array(rows, dtype=float)[:, :, 2]


def merged(folder: Path, picture: npt.NDArray[np.uint8], response: Path, *options: str) -> Floats:
    """X, Y, Z that pfshdrcalibrate makes of one exposure, shape (3, width).

    It gets 16 bits half a level above ours, as it multiplies by 255 and cuts the fraction off.
    """
    samples = (257 * picture.astype(int) + 128).astype(">u2")
    size = f"{picture.shape[1]} {picture.shape[0]}"
    (folder / "frame.ppm").write_bytes(f"P6\n{size}\n65535\n".encode() + samples.tobytes())
    (folder / "frame.hdrgen").write_text(f"{folder / 'frame.ppm'} 1.0 1.0 100 0\n")
    frames = subprocess.run(
        ["pfsinhdrgen", "frame.hdrgen"], cwd=folder, capture_output=True, check=True
    )
    merged = subprocess.run(
        ["pfshdrcalibrate", "--response-file", str(response), "-o", "0", *options],
        cwd=folder, input=frames.stdout, capture_output=True, check=True,
    )  # fmt: skip
    header, _, planes = merged.stdout.partition(b"ENDH")
    assert header.startswith(b"PFS1\n" + size.encode() + b"\n3\n")
    return np.frombuffer(planes, "<f4").reshape(3, picture.shape[1]).astype(float)


# From linear sRGB (IEC 61966-2-1), as which the program takes its input, to what it gives out.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


@pytest.mark.parametrize("curves", [CURVES, (ModelCurve("ameegc2-exact", (-1.0, 2.0, -1.0)),) * 3])
def test_pfshdrcalibrate_makes_a_picture_linear(
    curves: tuple[AbstractCurve, ...], tmp_path: Path
) -> None:
    require("pfstools", "pfsinhdrgen", "pfshdrcalibrate")
    camera = make_camera(*curves)
    export_response(camera, tmp_path / "camera.m", "pfstools")
    picture = np.stack([LEVELS, np.roll(LEVELS, 85), np.roll(LEVELS, 170)], axis=-1)[np.newaxis]

    seen = merged(tmp_path, picture, tmp_path / "camera.m")

    light = np.all(picture[0] > 0, axis=1)  # black is above 0 in our file, for its logarithm
    linear = camera.linearize(picture)[0, light].astype(float)
    matrix, *_ = np.linalg.lstsq(linear, seen[:, light].T)
    assert linear @ matrix == pytest.approx(seen[:, light].T, abs=1e-6)
    assert matrix.T / matrix.sum() * XYZ.sum() == pytest.approx(XYZ, abs=1e-4)


def test_pfshdrcalibrate_makes_luminance_linear(tmp_path: Path) -> None:
    require("pfstools", "pfsinhdrgen", "pfshdrcalibrate")
    camera = make_camera(CURVES[0])
    export_response(camera, tmp_path / "camera.m", "pfstools")
    picture = np.stack([LEVELS] * 3, axis=-1)[np.newaxis]

    _, seen, _ = merged(tmp_path, picture, tmp_path / "camera.m", "--luminance")

    wanted = camera.linearize(LEVELS[np.newaxis])[0].astype(float)
    scale = np.vdot(seen, wanted) / np.vdot(wanted, wanted)
    assert seen[1:] / scale == pytest.approx(wanted[1:], rel=1e-5)


def test_pfshdrcalibrate_keeps_our_numbers(tmp_path: Path) -> None:
    require("pfstools", "pfsinhdrgen", "pfshdrcalibrate")
    export_response(make_camera(*CURVES), tmp_path / "camera.m", "pfstools")
    picture = np.stack([LEVELS] * 3, axis=-1)[np.newaxis]

    merged(tmp_path, picture, tmp_path / "camera.m", "--save-response", "again.m")

    ours = three_columns((tmp_path / "camera.m").read_text())
    theirs = three_columns((tmp_path / "again.m").read_text())
    assert ours.shape == (3, 256)
    assert theirs == pytest.approx(ours, rel=1e-6)  # it writes seven digits


def test_a_file_of_pfshdrcalibrate(data_path: Path) -> None:
    path = data_path / "format_samples" / "pfstools_2.2.0_response.m"

    camera = import_response(path)

    assert [each.name for each in camera.channels] == ["R", "G", "B"]
    for response, column in zip(camera.channels, three_columns(path.read_text()), strict=True):
        assert response.method == "pfstools"
        assert response.inverse_lut[0] == 0
        assert response.inverse_lut[1:] == pytest.approx(column[1:] / column[-1], abs=2e-9)


def text_of(camera: Calibration, n_levels: int | None = None) -> str:
    encoded = FORMATS["pfstools"].encode(camera, ExportSettings(n_levels=n_levels))
    return encoded.content.decode()


@pytest.mark.parametrize("n_levels", [256, 1024])
def test_curves_rise_at_every_level_and_weights_stand_behind(n_levels: int) -> None:
    flat = SampledCurve((0.0, 1 - 1e-9, 1.0), (0.0, 0.5, 1.0))

    text = text_of(make_camera(flat, *CURVES[1:]), n_levels)

    table = three_columns(text).astype(np.float32)
    assert table.shape == (3, n_levels)
    assert np.all(table > 0)
    assert np.all(np.diff(table) > 0)
    assert text.index("# name: W\n") > text.index("# name: IB\n")
    weights = [
        float(line.split()[0]) for line in text.partition("columns: 2\n")[2].split("\n")[:-2]
    ]
    assert len(weights) == n_levels
    assert min(weights) == pytest.approx(np.exp(-4))


def test_levels_without_irradiance_were_not_seen(tmp_path: Path) -> None:
    lines = text_of(make_camera(CURVES[0])).split("\n")
    for level in (0, 1, 2, 100, 255):
        lines[6 + level] = f" -6.000000e+00 {level:4d} 0.000000e+00"
    (tmp_path / "gaps.m").write_text("\n".join(lines))

    camera = import_response(tmp_path / "gaps.m")

    (response,) = camera.channels
    assert response.name == "Y"
    assert response.observed_levels == (3, 254)
    assert camera.provenance["remarks"] == [
        f"{tmp_path / 'gaps.m'}: channel Y: filled 5 levels without value"
    ]
    low, _, high = CURVES[0].inverse(np.array([99, 100, 101]) / 255)
    last = CURVES[0].inverse(254 / 255)
    assert response.inverse_lut[100] == pytest.approx((low + high) / 2 / last, abs=1e-7)


def test_a_curve_that_falls_is_flagged(tmp_path: Path) -> None:
    lines = text_of(make_camera(CURVES[0])).split("\n")
    lines[6 + 100] = " -0.3  100 5.0e-01"
    (tmp_path / "falls.m").write_text("\n".join(lines))

    assert import_response(tmp_path / "falls.m").channels[0].flags == (Flag.NOT_MONOTONE,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("# rows: 256", "# rows: 255"), "different numbers of levels"),
        (
            ("# rows: 256", "# rows: 999999999"),
            ("a matrix of 999999999 rows is not a response curve"),
        ),
        (("# rows: 256", "# rows: -5"), "a matrix of -5 rows is not a response curve"),
        (("# rows: 256", "# rows: 300"), "the number of columns changed from 3 to "),
        (("# rows: 256", "# rows: 60000"), "a matrix of 60000 rows ends after "),
        (("# columns: 2", "# columns: 3"), "a matrix has 2 columns, not 3 as its header states"),
        (("   7 ", "   8 "), "levels are not 0, 1, 2"),
        (("   7 ", " seven "), "could not convert string 'seven' to float64 at row 7"),
        (("   7 ", " "), "the number of columns changed from 3 to 2 at row 8"),
        (("# columns: 3", "# colours: 3"), "its table has 2 channels, not 1 or 3"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    text = text_of(make_camera(*CURVES))
    assert change[0] in text
    (tmp_path / "bad.m").write_text(text.replace(*change, 1))

    with pytest.raises(CalibrationFileError, match="not a sound pfstools response") as caught:
        import_response(tmp_path / "bad.m", "pfstools")

    assert message in str(caught.value)
