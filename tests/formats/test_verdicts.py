"""How far to trust a curve: in the files of other programs, and said by who writes them."""

import io
import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from cameras import CURVES, make_camera
from PIL import Image, ImageCms
from programs import LEVELS, linearised_by_ffmpeg, linearised_by_ocio

from chartless.cli import main
from chartless.flags import Flag
from chartless.formats import FORMATS, ExportSettings, export_response, import_response
from chartless.formats._base import Source
from chartless.formats._tables import noted_verdict, recorded_verdict
from chartless.formats.calibration_file import save
from chartless.result.calibration import Calibration
from chartless.result.verdict import verdict

NOTED = [name for name, each in FORMATS.items() if each.keeps.verdict]
SIZE = ExportSettings(size=(64, 48))
WIDE = "usable with care: The curve is known to ± 0.028 of the light at white; a good one is"


def wide(*flags: Flag) -> Calibration:
    """A camera whose curve is not known well, or worse."""
    camera = make_camera(CURVES[1])
    response = replace(camera.channels[0], inverse_lut_std=np.full(256, 0.028))
    return replace(camera, channels=(response.with_flags(*flags),))


def foreign(folder: Path, *, falls: bool = False) -> Path:
    """A table of another program."""
    light = np.linspace(0, 1, 256) ** 2
    light[100] -= 0.5 * falls * light[100]
    path = folder / "theirs.cube"
    rows = "\n".join(f"{each:.9g} {each:.9g} {each:.9g}" for each in light)
    path.write_text(f"LUT_1D_SIZE 256\n{rows}\n")
    return path


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "a.png"
    levels = np.broadcast_to(np.arange(256, dtype=np.uint8)[:, np.newaxis], (64, 256, 3))
    Image.fromarray(np.ascontiguousarray(levels)).save(path)
    return path


def said(captured: str) -> list[str]:
    """Lines about a verdict."""
    return [line for line in captured.splitlines() if ": usable with care: " in line
            or ": do not trust: " in line]  # fmt: skip


# In files


def test_these_formats_have_room_for_it() -> None:
    assert NOTED == ["clf", "icc", "csp", "resolve", "cube", "ppisp", "npz"]


@pytest.mark.parametrize("name", NOTED)
def test_the_file_says_it(name: str, tmp_path: Path) -> None:
    """In ASCII; what chartless reads again has it as a remark, but of an archive that is packed."""
    path = tmp_path / f"camera{FORMATS[name].suffix}"
    camera = wide(Flag.MISFIT)

    export_response(camera, path, name, SIZE)

    note = noted_verdict(camera)
    assert note.startswith("Verdict of chartless: do not trust: A curve and its noise do not")
    assert "several times the given +-0.028" in note
    if name == "npz":
        assert np.load(path)["verdict"].item() == note
        return
    assert note.encode() in path.read_bytes()
    (remark,) = import_response(path).provenance["remarks"]
    assert remark.endswith(note.replace("Verdict of chartless:", "with the verdict"))


def test_where_each_program_finds_it(tmp_path: Path) -> None:
    note = noted_verdict(wide())
    files = {name: tmp_path / f"{name}{FORMATS[name].suffix}" for name in NOTED}
    for name, path in files.items():
        export_response(wide(), path, name)

    assert files["cube"].read_text().splitlines()[0] == f"# {note}"
    assert files["resolve"].read_text().splitlines()[0] == f"# {note}"
    described = ET.fromstring(files["clf"].read_text()).findall("{*}Description")
    assert [each.text for each in described][1:] == [note]
    before, _, after = files["csp"].read_text().partition(note)
    assert "BEGIN METADATA" in before
    assert after.startswith("\nEND METADATA")
    profile = ImageCms.ImageCmsProfile(io.BytesIO(files["icc"].read_bytes())).profile
    assert profile.profile_description.endswith("; verdict: usable with care")
    assert profile.model == note


