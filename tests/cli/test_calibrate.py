"""``chartless calibrate``: what it refuses, what it doubts, what it writes."""

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from skimage.data import camera
from slow_cases import slow_but

from chartless import AffineNoise, load, named_curve, rmse, simulate_frames
from chartless.flags import Flag
from chartless.images import write_image
from chartless.result.response import Status

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot
QUICK = ("--method", "ism-bin", "--levels", "64", "--rounds", "1")
"""Enough of a search where its outcome does not matter."""

NO_EXPOSURES = "chartless: note: evidence: noise (the files record no exposure settings)\n"
"""What is said of frames without EXIF."""

FRAME_FLAGS = {"motion", "brightness-drift", "structured-difference", "correlated-noise"}
"""Doubts about how the frames were taken."""


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Without ``-o`` the result goes to the current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def photograph() -> Pixels:
    """Light of a photograph with fine detail, the brightest at 0.75."""
    return 0.75 * named_curve("srgb").inverse(camera()[::2, ::2, np.newaxis] / 255)


# Frames that are refused


def test_one_picture_gets_the_typical_curve(
    shoot: Shoot, chartless: Chartless, tmp_path: Path
) -> None:
    (only,) = shoot(n_frames=1)
    file, page = tmp_path / "camera.json", tmp_path / "camera.html"

    done = chartless("calibrate", only, "-o", file, "--report", page)

    assert done.status == 0, done.err
    assert "evidence: the typical curve (one picture, no evidence)" in done.err
    assert "no-evidence" in done.err
    assert "give two or more exposures of one scene, or the raw file" in done.err
    assert "  assumed\n" in done.out
    assert "usable with care: The curve is assumed, not measured" in done.out
    assert "typical digital camera" in page.read_text(encoding="utf-8")
    channels = json.loads(file.read_text(encoding="utf-8"))["channels"]
    assert {channel["status"] for channel in channels} == {"assumed"}
    light = tmp_path / "linear.exr"
    assert chartless("linearize", file, only, "-o", light).status == 0
    assert light.is_file()


def test_one_picture_is_no_success_under_strict(shoot: Shoot, chartless: Chartless) -> None:
    assert chartless("calibrate", *shoot(n_frames=1), "--strict", "--json").status == 3


def test_one_frame_has_no_noise(shoot: Shoot, refusal: Refusal) -> None:
    (only,) = shoot(n_frames=1)

    line = refusal("calibrate", only, "--evidence", "noise")

    assert f"two or more frames of one still scene, only {only} was given" in line


def test_the_same_file_twice(shoot: Shoot, refusal: Refusal) -> None:
    (only,) = shoot(n_frames=1)

    assert f"{only} and {only} are the same file" in refusal("calibrate", only, only)


