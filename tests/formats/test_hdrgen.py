"""Responses of hdrgen, read and applied as its source does."""

from pathlib import Path

import numpy as np
import pytest
from cameras import CURVES, make_camera
from hypothesis import given
from hypothesis import strategies as st

from chartless.curves import ModelCurve, SampledCurve, SrgbCurve
from chartless.datasets import load_dorf
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, encode_response, export_response, import_response
from chartless.formats._base import Source
from chartless.types import Floats

LEVELS = np.linspace(0, 1, 256)
# As the program writes what it finds in a bracket of a camera: six digits and more.
FOUND = """\
4 2.5 -2.6 1.01 0.0875 0.0025
4 2.6 -2.75 1.07 0.0775 0.0025
4 3.2 -3.6 1.4 -0.005 0.005
"""


def hdrgen(text: str) -> Floats:
    """Light at each level, shape (256, 3): numbers in a row, polynomials, a straight toe."""
    words = iter(text.split())
    columns = []
    for _ in range(3):
        degree = int(next(words))
        assert 0 <= degree <= 5
        power = [float(next(words)) for _ in range(degree + 1)][::-1]
        light = [0.0] * 256
        toe = 256
        while toe > 19:
            x = (toe - 1 + 0.5) / 256
            value = sum(c * x**k for k, c in enumerate(power))
            slope = sum(k * c * x ** (k - 1) for k, c in enumerate(power) if k)
            if value <= 0 or slope <= 0:
                break
            toe -= 1
            light[toe] = value
        for level in range(toe):
            light[level] = light[toe] * (level + 0.5) / (toe + 0.5)
        columns.append(light)
    assert next(words, None) is None
    return np.array(columns).T


def written(folder: Path, text: str) -> Path:
    path = folder / "camera.rsp"
    path.write_text(text)
    return path


def test_the_program_applies_what_is_told() -> None:
    camera = make_camera(*CURVES)
    encoded = encode_response(camera, "hdrgen")

    light = hdrgen(encoded.content.decode())

    off = light / light[-1] - np.column_stack(
        [each.curve.inverse(LEVELS) for each in camera.channels]
    )
    assert np.abs(off[1:]).max() < 0.02
    assert np.all(np.diff(light, axis=0) > 0)
    coefficients = np.array(
        [line.split()[1:] for line in encoded.content.decode().splitlines()], float
    )
    assert coefficients.sum(axis=1) == pytest.approx(1, abs=1e-10)
    (told,) = encoded.lost
    assert told.startswith("what polynomials of degree 5 cannot follow: rms 0.0")


def test_polynomials_of_the_format_are_found_again() -> None:
    x = (np.arange(256) + 0.5) / 256
    light = 0.2 * x**5 + 0.1 * x**4 + 0.5 * x**2 + 0.19 * x + 0.01
    light[:19] = light[19] * x[:19] / x[19]
    table = light / light[-1]
    table[0] = 0
    curve = SampledCurve.from_inverse(table)

    line = encode_response(make_camera(curve), "hdrgen").content.decode().splitlines()[0]

    assert line.split()[0] == "5"
    assert np.array(line.split()[1:], float) == pytest.approx(
        [0.2, 0.1, 0, 0.5, 0.19, 0.01], abs=1e-6
    )


def test_a_file_as_the_program_writes_it(tmp_path: Path) -> None:
    camera = import_response(written(tmp_path, FOUND))

    light = hdrgen(FOUND)
    for response, column in zip(camera.channels, light.T, strict=True):
        assert response.method == "hdrgen"
        assert response.inverse_lut[1:] == pytest.approx(column[1:] / column[-1], abs=1e-8)
    assert camera.flags == {}
    assert camera.provenance["remarks"] == []


@pytest.mark.parametrize("text", [FOUND.replace("\n", "\r\n"), FOUND.replace(" ", "  ") + "\n"])
def test_other_blanks_and_line_ends(text: str, tmp_path: Path) -> None:
    camera = import_response(written(tmp_path, text))

    assert [each.method for each in camera.channels] == ["hdrgen"] * 3