@pytest.mark.parametrize("name", ["clf", "csp", "cube", "resolve"])
def test_programs_read_files_that_say_it(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"camera{FORMATS[name].suffix}"
    camera = wide(Flag.MISFIT)
    export_response(camera, path, name)
    light = np.repeat(camera.linearize(LEVELS[0][:, :1]), 3, axis=1)

    assert np.abs(linearised_by_ocio(path) - light).max() <= FORMATS[name].precision
    if name != "clf":
        assert np.abs(linearised_by_ffmpeg(path) - light).max() <= FORMATS[name].precision


def test_of_a_foreign_curve_without_a_fault_no_file_says_anything(tmp_path: Path) -> None:
    camera = import_response(foreign(tmp_path))

    export_response(camera, tmp_path / "again.cube", "cube")

    assert b"erdict" not in (tmp_path / "again.cube").read_bytes()


def test_a_file_cannot_write_to_the_terminal() -> None:
    content = b"# Verdict of chartless: good\x1b[2J\n" + b"# " + b"x" * 10_000

    assert recorded_verdict(Source(Path("a"), content)) == "good"


def test_the_calibration_file_says_it(tmp_path: Path) -> None:
    save(wide(), tmp_path / "camera.json")

    told = json.loads((tmp_path / "camera.json").read_text())["verdict"]

    assert told == verdict(wide().channels).to_json()
    assert told["grade"] == "usable with care"


# On the command line


@pytest.mark.parametrize("command", ["linearize", "merge", "export"])
def test_who_uses_a_calibration_is_told_in_one_line(
    command: str, picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = tmp_path / "camera.json"
    bad = "do not trust: A curve and its noise do not explain the pictures: misfit."
    for calibration, line in ((wide(), WIDE), (wide(Flag.MISFIT), bad)):
        save(calibration, camera)

        assert main(arguments(command, camera, picture)) == 0

        (told,) = said(capsys.readouterr().err)
        assert told.startswith(f"chartless: note: {camera}: {line}")


@pytest.mark.parametrize("command", ["linearize", "merge", "export"])
def test_nothing_is_said_of_a_good_curve_or_a_foreign_one_without_a_fault(
    command: str, picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = tmp_path / "good.json"
    save(make_camera(*CURVES[:1]), good)
    export_response(make_camera(*CURVES[:1]), tmp_path / "good.cube", "cube")
    for camera in (good, tmp_path / "good.cube", foreign(tmp_path)):
        assert main(arguments(command, camera, picture)) == 0
        err = capsys.readouterr().err
        assert said(err) == []
        assert "verdict" not in err


def test_a_foreign_curve_that_falls_is_not_to_be_trusted(
    picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    theirs = foreign(tmp_path, falls=True)

    assert main(arguments("linearize", theirs, picture)) == 0

    (told,) = said(capsys.readouterr().err)
    assert told.startswith(f"chartless: note: {theirs}: do not trust: ")
    assert "not monotone" in told


def test_a_bad_curve_that_went_through_another_format_is_known_as_bad(
    picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cube = tmp_path / "camera.cube"
    export_response(wide(Flag.MISFIT), cube, "cube")

    assert main(arguments("linearize", cube, picture)) == 0

    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(
        f"chartless: note: {cube}: chartless wrote it with the verdict do not trust: A curve"
    )


@pytest.mark.parametrize("command", ["merge", "export"])
def test_json_has_grade_and_reasons(
    command: str, picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(wide(), tmp_path / "camera.json")

    assert main([*arguments(command, tmp_path / "camera.json", picture), "--json"]) == 0

    told = json.loads(capsys.readouterr().out)["verdict"]
    assert told == verdict(wide().channels).to_json()


def arguments(command: str, camera: Path, picture: Path) -> list[str]:
    folder = picture.parent
    if command == "linearize":
        return ["linearize", str(camera), str(picture), "-o", str(folder / "light.exr")]
    if command == "export":
        return ["export", str(camera), "--to", "clf", "-o", str(folder / "out.clf")]
    longer = folder / "b.png"
    shorter = np.asarray(Image.open(picture))
    light = np.minimum(1.0, 2 * (shorter / 255.0) ** 2)
    Image.fromarray(np.rint(255 * np.sqrt(light)).astype(np.uint8)).save(longer)
    frames = [str(picture), str(longer), "--times", "1,2"]
    return ["merge", *frames, "-c", str(camera), "-o", str(folder / "scene.exr")]


# Vignetting


@pytest.mark.parametrize("name", ["dso", "hugin"])
def test_formats_that_want_vignetting_say_that_none_was_measured(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(make_camera(*CURVES), tmp_path / "camera.json")
    target = str(tmp_path / f"out{FORMATS[name].suffix}")

    how = ["--to", name, "--size", "64x48", "-o", target]
    assert main(["export", str(tmp_path / "camera.json"), *how]) == 0

    (line,) = (each for each in capsys.readouterr().err.splitlines() if "lost or changed" in each)
    assert "; vignetting, which was not measured" in line
