"""Two-column curves: what fit and compare read is a calibration too, and the other way round."""

from pathlib import Path

import numpy as np
import pytest
from cameras import CURVES, make_camera
from slow_cases import slow_but

from chartless.cli import main
from chartless.curves.file import read_curve
from chartless.errors import CalibrationFileError
from chartless.formats import (
    FORMATS,
    ExportSettings,
    export_response,
    import_response,
    is_calibration,
)
from chartless.images import read_values, write_image

LEVELS = np.arange(256, dtype=np.uint8)
SAMPLES = "0,0\n0.1,0.4\n.5,0.7\n1,1\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "curve.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("n_levels", slow_but([2, 256, 65536], 2, 256))
def test_numpy_reads_irradiance_and_brightness(n_levels: int, tmp_path: Path) -> None:
    camera = make_camera(CURVES[1])
    export_response(camera, tmp_path / "a.csv", "curve", ExportSettings(n_levels=n_levels))

    irradiance, brightness = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1).T

    assert brightness == pytest.approx(np.arange(n_levels) / (n_levels - 1), abs=1e-12)
    assert irradiance == pytest.approx(brightness**2, abs=FORMATS["curve"].precision)
    assert np.all(np.diff(irradiance) > 0)
    assert (irradiance[0], irradiance[-1]) == (0, 1)


def test_of_three_channels_it_is_the_curve_of_greys(tmp_path: Path) -> None:
    camera = make_camera(*CURVES)
    lost, _ = export_response(camera, tmp_path / "a.csv", "curve")
    grey = camera.linearize(np.stack([LEVELS] * 3, axis=-1)[np.newaxis])[0]

    irradiance, _ = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1).T

    assert irradiance == pytest.approx(grey @ [0.299, 0.587, 0.114], abs=1e-6)
    assert "the channels became one, their luma" in lost


@pytest.mark.parametrize(
    "text",
    [
        SAMPLES,
        "irradiance,brightness\n" + SAMPLES,
        "# mine\n\nI B\n" + SAMPLES.replace(",", "\t"),
        SAMPLES.replace(",", " ; ").replace("\n", "\r\n"),
    ],
)
def test_it_is_the_curve_that_fit_reads(text: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)

    (response,) = import_response(path).channels

    assert (response.name, response.method, response.n_levels) == ("Y", "curve", 256)
    assert response.curve == read_curve(path)
    assert response.curve.inverse(0.55) == pytest.approx(0.3)


@pytest.mark.parametrize(
    "text",
    ["0\n1\n2\n3\n", "level,R,G,B\n0,0,0,0\n1,1,1,1\n", "1 2 3\n4 5 6\n", "a b\nc d\n", "# \n", ""],
)
def test_other_texts_are_none(text: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)

    assert not is_calibration(path) or import_response(path).channels[0].method != "curve"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "0.1,0.2\n0.9,1\n",
            "runs from (0, 0) to (1, 1), this one from (0.1, 0.2) to (0.9, 1): scale it or add",
        ),
        ("0,0\n.5,.6\n.4,.7\n1,1\n", "irradiance must increase strictly"),
        ("0,0\n1,1\n2\n", "line 3 is not two numbers, irradiance and brightness: '2'"),
        ("0,0\nnan,.5\n1,1\n", "irradiance must increase strictly"),
        ("0,0\n" * 400_000, "more lines than a table of 65536 levels"),
    ],
)
def test_what_is_no_curve_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)

    with pytest.raises(CalibrationFileError) as caught:
        import_response(path)

    assert str(caught.value).startswith(f"{path}: not a sound two-column curve file: ")
    assert message in str(caught.value)


def test_a_measured_curve_makes_pictures_linear(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, picture = written(tmp_path, SAMPLES), tmp_path / "picture.png"
    write_image(picture, LEVELS.reshape(16, 16, 1) / 255, data_type="uint8", linear=False)

    assert main(["linearize", str(path), str(picture), "-o", str(tmp_path / "light.exr")]) == 0
    assert main(["import", str(path), "-o", str(tmp_path / "camera.json")]) == 0
    assert "read as curve, two-column curve" in capsys.readouterr().out

    light = read_values(tmp_path / "light.exr").values.ravel()
    wanted = np.interp(LEVELS / 255, [0, 0.4, 0.7, 1], [0, 0.1, 0.5, 1])
    assert light == pytest.approx(wanted, abs=1e-6)


def test_fit_reads_what_export_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    export_response(make_camera(CURVES[1]), tmp_path / "a.csv", "curve")

    assert main(["fit", str(tmp_path / "a.csv"), "--model", "gamma"]) == 0

    parameters = capsys.readouterr().out.splitlines()[2].split()
    assert float(parameters[1]) == pytest.approx(0.5, abs=1e-6)
