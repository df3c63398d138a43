"""Projects of Hugin: what nona makes of them, and of ours; copies, links, faults."""

import re
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from cameras import CURVES, make_camera
from programs import program

from chartless.cli import main
from chartless.curves import AbstractCurve, ModelCurve, SampledCurve, SrgbCurve
from chartless.datasets import load_dorf
from chartless.errors import CalibrationFileError
from chartless.flags import Flag
from chartless.formats import (
    ExportSettings,
    Hugin,
    encode_response,
    export_response,
    import_response,
)
from chartless.formats._base import Source
from chartless.formats.calibration_file import load, save
from chartless.formats.hugin import COEFFICIENTS
from chartless.images import write_image
from chartless.result.calibration import Calibration

Floats = npt.NDArray[np.float64]
GRID = np.linspace(0, 1, 1024)
LEVELS = np.linspace(0, 1, 256)
RAMP = np.repeat(np.arange(256, dtype=np.uint8).reshape(16, 16, 1), 3, axis=2)
SETTINGS = ExportSettings(size=(16, 16))
HEAD = 'p f0 w16 h16 v50 E0 R1 T"FLOAT" n"TIFF c:NONE"\nm i6\n'
REST = "Eev0 Er1 Eb1 r0 p0 y0 Va1 Vb0 Vc0 Vd0 Vm5"


def project(folder: Path, *pictures: str, rest: str = REST) -> Path:
    """Project of pictures with these parameters of the response."""
    path = folder / "camera.pto"
    lines = [f'i w16 h16 f0 v50 {each} {rest} n"ramp.tif"\n' for each in pictures]
    path.write_text(HEAD + "".join(lines))
    return path


def coefficients(text: str) -> Floats:
    return np.array([float(re.search(rf" {name}(\S+)", text)[1]) for name in COEFFICIENTS])


def as_nona_has_it(path: Path, *options: str) -> Floats:
    """Light that nona makes of a ramp with a project, shape (16, 16, 3)."""
    folder = path.parent
    write_image(folder / "ramp.tif", RAMP / 255, data_type="uint8")
    command = [program("nona", "hugin-tools"), "-o", "out.tif", *options, path.name, "ramp.tif"]
    if options:  # of a picture in the project
        del command[-1]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return np.asarray(oiio.ImageBuf(str(folder / "out.tif")).get_pixels("double"))[..., :3]


def as_nona_inverts(camera: Calibration) -> Floats:
    """Light of the ramp by a table of 1024 brightnesses and lines between them.

    It is what nona 2022 does, and differs from the inverse where that nearly jumps.
    """
    table = camera.channels[0].curve.inverse(GRID)
    return np.interp(RAMP / 255, GRID, table)


def told(lost: tuple[str, ...], what: str) -> float:
    """A number in what an export says that it lost."""
    return float(re.search(rf"{what} (\.\d+|0\.\d+)", " ".join(lost))[1])


def refusal(path: Path) -> str:
    with pytest.raises(CalibrationFileError) as caught:
        import_response(path, "hugin")
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line


# What nona 2022.0.0 returned for levels 1, 20, 64, 128, 200 and 254, by hand and rounded.
GOLDEN = {
    "Ra0": [0.00043, 0.01900, 0.09103, 0.23680, 0.53954, 0.98796],
    "Ra1": [0.00052, 0.02218, 0.10573, 0.27129, 0.59043, 0.99049],
    "Rt1": [0.00392, 0.07843, 0.25098, 0.50196, 0.78431, 0.99608],
}


@pytest.mark.parametrize("response", GOLDEN)
def test_light_as_nona_printed_it(response: str, tmp_path: Path) -> None:
    camera = import_response(project(tmp_path, response))

    inverse = camera.channels[0].inverse_lut
    assert inverse[[1, 20, 64, 128, 200, 254]] == pytest.approx(GOLDEN[response], abs=5.1e-6)
    assert (inverse[0], inverse[-1]) == (0, 1)


def test_the_curves_are_those_published(data_path: Path, tmp_path: Path) -> None:
    text = (data_path / "emor" / "emor.txt").read_text()
    blocks = [each.split() for each in re.split(r"^.*=\s*$", text, flags=re.MULTILINE)]
    mean, *components = np.array(blocks[2:8], dtype=float)

    def nodes(response: str) -> Floats:
        return import_response(project(tmp_path, response)).channels[0].response_lut

    assert nodes("") == pytest.approx(mean, abs=2e-7)
    for name, component in zip(COEFFICIENTS, components, strict=True):
        assert nodes(f"{name}0.1") == pytest.approx(mean + 0.1 * component, abs=2e-7)


