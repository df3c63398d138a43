"""What holds of every format: round trips within its precision, refusals, the command line."""

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera
from hypothesis import given
from hypothesis import strategies as st

from chartless.cli import main
from chartless.curves import AbstractCurve, ModelCurve
from chartless.errors import CalibrationFileError, ParameterError
from chartless.formats import (
    FORMATS,
    AbstractFormat,
    ExportSettings,
    export_response,
    import_response,
)
from chartless.formats._base import Source
from chartless.formats._tables import (
    above_zero,
    inverse_table,
    luma,
    strictly_increasing,
    table_through_levels,
)
from chartless.formats.calibration_file import load, save
from chartless.images import write_image
from chartless.result.calibration import Calibration

SETTINGS = ExportSettings(size=(64, 48))
BRIGHTNESS = np.linspace(0, 1, 256)
LUMA = (0.299, 0.587, 0.114)
BOTH = [name for name, each in FORMATS.items() if each.is_written and each.is_read]
WRITTEN = [name for name, each in FORMATS.items() if each.is_written]

# From nearly linear to steeper than any camera, in the family that the exports draw from.
curves = st.builds(
    lambda a, s, c: ModelCurve("ameegc2-exact", (a, s, c)),
    st.floats(-1.5, 0.5),
    st.floats(0, 2),
    st.floats(-2, 2),
)


def wanted(each: AbstractFormat, camera: Calibration) -> list[npt.NDArray[np.float64]]:
    """Inverse responses that a file of the format should hold, channel by channel."""
    tables = [response.curve.inverse(BRIGHTNESS) for response in camera.channels]
    if each.keeps.channels != "each" and len(tables) > 1:
        weights = LUMA if "luma" in each.keeps.channels else None
        return [np.average(tables, axis=0, weights=weights)]
    return tables


def in_its_family(each: AbstractFormat, camera: Calibration, folder: Path) -> Calibration:
    """A camera that the format holds: if only a family of curves, what a first round trip makes."""
    if not each.keeps.curves:
        return camera
    path = folder / f"nearest{each.suffix}"
    export_response(camera, path, each.name, SETTINGS)
    return import_response(path, each.name)


def held(camera: Calibration) -> list[npt.NDArray[np.float64]]:
    return [response.curve.inverse(BRIGHTNESS) for response in camera.channels]


def assert_same(each: AbstractFormat, camera: Calibration, again: Calibration) -> None:
    for had, has in zip(wanted(each, camera), held(again), strict=True):
        assert np.abs(had - has).max() <= each.precision


@pytest.mark.parametrize("name", BOTH)
def test_a_round_trip_keeps_the_curve(name: str, tmp_path: Path) -> None:
    """Also told apart from all other formats, by its content alone."""
    each = FORMATS[name]
    for measured in (make_camera(*CURVES), make_camera(CURVES[0])):
        camera = in_its_family(each, measured, tmp_path)
        path = tmp_path / f"camera{each.suffix}"
        export_response(camera, path, name, SETTINGS)

        again = import_response(path)

        assert again.channels[0].method == name
        assert again.provenance["inputs"][0]["file"] == str(path)
        if len(camera.channels) == len(again.channels):
            assert_same(each, camera, again)
        else:  # three equal channels of one, or one of three
            for had, has in zip([wanted(each, camera)[0]] * 3, held(again), strict=False):
                assert np.abs(had - has).max() <= each.precision


@pytest.mark.slow
@pytest.mark.parametrize("name", BOTH)
@given(three=st.tuples(curves, curves, curves))
def test_a_round_trip_keeps_any_curve(
    name: str, three: tuple[AbstractCurve, ...], tmp_path_factory: pytest.TempPathFactory
) -> None:
    each, folder = FORMATS[name], tmp_path_factory.mktemp("formats")
    camera = in_its_family(each, make_camera(*three), folder)
    path = folder / f"camera{each.suffix}"
    export_response(camera, path, name, SETTINGS)

    again = import_response(path, name)

    assert_same(each, camera, again)
    for response in again.channels:
        assert np.all(np.diff(response.inverse_lut) > 0)


@pytest.mark.parametrize("name", WRITTEN)
def test_every_format_says_what_it_is(name: str) -> None:
    each = FORMATS[name]

    assert each.name == name
    assert each.suffix.startswith(".")
    assert all((each.title, each.programs, each.tested_with, each.keeps.channels))
    assert 0 < each.precision < 0.05