def test_the_same_file_by_another_name(shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    (only,) = shoot(n_frames=1)
    link = tmp_path / "link.png"
    link.symlink_to(only)

    assert f"{link} and {only} are the same file" in refusal("calibrate", only, link)


@pytest.mark.parametrize("extension", ["png", "bmp"])
def test_identical_pixels(extension: str, shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    (only,) = shoot(n_frames=1)
    copy = tmp_path / f"copy.{extension}"
    with Image.open(only) as image:
        image.save(copy)

    assert f"{only} and {copy} show identical pixels" in refusal("calibrate", only, copy)


def test_identical_pixels_later_in_a_burst(shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    first, second = shoot()
    shutil.copy(second, tmp_path / "copy.png")

    line = refusal("calibrate", first, second, tmp_path / "copy.png")

    assert "show identical pixels" in line


@pytest.mark.parametrize(
    ("shape", "what"),
    [
        ((96, 256, 1), "size"),
        ((256, 192, 1), "size"),
        ((192, 256, 3), "channels"),
    ],
)
def test_frames_of_different_shape(
    shape: tuple[int, int, int], what: str, shoot: Shoot, refusal: Refusal
) -> None:
    (first,) = shoot(n_frames=1)
    (second,) = shoot(shoot.scene(*shape), name="other", n_frames=1)

    line = refusal("calibrate", first, second)

    assert line.startswith(f"the frames differ in {what}: {first} has ")
    assert str(second) in line


@pytest.mark.parametrize("n_frames", [2, 3])
def test_frames_of_random_levels_are_refused_at_once(
    n_frames: int, shoot: Shoot, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They have no displacement, drift or patches; their search took most of a minute."""
    monkeypatch.setattr("chartless.methods.LikelihoodSearch.calibrate", pytest.fail)
    levels = np.random.default_rng(0).integers(0, 256, (n_frames, 64, 64, 3)).astype(np.uint8)
    files = [shoot.write(f"{place}.png", each) for place, each in enumerate(levels)]

    line = refusal("calibrate", *files, "--evidence", "noise")

    assert line.startswith("frames 1 and 2 do not show the same scene")


def test_frames_of_different_depth(shoot: Shoot, refusal: Refusal) -> None:
    (first,) = shoot(n_frames=1)
    (second,) = shoot(name="deep", n_frames=1, bit_depth=16)

    line = refusal("calibrate", first, second)

    assert f"differ in bit depth: {first} has 8 bits, {second} has 16 bits" in line


def spoil(kind: str, good: Path) -> Path:
    """Make a file that is no good frame."""
    stem = good.with_name(kind)
    with Image.open(good) as image:
        picture = image.copy()
    light = np.asarray(picture)[..., np.newaxis] / 255
    makers: dict[str, tuple[str, Callable[[Path], object]]] = {
        "missing": (".png", lambda _: None),
        "folder": (".png", Path.mkdir),
        "empty": (".png", Path.touch),
        "text": (".png", lambda bad: bad.write_text("not a picture\n")),
        "truncated": (".png", lambda bad: bad.write_bytes(good.read_bytes()[:-1000])),
        "truncated-jpeg": (".jpg", lambda bad: cut_jpeg(picture, bad)),
        "palette": (".png", picture.convert("P").save),
        "one-bit": (".png", picture.convert("1").save),
        "float": (".tif", lambda bad: write_image(bad, light)),
        "exr": (".exr", lambda bad: write_image(bad, light)),
        "gif": (".gif", picture.save),
    }
    suffix, make = makers[kind]
    bad = stem.with_suffix(suffix)
    make(bad)
    return bad


def cut_jpeg(picture: Image.Image, path: Path) -> None:
    picture.save(path, quality=95)
    path.write_bytes(path.read_bytes()[:-2000])


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("missing", "does not exist"),
        ("folder", "is a folder"),
        ("empty", "is empty"),
        ("text", "is not a picture"),
        ("truncated", "damaged or cut short"),
        ("truncated-jpeg", "damaged or cut short"),
        ("palette", "palette"),
        ("one-bit", "1-bit"),
        ("float", "floating point"),
        ("exr", "floating point"),
        ("gif", "palette"),
    ],
)
@pytest.mark.parametrize("place", ["first", "last"])
def test_a_file_that_is_no_good_is_named(
    kind: str, why: str, place: str, shoot: Shoot, refusal: Refusal
) -> None:
    (good,) = shoot(n_frames=1)
    bad = spoil(kind, good)
    frames = (bad, good) if place == "first" else (good, bad)

    line = refusal("calibrate", *frames)

    assert line.startswith(f"{bad}: ")
    assert why in line


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads everything")
def test_a_file_that_may_not_be_read(shoot: Shoot, refusal: Refusal) -> None:
    first, second = shoot()
    second.chmod(0)

    assert refusal("calibrate", first, second).startswith(f"{second}: may not be read")


def test_a_constant_picture(shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    frames = [
        shoot.write(f"{level}.png", np.full((64, 64, 1), level, np.uint8)) for level in (100, 101)
    ]
    refusal("calibrate", *frames)


@pytest.mark.parametrize("n_channels", [1, 3])
def test_a_constant_picture_with_a_little_noise(
    shoot: Shoot, n_channels: int, refusal: Refusal, tmp_path: Path
) -> None:
    rng = np.random.default_rng(3)
    frames = [
        shoot.write(f"{name}.png", rng.integers(99, 102, (64, 64, n_channels), np.uint8))
        for name in "ab"
    ]
    line = refusal("calibrate", *frames)

    assert "cover 1% of the range, too little for a curve" in line
    assert "photograph a scene with both dark and bright parts" in line


@pytest.mark.parametrize(("level", "word"), [(255, "saturated"), (0, "black")])
def test_almost_nothing_between_black_and_white(
    shoot: Shoot, level: int, word: str, refusal: Refusal, tmp_path: Path
) -> None:
    clipped = np.random.default_rng(4).uniform(size=(192, 256, 1)) < 0.95
    frames = [
        shoot.write(f"{seed}.png", np.where(clipped, np.uint8(level), levels))
        for seed in (1, 2)
        for levels in shoot.frames(shoot.scene(), n_frames=1, seed=seed)
    ]
    line = refusal("calibrate", *frames)

    assert f"of the pixels are clipped, most of them {word}" in line


# Frames that are refused when it is gross, flagged when it is suspicious


def doubts(chartless: Chartless, *frames: Path) -> set[str]:
    """Flags, or "refused"."""
    done = chartless("calibrate", *frames, *QUICK, "--json")
    if done.status == 2:
        assert done.err.count("\n") == 1
        return {"refused", done.json["error"]}
    assert done.status == 0
    return {flag for channel in done.json["channels"] for flag in channel["flags"]}


@pytest.mark.parametrize("response", slow_but(["srgb", "linear", "gamma:0.4"], "srgb"))
@pytest.mark.parametrize("bit_depth", slow_but([8, 16], 8))
def test_clean_frames_raise_no_doubt_about_themselves(
    bit_depth: int, response: str, photograph: Pixels, shoot: Shoot, chartless: Chartless
) -> None:
    for scene in (photograph, shoot.scene(), shoot.scene(n_channels=3)):
        frames = shoot(scene, n_frames=3, response=response, bit_depth=bit_depth, seed=5)
        assert not doubts(chartless, *frames) & {*FRAME_FLAGS, "refused"}


@pytest.mark.slow
@pytest.mark.parametrize("shift", [(0, 1), (1, 0), (1, 1), (0, 2), (2, 0), (2, 2)])
def test_a_camera_that_moved_is_noticed(
    shift: tuple[int, int], photograph: Pixels, shoot: Shoot, chartless: Chartless
) -> None:
    down, across = shift
    (first,) = shoot(photograph[2:, 2:], name="before", n_frames=1, seed=1)
    (second,) = shoot(
        photograph[2 - down :, 2 - across :][:254, :254], name="after", n_frames=1, seed=2
    )

    found = doubts(chartless, first, second)

    assert found & {"refused", "motion"}, found


@pytest.mark.slow
@pytest.mark.parametrize("gain", slow_but([0.7, 0.9, 0.95, 1.05, 1.1, 1.3], 0.7, 0.95, 1.05))
@pytest.mark.parametrize("subject", ["smooth", "photograph"])
def test_brightness_that_changed_is_noticed(
    subject: str, gain: float, photograph: Pixels, shoot: Shoot, chartless: Chartless
) -> None:
    scene = photograph if subject == "photograph" else 0.75 * shoot.scene()
    (first,) = shoot(scene, name="before", n_frames=1, seed=1)
    (second,) = shoot(scene * gain, name="after", n_frames=1, seed=2)

    found = doubts(chartless, first, second)

    assert found & {"refused", "brightness-drift"}, found


def test_a_gross_change_of_brightness_is_called_one(shoot: Shoot, refusal: Refusal) -> None:
    (first,) = shoot(0.5 * shoot.scene(), name="before", n_frames=1, seed=1)
    (second,) = shoot(0.9 * shoot.scene(), name="after", n_frames=1, seed=2)

    line = refusal("calibrate", first, second)

    assert "brightness changed" in line or "light changed" in line


def test_something_that_moved_in_the_scene_is_noticed(
    photograph: Pixels, shoot: Shoot, chartless: Chartless
) -> None:
    moved = photograph.copy()
    moved[96:160, 30:94] = photograph[96:160, 130:194]
    (first,) = shoot(photograph, name="before", n_frames=1, seed=1)
    (second,) = shoot(moved, name="after", n_frames=1, seed=2)

    found = doubts(chartless, first, second)

    assert found & {"refused", "structured-difference"}, found


@pytest.mark.parametrize(("suffix", "compressed"), [("png", False), ("jpg", True)])
def test_frames_that_were_compressed_are_flagged(
    suffix: str, compressed: bool, shoot: Shoot, chartless: Chartless
) -> None:
    frames = []
    for path in shoot():
        frames.append(path.with_suffix(f".{suffix}"))
        Image.open(path).save(frames[-1], quality=100)

    done = chartless("calibrate", *frames, *QUICK, "--json")

    (channel,) = done.json["channels"]
    assert ("compressed" in channel["flags"]) == compressed


def test_a_mask_leaves_out_what_moved(
    photograph: Pixels, shoot: Shoot, chartless: Chartless, tmp_path: Path
) -> None:
    moved = photograph.copy()
    moved[96:160, 30:94] = photograph[96:160, 130:194]
    (first,) = shoot(photograph, name="before", n_frames=1, seed=1)
    (second,) = shoot(moved, name="after", n_frames=1, seed=2)
    still = np.full((*photograph.shape[:2], 1), 255, np.uint8)
    still[96:160, 30:94] = 0
    mask = shoot.write("mask.png", still)

    done = chartless("calibrate", first, second, *QUICK, "--mask", mask, "--json")

    assert done.status == 0
    (channel,) = done.json["channels"]
    assert not FRAME_FLAGS & set(channel["flags"])
    assert channel["pairs"] == np.count_nonzero(still)
    assert done.json["provenance"]["settings"]["mask"] == str(mask)


def test_noise_that_neighbours_share_is_flagged(
    shoot: Shoot, chartless: Chartless, tmp_path: Path
) -> None:
    from scipy.ndimage import gaussian_filter

    frames = []
    for seed in (1, 2):
        (levels,) = shoot.frames(shoot.scene(), n_frames=1, seed=seed)
        soft = gaussian_filter(levels.astype(float), (0.8, 0.8, 0))
        frames.append(shoot.write(f"{seed}.png", np.rint(soft).astype(np.uint8)))

    assert "correlated-noise" in doubts(chartless, *frames)


def test_strict_tells_doubt_by_the_status(shoot: Shoot, chartless: Chartless) -> None:
    frames = shoot()

    careless = chartless("calibrate", *frames, *QUICK)
    strict = chartless("calibrate", *frames, *QUICK, "--strict", "-o", "strict.json")

    assert (careless.status, strict.status) == (0, 3)
    assert strict.err == careless.err
    assert strict.err.splitlines()[1].startswith("chartless: note: search-unfinished (Y): ")
    assert Path("strict.json").is_file()


def test_strict_is_content_without_doubt(shoot: Shoot, chartless: Chartless) -> None:
    done = chartless(
        "calibrate",
        *shoot(),
        "--method",
        "ism-bin",
        "--levels",
        64,
        "--rounds",
        6,
        "--strict",
        "--json",
    )

    flags = {flag for channel in done.json["channels"] for flag in channel["flags"]}
    assert done.status == (3 if flags else 0), flags


def test_strict_does_not_change_a_refusal(shoot: Shoot, refusal: Refusal) -> None:
    refusal("calibrate", *shoot(n_frames=1), "--evidence", "noise", "--strict", "--json")


# Alpha


@pytest.mark.slow
def test_alpha_is_dropped_with_a_remark_and_changes_nothing(
    shoot: Shoot, chartless: Chartless, tmp_path: Path
) -> None:
    plain = shoot(n_channels=3)
    rng = np.random.default_rng(7)
    with_alpha = []
    for path in plain:
        with Image.open(path) as image:
            colours = np.asarray(image)
        alpha = rng.integers(0, 256, (*colours.shape[:2], 1), dtype=np.uint8)
        with_alpha.append(
            shoot.write(f"alpha-{path.name}", np.concatenate([colours, alpha], axis=2))
        )

    without = chartless("calibrate", *plain, *QUICK, "--json")
    done = chartless("calibrate", *with_alpha, *QUICK, "--json")

    assert done.json["channels"] == without.json["channels"]
    assert without.err == NO_EXPOSURES
    assert done.err.splitlines(keepends=True)[0] == NO_EXPOSURES
    assert done.err.splitlines()[1:] == [
        f"chartless: note: {path}: dropped the alpha channel" for path in with_alpha
    ]


# Settings


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--model", "ameegc2-exat", "unknown model 'ameegc2-exat'. Did you mean 'ameegc2-exact'?"),
        ("--model", "zzz", "unknown model 'zzz'. Available: "),
        ("--method", "ism_bin", "unknown method 'ism_bin'. Did you mean 'ism-bin'?"),
        ("--method", "", "unknown method ''"),
        ("--channels", "cmyk", "channels must be one of auto, rgb, luma, not 'cmyk'"),
        ("--channels", "rgb", "grey"),
        ("--levels", "0", "levels must lie between 16 and 256"),
        ("--levels", "-5", "levels must lie between 16 and 256"),
        ("--levels", "15", "levels must lie between 16 and 256"),
        ("--levels", "257", "levels must lie between 16 and 256"),
        ("--levels", "many", "--levels"),
        ("--rounds", "0", "rounds"),
        ("--rounds", "-3", "rounds"),
        ("--rounds", "1.5", "--rounds"),
        ("--iterations", "0", "iterations"),
        ("--start", "", "noise must be two numbers U,V"),
        ("--start", "much", "noise must be two numbers U,V such as 0.17,0.7, not 'much'"),
        ("--start", "0.03", "noise must be two numbers U,V"),
        ("--start", "0.03,16,1", "noise must be two numbers U,V"),
        ("--start", "0.03;16", "noise must be two numbers U,V"),
        ("--start", "-0.03,16", "U = -0.03"),
        ("--start", "0.03,0", "V = 0"),
        ("--start", "nan,16", "U = nan"),
        ("--start", "0.03,inf", "V = inf"),
        ("--curve-step", "nan", "nan"),
        ("--curve-step", "inf", "inf"),
        ("--noise-step", "nan", "nan"),
        ("--noise-step", "inf", "inf"),
        ("--shrink", "nan", "nan"),
        ("--shrink", "inf", "inf"),
    ],
)
def test_a_setting_without_meaning_is_refused(
    option: str, value: str, message: str, shoot: Shoot, refusal: Refusal
) -> None:
    line = refusal(
        "calibrate", *shoot(), "--method", "ism-bin", "--rounds", 2, "--levels", 64, option, value
    )

    assert message in line
    assert not Path("camera.json").exists()


def test_a_start_without_slope_is_a_start(shoot: Shoot, chartless: Chartless) -> None:
    done = chartless("calibrate", *shoot(), *QUICK, "--start", "0,1", "--json")

    assert done.status == 0
    assert "Warning" not in done.err


def test_a_mask_of_another_size(shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    mask = shoot.write("mask.png", np.full((10, 20, 1), 255, np.uint8))

    line = refusal("calibrate", *shoot(), "--mask", mask)

    assert "the mask is 20 × 10, the frames are 256 × 192 pixels" in line


def test_a_mask_that_is_all_black(shoot: Shoot, refusal: Refusal, tmp_path: Path) -> None:
    mask = shoot.write("mask.png", np.zeros((192, 256, 1), np.uint8))

    assert "the mask leaves no pixels" in refusal("calibrate", *shoot(), "--mask", mask)


def test_a_mask_that_does_not_exist(shoot: Shoot, refusal: Refusal) -> None:
    line = refusal("calibrate", *shoot(), "--mask", "mask.png")

    assert line.startswith("mask.png: does not exist")


# Where the result goes


@pytest.mark.parametrize(
    ("output", "why"),
    [
        ("missing/camera.json", "does not exist: create it first"),
        ("shot_0.png/camera.json", "is a file, not a folder"),
        ("folder", "is a folder: name a file in it"),
        pytest.param(
            "/dev/full",
            "is not an ordinary file",
            marks=pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device"),
        ),
    ],
)
def test_a_place_where_no_file_can_be_written(
    output: str, why: str, shoot: Shoot, refusal: Refusal, in_folder: Path
) -> None:
    frames = shoot()
    (in_folder / "folder").mkdir()
    before = sorted(in_folder.rglob("*"))

    line = refusal("calibrate", *frames, *QUICK, "-o", output)

    assert line.startswith(f"{output}: ")
    assert why in line
    assert sorted(in_folder.rglob("*")) == before


def test_a_folder_without_permission_to_write(
    shoot: Shoot, refusal: Refusal, in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = shoot()
    folder = in_folder / "closed"
    folder.mkdir(mode=0o500)
    if os.geteuid() == 0:  # whom permissions do not stop
        access = os.access

        def as_a_user(path: Any, mode: int, **options: Any) -> bool:
            return Path(path) != folder and access(path, mode, **options)

        monkeypatch.setattr(os, "access", as_a_user)

    line = refusal("calibrate", *frames, *QUICK, "-o", folder / "camera.json")

    assert f"output folder {folder} is not writable" in line
    assert list(folder.iterdir()) == []


def test_a_failure_leaves_an_older_result_alone(
    shoot: Shoot, refusal: Refusal, in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = shoot()
    older = in_folder / "camera.json"
    older.write_text("older")

    refusal("calibrate", frames[0], "--evidence", "noise")
    assert older.read_text() == "older"

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    line = refusal("calibrate", *frames, *QUICK, "-o", older)
    monkeypatch.undo()

    assert line == f"{older}: cannot be written (No space left on device)"
    assert older.read_text() == "older"
    assert sorted(in_folder.iterdir()) == sorted([older, *frames])


def test_a_frame_is_not_overwritten_by_the_result(shoot: Shoot, refusal: Refusal) -> None:
    frames = shoot()
    before = frames[1].read_bytes()

    refusal("calibrate", *frames, *QUICK, "-o", frames[1])

    assert frames[1].read_bytes() == before


def test_a_refusal_comes_as_json_too(shoot: Shoot, refusal: Refusal) -> None:
    (only,) = shoot(n_frames=1)

    refusal("calibrate", only, "--evidence", "noise", "--json")
    refusal("calibrate", only, only, "--json")
    refusal("calibrate", only, "no such file ☂.png", "--json")


# What it writes


@pytest.mark.parametrize(("n_channels", "names"), [(1, ["Y"]), (3, ["R", "G", "B"])])
def test_two_frames_make_a_calibration(
    n_channels: int, names: list[str], shoot: Shoot, chartless: Chartless
) -> None:
    frames = shoot(n_channels=n_channels)

    done = chartless("calibrate", *frames, "--method", "ism-bin", "--levels", 64, "--rounds", 3)

    assert done.status == 0
    table = done.out.splitlines()
    assert table[0].split() == [
        "channel", "U", "V", "levels", "seen", "error", "fit", "status",
    ]  # fmt: skip
    assert [line.split()[0] for line in table[1 : len(names) + 1]] == names
    assert table[-1] == "calibration of 2 frames written to camera.json"
    calibration = load(Path("camera.json"))
    assert [response.name for response in calibration.channels] == names
    assert calibration.bit_depth == 8
    for response in calibration.channels:
        assert rmse(response.curve, named_curve("srgb")) < 0.06
        assert response.n_pairs == 192 * 256


@pytest.mark.slow
def test_what_is_known_of_the_sensor_narrows_the_band(shoot: Shoot, chartless: Chartless) -> None:
    frames = simulate_frames(shoot.scene(), named_curve("srgb"), AffineNoise.of_sensor(1_000, 6))
    paths = [shoot.write(f"{place}.png", levels) for place, levels in enumerate(frames)]

    usual, told = (
        chartless("calibrate", *paths, *how, "--json").json
        for how in ((), ("--set", "noise_prior=1000,6"))
    )

    bands, errors = [], []
    for found in (usual, told):
        (channel,) = found["channels"]
        light = np.array(channel["inverse_lut"])
        truth = named_curve("srgb").inverse(np.arange(256) / 255)
        bands.append(float(np.sqrt(np.mean(np.square(channel["inverse_lut_std"])))))
        errors.append(float(np.sqrt(np.mean((light - truth) ** 2))))
    assert bands[1] < 0.7 * bands[0]
    assert errors[1] < 2 * bands[1]
    prior = told["provenance"]["settings"]["noise_prior"]
    assert prior["centre"]["slope"] == pytest.approx(1e-3)
    assert prior["centre"]["floor"] == pytest.approx(3.6e-5)


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--set", "weight"], "--set takes NAME=VALUE, such as weight=0.5, not 'weight'"),
        (["--set", "weight=much"], "--set weight takes a number, such as 0.2, not 'much'"),
        (["--set", "weight=7"], "weight must lie above 0"),
        (["--set", "noise_prior=1000"], "--set noise_prior takes electrons at white and of"),
        (["--set", "noise_prior=0,1"], "--set noise_prior takes electrons"),
        (["--set", "colour=1"], "unknown setting of likelihood 'colour'"),
        (
            ["--method", "ism-bin", "--rounds", "3", "--set", "rounds=4"],
            "--rounds is given both by",
        ),
        (["--method", "ism-bin", "--set", "rounds=1.5"], "--set rounds takes a whole number"),
        (
            ["--method", "ism-bin", "--set", "start=1"],
            "--set start takes 2 numbers, such as 0.06,1",
        ),
    ],
)
def test_settings_without_meaning_are_refused(
    arguments: list[str], why: str, shoot: Shoot, refusal: Refusal
) -> None:
    assert why in refusal("calibrate", *shoot(), *arguments)


def test_json_goes_to_standard_output_and_no_file_is_written(
    shoot: Shoot, chartless: Chartless, in_folder: Path
) -> None:
    frames = shoot()

    done = chartless("calibrate", *frames, *QUICK, "--json")

    assert done.status == 0
    assert done.json["format"] == "chartless-calibration"
    assert sorted(in_folder.iterdir()) == sorted(frames)


def test_json_with_an_output_is_the_content_of_the_file(shoot: Shoot, chartless: Chartless) -> None:
    done = chartless("calibrate", *shoot(), *QUICK, "--json", "-o", "camera.json")

    assert done.json == json.loads(Path("camera.json").read_text(encoding="utf-8"))


def no_constant(name: str) -> None:
    pytest.fail(f"{name} is not JSON")


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


@pytest.mark.parametrize("n_channels", [1, 3])
def test_the_file_holds_what_is_documented(
    n_channels: int, shoot: Shoot, chartless: Chartless
) -> None:
    frames = shoot(n_channels=n_channels)
    chartless("calibrate", *frames, *QUICK, "--method", "ism-sampled", "--model", "ameegc1")

    content = json.loads(Path("camera.json").read_text(), parse_constant=no_constant)

    assert (content["format"], content["version"]) == ("chartless-calibration", 2)
    assert (content["bit_depth"], content["levels"]) == (8, 64)
    assert (content["method"], content["model"]) == ("ism-sampled", "ameegc1")
    names = [each["name"] for each in content["channels"]]
    assert names == (["Y"] if n_channels == 1 else ["R", "G", "B"])
    for each in content["channels"]:
        assert len(each["parameters"]) == 2
        assert all(map(is_number, each["parameters"].values()))
        for key, length in (("inverse_lut", 64), ("response_lut", 1024)):
            table = each[key]
            assert len(table) == length
            assert all(map(is_number, table))
            assert (table[0], table[-1]) == (0, 1)
            assert table == sorted(table)
        assert each["inverse_lut_std"] is None or len(each["inverse_lut_std"]) == 64
        noise = each["noise"]
        assert noise["U"] == pytest.approx(255 * noise["u"])
        assert noise["V"] == pytest.approx(255**2 * noise["v"])
        assert "std" in noise
        low, high = each["observed_levels"]
        assert 0 <= low < high <= 63
        assert each["pairs"] == 192 * 256
        assert each["status"] in {status.value for status in Status}
        assert set(each["flags"]) <= {flag.code for flag in Flag}
        (account,) = each["accounts"]
        assert account["kind"] == "noise"
    (reading,) = content["evidence"]
    assert (reading["kind"], reading["inputs"]) == ("noise", [0, 1])
    provenance = content["provenance"]
    assert isinstance(provenance["chartless"], str)
    assert isinstance(provenance["created"], str)
    assert provenance["inputs"] == [
        {"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        for path in frames
    ]
    settings = provenance["settings"]
    assert (settings["model"], settings["method"]) == ("ameegc1", "ism-sampled")
    assert (settings["levels"], settings["rounds"]) == (64, 1)
    assert settings["channels"] == "auto"
    assert settings["mask"] is None


def test_sixteen_bits_are_reduced_to_the_levels_asked_for(
    shoot: Shoot, chartless: Chartless
) -> None:
    done = chartless(
        "calibrate",
        *shoot(bit_depth=16),
        "--method",
        "ism-bin",
        "--levels",
        128,
        "--rounds",
        3,
        "--json",
    )

    assert done.status == 0
    assert (done.json["bit_depth"], done.json["levels"]) == (16, 128)
    assert len(done.json["channels"][0]["inverse_lut"]) == 128


@pytest.mark.slow
def test_sixteen_and_eight_bits_tell_the_same_curve(shoot: Shoot, chartless: Chartless) -> None:
    curves = [
        chartless(
            "calibrate", *frames, "--method", "ism-bin", "--levels", 64, "--rounds", 4, "--json"
        ).json["channels"][0]["response_lut"]
        for frames in (shoot(), shoot(bit_depth=16, name="deep"))
    ]

    assert np.abs(np.subtract(*curves)).max() < 0.05


def test_luma_is_one_channel(shoot: Shoot, chartless: Chartless) -> None:
    done = chartless("calibrate", *shoot(n_channels=3), *QUICK, "--channels", "luma", "--json")

    assert [each["name"] for each in done.json["channels"]] == ["Y"]


def test_luma_of_grey_frames_is_the_frames(shoot: Shoot, chartless: Chartless) -> None:
    frames = shoot()

    runs = [
        chartless("calibrate", *frames, *QUICK, "--channels", channels, "--json")
        for channels in ("luma", "auto")
    ]

    assert runs[0].json["channels"] == runs[1].json["channels"]


def test_more_frames_are_consecutive_pairs(shoot: Shoot, chartless: Chartless) -> None:
    done = chartless("calibrate", *shoot(n_frames=5), *QUICK, "--json")

    assert done.json["channels"][0]["pairs"] == 4 * 192 * 256
    assert len(done.json["provenance"]["inputs"]) == 5


def test_equal_runs_are_equal(shoot: Shoot, chartless: Chartless) -> None:
    frames = shoot(n_channels=3)

    runs = [chartless("calibrate", *frames, *QUICK, "--json").json["channels"] for _ in "ab"]

    assert runs[0] == runs[1]