@pytest.mark.parametrize(
    "curves",
    [(each,) for each in CURVES] + [CURVES, (ModelCurve("ameegc2-exact", (-1.5, 0.0, 2.0)),)],
    ids=["sRGB", "square root", "steep", "three", "kept from falling"],
)
def test_nona_applies_what_was_exported(curves: tuple[AbstractCurve, ...], tmp_path: Path) -> None:
    path, camera = tmp_path / "camera.pto", make_camera(*curves)
    export_response(camera, path, "hugin", SETTINGS)

    light = as_nona_has_it(path)

    assert light == pytest.approx(as_nona_inverts(import_response(path)), abs=2e-5)
    lost = encode_response(camera, "hugin").lost
    if len(curves) == 1 and "(increasing)" in lost[-1]:
        most = told(lost, "brightness, max")
        assert np.abs(light - camera.linearize(RAMP)).max() == pytest.approx(most, abs=7e-5)


@pytest.mark.parametrize("response", ["Ra0.5 Rb3 Rc-1 Rd0.3 Re0", "Ra0 Rb0 Rc0 Rd0 Re0.3", "Rt1"])
def test_nona_repairs_curves_that_fall_or_exceed_white_alike(response: str, tmp_path: Path) -> None:
    path = project(tmp_path, response)

    camera = import_response(path)

    assert (camera.channels[0].flags == (Flag.NOT_MONOTONE,)) == (response != "Rt1")
    assert as_nona_has_it(path) == pytest.approx(as_nona_inverts(camera), abs=1e-6)


