"""Reports as files, and the frame that they show."""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from chartless import Calibration
from chartless.errors import OutputError, ParameterError
from chartless.evidence.bracket.gather import bracket_evidence
from chartless.evidence.registry import KINDS
from chartless.frames.frame import Frame
from chartless.report import example_frame, save
from chartless.result.account import Reading


def taken(folder: Path, name: str, level: int) -> dict[str, Any]:
    """A grey picture, as provenance names it."""
    path = folder / name
    Image.fromarray(np.full((8, 8), level, np.uint8)).save(path)
    return {"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


@pytest.mark.parametrize("name", ["report.html", "report.HTM"])
def test_a_report_is_written(linear_camera: Calibration, tmp_path: Path, name: str) -> None:
    save(linear_camera, tmp_path / name)

    assert (tmp_path / name).read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["report.pdf", "report", "report.html.bak"])
def test_other_extensions_are_refused(
    linear_camera: Calibration, tmp_path: Path, name: str
) -> None:
    with pytest.raises(OutputError, match=r"name it \.html"):
        save(linear_camera, tmp_path / name)

    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_refused(linear_camera: Calibration, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="create it first"):
        save(linear_camera, tmp_path / "missing" / "report.html")


@pytest.mark.slow
def test_a_frame_of_other_channels_leaves_no_report(of_noise: Calibration, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="the picture has 1"):
        save(of_noise, tmp_path / "a.html", Frame(Path("a.png"), np.zeros((2, 2, 1), np.uint8)))

    assert not list(tmp_path.iterdir())


def test_the_first_frame_is_found_again(linear_camera: Calibration, tmp_path: Path) -> None:
    inputs = [taken(tmp_path, f"{level}.png", level) for level in (7, 8)]

    found = example_frame(replace(linear_camera, provenance={"inputs": inputs}))

    assert found is not None
    assert (found.levels == 7).all()


def test_the_example_of_the_evidence_is_taken(linear_camera: Calibration, tmp_path: Path) -> None:
    inputs = [taken(tmp_path, f"{level}.png", level) for level in (1, 2, 3)]
    readings = [
        Reading(kind=kind, title="", sentence="", inputs=(0, 1, 2), example=example)
        for kind, example in (("noise", None), ("bracket", 1))
    ]

    found = example_frame(
        replace(linear_camera, evidence=tuple(readings), provenance={"inputs": inputs})
    )

    assert found is not None
    assert (found.levels == 2).all()


def test_of_a_bracket_the_least_clipped_is_the_example() -> None:
    """Neither that with least black nor that with least white."""
    frames = []
    for name, n_black, n_white in (("a.png", 300, 0), ("b.png", 50, 50), ("c.png", 0, 200)):
        levels = np.random.default_rng(0).integers(10, 240, (1000, 1), dtype=np.uint8)
        levels[:n_black], levels[1000 - n_white :] = 0, 255
        frames.append(Frame(Path(name), levels.reshape(20, 50, 1)))

    evidence = bracket_evidence(frames, np.log([1.0, 2.0, 4.0]))

    found = KINDS["bracket"].example(evidence)
    assert found is not None
    assert found.path == Path("b.png")


def test_a_changed_file_is_not_shown(linear_camera: Calibration, tmp_path: Path) -> None:
    source = taken(tmp_path, "a.png", 7)
    taken(tmp_path, "a.png", 8)

    assert example_frame(replace(linear_camera, provenance={"inputs": [source]})) is None


@pytest.mark.parametrize("file", ["gone.png", "frame 1", ""])
def test_a_missing_file_is_not_shown(linear_camera: Calibration, file: str) -> None:
    inputs = [{"file": file, "sha256": "0" * 64}]

    assert example_frame(replace(linear_camera, provenance={"inputs": inputs})) is None


def test_without_inputs_there_is_no_frame(linear_camera: Calibration) -> None:
    assert example_frame(linear_camera) is None
