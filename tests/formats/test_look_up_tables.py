"""Look-up tables in text: what OpenColorIO and FFmpeg make of ours, and we of others'."""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from cameras import CURVES, make_camera
from programs import LEVELS, Floats32, linearised_by_ffmpeg, linearised_by_ocio, ocio_processor

from chartless.errors import CalibrationFileError
from chartless.flags import Flag
from chartless.formats import (
    FORMATS,
    ExportSettings,
    encode_response,
    export_response,
    import_response,
)

NAMES = ("spi1d", "cube", "resolve", "csp", "clf")
GAMMAS = (2.2, 2.0, 1.8)
"""Of the samples."""
ROWS = "0 0 0\n0.1 0.2 0.3\n0.4 0.5 0.6\n2 1 0.8\n"


def text_of(name: str) -> str:
    return encode_response(make_camera(*CURVES), name).content.decode()


def written(folder: Path, text: str, name: str = "lut.txt") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


# What other programs make of our files


def assert_linearises(read: Callable[[Path], Floats32], name: str, folder: Path) -> None:
    for camera in (make_camera(*CURVES), make_camera(CURVES[0])):
        path = folder / f"camera{FORMATS[name].suffix}"
        export_response(camera, path, name)

        assert np.abs(read(path) - camera.linearize(LEVELS)[0]).max() <= FORMATS[name].precision


@pytest.mark.parametrize("name", NAMES)
def test_opencolorio_linearises_with_it(name: str, tmp_path: Path) -> None:
    assert_linearises(linearised_by_ocio, name, tmp_path)