def test_where_the_polynomial_falls_the_toe_is_straight(tmp_path: Path) -> None:
    text = "2 1.5 -0.6 0.1\n" * 3  # lowest at brightness 0.2

    (response, *_) = import_response(written(tmp_path, text)).channels

    light = hdrgen(text)[:, 0]
    assert response.inverse_lut[1:] == pytest.approx(light[1:] / light[-1], abs=1e-8)
    steps = np.diff(response.inverse_lut[1:51])
    assert steps == pytest.approx(steps[0], rel=1e-4)


def test_white_balance_is_remarked(tmp_path: Path) -> None:
    path = written(tmp_path, "1 3 0.5\n1 2.8 0.5\n1 2.6 0.5\n")

    camera = import_response(path)

    (remark,) = camera.provenance["remarks"]
    assert (
        remark == f"{path}: its white balance (3.5, 3.3, 3.1 at white) is no part of the response"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FOUND + "1 1 0\n", "it has 4 lines, not 3 for red, green and blue"),
        ("4 1 2 3\n" * 3, "a polynomial of degree 4 has 5 coefficients, not 3"),
        ("6 1 0 0 0 0 0 0\n" * 3, "a line begins with '6', not with a degree from 1 to 5"),
        ("0 1\n" * 3, "a line begins with '0', not with a degree from 1 to 5"),
        ("1.0 1 0\n" * 3, "a line begins with '1.0', not"),
        ("1 nan 0\n" * 3, "coefficients must be numbers up to 1e+06"),
        ("1 1e999 0\n" * 3, "coefficients must be numbers up to 1e+06"),
        ("1 x 0\n" * 3, "could not convert string to float"),
        ("1 -1 2\n" * 3, "a polynomial falls or is not above 0 at white"),
        ("1 1 -2\n" * 3, "a polynomial falls or is not above 0 at white"),
    ],
)
def test_damaged_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(CalibrationFileError) as caught:
        import_response(written(tmp_path, text), "hdrgen")

    assert message in str(caught.value)


def test_other_tables_of_numbers_are_none() -> None:
    for text in ("1 1 0\n1 1 0\n", "0 0\n1 1\n1 1\n", "1 2 3\n4 5 6\n7 8 9\n", ""):
        assert not FORMATS["hdrgen"].recognises(Source(Path("a"), text.encode()))


def test_a_grey_camera_has_three_equal_lines(tmp_path: Path) -> None:
    _, (path,) = export_response(make_camera(SrgbCurve()), tmp_path / "grey.rsp", "hdrgen")

    assert len(set(path.read_text().splitlines())) == 1
    assert len(path.read_text().splitlines()) == 3


@pytest.mark.slow
@given(
    parameters=st.tuples(st.floats(-2, 1), st.floats(0, 3), st.floats(-4, 4)),
)
def test_any_curve_gives_light_that_rises(parameters: tuple[float, ...]) -> None:
    camera = make_camera(ModelCurve("ameegc2-exact", parameters))

    light = hdrgen(encode_response(camera, "hdrgen").content.decode())

    assert np.all(np.diff(light, axis=0) > 0)


@pytest.mark.slow
def test_how_far_measured_cameras_are_from_polynomials(data_path: Path) -> None:
    dorf = load_dorf(data_path / "dorf")
    grid = np.linspace(0, 1, 1024)
    rms = []
    for row in dorf.distinct:
        nodes = np.maximum.accumulate(np.interp(grid, dorf.irradiance, dorf.curves[row]))
        nodes[[0, -1]] = 0, 1
        camera = make_camera(SampledCurve(tuple(grid.tolist()), tuple(nodes.tolist())))
        (told,) = encode_response(camera, "hdrgen").lost
        rms.append(float(told.partition("rms ")[2].partition(",")[0]))

    assert np.median(rms) <= 0.0016
    assert np.quantile(rms, 0.9) <= 0.013
