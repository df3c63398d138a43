"""``--report`` of calibrate and show."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Callable[..., list[Path]]


@pytest.fixture
def frames(shoot: Shoot) -> list[Path]:
    return shoot()


def test_calibrate_writes_a_report(shoot: Shoot, chartless: Chartless, tmp_path: Path) -> None:
    frames = shoot(n_channels=3)
    camera, report = tmp_path / "camera.json", tmp_path / "camera.html"

    done = chartless("calibrate", *frames, "--method", "nlf", "-o", camera, "--report", report)

    assert done.status == 0
    assert done.out.endswith(f"report written to {report}\n")
    page = report.read_text(encoding="utf-8")
    assert page.count("<svg ") == 5
    assert page.count('src="data:image/jpeg;base64,') == 2
    assert frames[0].name in page


@pytest.mark.slow
def test_show_writes_the_same_report(
    frames: list[Path], chartless: Chartless, tmp_path: Path
) -> None:
    camera, first, second = (tmp_path / name for name in ("c.json", "1.html", "2.html"))
    chartless("calibrate", *frames, "--method", "nlf", "-o", camera, "--report", first)

    done = chartless("show", camera, "--report", second)

    assert done.status == 0
    assert done.out.endswith(f"report written to {second}\n")
    # The file in the page has been through a file; its last digits may differ.
    shown = [
        re.sub(r'href="data:[^"]*"', "", path.read_text(encoding="utf-8"))
        for path in (first, second)
    ]
    assert shown[0] == shown[1]


def test_frames_that_are_gone_are_missed(
    grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    done = chartless("show", grey_camera, "--report", tmp_path / "a.html")

    assert done.err == (
        "chartless: note: the report shows no picture: the frames were moved or have changed\n"
    )
    assert "<img" not in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_report_leaves_json_alone(
    frames: list[Path], chartless: Chartless, tmp_path: Path
) -> None:
    report = tmp_path / "camera.html"

    done = chartless("calibrate", *frames, "--method", "nlf", "--json", "--report", report)

    assert done.json["format"] == "chartless-calibration"
    assert report.exists()


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a.pdf", "a.pdf: a report is a page: name it .html"),
        ("missing/a.html", "does not exist: create it first"),
        ("c.html", "cannot be both calibration and report"),
    ],
)
def test_a_bad_place_is_refused_before_the_work(
    frames: list[Path], refusal: Refusal, tmp_path: Path, name: str, says: str
) -> None:
    before = set(tmp_path.iterdir())

    said = refusal("calibrate", *frames, "-o", tmp_path / "c.html", "--report", tmp_path / name)

    assert says in said
    assert set(tmp_path.iterdir()) == before


def test_a_report_does_not_replace_its_calibration(grey_camera: Path, refusal: Refusal) -> None:
    camera = grey_camera.rename(grey_camera.with_suffix(".html"))
    content = camera.read_bytes()

    assert "would overwrite the calibration" in refusal("show", camera, "--report", camera)
    assert camera.read_bytes() == content
