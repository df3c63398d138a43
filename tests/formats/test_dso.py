"""Responses of DSO, read and applied as its source does."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from cameras import CURVES, make_camera
from hypothesis import given
from hypothesis import strategies as st

from chartless.curves import SampledCurve
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, export_response, import_response
from chartless.result.calibration import Calibration

SIZE = ExportSettings(size=(64, 48))
GREY = np.arange(256, dtype=np.uint8)


def dso(text: str) -> npt.NDArray[np.float32]:
    """Table of the program: floats of the first line, strictly increasing, scaled to 0 … 255."""
    values = np.array(text.partition("\n")[0].split()).astype(np.float32)
    assert values.size == 256
    assert np.all(np.isfinite(values))
    assert np.all((values == 0) | (values >= np.finfo(np.float32).tiny))
    assert np.all(np.diff(values) > 0)
    return 255 * (values - values[0]) / (values[-1] - values[0])


def text_of(camera: Calibration) -> str:
    return FORMATS["dso"].encode(camera, SIZE).content.decode()


def test_the_program_makes_every_level_linear() -> None:
    camera = make_camera(CURVES[0])

    table = dso(text_of(camera))

    assert table == pytest.approx(255 * camera.linearize(GREY[np.newaxis])[0], abs=3e-5)
    assert text_of(camera).split()[0] == "0.00000000e+00"
    assert text_of(camera).split()[-1] == "2.55000000e+02"


def test_of_three_channels_it_has_the_luma_of_what_is_grey() -> None:
    camera = make_camera(*CURVES)

    table = dso(text_of(camera))

    linear = camera.linearize(np.stack([GREY] * 3, axis=-1)[np.newaxis])[0]
    assert table == pytest.approx(255 * linear @ [0.299, 0.587, 0.114], abs=3e-5)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20), st.floats(0, 1e-30))
def test_flat_curves_increase_for_the_program(steps: list[float], toe: float) -> None:
    """Also where many levels have one irradiance to all digits of float32."""
    places = np.sort(np.array([0, toe, *steps, 1]))
    irradiance = np.unique(np.append(places, np.nextafter(1, 0)))
    curve = SampledCurve(tuple(irradiance.tolist()), tuple(np.linspace(0, 1, irradiance.size)))

    text = text_of(make_camera(curve))

    table = dso(text)
    assert text.split()[-1] == "2.55000000e+02"
    assert table == pytest.approx(255 * curve.inverse(GREY / 255), abs=0.02)


def test_a_vignette_of_the_cameras_size_without_attenuation(tmp_path: Path) -> None:
    _, files = export_response(make_camera(*CURVES), tmp_path / "pcalib.txt", "dso", SIZE)

    assert files == (tmp_path / "pcalib.txt", tmp_path / "vignette.png")
    picture = oiio.ImageInput.open(str(files[1]))
    spec = picture.spec()
    assert (spec.width, spec.height, spec.nchannels, str(spec.format)) == (64, 48, 1, "uint16")
    assert np.all(picture.read_image("uint16") == 65535)


def test_a_file_as_the_calibration_tool_writes_it(tmp_path: Path) -> None:
    """Fifteen digits, a blank at the end of the line, a scale and a black of its own."""
    irradiance = 3 + 40 * (GREY / 255) ** 2.2
    text = "".join(f"{value:.15g} " for value in irradiance) + "\nand what else there may be\n"
    (tmp_path / "pcalib.txt").write_text(text)

    (response,) = import_response(tmp_path / "pcalib.txt").channels

    assert (response.method, response.name) == ("dso", "Y")
    assert response.inverse_lut == pytest.approx((GREY / 255) ** 2.2, abs=2e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.5 2.5 3.5", "first line does not have 256 to 65536 numbers"),
        ("\n" + "1.5 " * 300, "first line does not have 256 to 65536 numbers"),
        ("1.5 " * 70_000, "first line does not have 256 to 65536 numbers"),
        ("1 " * 2_000_000, "first line does not have 256 to 65536 numbers"),
        ("nan " * 256, "not all its numbers are finite"),
        ("1e999 " * 256, "not all its numbers are finite"),
        ("1.5 " * 255 + "--", "could not convert string to float"),
        ("1.5 " * 256, "channel Y has no irradiance above 0"),
    ],
)
def test_damaged_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "pcalib.txt").write_text(text)

    with pytest.raises(CalibrationFileError, match=message):
        import_response(tmp_path / "pcalib.txt", "dso")
