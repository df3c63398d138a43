"""``chartless calibrate`` with raw files: beside their pictures, and as frames themselves."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_content import fact_of
from PIL import Image
from raw_cameras import XTRANS, Camera, patches, write_dng
from scipy.ndimage import gaussian_filter

from chartless import calibrate, load, named_curve
from chartless.errors import ParameterError
from chartless.result.response import rmse

Chartless = Callable[..., Any]
Refusal = Callable[..., str]


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """IMG_1 and IMG_2, each as .JPG and .dng."""
    folder = tmp_path_factory.mktemp("shots")
    Camera().store(folder, "IMG_1", patches())
    Camera().store(folder, "IMG_2", patches(seed=1), exposure=0.6)
    return folder


def test_a_picture_and_its_raw_file_give_a_calibration(
    shots: Path, tmp_path: Path, chartless: Chartless
) -> None:
    output = tmp_path / "camera.json"
    done = chartless(
        "calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_1.dng", "-o", output, "--strict"
    )

    assert done.status == 0, done.err
    assert "note: evidence: a raw file beside its picture" in done.err
    assert "scatter " in done.out
    assert "calibration of 2 files written" in done.out
    camera = load(output)
    for response in camera.channels:
        assert rmse(response.curve, named_curve("srgb")) < 0.012
        assert response.method == "likelihood"
    names = [Path(each["file"]).name for each in camera.provenance["inputs"]]
    assert names == ["IMG_1.JPG", "IMG_1.dng"]
    assert all(len(each["sha256"]) == 64 for each in camera.provenance["inputs"])
    assert chartless("show", output).status == 0
    linear = tmp_path / "linear.exr"
    assert chartless("linearize", output, shots / "IMG_2.JPG", "-o", linear).status == 0


def test_pairs_are_matched_by_name(shots: Path, chartless: Chartless) -> None:
    raw = ["--raw", shots / "IMG_2.dng", "--raw", shots / "IMG_1.dng"]
    done = chartless("calibrate", shots / "IMG_1.JPG", shots / "IMG_2.JPG", *raw, "--json")

    assert done.status == 0, done.err
    content = done.json
    assert content["method"] == "likelihood"
    names = [Path(each["file"]).name for each in content["provenance"]["inputs"]]
    assert names == ["IMG_1.JPG", "IMG_1.dng", "IMG_2.JPG", "IMG_2.dng"]
    for channel in content["channels"]:
        assert len(fact_of(channel, "raw", "gains")) == 2
        assert channel["noise"] is None
        assert len(channel["inverse_lut_std"]) == 256


def test_luma_a_family_and_fewer_levels(shots: Path, chartless: Chartless) -> None:
    done = chartless(
        *("calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_1.dng", "--channels", "luma"),
        *("--levels", 64, "--model", "ameegc2-exact", "--json"),
    )

    (channel,) = done.json["channels"]
    assert done.json["model"] == "ameegc2-exact"
    assert len(channel["inverse_lut"]) == 64
    found = np.interp(np.linspace(0, 1, 50), np.linspace(0, 1, 1024), channel["response_lut"])
    truth = named_curve("srgb").response(np.linspace(0, 1, 50))
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.03


@pytest.mark.slow
def test_a_mask_leaves_pixels_out(shots: Path, tmp_path: Path, chartless: Chartless) -> None:
    pixels = np.zeros((384, 512), np.uint8)
    pixels[:, :256] = 255
    Image.fromarray(pixels).save(tmp_path / "mask.png")
    arguments = ("calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_1.dng", "--json")

    whole, half = (
        chartless(*arguments, *more).json["channels"][1]["pairs"]
        for more in ((), ("--mask", tmp_path / "mask.png"))
    )
    assert 0.3 * whole < half < 0.7 * whole


@pytest.mark.slow
def test_an_x_trans_sensor_is_read(tmp_path: Path, chartless: Chartless) -> None:
    picture, raw = Camera(pattern=XTRANS).store(tmp_path, "a", patches(720, 960))
    done = chartless("calibrate", picture, "--raw", raw, "--json")

    for channel in done.json["channels"]:
        found = np.array(channel["response_lut"])
        truth = named_curve("srgb").response(np.linspace(0, 1, 1024))
        assert np.sqrt(np.mean((found - truth) ** 2)) < 0.02


# What is refused


def test_names_that_do_not_match_are_refused(shots: Path, refusal: Refusal) -> None:
    one, two = shots / "IMG_1.JPG", shots / "IMG_2.JPG"
    raw = ["--raw", shots / "IMG_1.dng"]

    message = refusal("calibrate", one, two, *raw)
    assert message == f"{two}: no raw file has its name: give it as --raw, or omit the picture"
    message = refusal("calibrate", one, *raw, "--raw", shots / "IMG_2.dng")
    assert message.endswith("IMG_2.dng: no picture has its name: give its JPEG, such as IMG_2.JPG")
    message = refusal("calibrate", one, one, *raw)
    assert f"{one} and {one} are the same file" in message


def test_another_shot_and_another_size_are_refused(
    shots: Path, tmp_path: Path, refusal: Refusal
) -> None:
    message = refusal("calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_2.dng")
    assert "IMG_1.JPG does not show the same scene as" in message
    small = tmp_path / "IMG_1.JPG"
    Image.open(shots / "IMG_1.JPG").resize((256, 192)).save(small)
    message = refusal("calibrate", small, "--raw", shots / "IMG_1.dng", "--json")
    assert "IMG_1.JPG is 256 × 192 pixels" in message
    assert "give the JPEG of the same shot at full size" in message
    large = tmp_path / "IMG_2.JPG"
    Image.open(shots / "IMG_2.JPG").resize((1024, 768)).save(large)
    message = refusal("calibrate", large, "--raw", shots / "IMG_2.dng")
    assert "IMG_2.JPG is 1024 × 768 pixels" in message


def test_damaged_and_foreign_raw_files_are_refused_in_one_line(
    shots: Path, tmp_path: Path, refusal: Refusal
) -> None:
    cut = tmp_path / "IMG_1.dng"
    cut.write_bytes((shots / "IMG_1.dng").read_bytes()[:200_000])
    message = refusal("calibrate", shots / "IMG_1.JPG", "--raw", cut)
    assert message == f"{cut}: is damaged or cut short: copy it again from the camera or card"
    message = refusal("calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_2.JPG")
    assert "IMG_2.JPG: is not a raw file that LibRaw" in message


def test_without_rawpy_one_line_says_what_to_install(
    shots: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rawpy", None)

    message = refusal("calibrate", shots / "IMG_1.JPG", "--raw", shots / "IMG_1.dng")
    assert message.endswith(
        "IMG_1.dng: is a raw file, which rawpy reads: in the folder of chartless, run "
        "pip install '.[raw]'"
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ("--method", "nlf"),
            "nlf uses noise only; noise needs two or more frames",
        ),
        (("--times", "1"), "--times has no effect on a raw file beside its picture"),
        (("--evidence", "noise"), "noise needs two or more frames of one still scene, only "),
        (("--evidence", "raw,bracket"), "the files record no exposure settings: give --times"),
        (("--shared-noise",), "--shared-noise has no effect on a raw file beside its picture"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    shots: Path, refusal: Refusal, arguments: tuple[str, ...], says: str
) -> None:
    given = (shots / "IMG_1.JPG", "--raw", shots / "IMG_1.dng", *arguments)

    assert refusal("calibrate", *given).startswith(says)


def test_raw_files_that_are_missing_are_asked_for(shots: Path, refusal: Refusal) -> None:
    message = refusal("calibrate", shots / "IMG_1.JPG", shots / "IMG_2.JPG", "--evidence", "raw")

    assert message == "no raw files were given: give those of the pictures as --raw"


def test_a_raw_file_is_not_overwritten(shots: Path, refusal: Refusal) -> None:
    raw = shots / "IMG_1.dng"
    before = raw.read_bytes()

    message = refusal("calibrate", shots / "IMG_1.JPG", "--raw", raw, "-o", raw)
    assert message.endswith("would be overwritten: choose another output")
    assert raw.read_bytes() == before


def test_arrays_have_no_names_to_match(shots: Path) -> None:
    with pytest.raises(ParameterError, match="matched by their names: give files, not arrays"):
        calibrate([np.zeros((8, 8, 3), np.uint8)], raw=[shots / "IMG_1.dng"])


# Raw files as frames


@pytest.mark.slow
def test_a_bracket_of_raw_files_is_linear(tmp_path: Path, chartless: Chartless) -> None:
    scene = gaussian_filter(patches(512, 640), (2, 2, 0))
    camera = Camera(noise=(1e-4, 2e-6))
    frames = [
        camera.store(tmp_path, f"{k}", scene, exposure=2.0 ** (k - 2), seed=k)[1] for k in range(4)
    ]
    done = chartless("calibrate", *frames, "--times", "1,2,4,8", "--json")

    assert done.status == 0, done.err
    assert "the response is linear within 0.01" in done.err
    assert "read levels 256 to 4095 of the sensor" in done.err
    assert done.json["bit_depth"] == 16
    for channel in done.json["channels"]:
        light = np.linspace(0, 1, 1024)
        assert np.sqrt(np.mean((np.array(channel["response_lut"]) - light) ** 2)) < 0.006


def test_noise_of_raw_files_comes_with_a_warning(tmp_path: Path, chartless: Chartless) -> None:
    scene = gaussian_filter(patches(256, 320), (2, 2, 0))
    camera = Camera(noise=(1e-4, 1e-5))
    frames = [camera.store(tmp_path, f"{k}", 1.2 * scene, seed=k)[1] for k in range(2)]
    for jobs in (1, 2):
        done = chartless("calibrate", *frames, "--method", "nlf", "--jobs", jobs, "--json")

        assert done.status == 0, done.err
        assert "note: noise determines to about 0.02 whether raw files are linear" in done.err


def test_raw_files_are_neither_linearized_nor_merged(
    tmp_path: Path, grey_camera: Path, refusal: Refusal
) -> None:
    raw = write_dng(tmp_path / "a.dng", np.full((32, 32), 999, np.uint16))

    other = write_dng(tmp_path / "b.dng", np.full((32, 32), 999, np.uint16))
    for command in (
        ("linearize", grey_camera, raw, "-o", tmp_path / "a.exr"),
        ("merge", raw, other, "--calibration", grey_camera, "-o", tmp_path / "a.exr"),
    ):
        assert "a.dng: is a raw file, whose levels are linear already" in refusal(*command)
