"""``chartless simulate``, and the whole way from a scene to its response."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from skimage.data import astronaut

from chartless import named_curve
from chartless.images import read_frame, write_image

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot


@pytest.fixture
def scene(shoot: Shoot, tmp_path: Path) -> Path:
    """Smooth light in a floating-point file."""
    path = tmp_path / "scene.exr"
    write_image(path, shoot.scene())
    return path


@pytest.fixture
def sim(tmp_path: Path) -> Path:
    return tmp_path / "sim"


def levels_of(folder: Path) -> list[Pixels]:
    return [read_frame(path).levels for path in sorted(folder.glob("frame_*.png"))]


def test_frames_and_truth_are_written(scene: Path, sim: Path, chartless: Chartless) -> None:
    done = chartless("simulate", scene, "-o", sim, "--frames", 3)

    names = ["frame_1.png", "frame_2.png", "frame_3.png", "truth.json"]
    assert (done.status, done.err) == (0, "")
    assert done.out == f"3 frames and truth.json written to {sim}\n"
    assert sorted(path.name for path in sim.iterdir()) == names
    first, second, third = levels_of(sim)
    assert first.shape == (192, 256, 1)
    assert first.dtype == np.uint8
    assert not np.array_equal(first, second)
    assert not np.array_equal(second, third)


def test_names_sort_in_the_order_of_the_frames(
    sim: Path, chartless: Chartless, refusal: Refusal, tmp_path: Path
) -> None:
    small = tmp_path / "small.exr"
    write_image(small, np.full((8, 8, 1), 0.5))

    chartless("simulate", small, "-o", sim, "--frames", 10)

    assert sorted(path.name for path in sim.glob("frame_*")) == [
        *(f"frame_0{number}.png" for number in range(1, 10)), "frame_10.png",
    ]  # fmt: skip
    line = refusal("simulate", small, "-o", sim, "--frames", 3)
    assert "holds frame_01.png of another simulation" in line


def test_truth_holds_response_and_noise(scene: Path, sim: Path, chartless: Chartless) -> None:
    chartless(
        "simulate", scene, "-o", sim, "--response", "gamma:0.4", "--noise", "0.02,9", "--seed", 4
    )

    truth = json.loads((sim / "truth.json").read_text())
    assert truth["response_lut"] == pytest.approx(np.linspace(0, 1, 1024) ** 0.4)
    assert truth["noise"]["U"] == pytest.approx(0.02)
    assert truth["noise"]["V"] == pytest.approx(9)
    assert truth["noise"]["u"] == pytest.approx(0.02 / 255)
    assert truth["noise"]["v"] == pytest.approx(9 / 255**2)
    assert truth["settings"]["response"] == "gamma:0.4"
    assert truth["settings"]["seed"] == 4
    assert truth["bit_depth"] == 8


def test_equal_seeds_give_equal_frames(scene: Path, tmp_path: Path, chartless: Chartless) -> None:
    for name, seed in (("a", 7), ("b", 7), ("c", 8)):
        chartless("simulate", scene, "-o", tmp_path / name, "--seed", seed)

    a, b, c = (levels_of(tmp_path / name) for name in "abc")
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_the_noise_is_the_one_asked_for(sim: Path, chartless: Chartless, tmp_path: Path) -> None:
    """A linear camera and even light: variance of the levels is U · level + V + rounding."""
    flat = tmp_path / "flat.exr"
    write_image(flat, np.full((400, 500, 1), 0.6))

    chartless("simulate", flat, "-o", sim, "--response", "linear", "--noise", "0.05,9")

    first, second = (levels.astype(float) for levels in levels_of(sim))
    assert first.mean() == pytest.approx(0.6 * 255, abs=0.05)
    assert (first - second).var() / 2 == pytest.approx(0.05 * 153 + 9 + 1 / 12, rel=0.02)


def test_undo_takes_the_response_of_the_scene_away(
    shoot: Shoot, sim: Path, chartless: Chartless, tmp_path: Path
) -> None:
    levels = np.repeat(np.arange(0, 256, dtype=np.uint8), 64).reshape(128, 128, 1)
    photo = shoot.write("photo.png", levels)

    chartless(
        "simulate", photo, "-o", sim, "--undo", "srgb", "--response", "srgb", "--noise", "0,0.0001"
    )

    first, _ = levels_of(sim)
    assert np.abs(first.astype(int) - levels)[levels > 20].max() <= 1


def test_sixteen_bits(scene: Path, sim: Path, chartless: Chartless) -> None:
    chartless("simulate", scene, "-o", sim, "--bits", 16)

    first, _ = levels_of(sim)
    assert first.dtype == np.uint16
    assert np.unique(first % 257).size > 200
    assert json.loads((sim / "truth.json").read_text())["bit_depth"] == 16


@pytest.mark.parametrize("extension", ["csv", "txt", "json"])
def test_a_measured_response(
    extension: str, scene: Path, sim: Path, chartless: Chartless, tmp_path: Path
) -> None:
    irradiance = np.linspace(0, 1, 257)
    brightness = named_curve("gamma:0.5").response(irradiance)
    curve = tmp_path / f"curve.{extension}"
    if extension == "json":
        curve.write_text(json.dumps({"response_lut": brightness.tolist()}))
    else:
        separator = "," if extension == "csv" else "\t"
        rows = [f"{x}{separator}{y}" for x, y in zip(irradiance, brightness, strict=True)]
        curve.write_text("\n".join(["# I and B", *rows]))

    done = chartless("simulate", scene, "-o", sim, "--response", curve)

    assert done.status == 0
    truth = json.loads((sim / "truth.json").read_text())["response_lut"]
    expected = np.interp(np.linspace(0, 1, 1024), irradiance, brightness)
    assert truth == pytest.approx(expected)


def test_light_above_saturation_is_white(sim: Path, chartless: Chartless, tmp_path: Path) -> None:
    bright = tmp_path / "bright.exr"
    write_image(bright, np.full((8, 8, 3), 7.5))

    chartless("simulate", bright, "-o", sim)

    assert all(np.all(levels == 255) for levels in levels_of(sim))


# From the scene to its response


@pytest.mark.slow
@pytest.mark.parametrize(
    "camera",
    [("srgb", 8, "0.17,0.7"), ("gamma:0.6", 8, "0.25,1.5"), ("linear", 16, "0.17,0.7")],
)
def test_the_response_is_recovered(
    camera: tuple[str, int, str], scene: Path, sim: Path, chartless: Chartless
) -> None:
    response, bits, noise = camera
    chartless(
        "simulate", scene, "-o", sim, "--response", response, "--bits", bits, "--noise", noise
    )
    calibration = sim / "camera.json"
    done = chartless(
        "calibrate", sim / "frame_1.png", sim / "frame_2.png", "-o", calibration, "--levels", 128
    )
    assert done.status == 0

    shown = chartless("show", calibration, "--truth", sim / "truth.json", "--json")

    (error,) = shown.json["truth"]["rmse"]
    assert error < 0.06


@pytest.mark.slow
def test_the_response_is_recovered_from_a_photograph(
    sim: Path, chartless: Chartless, tmp_path: Path
) -> None:
    photo = tmp_path / "photo.png"
    Image.fromarray(astronaut()[::2, ::2]).save(photo)
    chartless("simulate", photo, "-o", sim, "--undo", "srgb")
    chartless("calibrate", *sorted(sim.glob("frame_*.png")), "-o", sim / "camera.json")

    shown = chartless("show", sim / "camera.json", "--truth", sim / "truth.json", "--json")

    assert max(shown.json["truth"]["rmse"]) < 0.06


# Refusals


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--noise", "loud"), "noise must be two numbers U,V"),
        (("--noise", "0.03"), "noise must be two numbers U,V"),
        (("--noise", "0.03,16,2"), "noise must be two numbers U,V"),
        (("--noise", "-1,16"), "U = -1"),
        (("--noise", "0.03,0"), "V = 0"),
        (("--noise", "nan,nan"), "U = nan"),
        (("--frames", "0"), "--frames"),
        (("--frames", "x"), "--frames"),
        (("--bits", "12"), "8 or 16 bits, not 12"),
        (("--bits", "0"), "8 or 16 bits, not 0"),
        (("--seed", "-1"), "--seed"),
        (("--response", "sgrb"), "unknown response 'sgrb'. Did you mean 'srgb'?"),
        (("--response", "gamma:0"), "gamma > 0"),
        (("--response", "curve.csv"), "curve.csv: cannot be read"),
        (("--undo", "nothing"), "unknown response 'nothing'"),
    ],
)
def test_a_setting_without_meaning_is_refused(
    options: tuple[str, str], why: str, scene: Path, sim: Path, refusal: Refusal
) -> None:
    assert why in refusal("simulate", scene, "-o", sim, *options)
    assert not sim.exists()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0,0\n1,1,1\n", "line 2 is not two numbers"),
        ("0,0\n0.5,0.6\n", "from (0, 0) to (1, 1)"),
        ("0,0\n0.5,0.7\n0.4,0.8\n1,1\n", "must increase"),
        ("", "two rows or more"),
    ],
)
def test_a_measured_response_that_is_none(
    text: str, why: str, scene: Path, refusal: Refusal, tmp_path: Path
) -> None:
    sim = tmp_path / "sim"
    curve = tmp_path / "curve.csv"
    curve.write_text(text)

    line = refusal("simulate", scene, "-o", sim, "--response", curve)

    assert line.startswith(f"{curve}: ")
    assert why in line


def test_negative_light_is_refused(sim: Path, refusal: Refusal, tmp_path: Path) -> None:
    dark = tmp_path / "dark.exr"
    write_image(dark, np.full((8, 8, 1), -0.5))

    assert "must be finite and not negative" in refusal("simulate", dark, "-o", sim)
    assert not sim.exists()


def test_light_that_is_not_finite_is_refused(sim: Path, refusal: Refusal, tmp_path: Path) -> None:
    hole = tmp_path / "hole.exr"
    write_image(hole, np.full((8, 8, 1), np.nan))

    assert refusal("simulate", hole, "-o", sim).startswith(f"{hole}: holds values that are not")


@pytest.mark.parametrize(
    ("place", "why"), [("missing/sim", "does not exist: create it first"), ("file", "is a file")]
)
def test_a_folder_that_cannot_be_made(
    place: str, why: str, scene: Path, refusal: Refusal, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("here first")

    line = refusal("simulate", scene, "-o", tmp_path / place)

    assert line.startswith(f"{tmp_path / place}: ")
    assert why in line
    assert (tmp_path / "file").read_text() == "here first"


def test_the_scene_is_not_overwritten_by_a_frame(
    sim: Path, chartless: Chartless, refusal: Refusal, scene: Path
) -> None:
    chartless("simulate", scene, "-o", sim)
    frame = sim / "frame_1.png"
    before = frame.read_bytes()

    refusal("simulate", frame, "-o", sim)

    assert frame.read_bytes() == before


def test_a_folder_in_use_gets_new_frames(scene: Path, sim: Path, chartless: Chartless) -> None:
    results: list[Any] = []
    for seed in (1, 2):
        assert chartless("simulate", scene, "-o", sim, "--seed", seed).status == 0
        results.append(levels_of(sim))

    assert not np.array_equal(*results)
