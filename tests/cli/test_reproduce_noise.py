"""``chartless reproduce noise``: what is printed, what the folder holds, what is refused."""

import errno
import json
import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from chartless.datasets import DigitalCameras
from chartless.experiments import noise, noise_digital, noise_sweeps

Chartless = Callable[..., Any]
Refusal = Callable[..., str]

STATISTICS = [
    "cases", "median", "q25", "q75", "mean", "p90", "infeasible", "evaluations", "slope_ratio",
    "floor_ratio", "within_1", "within_2", "seconds",
]  # fmt: skip
FIGURES = ["dependence", "fig4_scenes", "fig5_errors", "fig5_search", "likelihood"]


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small photographs, short searches, few sweeps."""
    monkeypatch.setattr(noise, "LEAST_SIZE", (60, 80))
    monkeypatch.setattr(noise, "ROUNDS", 1)
    monkeypatch.setattr(noise_sweeps, "ROUNDS", 1)
    irradiance = np.linspace(0, 1, 32)
    cameras = DigitalCameras(irradiance, np.sqrt(irradiance)[np.newaxis], ("one",))
    monkeypatch.setattr("chartless.datasets.find_digital", lambda: cameras)
    reference = noise_sweeps.Camera()
    for factor, (label, _) in noise_sweeps.FACTORS.items():
        values = (2, 4) if factor == "frames" else (getattr(reference, factor),)
        monkeypatch.setitem(noise_sweeps.FACTORS, factor, (label, values))


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    folder = tmp_path / "scenes"
    folder.mkdir()
    for number in range(2):
        levels = np.random.default_rng(number).integers(0, 256, (60, 80, 3), dtype=np.uint8)
        Image.fromarray(levels).save(folder / f"{number}.png")
    return folder


@pytest.fixture
def arguments(scenes: Path, dorf_file: Path) -> tuple[object, ...]:
    return (
        *("reproduce", "noise", "--scenes", scenes, "--dorf", dorf_file),
        *("--cases", 2, "--sweeps", 1),
    )


@pytest.mark.slow
def test_the_folder_holds_tables_figures_and_a_summary_and_json_is_the_summary(
    arguments: tuple[object, ...], tmp_path: Path, chartless: Chartless
) -> None:
    out = tmp_path / "out"
    done = chartless(*arguments, "-o", out)
    assert (done.status, done.err) == (0, "")
    of_dorf, of_digital, (last,) = (part.splitlines() for part in done.out.split("\n\n"))
    first, header, *rows = of_dorf
    assert first == "RMSE of the response over 2 cases of DoRF"
    assert header.split() == [
        "method", "median", "mean", "p90", "infeasible", "evaluations", "seconds",
    ]  # fmt: skip
    assert [row.split()[0] for row in rows] == list(noise.METHODS)
    assert last == f"figures, tables and summary.json in {out}"
    title, _, *rows = of_digital
    assert title == "RMSE over 2 cases of digital cameras, and levels within two deviations"
    assert [row.split()[0] for row in rows] == list(noise_digital.METHODS)
    assert sorted(path.name for path in out.iterdir()) == sorted(
        ["cases", "sweeps", "cases.csv", "digital.csv", "summary.json", "timing.json"]
        + [f"{name}.png" for name in FIGURES]
    )

    summary = json.loads((out / "summary.json").read_text())
    assert list(summary["noise"]) == list(noise.METHODS)
    assert all(list(numbers) == STATISTICS for numbers in summary["noise"].values())
    assert list(summary["sweeps"]) == list(noise_sweeps.FACTORS)
    assert list(summary["sweeps"]["frames"]) == ["2", "4"]
    again = chartless(*arguments, "-o", out, "--json")
    assert again.json == summary


def test_a_relative_folder_of_scenes_is_found_from_anywhere(
    scenes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(scenes.parent)

    found = noise.scene_files(Path("scenes"))

    assert found == [scenes / "0.png", scenes / "1.png"]


# Refusals


def test_without_scenes_one_line_says_how_to_give_them(
    dorf_file: Path, tmp_path: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CHARTLESS_DATA", raising=False)

    line = refusal("reproduce", "noise", "-o", tmp_path / "out", "--dorf", dorf_file)

    assert line.startswith("no scenes: give a folder of RGB photographs")
    assert "--scenes" in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ("missing", "there is no such folder"),
        ("empty", "no photographs"),
        ("small", "a scene has 80 × 60 pixels or more, not 79 × 60"),
        ("grey", "a scene is an RGB photograph, this one has 1 channel"),
        ("torn", "damaged"),
    ],
)
def test_scenes_that_are_none(
    what: str, why: str, dorf_file: Path, tmp_path: Path, refusal: Refusal
) -> None:
    folder = tmp_path / what
    if what != "missing":
        folder.mkdir()
    pixels = np.zeros((60, 79, 3) if what == "small" else (60, 80), dtype=np.uint8)
    if what in ("small", "grey", "torn"):
        Image.fromarray(pixels).save(folder / "a.png")
    if what == "torn":
        content = (folder / "a.png").read_bytes()
        (folder / "a.png").write_bytes(content[: len(content) // 2])

    line = refusal(
        "reproduce", "noise", "-o", tmp_path / "out", "--scenes", folder, "--dorf", dorf_file
    )

    assert str(folder) in line
    assert why in line
    assert not (tmp_path / "out" / "cases").exists()


def test_a_file_that_is_no_dorf(scenes: Path, tmp_path: Path, refusal: Refusal) -> None:
    line = refusal(
        "reproduce", "noise", "-o", tmp_path / "out", "--scenes", scenes, "--dorf",
        tmp_path / "missing.npz",
    )  # fmt: skip

    assert "missing.npz" in line
    assert "No such file" in line
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(
    arguments: tuple[object, ...], tmp_path: Path, refusal: Refusal
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"

    line = refusal(*arguments, "-o", tmp_path / "out", "--scheduler", address)

    assert (
        line == f"no Dask scheduler answers at {address}: start one with the command dask scheduler"
    )


def test_a_folder_that_may_not_be_written(
    arguments: tuple[object, ...], tmp_path: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    # Permissions do not stop root.
    monkeypatch.setattr(os, "access", lambda _, mode, **__: not mode & os.W_OK)

    assert refusal(*arguments, "-o", out).startswith(f"{out}: is not writable")
    assert list(out.iterdir()) == []


@pytest.mark.slow
def test_a_full_disk(
    arguments: tuple[object, ...], tmp_path: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)

    line = refusal(*arguments, "-o", tmp_path / "out")

    assert "case-0000.json: cannot be written (No space left on device)" in line
    assert not list((tmp_path / "out" / "cases").iterdir())


def test_help_has_an_example(chartless: Chartless) -> None:
    done = chartless("reproduce", "noise", "--help")

    _, _, example = done.out.partition("Example:\n")
    assert example.startswith("      chartless reproduce noise -o ")