def test_nona_and_linearize_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(make_camera(SrgbCurve()), tmp_path / "camera.json")
    write_image(tmp_path / "level.png", RAMP / 255, data_type="uint8")
    names = [
        str(tmp_path / each) for each in ("camera.json", "camera.pto", "level.png", "ours.tif")
    ]

    assert main(["export", names[0], "--to", "hugin", "--size", "16x16", "-o", names[1]]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert main(["linearize", names[0], names[2], "-o", names[3]]) == 0

    ours = np.asarray(oiio.ImageBuf(names[3]).get_pixels("double"))
    theirs = as_nona_has_it(tmp_path / "camera.pto")
    assert np.abs(ours - theirs).max() == pytest.approx(told((line,), "brightness, max"), abs=7e-5)


# What an export chooses


def test_the_fit_is_that_of_least_squares() -> None:
    """Of sRGB, whose nearest member increases, so that no inequality is at work."""
    camera = make_camera(SrgbCurve())
    encoded = encode_response(camera, "hugin")
    found = coefficients(encoded.content.decode())
    members = [unit_response(each) for each in np.vstack([np.zeros(5), 0.1 * np.eye(5)])]

    design = np.array([(each - members[0]) / 0.1 for each in members[1:]]).T
    wanted = camera.channels[0].response_lut - members[0]
    solution = np.linalg.lstsq(design, wanted, rcond=None)[0]

    assert found == pytest.approx(solution, abs=1e-5)
    rest = wanted - design @ solution
    assert told(encoded.lost, "rms") == pytest.approx(np.sqrt(np.mean(rest**2)), abs=6e-5)
    assert told(encoded.lost, "max") == pytest.approx(np.abs(rest).max(), abs=6e-5)
    assert "(increasing)" in encoded.lost[-1]


def unit_response(values: Floats) -> Floats:
    """Nodes of the member of these coefficients."""
    response = " ".join(f"{name}{value}" for name, value in zip(COEFFICIENTS, values, strict=True))
    source = Source(Path("camera.pto"), f"{HEAD}i w16 h16 f0 v50 {response}\n".encode())
    return Hugin().decode(source).channels[0].response_lut


def test_a_fit_that_would_fall_is_kept_from_it(tmp_path: Path) -> None:
    camera = make_camera(ModelCurve("ameegc2-exact", (-1.5, 0.0, 2.0)))

    encoded = encode_response(camera, "hugin")

    assert "(kept from falling)" in encoded.lost[-1]
    path = project(tmp_path, " ".join(re.findall(r"R[a-e]\S+", encoded.content.decode())))
    assert import_response(path).flags == {}
    path = project(tmp_path, "Ra0 Rb0 Rc0 Rd0 Re0.3")
    assert import_response(path).flags == {Flag.NOT_MONOTONE: ["Y"]}


def test_three_channels_become_their_mean() -> None:
    camera = make_camera(*CURVES)
    curves = np.array([each.response_lut for each in camera.channels])
    mean = curves.mean(axis=0)
    nodes = tuple(mean.tolist())

    three = encode_response(camera, "hugin", SETTINGS)
    one = encode_response(make_camera(SampledCurve(tuple(GRID.tolist()), nodes)), "hugin", SETTINGS)

    assert coefficients(three.content.decode()) == pytest.approx(
        coefficients(one.content.decode()), abs=1e-6
    )
    assert told(three.lost, "by up to") == pytest.approx(np.abs(curves - mean).max(), abs=6e-5)
    assert len(one.lost) == 2  # vignetting, and how near the family comes


def test_how_far_measured_cameras_are_from_hugin_s(data_path: Path) -> None:
    dorf = load_dorf(data_path / "dorf")
    curves = [np.interp(GRID, dorf.irradiance, dorf.curves[each]) for each in dorf.distinct]
    cameras = [
        make_camera(SampledCurve(tuple(GRID.tolist()), tuple(each.tolist()))) for each in curves
    ]

    lost = [encode_response(each, "hugin").lost for each in cameras]

    rms = np.array([told(each, "rms") for each in lost])
    light = np.array([told(each, "brightness, max") for each in lost])
    assert np.median(rms) < 0.0016
    assert np.median(light) < 0.0066
    assert np.quantile(light, 0.9) < 0.042
    assert light.max() < 0.15


# Copies of projects

MADE = """\
# hugin project file
p f2 w3000 h1500 v360  k0 E0 R0 n"TIFF_m c:LZW r:CROP"\r
#-hugin  cropFactor=1
i w16 h16 f0 v50 Ra0 Rb-0.5 Rc1e-3 Rd0 Re0 Eev12 Er1 Eb1 r0 p0 y0 Vm5 n"a Ra9 \xe9.tif"\r
i w16 h16 f0 v=0 Ra=0 Rb=0 Rc=0 Rd=0 Re=0 Eev0 Er1 Eb1 r0 p0 y0 Vm5 n"ramp.tif"
i w16 h16 f0 v50 Rt1 Rb3 Eev0 r0 p0 y0 Vm5 n"ramp.tif"
v Ra0
v Eev1
i
image Ra7
"""


def test_a_copy_differs_in_the_coefficients_alone(tmp_path: Path) -> None:
    path = tmp_path / "made.pto"
    path.write_bytes(MADE.encode("latin-1"))

    encoded = encode_response(make_camera(SrgbCurve()), "hugin", ExportSettings(project=path))

    alone = encode_response(make_camera(SrgbCurve()), "hugin").content.decode()
    ra, rb, rc, rd, re_ = re.findall(r"R[a-e]\S+", alone)
    wanted = MADE.replace("v50 Ra0 Rb-0.5 Rc1e-3 Rd0 Re0", f"v50 {ra} {rb} {rc} {rd} {re_}")
    wanted = wanted.replace(
        "i w16 h16 f0 v50 Rt1 Rb3", f"i {ra} {rc} {rd} {re_} w16 h16 f0 v50 Rt0 {rb}"
    )
    assert encoded.content == wanted.encode("latin-1")


def test_nona_reads_a_copy_with_links(tmp_path: Path) -> None:
    made = project(tmp_path, "Ra1 Rb0 Rc0 Rd0 Re0", "Ra=0 Rb=0 Rc=0 Rd=0 Re=0", "Rt1")
    camera = make_camera(SrgbCurve())
    export_response(camera, tmp_path / "copy.pto", "hugin", ExportSettings(project=made))

    wanted = import_response(tmp_path / "copy.pto").linearize(RAMP)

    assert np.abs(wanted - camera.linearize(RAMP)).max() < 0.005
    for picture in "012":
        light = as_nona_has_it(tmp_path / "copy.pto", "-i", picture)
        assert light == pytest.approx(wanted, abs=2e-5)


def test_projects_that_cannot_be_copied(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save(make_camera(SrgbCurve()), tmp_path / "camera.json")
    (tmp_path / "empty.pto").write_text("p f0 w16 h16 v50\n")

    messages = {"none": "cannot be read: No such", "empty": "no Hugin project to copy: it has no"}
    for name, message in messages.items():
        made = tmp_path / f"{name}.pto"
        arguments = ["--to", "hugin", "--project", str(made), "-o", str(tmp_path / "out.pto")]
        assert main(["export", str(tmp_path / "camera.json"), *arguments]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"chartless: error: {made}: {message}")
        assert not (tmp_path / "out.pto").exists()


# What is read


def test_a_project_that_nona_read(data_path: Path, tmp_path: Path) -> None:
    camera = import_response(data_path / "format_samples" / "hugin_emor0.pto")

    (response,) = camera.channels
    assert (response.name, response.method, response.n_levels) == ("Y", "hugin", 256)
    assert response.inverse_lut[[1, 128, 254]] == pytest.approx(
        [0.00043, 0.2368, 0.98796], abs=6e-6
    )
    assert response.noise is None
    assert response.flags == ()
    assert camera.provenance["remarks"] == []


def test_an_imported_curve_survives_the_calibration_file(tmp_path: Path) -> None:
    path = project(tmp_path, "Ra0.5 Rb3 Rc-1 Rd0.3 Re0")
    camera = import_response(path)
    save(camera, tmp_path / "camera.json")

    again = load(tmp_path / "camera.json")

    assert again.channels[0].inverse_lut == pytest.approx(camera.channels[0].inverse_lut, abs=1e-12)


def test_names_of_files_are_no_coefficients(tmp_path: Path) -> None:
    path = project(tmp_path, "Ra1")
    plain = import_response(path).channels[0].inverse_lut
    path.write_text(path.read_text().replace('n"ramp.tif"', 'n"my Ra9 Eev3 photos/ramp.tif"'))

    camera = import_response(path)

    assert np.array_equal(camera.channels[0].inverse_lut, plain)
    assert camera.provenance["remarks"] == []


def test_links_are_followed(tmp_path: Path) -> None:
    linked = import_response(project(tmp_path, "Ra1 Rb0.1", "Ra=0 Rb=0", "Ra=1 Rb0.1"))
    plain = import_response(project(tmp_path, "Ra1 Rb0.1"))

    assert np.array_equal(linked.channels[0].inverse_lut, plain.channels[0].inverse_lut)


def test_what_is_no_part_of_the_curve_is_remarked(tmp_path: Path) -> None:
    rest = "Eev12.5 Er1 Eb1.1 Va=0 Vb0 Vc-0.2 Vd0 Vx3 Vm5"
    path = project(tmp_path, "Ra1", rest=rest)

    camera = import_response(path)

    assert camera.provenance["remarks"] == [
        f"{path}: exposure, white balance and vignetting (Eev, Eb, Vc) are not part of it"
    ]


@pytest.mark.parametrize(
    ("pictures", "message"),
    [
        (["Ra1", "Ra=0", "Ra0"], "picture 2 has a different response from picture 0: keep the"),
        (["Ra1", "Ra1 Rt1"], "picture 1 has a different response from picture 0"),
        (["Rt2"], "a response of type Rt2, for which a project holds no curve"),
        (["Ra=0"], "Ra=0 of picture 0 is not an earlier picture"),
        (["Ra1", "Ra=7"], "Ra=7 of picture 1 is not an earlier picture"),
        (["Ra1", "Ra=x"], "Ra=x of picture 1 is not an earlier picture"),
        (["Ra=-1"], "Ra=-1 of picture 0 is not an earlier picture"),
        (["Ranan"], "Ra must be a number up to 1e+06, not 'nan'"),
        (["Re1e300"], "Re must be a number up to 1e+06, not '1e300'"),
        (["Rb"], "Rb must be a number up to 1e+06, not ''"),
        ([], "it has no picture, a line that begins with i"),
        (["Ra0"] * 10_001, "it has more than 10000 pictures"),
        (["Ra0" + " " * 70_000], "or more on a line than Hugin writes"),
    ],
)
def test_unsound_projects_are_refused(pictures: list[str], message: str, tmp_path: Path) -> None:
    assert message in refusal(project(tmp_path, *pictures))


def test_the_format_does_not_depend_on_the_name(tmp_path: Path) -> None:
    path = project(tmp_path, "Ra1").rename(tmp_path / "project.txt")

    assert import_response(path).channels[0].method == "hugin"


def test_a_size_is_that_of_the_picture() -> None:
    camera = make_camera(SrgbCurve())
    text = encode_response(camera, "hugin", SETTINGS).content.decode()

    assert "the size of the pictures, give `size`" in encode_response(camera, "hugin").lost[0]
    assert "\np f0 w16 h16 " in text
    assert "\ni w16 h16 " in text