@pytest.mark.parametrize("name", ["cube", "resolve", "csp"])
def test_ffmpeg_linearises_with_it(name: str, tmp_path: Path) -> None:
    assert_linearises(linearised_by_ffmpeg, name, tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_opencolorio_turns_it_round(name: str, tmp_path: Path) -> None:
    """Which needs entries that increase in float32."""
    path = tmp_path / f"camera{FORMATS[name].suffix}"
    camera = make_camera(*CURVES)
    export_response(camera, path, name)
    pixels = np.ascontiguousarray(camera.linearize(LEVELS)[0])

    ocio_processor(path, inverse=True).getDefaultCPUProcessor().applyRGB(pixels)

    assert pixels * 255 == pytest.approx(LEVELS[0], abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("n_levels", [2, 1000, 65536])
def test_tables_of_any_number_of_levels(name: str, n_levels: int, tmp_path: Path) -> None:
    path = tmp_path / f"camera{FORMATS[name].suffix}"
    camera = make_camera(CURVES[1])
    export_response(camera, path, name, ExportSettings(n_levels=n_levels))

    (lut,) = ocio_processor(path).createGroupTransform()
    at = n_levels // 3

    assert lut.getLength() == n_levels
    wanted = camera.channels[0].curve.inverse(at / (n_levels - 1))
    assert lut.getValue(at)[0] == pytest.approx(float(wanted), abs=6e-8)


def test_a_clf_says_what_it_is(tmp_path: Path) -> None:
    """And is named after its numbers: the same twice, another for other curves."""
    root = ET.fromstring(text_of("clf"))
    space = "{urn:AMPAS:CLF:v3.0}"

    assert [child.tag for child in root] == [
        f"{space}{name}"
        for name in (
            "Description", "Description", "InputDescriptor", "OutputDescriptor", "LUT1D",
        )
    ]  # fmt: skip
    assert root.get("compCLFversion") == "3.0"
    assert root.get("id") == ET.fromstring(text_of("clf")).get("id")
    grey = encode_response(make_camera(CURVES[0]), "clf").content
    assert root.get("id") != ET.fromstring(grey).get("id")
    metadata = ocio_processor(written(tmp_path, text_of("clf"), "a.clf")).getFormatMetadata()
    assert metadata.getID() == root.get("id")


# What we make of the files of others


@pytest.mark.parametrize(
    ("sample", "name"),
    [
        ("gamma_a.spi1d", "spi1d"),
        ("gamma_a.cube", "cube"),
        ("gamma_r.cube", "resolve"),
        ("gamma_a.clf", "clf"),
        ("gamma_a8.clf", "clf"),
    ],
)
def test_a_sample(sample: str, name: str, data_path: Path) -> None:
    camera = import_response(data_path / "format_samples" / sample)

    assert camera.bit_depth == 8
    assert camera.provenance["remarks"] == []
    for response, gamma in zip(camera.channels, GAMMAS, strict=True):
        assert response.method == name
        assert response.inverse_lut == pytest.approx((np.arange(256) / 255) ** gamma, abs=2e-9)


def cube(head: str, rows: str = ROWS) -> str:
    return f"{head}\n{rows}"


def spi1d(head: str, rows: str = ROWS) -> str:
    return f"Version 1\n{head}\nLength {rows.count(chr(10))}\n{{\n{rows}}}\n"


def csp(domain: str, rows: str = ROWS, notes: str = "") -> str:
    return f"CSPLUTV100\n1D\n\n{notes}{domain}\n\n{rows.count(chr(10))}\n{rows}"


def clf(attributes: str, rows: str = ROWS, dim: str = "4 3") -> str:
    return (
        '<ProcessList xmlns="urn:AMPAS:CLF:v3.0" id="a" compCLFversion="3.0">'
        f'<LUT1D {attributes}><Array dim="{dim}">{rows}</Array></LUT1D></ProcessList>'
    )


UNIT = "2\n0 1\n0 1\n"
FLOATS = 'inBitDepth="32f" outBitDepth="32f"'


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.spi1d", spi1d("From -0.125 1.125\nComponents 3")),
        ("a.spi1d", spi1d("Components 1\nFrom 0 1", "0\n.25\n5.0E-1\n+7\n")),
        ("a.cube", cube("# lut\nLUT_1D_SIZE 4\nDOMAIN_MIN -0.5 0 0\n# b\nDOMAIN_MAX 1 1.5 2")),
        ("a.cube", cube("LUT_1D_SIZE 4\nLUT_1D_INPUT_RANGE -1 2")),
        ("a.cube", cube('TITLE "1 2"\nlut_1d_size 4', ROWS.replace("\n", "\n# dark\n\n"))),
        ("a.csp", csp("2\n-1 1\n0 1\n2\n0 2\n0 1\n" + UNIT)),
        ("a.csp", csp(UNIT * 3, notes="BEGIN METADATA\n1 2\nEND METADATA\n")),
        ("a.clf", clf('inBitDepth="8i" outBitDepth="10i"', "0\n100 300 1023\n", "4 1")),
        ("a.clf", clf(FLOATS).replace("<LUT1D", "<!-- a --><Info/><Description/><LUT1D")),
        ("a.clf", clf(FLOATS, ROWS.replace("\n", " "))),
    ],
)
def test_it_is_read_as_opencolorio_does(name: str, text: str, tmp_path: Path) -> None:
    """Up to the scale of each channel and its irradiance at black."""
    path = written(tmp_path, text, name)
    theirs = linearised_by_ocio(path)

    camera = import_response(path)

    for response, column in zip(camera.channels, theirs.T, strict=False):
        curve = response.curve.inverse(np.arange(1, 256) / 255)
        assert curve == pytest.approx(column[1:] / column[-1], abs=3e-4)
    assert {each.flags for each in camera.channels} == {()}


def test_a_domain_of_its_own_is_remarked_on(tmp_path: Path) -> None:
    path = written(tmp_path, spi1d("From -1 2\nComponents 3"))

    (remark, *_) = import_response(path).provenance["remarks"]

    assert remark == f"{path}: read the part 0 … 1 of its domain -1 -1 -1 … 2 2 2, at 4096 levels"


def test_line_ends_and_names_do_not_matter(tmp_path: Path) -> None:
    for name in NAMES:
        path = tmp_path / "lut.dat"
        path.write_bytes(b"\xef\xbb\xbf" + text_of(name).replace("\n", "\r\n").encode())

        assert import_response(path).channels[0].method == name


def test_a_table_that_falls_is_flagged(tmp_path: Path) -> None:
    rows = "0 0 0\n0.5 0.5 0.5\n0.4 0.6 0.6\n1 1 1\n"

    camera = import_response(written(tmp_path, cube("LUT_1D_SIZE 4", rows)))

    assert [each.flags for each in camera.channels] == [(Flag.NOT_MONOTONE,), (), ()]


