"""``chartless plan``, and evidence that is asked for by name."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_content import fact_of
from PIL import Image
from raw_cameras import Camera, patches

from chartless import plan
from chartless.evidence.registry import KINDS

Chartless = Callable[..., Any]
Refusal = Callable[..., str]


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three shots of one scene, an exposure of half a stop and more apart, and their raw files."""
    folder = tmp_path_factory.mktemp("shots")
    for place, exposure in enumerate((0.25, 0.5, 1.0)):
        Camera(gain=1.0).store(folder, f"IMG_{place}", patches(), exposure=exposure, seed=place)
    return folder


def files(shots: Path, suffix: str) -> list[Path]:
    return sorted(shots.glob(f"*.{suffix}"))


def raw_of(shots: Path) -> list[Any]:
    return [each for path in files(shots, "dng") for each in ("--raw", path)]


def test_a_table_says_what_there_is_and_why_not(shots: Path, chartless: Chartless) -> None:
    done = chartless("plan", *files(shots, "JPG"), *raw_of(shots))

    head, *lines, _, last = done.out.rstrip().split("\n")
    rows = {line.split()[0]: line for line in lines}
    assert head.split()[0] == "evidence"
    assert list(rows) == list(KINDS)
    assert "yes" in rows["raw"]
    assert rows["bracket"].endswith("such as --times 1,2,4, or --times unknown")
    assert rows["noise"].endswith("to use it, name it in --evidence")
    assert last == "calibrate would use 3 raw files beside their pictures"


def test_json_has_a_row_for_each_kind(shots: Path, chartless: Chartless) -> None:
    done = chartless("plan", *files(shots, "JPG"), "--times", "1,2,4", "--json")

    rows = {row["kind"]: row for row in done.json["kinds"]}
    assert list(rows) == list(KINDS)
    assert rows["bracket"] == {
        "kind": "bracket",
        "used": True,
        "frames": 3,
        "reason": "a bracket of 3 exposures, 1 to 4 by `times`",
    }
    assert not rows["noise"]["used"]
    assert rows["raw"]["reason"].startswith("no raw files were given")


def test_python_says_the_same(shots: Path) -> None:
    found = plan(files(shots, "JPG"), times=[1, 2, 4])

    assert found.kinds == {"bracket"}
    assert found.reason == "a bracket of 3 exposures, 1 to 4 by `times`"


def test_frames_that_hold_nothing_are_refused(
    shots: Path, tmp_path: Path, refusal: Refusal
) -> None:
    (first, *_) = files(shots, "JPG")

    assert "no exposure is repeated" in refusal(
        "plan", *files(shots, "JPG"), "--times", "1,2,4", "--evidence", "both"
    )
    assert "evidence must be auto or some of raw, bracket, " in refusal(
        "plan", first, "--evidence", "light"
    )
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(tmp_path / "a.png")
    assert "method 'none'" in refusal("plan", tmp_path / "a.png", "--method", "none")


@pytest.mark.slow
def test_raw_files_and_exposures_make_one_calibration(
    shots: Path, tmp_path: Path, chartless: Chartless
) -> None:
    given = [*files(shots, "JPG"), *raw_of(shots), "--times", "1,2,4"]
    both = tmp_path / "both.json"

    done = chartless("calibrate", *given, "--evidence", "raw,bracket", "-o", both)

    assert "evidence: 3 raw files beside their pictures, and a bracket of 3 exposures" in done.err
    content = json.loads(both.read_text())
    for channel in content["channels"]:
        assert len(fact_of(channel, "raw", "matrix")) == 3
        assert fact_of(channel, "bracket", "exposures") == pytest.approx([1, 2, 4])
    names = [Path(each["file"]).name for each in content["provenance"]["inputs"]]
    assert sorted(names) == sorted(path.name for path in shots.iterdir())


def test_settings_that_are_true_or_false_are_words(shots: Path, refusal: Refusal) -> None:
    message = refusal("calibrate", *files(shots, "JPG"), "--set", "shared_noise=perhaps")

    assert message == "--set shared_noise takes yes or no, not 'perhaps'"
