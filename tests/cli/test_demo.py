"""``chartless demo``: the main job, with the truth to compare with."""

import contextlib
import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from PIL import Image

from chartless import Calibration, load, named_curve, rmse
from chartless.cli import main

Chartless = Callable[..., Any]
Refusal = Callable[..., str]

pytestmark = pytest.mark.slow  # CI runs the command besides

FILES = ["camera.json", "frame_1.png", "frame_2.png", "linear.exr", "report.png", "truth.json"]


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Folder and JSON of one run, which takes some seconds."""
    folder = tmp_path_factory.mktemp("demo") / "out"
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(["demo", "--json", "-o", str(folder)])
    assert (status, err.getvalue()) == (0, "")
    return folder, json.loads(out.getvalue())


def test_it_writes_its_files(demo: tuple[Path, Any]) -> None:
    folder, _ = demo

    assert sorted(path.name for path in folder.iterdir()) == FILES
    with Image.open(folder / "frame_1.png") as frame, Image.open(folder / "report.png") as report:
        assert frame.size == (512, 512)
        assert report.size > (800, 600)
    spec = oiio.ImageInput.open(str(folder / "linear.exr")).spec()
    assert (spec.width, spec.height, spec.nchannels, str(spec.format)) == (512, 512, 3, "float")


def test_json_is_the_calibration_with_the_truth(demo: tuple[Path, Any]) -> None:
    folder, printed = demo
    truth = printed["truth"]

    assert {key: printed[key] for key in printed if key != "truth"} == json.loads(
        (folder / "camera.json").read_text()
    )
    calibration = load(folder / "camera.json")
    assert truth["rmse"] == [
        pytest.approx(rmse(response.curve, named_curve("srgb")))
        for response in calibration.channels
    ]
    assert [channel["flags"] for channel in printed["channels"]] == [[], [], []]
    assert len(truth["rmse"]) == 3
    assert max(truth["rmse"]) < 0.06
    assert max(truth["rmse"]) < truth["rmse_linear"] / 3


@pytest.fixture
def without_search(demo: tuple[Path, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """The calibration that the first run found."""
    found = load(demo[0] / "camera.json")

    def calibrate(*_: object, **__: object) -> Calibration:
        return found

    monkeypatch.setattr("chartless.workflow.calibrate", calibrate)


@pytest.mark.usefixtures("without_search")
def test_it_prints_a_table_with_the_errors(
    demo: tuple[Path, Any], chartless: Chartless, tmp_path: Path
) -> None:
    folder = tmp_path / "again"

    done = chartless("demo", "-o", folder)

    assert done.status == 0
    rows = [line.split() for line in done.out.splitlines()]
    header = next(row for row in rows if row[:1] == ["channel"])
    assert header[1] == "RMSE"
    errors = [float(row[1]) for row in rows if row[:1] in (["R"], ["G"], ["B"])]
    assert errors == pytest.approx(demo[1]["truth"]["rmse"], abs=6e-5)
    for name in FILES:
        assert name in done.out
        assert (folder / name).is_file()


@pytest.mark.usefixtures("without_search")
def test_it_is_the_same_every_time(
    demo: tuple[Path, Any], chartless: Chartless, tmp_path: Path
) -> None:
    folder = tmp_path / "again"
    chartless("demo", "-o", folder)

    for name in ("frame_1.png", "frame_2.png", "truth.json"):
        assert (folder / name).read_bytes() == (demo[0] / name).read_bytes()


@pytest.mark.usefixtures("without_search")
@pytest.mark.parametrize(
    ("place", "why", "prepare"),
    [
        ("missing/out", "does not exist: create it first", lambda _: None),
        ("file", "is a file: choose another output folder", Path.touch),
    ],
)
def test_a_folder_that_cannot_be_made(
    place: str, why: str, prepare: Callable[[Path], None], refusal: Refusal, tmp_path: Path
) -> None:
    prepare(tmp_path / place)

    line = refusal("demo", "-o", tmp_path / place, "--json")

    assert line.startswith(f"{tmp_path / place}: ")
    assert why in line


@pytest.mark.usefixtures("without_search")
def test_a_folder_in_use_is_used_again(
    demo: tuple[Path, Any], chartless: Chartless, tmp_path: Path
) -> None:
    folder = tmp_path / "again"
    shutil.copytree(demo[0], folder)
    (folder / "notes.txt").write_text("mine")

    assert chartless("demo", "-o", folder).status == 0
    assert (folder / "notes.txt").read_text() == "mine"