def refusal(path: Path, name: str) -> str | None:
    """Why the file is refused; None if it is not."""
    try:
        import_response(path, name)
    except (CalibrationFileError, ParameterError) as error:
        return str(error)
    return None


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files_end_in_one_line(name: str, tmp_path: Path) -> None:
    each = FORMATS[name]
    path = tmp_path / f"camera{each.suffix}"
    if each.is_written:
        export_response(make_camera(*CURVES), path, name, SETTINGS)
    content = path.read_bytes() if path.exists() else b"what is this"

    for broken in (b"", content[: len(content) // 2], b"\0" * 400, content.replace(b"0", b"?")):
        path.write_bytes(broken)
        line = refusal(path, name)
        assert line is None or line.startswith(f"{path}: ")
        assert "\n" not in (line or "")


def test_a_file_of_no_format_names_those_there_are(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear reader")

    with pytest.raises(CalibrationFileError, match=r"is not in a known format \(opencv, "):
        import_response(tmp_path / "letter.txt")


def test_floats_that_increase() -> None:
    flat = np.array([[0, 0], [1e-30, 0], [0.5, 0.5], [0.5, 0.4], [0.5, 1], [1, 1]])

    rising = strictly_increasing(flat)

    assert rising.dtype == np.float32
    assert np.all(np.diff(rising, axis=0) > 0)
    assert rising == pytest.approx(np.maximum.accumulate(flat), abs=1e-6)
    steep = inverse_table(make_camera(ModelCurve("gamma", (0.4,))))
    assert np.array_equal(strictly_increasing(steep), steep.astype(np.float32))
    above = strictly_increasing(np.zeros((256, 1)))[1:]
    assert np.all(above >= np.finfo(np.float32).tiny)


def test_black_for_logarithms_stays_below_the_next_level() -> None:
    for gamma in (0.2, 1.0, 3.0):
        camera = make_camera(ModelCurve("gamma", (gamma,)))
        table = above_zero(inverse_table(camera), camera)

        assert 0 < table[0, 0] <= table[1, 0]
        assert np.array_equal(table[1:], inverse_table(camera)[1:])


@pytest.mark.slow
@given(curve=curves, n_rows=st.integers(511, 5000))
def test_lines_between_rows_of_another_grid_meet_the_curve_at_its_levels(
    curve: AbstractCurve, n_rows: int
) -> None:
    camera = make_camera(curve)

    (table,) = table_through_levels(camera, n_rows).T

    drawn = np.interp(BRIGHTNESS, np.linspace(0, 1, n_rows), table)
    assert drawn == pytest.approx(curve.inverse(BRIGHTNESS), abs=1e-12)
    assert np.all(np.diff(table) > -1e-15)
    (steps,) = table_through_levels(camera, n_rows, nearest=True).T
    nearest = steps[np.rint(BRIGHTNESS * (n_rows - 1)).astype(int)]
    assert nearest == pytest.approx(curve.inverse(BRIGHTNESS), abs=1e-12)


def test_coarser_grids_are_the_curve_itself() -> None:
    camera = make_camera(*CURVES)

    for n_rows in (2, 100, 256, 510):
        assert np.array_equal(table_through_levels(camera, n_rows), inverse_table(camera, n_rows))


def test_luma_is_exact_where_a_picture_has_no_colour() -> None:
    grey = np.arange(256, dtype=np.uint8)
    linear = make_camera(*CURVES).linearize(np.stack([grey] * 3, axis=-1)[np.newaxis])[0]

    (column,) = luma(inverse_table(make_camera(*CURVES))).T

    assert column == pytest.approx(linear @ np.array(LUMA), abs=1e-7)


def test_pictures_that_are_there_already_stay(tmp_path: Path) -> None:
    vignette = tmp_path / "vignette.png"
    write_image(vignette, np.full((48, 64, 1), 0.5))
    measured = vignette.read_bytes()

    lost, files = export_response(make_camera(*CURVES), tmp_path / "pcalib.txt", "dso", SETTINGS)

    assert "a new vignette.png, as there is one already" in lost
    assert files == (tmp_path / "pcalib.txt",)
    assert vignette.read_bytes() == measured
    other = ExportSettings(size=(640, 480))
    with pytest.raises(ParameterError, match="exists already and is not of 640 × 480 pixels"):
        export_response(make_camera(*CURVES), tmp_path / "other.txt", "dso", other)
    assert not (tmp_path / "other.txt").exists()


def test_texts_longer_than_any_table_are_refused(tmp_path: Path) -> None:
    head = "# rows: 256\n# columns: 3\n"
    for text, message in (
        (head + "1\n" * 400_000, "more lines than a table of 65536 levels"),
        (head + "1 " * 4000, "a line of 7999 characters"),
    ):
        (tmp_path / "long.m").write_text(text)
        with pytest.raises(CalibrationFileError, match=message):
            import_response(tmp_path / "long.m")


def test_a_source_reads_any_line_ends() -> None:
    text = Source(Path("a"), b"\xef\xbb\xbfa\r\nb\rc\n").text

    assert text == "a\nb\nc\n"


# The command line


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
def test_export_and_import(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    each = FORMATS[name]
    save(make_camera(*CURVES, seen=(3, 250)), tmp_path / "camera.json")
    target = tmp_path / f"foreign{each.suffix}"

    size = ["--size", "64x48"] if "size" in each.takes else []
    arguments = ["--to", name, *size, "-o", str(target)]
    assert main(["export", str(tmp_path / "camera.json"), *arguments]) == 0

    told = capsys.readouterr()
    assert told.out.splitlines()[0] == str(target)
    assert ("the error band" in told.err) == (not each.keeps.band)
    assert ("which levels were observed" in told.err) == (not each.keeps.range)
    if each.is_read:
        assert main(["import", str(target), "-o", str(tmp_path / "again.json")]) == 0
        camera = in_its_family(each, make_camera(*CURVES), tmp_path)
        assert_same_or_shared(each, camera, load(tmp_path / "again.json"))


def assert_same_or_shared(each: AbstractFormat, camera: Calibration, again: Calibration) -> None:
    tables = wanted(each, camera)
    for had, has in zip(tables, held(again), strict=False):
        assert np.abs(had - has).max() <= each.precision


def test_names_where_none_is_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    camera = tmp_path / "camera.json"
    save(make_camera(*CURVES), camera)
    before = camera.read_bytes()

    names = {"csv": "camera.csv", "cube": "camera.cube", "dng": "camera_dng.txt"}
    for name, written in {**names, "alicevision": "camera_alicevision.csv"}.items():
        assert main(["export", str(camera), "--to", name]) == 0
        assert capsys.readouterr().out.split() == [str(tmp_path / written)]
    cube = (tmp_path / "camera.cube").read_bytes()
    for command in (["import", f"{tmp_path}/camera.cube"], ["export", str(camera), "--to", "cube"]):
        assert main(command) == 2
        assert " exists already: name" in capsys.readouterr().err
    assert camera.read_bytes() == before
    assert (tmp_path / "camera.cube").read_bytes() == cube
    assert main(["import", str(tmp_path / "camera_dng.txt")]) == 0
    assert "read as dng, " in capsys.readouterr().out
    assert len(load(tmp_path / "camera_dng.json").channels) == 1
    assert main(["import", str(camera), "-o", str(tmp_path / "a.json")]) == 2
    assert "is already a calibration of chartless" in capsys.readouterr().err


def test_the_name_of_the_output_tells_the_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(make_camera(*CURVES), tmp_path / "camera.json")

    for name, format_name in (("camera.csv", "csv"), ("camera.crf", "radical")):
        assert main(["export", str(tmp_path / "camera.json"), "-o", str(tmp_path / name)]) == 0
        assert import_response(tmp_path / name).channels[0].method == format_name
    assert main(["export", str(tmp_path / "camera.json"), "-o", str(tmp_path / "a.txt")]) == 2
    assert (
        ".txt files can have several formats: give --to dng or --to dso"
    ) in capsys.readouterr().err


def test_the_list_of_formats(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == list(FORMATS)

    assert main(["export", "--list", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert [each["name"] for each in content["formats"]] == list(FORMATS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give the calibration to export, or --list"),
        (["{camera}", "--to", "cubes"], "unknown format 'cubes'"),
        (["{camera}"], "name the format with --to"),
        (["{camera}", "-o", "{folder}/camera.json", "--to", "csv"], "would be overwritten"),
        (["{camera}", "--to", "dso", "--size", "0x7"], "--size must be width and height"),
        (["{camera}", "--to", "csv", "--size", "64x48"], "csv does not use --size: omit it"),
        (["{camera}", "--to", "opencv", "--levels", "512"], "opencv does not use --levels"),
        (["{folder}", "--to", "csv"], "cannot be read: Is a directory"),
        (["{camera}", "--to", "csv", "--levels", "1"], "between 2 and 65536 levels, not 1"),
        (["{camera}", "--to", "hdrtoolbox", "--levels", "0"], "between 2 and 65536 levels, not 0"),
        (
            ["{camera}", "--to", "pfstools", "--levels", "300"],
            "256, 512, 1024 … levels, not of 300",
        ),
        (["{camera}", "--to", "alicevision", "--levels", "99999999"], "levels, not 99999999"),
        (["{camera}", "--to", "dso"], "give its --size, such as 640x480"),
        (["{camera}", "--to", "csv", "-o", "{folder}/none/a.csv"], "does not exist: create it"),
    ],
)
def test_bad_requests_end_in_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(make_camera(*CURVES), tmp_path / "camera.json")
    filled = [each.format(camera=tmp_path / "camera.json", folder=tmp_path) for each in arguments]

    assert main(["export", *filled]) == 2

    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("chartless: error: ")
    assert message in line
    assert [each.name for each in tmp_path.iterdir()] == ["camera.json"]
