"""Videos and patterns of names through the program."""

import hashlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from videos import grey_planes, write_video

from chartless import load, named_curve, rmse
from chartless.images import read_values, read_video

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot
Record = Callable[..., Path]


@pytest.fixture
def record(tmp_path: Path, shoot: Shoot) -> Record:
    """Record a still scene as a video of limited range, without loss."""

    def record_as(name: str = "clip.mkv", *, n_frames: int = 4, **how: Any) -> Path:
        taken = shoot.frames(shoot.scene(), n_frames=n_frames, bit_depth=16, seed=7)
        frames = [np.rint(16 + 219 * (each[..., 0] / 65535)).astype(np.uint8) for each in taken]
        return write_video(tmp_path / name, map(grey_planes, frames), **{"colour_range": 1} | how)

    return record_as


@pytest.mark.slow
def test_a_video_is_calibrated_like_its_camera(
    record: Record, chartless: Chartless, tmp_path: Path
) -> None:
    clip = record(n_frames=6)
    camera = tmp_path / "camera.json"

    done = chartless("calibrate", clip, "-o", camera)

    assert done.status == 0, done.err
    calibration = load(camera)
    response = calibration.channel("Y")
    assert rmse(response.curve, named_curve("srgb")) < 0.06
    assert (response.n_levels, calibration.bit_depth) == (220, 8)
    assert response.n_pairs == 5 * 192 * 256
    assert calibration.provenance["inputs"] == [
        {
            "file": str(clip),
            "sha256": hashlib.sha256(clip.read_bytes()).hexdigest(),
            "frames": [1, 6],
        }
    ]
    assert calibration.provenance["settings"]["levels"] == 220
    assert f"{clip}: Y′ read as stored, without chroma; 8 bits, black 16, white 235" in done.err
    assert f"{clip}: used 0.00 to 0.20 s (frames 1 to 6)" in done.err
    assert f"calibration of 6 frames written to {camera}" in done.out


def test_levels_of_a_video_may_be_reduced(record: Record, chartless: Chartless) -> None:
    done = chartless("calibrate", record(), "--levels", 64, "--method", "nlf", "--json")

    assert done.json["levels"] == 64


def test_colours_of_a_video_are_calibrated_on_request(record: Record, chartless: Chartless) -> None:
    done = chartless("calibrate", record(), "--channels", "rgb", "--method", "nlf", "--json")

    assert [each["name"] for each in done.json["channels"]] == ["R", "G", "B"]
    assert done.json["levels"] == 256
    assert any("computed from Y′CbCr by BT.601 (assumed" in each for each in remarks(done.json))


def remarks(content: dict[str, Any]) -> list[str]:
    return list(content["provenance"]["remarks"])


@pytest.mark.slow
def test_dark_frames_may_be_a_video(record: Record, chartless: Chartless, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    black = (rng.normal(18, 1, (192, 256)).round().clip(16).astype(np.uint8) for _ in range(3))
    dark = write_video(tmp_path / "dark.mkv", map(grey_planes, black), colour_range=1)

    done = chartless("calibrate", record(), "--dark", dark, "--json")

    assert done.status == 0, done.err
    assert done.json["provenance"]["settings"]["dark"] == [str(dark)]


def test_a_compressed_video_is_not_trusted(
    record: Record, chartless: Chartless, tmp_path: Path
) -> None:
    clip = record("clip.mp4", codec="libx264", options={"crf": "26"}, n_frames=8)

    done = chartless(
        "calibrate", clip, "--method", "nlf", "-o", tmp_path / "camera.json", "--strict"
    )

    assert done.status == 3
    assert "movers (Y): some pixels changed far more than noise explains" in done.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--jobs", "2"],
            ("is a video, which only one process can read: omit --jobs and --scheduler"),
        ),
        (["--times", "1,2"], "2 times were given for 1 frames"),
        (["--evidence", "bracket"], "the files record no exposure settings"),
    ],
)
def test_options_that_suit_no_video_are_refused(
    options: list[str], words: str, record: Record, refusal: Refusal, tmp_path: Path
) -> None:
    assert words in refusal("calibrate", record(), *options, "-o", tmp_path / "camera.json")
    assert not (tmp_path / "camera.json").exists()


def test_a_video_is_given_alone(record: Record, shoot: Shoot, refusal: Refusal) -> None:
    clip = record()

    message = refusal("calibrate", clip, *shoot(), "--json")

    assert message == f"{clip} is a video, whose frames are compared with each other: give it alone"


# Linear frames


