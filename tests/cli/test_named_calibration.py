"""Names in place of calibration files, in every command that takes one."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from PIL import Image, ImageCms

Chartless = Callable[..., Any]
Refusal = Callable[..., str]
SRGB_NOTE = (
    "chartless: note: srgb: named transfer function sRGB (IEC 61966-2-1:1999, 5.2): "
    "assumed, not measured\n"
)
ICC = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """Every level in every channel, with a profile."""
    rng = np.random.default_rng(3)
    levels = np.stack([rng.permutation(256).reshape(16, 16) for _ in "RGB"], axis=-1)
    Image.fromarray(levels.astype(np.uint8)).save("photo.png", icc_profile=ICC)
    return Path("photo.png")


def read(path: str) -> Any:
    return oiio.ImageInput.open(path).read_image("unknown")


def srgb_light(photo: Path) -> Any:
    v = np.asarray(Image.open(photo)) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def test_linearize_takes_a_name(photo: Path, chartless: Chartless) -> None:
    done = chartless("linearize", "srgb", photo, "-o", "a.exr")

    assert (done.status, done.out, done.err) == (0, "a.exr\n", SRGB_NOTE)
    assert np.abs(read("a.exr") - srgb_light(photo)).max() < 1e-6


def test_linearize_goes_back_by_name(photo: Path, chartless: Chartless) -> None:
    chartless("linearize", "V-Log", photo, "-o", "a.exr")

    chartless("linearize", "vlog", "a.exr", "--inverse", "-o", "back.png")

    levels, back = np.asarray(Image.open(photo)), read("back.png") / 257
    shown = levels > 255 * 0.125  # below is black
    assert np.abs(back - levels)[shown].max() < 0.01
    assert back[~shown] == pytest.approx(255 * 0.125, abs=0.01)


def test_linearize_takes_the_profile_in_the_picture(photo: Path, chartless: Chartless) -> None:
    done = chartless("linearize", "icc", photo, "-o", "a.exr")

    assert done.status == 0
    assert done.err == (
        "chartless: note: icc: the ICC profile 'sRGB built-in' in photo.png: "
        "assumed, not measured\n"
    )
    assert np.abs(read("a.exr") - srgb_light(photo)).max() < 3e-5


def test_merge_takes_a_name(chartless: Chartless) -> None:
    scene = np.geomspace(0.002, 1, 64).reshape(8, 8, 1) * [1.0, 0.8, 0.6]
    for name, time in (("a.png", 1), ("b.png", 4)):
        v = (scene * time).clip(0, 1)
        v = np.where(v < 0.018, 4.5 * v, 1.099 * v**0.45 - 0.099)
        Image.fromarray(np.rint(255 * v).astype(np.uint8)).save(name)

    done = chartless(
        "merge", "a.png", "b.png", "-c", "rec709", "--times", "1,4", "--unbalanced", "-o", "a.exr"
    )

    assert done.status == 0, done.err
    assert "rec709: named transfer function Rec. 709 (ITU-R BT.709-6, item 1.2)" in done.err
    error = read("a.exr") / scene - 1
    assert np.abs(error[scene[..., 0] > 0.05]).max() < 0.03


def test_show_takes_a_name(chartless: Chartless) -> None:
    done = chartless("show", "srgb", "--truth", "rec709")

    assert done.status == 0
    header, row, *rest = done.out.splitlines()
    assert header.split()[:2] == ["channel", "RMSE"]
    assert row.split()[-1] == "assumed"
    assert rest[-1].startswith("usable with care: The curve is assumed, not measured")
    assert done.err == SRGB_NOTE


def test_show_prints_the_calibration_of_a_name(chartless: Chartless) -> None:
    content = chartless("show", "hlg", "--json").json

    assert (content["method"], content["channels"][0]["status"]) == ("named", "assumed")
    assert content["channels"][0]["inverse_lut"][-1] == 1


@pytest.mark.slow
def test_the_report_says_what_it_is(photo: Path, chartless: Chartless) -> None:
    chartless("show", "icc:photo.png", "--report", "a.html")

    page = Path("a.html").read_text(encoding="utf-8")
    assert "The curve that is called icc:photo.png: assumed, not measured." in page
    assert "another program" not in page


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("slog3", "slog3.cube"),
        ("slog3:limited", "slog3_limited.cube"),
        ("gamma:0.45", "gamma_0.45.cube"),
        ("icc:photo.png", "icc_photo.png.cube"),
    ],
)
def test_export_takes_a_name_and_makes_one_of_it(
    name: str, file: str, photo: Path, chartless: Chartless
) -> None:
    done = chartless("export", name, "--to", "cube")

    assert (done.status, done.out) == (0, f"{file}\n")
    assert "LUT_1D_SIZE 4096" in Path(file).read_text()


def test_fit_takes_a_name(chartless: Chartless) -> None:
    done = chartless("fit", "gamma:0.45", "--model", "gamma", "--json")

    assert done.json["parameters"]["gamma"] == pytest.approx(0.45, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["srgb", "slog3:limited"])
def test_compare_takes_a_name(name: str, chartless: Chartless) -> None:
    done = chartless("compare", name, "--json")

    assert done.json["recommended"]
    assert min(each["rmse"] for each in done.json["models"]) < 0.003


def test_a_file_comes_first(photo: Path, chartless: Chartless) -> None:
    Path("srgb").write_text("0,0\n0.25,0.5\n1,1\n")

    done = chartless("show", "srgb", "--json")

    assert done.json["method"] == "curve"
    assert chartless("fit", "srgb", "--json").json["samples"] == 3


@pytest.mark.parametrize("option", [("linearize",), ("show",), ("merge", "-c"), ("export",)])
def test_unknown_names_are_one_line(option: tuple[str, ...], photo: Path, refusal: Refusal) -> None:
    command, *before = option
    rest: dict[str, tuple[object, ...]] = {
        "linearize": (photo, "-o", "a.exr"),
        "merge": (photo, photo.rename("b.png"), "-o", "a.exr", "--times", "1,2"),
        "export": ("--to", "cube"),
    }
    told = refusal(command, *before, "sgrb", *rest.get(command, ()))

    assert told.startswith(
        "unknown file or transfer function 'sgrb'. Did you mean 'srgb'? Available: linear, srgb, "
    )


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("icc", "icc is the profile in a picture: name the picture, as in icc:photo.jpg"),
        ("icc:a.png", "a.png: does not exist: check the name"),
        ("srgb:full", "srgb takes no parameters, not 'full'"),
        ("slog3:full", "slog3 takes 'limited' alone as a parameter, not 'full'"),
        ("camera.json", "camera.json: cannot be read: No such file or directory: check the name"),
    ],
)
def test_what_cannot_be_is_one_line(name: str, told: str, refusal: Refusal) -> None:
    assert refusal("show", name) == told


def test_a_picture_without_profile_is_one_line(refusal: Refusal) -> None:
    Image.new("RGB", (4, 4)).save("a.png")

    assert refusal("linearize", "icc", "a.png", "-o", "a.exr") == (
        "a.png: has no ICC profile: name its transfer function instead, such as srgb"
    )


def test_the_help_has_examples(chartless: Chartless) -> None:
    out = chartless("linearize", "--help").out

    assert "chartless linearize srgb a.jpg -o linear.exr" in out
    assert "slog3" in out


def test_what_is_kept_can_be_used_again(photo: Path, chartless: Chartless) -> None:
    Path("a.json").write_text(chartless("show", "srgb", "--json").out)

    chartless("linearize", "a.json", photo, "-o", "a.exr")

    assert json.loads(Path("a.json").read_text())["provenance"]["settings"]["name"] == "srgb"
    assert np.abs(read("a.exr") - srgb_light(photo)).max() < 1e-6
