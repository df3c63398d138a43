"""``chartless calibrate --points``: a chart's patches on the command line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_content import fact_of

from chartless import named_curve

Chartless = Callable[..., Any]
Refusal = Callable[..., str]


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def patches(tmp_path: Path) -> Path:
    light = np.geomspace(0.03, 0.9, 12)
    rows = zip(light, named_curve("srgb").response(light), strict=True)
    path = tmp_path / "patches.csv"
    path.write_text("irradiance,brightness\n" + "".join(f"{x},{y}\n" for x, y in rows))
    return path


def test_a_table_alone_gives_a_calibration_and_a_report(
    patches: Path, chartless: Chartless
) -> None:
    done = chartless("calibrate", "--points", patches, "--report", "camera.html")

    assert done.status == 0, done.err
    assert "evidence: points of patches.csv, up to a factor of irradiance" in done.err
    assert "the report shows no picture" not in done.err
    assert "calibration of 1 file written to camera.json" in done.out
    page = Path("camera.html").read_text(encoding="utf-8")
    assert "Found by chartless from 1 file, the first in patches.csv" in page
    assert "Measured points" in page
    assert "Scatter of the points" in page
    assert chartless("show", "camera.json").status == 0


def test_the_file_holds_what_points_say(patches: Path, chartless: Chartless) -> None:
    done = chartless("calibrate", "--points", patches, "--points-absolute", "--json")

    (channel,) = done.json["channels"]
    assert fact_of(channel, "points", "white") == pytest.approx(1, abs=1e-3)
    (reading,) = done.json["evidence"]
    assert (reading["kind"], reading["inputs"], reading["example"]) == ("points", [0], None)
    settings = done.json["provenance"]["settings"]
    assert (settings["points"], settings["points_absolute"]) == (str(patches), True)


def test_the_plan_says_that_points_are_used(patches: Path, chartless: Chartless) -> None:
    done = chartless("plan", "--points", patches, "--json")

    rows = {row["kind"]: row for row in done.json["kinds"]}
    assert rows["points"]["used"]
    assert not any(rows[name]["used"] for name in rows if name != "points")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "noise needs two or more frames of one still scene, none was given"),
        (("--points", "missing.csv"), "missing.csv: cannot be read"),
        (("--points-absolute",), "--points-absolute describes --points: give these as well"),
        (("--points", "patches.csv", "-o", "patches.csv"), "is one of the inputs and would be"),
        (("--points", "patches.csv", "--dark", "cap.png"), "--dark has no effect on"),
        (("--points", "patches.csv", "--method", "nlf"), "choose the method likelihood"),
    ],
)
def test_what_cannot_be_is_refused(
    arguments: tuple[str, ...], said: str, patches: Path, refusal: Refusal
) -> None:
    before = patches.read_text()

    line = refusal("calibrate", *arguments)

    assert said in line
    assert patches.read_text() == before
    assert not Path("camera.json").exists()