def test_frames_of_a_video_become_files(
    record: Record, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    clip, output = record(n_frames=3), tmp_path / "linear"
    output.mkdir()

    done = chartless("linearize", grey_camera, clip, "-o", output)

    assert done.status == 0, done.err
    assert done.out == f"{output / 'clip_%06d.exr'}\n"
    assert sorted(each.name for each in output.iterdir()) == [
        f"clip_{number:06d}.exr" for number in (1, 2, 3)
    ]
    assert done.err.count(f"{clip}: R′G′B′ computed from") == 1
    inverse = load(grey_camera).channel("Y").curve.inverse
    for number, (_, frame) in enumerate(read_video(clip, colour=True), start=1):
        light = read_values(output / f"clip_{number:06d}.exr").values
        assert np.abs(light - inverse(frame.levels / 255)).max() <= 1e-6


def test_what_was_written_is_a_pattern_to_read(
    record: Record, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "linear"
    output.mkdir()
    done = chartless("linearize", grey_camera, record(), "-o", output, "--format", "png")

    again = chartless("linearize", grey_camera, done.out.strip(), "-o", output, "--format", "tif")

    assert again.status == 0, again.err
    assert len(again.out.splitlines()) == 4


def test_a_video_needs_a_folder(
    record: Record, grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "none.exr"

    assert refusal("linearize", grey_camera, record(), "-o", output) == (
        f"{output} is not a folder, and a video needs one: create it first"
    )


def test_a_video_is_not_made_nonlinear(
    record: Record, grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    message = refusal("linearize", grey_camera, record(), "-o", tmp_path, "--inverse")

    assert message.endswith(
        "only recorded videos can be linearised, and no video can be made nonlinear"
    )


MEMORY = """
import resource, sys
from chartless.cli import main
status = main(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
raise SystemExit(status)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="memory is measured as Unix does")
def test_a_video_is_opened_once(
    record: Record, chartless: Chartless, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A webcam could not be read from its beginning again."""
    opened = []

    def counting(path: Path, **how: Any) -> Any:
        opened.append(path)
        return read_video(path, **how)

    monkeypatch.setattr("chartless.images.read_video", counting)
    clip = record()

    assert chartless("calibrate", clip, "--method", "nlf", "-o", tmp_path / "a.json").status == 0

    assert opened == [clip]


def test_a_video_that_is_missing_is_called_so(
    grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    line = refusal("linearize", grey_camera, tmp_path / "none.mp4", "-o", tmp_path)

    assert line == f"{tmp_path / 'none.mp4'}: does not exist: check the name"


@pytest.mark.slow
@pytest.mark.parametrize("command", ["calibrate", "linearize"])
def test_memory_does_not_grow_with_the_video(
    command: str, grey_camera: Path, tmp_path: Path
) -> None:
    output = tmp_path / "linear"
    output.mkdir()

    def peak(n_frames: int) -> int:
        clip = write_video(tmp_path / f"{n_frames}.mkv", moving(n_frames), colour_range=1)
        given = {
            "calibrate": [clip, "--json", "--method", "nlf"],
            "linearize": [grey_camera, clip, "-o", output],
        }[command]
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, command, *map(str, given)],
            capture_output=True,
            text=True,
            check=True,
        )
        return int(done.stderr.split()[-1])

    # Held, 970 more frames of 160 × 120 pixels would take 56 MB as levels of three channels.
    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    assert peak(1000) - peak(30) < 20 * unit
    if command == "linearize":
        assert len(list(output.iterdir())) == 1000 + 30


def moving(n_frames: int) -> Iterator[tuple[Pixels, ...]]:
    """Frames that jump now and then, so that no run is long enough to stop at."""
    rng = np.random.default_rng(3)
    scene = np.linspace(20, 230, 160 * 120).reshape(120, 160)
    for number in range(n_frames):
        shown = np.roll(scene, 20 * (number // 25), axis=0)
        yield grey_planes((shown + 2 * rng.standard_normal(shown.shape)).round().astype(np.uint8))


# Patterns


def test_quoted_patterns_name_pictures(shoot: Shoot, chartless: Chartless, tmp_path: Path) -> None:
    shoot(n_frames=3)

    for pattern in ("shot_*.png", "shot_%d.png"):
        done = chartless("calibrate", tmp_path / pattern, "--method", "nlf", "--json")

        inputs = [Path(each["file"]).name for each in done.json["provenance"]["inputs"]]
        assert inputs == ["shot_0.png", "shot_1.png", "shot_2.png"]


@pytest.mark.parametrize("command", ["calibrate", "linearize", "merge"])
def test_a_pattern_that_matches_nothing_is_refused(
    command: str, grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    pattern, output = tmp_path / "none_*.png", tmp_path / "out.exr"
    given = {
        "calibrate": [pattern],
        "linearize": [grey_camera, pattern, "-o", output],
        "merge": [pattern, "-c", grey_camera, "-o", output],
    }[command]

    assert refusal(command, *given) == f"{pattern}: no file matches this pattern: check it"


def test_linearize_takes_a_pattern(
    shoot: Shoot, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    shoot()
    output = tmp_path / "linear"
    output.mkdir()

    done = chartless("linearize", grey_camera, tmp_path / "shot_*.png", "-o", output)

    assert done.out.split() == [str(output / "shot_0.exr"), str(output / "shot_1.exr")]


# Bits


@pytest.mark.slow
def test_12_bits_are_calibrated_and_linearised_as_such(
    shoot: Shoot, chartless: Chartless, tmp_path: Path
) -> None:
    frames = shoot.frames(shoot.scene(), n_frames=3, bit_depth=12, seed=3)
    paths = []
    for number, levels in enumerate(frames):
        paths.append(tmp_path / f"deep_{number}.png")
        Image.fromarray((levels[..., 0] << 4).astype(np.uint16)).save(paths[-1])
    camera, light = tmp_path / "camera.json", tmp_path / "light.exr"

    done = chartless("calibrate", *paths, "-o", camera)
    chartless("linearize", camera, paths[0], "-o", light)

    assert done.status == 0, done.err
    calibration = load(camera)
    response = calibration.channel("Y")
    assert calibration.bit_depth == 12
    assert not calibration.flags
    assert "deep_0.png: read 12 bits of samples that have room for 16" in done.err
    assert rmse(response.curve, named_curve("srgb")) < 0.06
    expected = response.curve.inverse(frames[0] / 4095)
    assert np.abs(read_values(light).values - expected).max() <= 1e-6
