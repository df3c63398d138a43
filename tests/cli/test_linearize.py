"""``chartless linearize``: g of every level, and f to go back."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from PIL import Image

from chartless import load

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot


def luts(calibration: Path) -> Pixels:
    """Table of g as other programs read it, shape (channels, levels)."""
    content = json.loads(calibration.read_text())
    return np.array([channel["inverse_lut"] for channel in content["channels"]])


def expected(calibration: Path, levels: Pixels) -> Pixels:
    tables = luts(calibration)
    return np.stack([table[levels[..., c]] for c, table in enumerate(tables)], axis=-1)


def read(path: Path) -> Pixels:
    """Samples as stored, shape (height, width, channels)."""
    pixels: Pixels = oiio.ImageInput.open(str(path)).read_image("unknown")
    return pixels


def remarks(done: Any) -> list[str]:
    """Lines on standard error, but for the one about the calibration."""
    _, *rest = done.err.splitlines()
    return list(rest)


@pytest.fixture
def picture(shoot: Shoot, tmp_path: Path) -> Path:
    """Every level in every channel."""
    rng = np.random.default_rng(11)
    levels = np.stack([rng.permutation(256 * 3).reshape(24, 32) % 256 for _ in "RGB"], axis=-1)
    return shoot.write("picture.png", levels.astype(np.uint8))


@pytest.fixture
def grey_picture(shoot: Shoot, tmp_path: Path) -> Path:
    levels = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    return shoot.write("grey.png", levels)


# Values


@pytest.mark.parametrize("extension", ["exr", "tif"])
def test_floats_are_g_of_the_levels(
    extension: str, picture: Path, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / f"light.{extension}"

    done = chartless("linearize", colour_camera, picture, "-o", output)

    assert (done.status, done.out) == (0, f"{output}\n")
    (verdict,) = done.err.splitlines()
    assert verdict.startswith(f"chartless: note: {colour_camera}: do not trust: ")
    light = read(output)
    assert light.dtype == np.float32
    wanted = expected(colour_camera, read(picture))
    assert np.abs(light - wanted).max() <= 1e-6


def test_png_is_g_of_the_levels_to_half_a_step(
    picture: Path, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "light.png"

    chartless("linearize", colour_camera, picture, "-o", output)

    light = read(output)
    assert light.dtype == np.uint16
    wanted = 65535 * expected(colour_camera, read(picture))
    assert np.abs(light - wanted).max() <= 0.5 + 65535 * 1e-7  # half a step, in float32


def test_grey_is_g_of_the_levels(
    grey_picture: Path, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "light.exr"

    chartless("linearize", grey_camera, grey_picture, "-o", output)

    light = read(output)
    assert light.shape == (16, 16, 1)
    assert np.abs(light.ravel() - luts(grey_camera)[0]).max() <= 1e-6


def test_sixteen_bits_are_g_of_their_brightness(
    shoot: Shoot, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    levels = np.arange(15, 65536, 16, dtype=np.uint16).reshape(64, 64, 1)
    picture = shoot.write("deep.png", levels)
    output = tmp_path / "light.exr"

    chartless("linearize", grey_camera, picture, "-o", output)

    wanted = load(grey_camera).channel("Y").curve.inverse(levels / 65535)
    assert np.abs(read(output) - wanted).max() <= 1e-6


def test_a_calibration_of_luma_serves_every_channel(
    picture: Path, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "light.exr"

    chartless("linearize", grey_camera, picture, "-o", output)

    wanted = luts(grey_camera)[0][read(picture)]
    assert np.abs(read(output) - wanted).max() <= 1e-6


def test_equal_light_stays_in_proportion(
    shoot: Shoot, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    """Twice the light gives twice the value, if the calibration is the truth."""
    curve = load(grey_camera).channel("Y").curve
    light = np.array([[0.1, 0.2, 0.4, 0.8]])
    levels = np.rint(65535 * curve.response(light)).astype(np.uint16)[..., np.newaxis]
    picture = shoot.write("steps.png", levels)

    chartless("linearize", grey_camera, picture, "-o", tmp_path / "light.exr")

    assert read(tmp_path / "light.exr").ravel() == pytest.approx(light.ravel(), abs=1e-4)


@pytest.mark.parametrize("through", ["exr", "tif", "png"])
def test_inverse_brings_the_levels_back(
    through: str, picture: Path, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    light, back = tmp_path / f"light.{through}", tmp_path / "back.png"

    chartless("linearize", colour_camera, picture, "-o", light)
    done = chartless("linearize", "--inverse", colour_camera, light, "-o", back)

    assert (done.status, remarks(done)) == (0, [])
    levels = read(picture)
    # 16 bits of light hold fewer steps near black than 8 bits of brightness do.
    seen = levels > 12 if through == "png" else np.ones(levels.shape, bool)
    assert np.abs(read(back) / 257 - levels)[seen].max() <= 1


# Files


def test_many_pictures_into_a_folder(
    shoot: Shoot, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    pictures = shoot(n_channels=3, n_frames=3)
    folder = tmp_path / "light"
    folder.mkdir()

    done = chartless("linearize", colour_camera, *pictures, "-o", folder, "--format", "tif")

    written = [folder / f"{path.stem}.tif" for path in pictures]
    assert (done.status, remarks(done)) == (0, [])
    assert done.out.splitlines() == [str(path) for path in written]
    assert sorted(folder.iterdir()) == written
    for path, picture in zip(written, pictures, strict=True):
        wanted = expected(colour_camera, read(picture))
        assert np.abs(read(path) - wanted).max() <= 1e-6


def test_the_format_in_a_folder_is_exr_unless_told(
    picture: Path, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    folder = tmp_path / "light"
    folder.mkdir()

    chartless("linearize", colour_camera, picture, "-o", folder)

    assert [path.name for path in folder.iterdir()] == ["picture.exr"]


def test_many_pictures_need_a_folder(
    picture: Path, grey_picture: Path, grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "light.exr"

    line = refusal("linearize", grey_camera, picture, grey_picture, "-o", output)

    assert f"{output} is not a folder, and 2 pictures need one: create it first" in line
    assert not output.exists()


def test_pictures_of_one_name_do_not_overwrite_each_other(
    picture: Path, grey_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    other = picture.with_suffix(".bmp")
    with Image.open(picture) as image:
        image.save(other)
    folder = tmp_path / "light"
    folder.mkdir()

    line = refusal("linearize", grey_camera, picture, other, "-o", folder)

    assert f"both be written to {folder / 'picture.exr'}" in line
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("way", ["same name", "folder", "link"])
def test_a_picture_is_not_overwritten_by_its_result(
    way: str, picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    before = picture.read_bytes()
    output = picture
    arguments: list[Any] = []
    if way == "folder":
        output, arguments = tmp_path, ["--format", "png"]
    elif way == "link":
        output = tmp_path / "link.png"
        output.symlink_to(picture)

    line = refusal("linearize", colour_camera, picture, "-o", output, *arguments)

    assert f"{picture} would be overwritten by its own result" in line
    assert picture.read_bytes() == before


def test_a_later_picture_is_not_overwritten_by_an_earlier_result(
    picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    """Result of other/a.tif would be a.png, which is still to be read."""
    folder = tmp_path / "other"
    folder.mkdir()
    first = folder / "picture.bmp"
    with Image.open(picture) as image:
        image.save(first)
    before = picture.read_bytes()

    refusal("linearize", colour_camera, first, picture, "-o", tmp_path, "--format", "png")

    assert picture.read_bytes() == before


def test_alpha_is_dropped_with_a_remark(
    picture: Path, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    with_alpha = tmp_path / "alpha.png"
    with Image.open(picture) as image:
        image.putalpha(77)
        image.save(with_alpha)

    chartless("linearize", colour_camera, picture, "-o", tmp_path / "a.exr")
    done = chartless("linearize", colour_camera, with_alpha, "-o", tmp_path / "b.exr")

    assert done.status == 0
    assert remarks(done) == [f"chartless: note: {with_alpha}: dropped the alpha channel"]
    assert np.array_equal(read(tmp_path / "a.exr"), read(tmp_path / "b.exr"))


def test_a_picture_that_cannot_be_read_stops_what_comes_after(
    shoot: Shoot, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    pictures = shoot(n_channels=3, n_frames=12)
    pictures[3].write_bytes(pictures[3].read_bytes()[:2000])
    folder = tmp_path / "light"

    line = refusal("linearize", colour_camera, *pictures, "-o", folder, "--format", "tif")

    assert line.startswith(f"{pictures[3]}: is damaged or cut short")
    written = sorted(folder.iterdir())
    wanted = {folder / f"{path.stem}.tif": path for path in pictures}
    assert {folder / f"{path.stem}.tif" for path in pictures[:3]} <= set(written)
    assert len(written) <= 6
    for path in written:
        light = expected(colour_camera, read(wanted[path]))
        assert np.abs(read(path) - light).max() <= 1e-6


def test_remarks_of_several_pictures_come_once_and_in_order(
    shoot: Shoot, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    pictures = shoot(n_channels=3, n_frames=4)
    for path in pictures:
        with Image.open(path) as image:
            image.putalpha(77)
            image.save(path)

    done = chartless("linearize", colour_camera, *pictures, "-o", tmp_path / "light")

    notes = [f"chartless: note: {path}: dropped the alpha channel" for path in pictures]
    assert remarks(done) == notes


def test_orientation_is_kept(grey_camera: Path, chartless: Chartless, tmp_path: Path) -> None:
    levels = np.arange(0, 240, dtype=np.uint8).reshape(12, 20)
    exif = Image.Exif()
    exif[0x0112] = 6
    picture = tmp_path / "turned.jpg"
    Image.fromarray(levels).save(picture, exif=exif, quality=100)

    chartless("linearize", grey_camera, picture, "-o", tmp_path / "light.exr")
    chartless("linearize", grey_camera, picture, "-o", tmp_path / "light.png")

    spec = oiio.ImageInput.open(str(tmp_path / "light.exr")).spec()
    assert spec.getattribute("Orientation") == 6
    assert (spec.width, spec.height) == (20, 12)
    assert read(tmp_path / "light.png").shape == (20, 12, 1)  # upright


# Refusals


def test_a_calibration_of_colours_does_not_fit_a_grey_picture(
    grey_picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "light.exr"

    line = refusal("linearize", colour_camera, grey_picture, "-o", output)

    assert "the calibration has the channels R, G, B, the picture has 1" in line
    assert str(grey_picture) in line
    assert not output.exists()


@pytest.mark.parametrize(
    ("output", "why"),
    [
        ("light.jpg", "pictures are written as .exr, .tif, .tiff, .png, .hdr, not as '.jpg'"),
        ("missing/light.exr", "does not exist: create it first"),
        ("picture.png/light.exr", "is a file, not a folder"),
    ],
)
def test_a_place_where_no_picture_can_be_written(
    output: str, why: str, picture: Path, colour_camera: Path, refusal: Refusal
) -> None:
    tmp_path = picture.parent
    before = sorted(tmp_path.rglob("*"))

    line = refusal("linearize", colour_camera, picture, "-o", tmp_path / output)

    assert line.startswith(f"{tmp_path / output}: ")
    assert why in line
    assert sorted(tmp_path.rglob("*")) == before


def test_an_unknown_format_in_a_folder(
    picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    line = refusal("linearize", colour_camera, picture, "-o", tmp_path / "new", "--format", "jpg")

    assert "not as '.jpg'" in line
    assert not (tmp_path / "new").exists()


def test_a_format_beside_the_name_of_a_file_is_refused(
    picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "linear.exr"

    line = refusal("linearize", colour_camera, picture, "-o", output, "--format", "tif")

    why = f"--format applies to files in a folder; the format of {output} follows from its name"
    assert line == why
    assert not output.exists()


def test_a_picture_that_cannot_be_read_leaves_an_older_result_alone(
    colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "light.exr"
    output.write_text("older")
    (tmp_path / "empty.png").touch()

    line = refusal("linearize", colour_camera, tmp_path / "empty.png", "-o", output)

    assert line.startswith(f"{tmp_path / 'empty.png'}: is empty")
    assert output.read_text() == "older"


def test_floats_are_no_levels_to_linearize(
    colour_camera: Path, picture: Path, chartless: Chartless, refusal: Refusal, tmp_path: Path
) -> None:
    light = tmp_path / "light.exr"
    chartless("linearize", colour_camera, picture, "-o", light)

    line = refusal("linearize", colour_camera, light, "-o", tmp_path / "twice.exr")

    assert line.startswith(f"{light}: is floating point")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (None, "cannot be read: No such file or directory"),
        ("", "not a calibration file: not JSON"),
        ('{"format": "chartless-cal', "not a calibration file: not JSON"),
        ("[1, 2]", "not a calibration file"),
        ('{"a": 1}', "not a calibration file"),
        ('{"format": "chartless-truth", "version": 1}', "not a calibration file"),
        ('{"format": "chartless-calibration", "version": 7}', "version 7"),
        ('{"format": "chartless-calibration", "version": 1}', "damaged calibration file"),
    ],
)
def test_a_calibration_that_is_none(
    content: str | None, why: str, picture: Path, refusal: Refusal, tmp_path: Path
) -> None:
    calibration = tmp_path / "camera.json"
    if content is not None:
        calibration.write_text(content)

    line = refusal("linearize", calibration, picture, "-o", tmp_path / "light.exr")

    assert line.startswith(f"{calibration}: ")
    assert why in line


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_without_permission_to_write(
    picture: Path, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o500)

    assert "is not writable" in refusal("linearize", colour_camera, picture, "-o", folder)


def test_a_picture_beside_itself_under_another_folder_is_fine(
    shoot: Shoot, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    (picture,) = shoot(shoot.scene(), n_frames=1)
    folder = tmp_path / "out"
    folder.mkdir()
    shutil.copy(picture, folder / "older.exr")

    done = chartless("linearize", grey_camera, picture, "-o", folder / "older.exr")

    assert done.status == 0
    assert read(folder / "older.exr").dtype == np.float32