# Refusals


def refusal(text: str, folder: Path) -> str:
    path = written(folder, text)
    with pytest.raises(CalibrationFileError) as caught:
        import_response(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (cube("LUT_3D_SIZE 2"), "three dimensions, which mixes the channels"),
        (cube("LUT_1D_SIZE 4\nLUT_3D_SIZE 2"), "three dimensions, which mixes the channels"),
        (cube("LUT_1D_SIZE 5"), "should have 5 entries, not 4"),
        (cube("LUT_1D_SIZE 2000000000"), "should have 2000000000 entries, not 4"),
        (cube("LUT_1D_SIZE 65537", "0 0 0\n" * 65537), "65537 entries, more than 65536"),
        (cube("LUT_1D_SIZE 4", "0 0 0\n" * 400_000), "more lines than a table of"),
        (cube("LUT_1D_SIZE 4", "0 " * 40_000), "a line of 79999 characters"),
        (cube("LUT_1D_SIZE 4", "0 0\n" * 4), "'0 0' should be 3 numbers"),
        (cube("LUT_1D_SIZE 4\nDOMAIN_MAX 0 1 1"), "0 0 0 … 0 1 1 is not a range of brightness"),
        (cube("LUT_1D_SIZE 4\nDOMAIN_MIN nan 0 0"), "is not a range of brightness"),
        (cube("LUT_1D_SIZE 4\nDOMAIN_MIN -1e308 0 0"), "is not a range of brightness"),
        (cube("LUT_1D_SIZE 1", "1 1 1\n"), "fewer than two entries"),
        (cube("LUT_1D_SIZE 2", "1e308 0 0\n5e-324 1 1\n"), "channel R has no irradiance above 0"),
        (spi1d("Components 2", "0 0\n1 1\n"), "has 2 columns"),
        (spi1d("Components 3").replace("}", ""), "no table between braces, or it is cut short"),
        (spi1d("From 0 1"), "no 'COMPONENTS'"),
        (csp(UNIT * 3).replace("1D", "3D"), "not a table of one dimension"),
        (csp("3\n0 .5 1\n0 .2 1\n" + UNIT * 2), "has a curve before its table"),
        (csp("2\n0 1\n0 2\n" + UNIT * 2), "has a curve before its table"),
        (csp(UNIT * 2), "has a curve before its table"),
        ("CSPLUTV100\n1D\n" + UNIT * 3, "has no table, or it is cut short"),
        (clf(FLOATS, dim="5 3"), "should be of 5 × 3 numbers"),
        (clf(FLOATS, dim="3 3"), "should be of 3 × 3 numbers"),
        (clf(FLOATS, dim="999999999 3"), "is of 999999999 3, not of up to 65536"),
        (clf(FLOATS, dim=""), "is of no size"),
        (clf(FLOATS + ' halfDomain="true"'), "of the bits of half floats (halfDomain)"),
        (clf(FLOATS).replace("LUT1D", "LUT3D"), "holds LUT3D, Array: only a single LUT1D"),
        (clf(FLOATS).replace("<LUT1D", "<Range/><LUT1D"), "holds Range, LUT1D, Array"),
        (clf(FLOATS).replace("<Array", "<IndexMap/><Array"), "holds LUT1D, IndexMap, Array"),
        (clf(FLOATS) + "<!--" + "0 " * 40_000 + "-->", "more than one array"),
        (f'<!DOCTYPE x [<!ENTITY a "b">]>{clf(FLOATS)}', "declares a document type"),
        (clf(FLOATS).replace("</ProcessList>", ""), "no element found"),
        (clf(FLOATS).replace("</Array>", ""), "no array of numbers, or it is cut short"),
        ("<ProcessList>" + "<Array" * 100_000, "no array of numbers"),
        ("<ProcessList><Array>1</Array>" + "<a>" * 20_000, "no element found"),
    ],
)
def test_what_is_no_curve_is_refused(text: str, message: str, tmp_path: Path) -> None:
    assert message in refusal(text, tmp_path)
