"""``chartless merge``: files in, radiance out."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest

from chartless import AffineNoise, Calibration, Response, named_curve, save
from chartless.curves import SampledCurve
from chartless.images import read_values
from chartless.result.response import Status
from chartless.simulate import simulate_frames

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]

SRGB = named_curve("srgb")
NOISE = AffineNoise.from_8bit(0.01, 0.5)
TIMES = (1 / 8, 1 / 2, 2.0)
N_COLOURS = 3


def exif(time: float, **more: object) -> dict[str, object]:
    return {"ExposureTime": time, "FNumber": 4.0, "Exif:ISOSpeedRatings": 200} | more


def write(path: Path, levels: Pixels, attributes: dict[str, object]) -> Path:
    height, width, n_channels = levels.shape
    spec = oiio.ImageSpec(width, height, n_channels, "uint8")
    spec["Exif:ColorSpace"] = 65535
    for name, value in attributes.items():
        spec[name] = value
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    target.write_image(np.ascontiguousarray(levels))
    target.close()
    return path


@pytest.fixture
def scene() -> Pixels:
    """Radiance in units of white at one second, f/4 and ISO 200, over eight stops."""
    ramp = np.exp2(np.linspace(-5, 2.7, 48))
    grey = np.broadcast_to(ramp, (128, 48))[..., np.newaxis]
    return grey * [1.0, 0.7, 0.5]


Bracket = Callable[..., list[Path]]


@pytest.fixture
def bracket(scene: Pixels, tmp_path: Path) -> Bracket:
    """Files of exposures of the scene."""

    def shoot(
        times: tuple[float, ...] = TIMES,
        attributes: Callable[[float], dict[str, object]] = exif,
        n_channels: int = N_COLOURS,
    ) -> list[Path]:
        frames = []
        for k, t in enumerate(times):
            (levels,) = simulate_frames(scene * t, SRGB, NOISE, n_frames=1, seed=k)
            path = tmp_path / f"shot_{k}.png"
            frames.append(write(path, levels[..., :n_channels], attributes(t)))
        return frames

    return shoot


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    """The true calibration."""
    curve = SampledCurve.from_inverse(SRGB.inverse(np.arange(256) / 255))
    channels = tuple(
        Response(
            name=name,
            curve=curve,
            noise=NOISE,
            n_levels=256,
            observed_levels=(0, 255),
            n_pairs=0,
            method="known",
            status=Status.CONVERGED,
        )
        for name in "RGB"
    )
    path = tmp_path / "camera.json"
    save(Calibration(channels=channels, bit_depth=8), path)
    return path


def opened(path: Path) -> tuple[Pixels, oiio.ImageSpec]:
    source = oiio.ImageInput.open(str(path))
    return source.read_image("unknown"), source.spec()


# Values


@pytest.mark.parametrize("extension", ["exr", "tif", "hdr"])
def test_radiance_is_that_of_the_scene(  # noqa: PLR0917 - fixtures
    extension: str,
    bracket: Bracket,
    camera: Path,
    scene: Pixels,
    chartless: Chartless,
    tmp_path: Path,
) -> None:
    output = tmp_path / f"merged.{extension}"

    done = chartless("merge", *bracket(), "-c", camera, "-o", output)

    assert (done.status, done.err) == (0, "")
    found = read_values(output).values
    unit = 200 / 4**2  # ISO/N²
    assert found.dtype == np.float32
    assert found.mean(axis=0) == pytest.approx(scene.mean(axis=0) / unit, rel=0.03)


def test_times_are_used_in_place_of_exif(
    bracket: Bracket, camera: Path, scene: Pixels, chartless: Chartless, tmp_path: Path
) -> None:
    frames = bracket(attributes=lambda _: exif(1.0))
    output = tmp_path / "merged.exr"

    done = chartless("merge", *frames, "-c", camera, "-o", output, "--times", "1/8, 0.5,2")

    assert done.status == 0
    found = read_values(output).values
    assert found.mean(axis=0) == pytest.approx(scene.mean(axis=0), rel=0.03)


def test_repeated_exposures_are_all_used(
    bracket: Bracket, camera: Path, scene: Pixels, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "merged.exr"
    spreads = []
    for times in ((0.5, 2.0), (0.5, 2.0, *[0.5] * 8)):
        done = chartless("merge", *bracket(times), "-c", camera, "-o", output)
        assert done.status == 0
        spreads.append(read_values(output).values[:, 35:40, 0].std(axis=0).mean())

    assert spreads[1] < spreads[0] / 2


def test_the_order_of_frames_does_not_matter(
    bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    frames = bracket()
    for name, order in (("a.exr", (0, 1, 2)), ("b.exr", (2, 0, 1))):
        chartless("merge", *(frames[k] for k in order), "-c", camera, "-o", tmp_path / name)

    assert np.array_equal(*(read_values(tmp_path / name).values for name in ("a.exr", "b.exr")))


def test_a_response_of_opencv_is_a_calibration(
    bracket: Bracket, scene: Pixels, chartless: Chartless, tmp_path: Path
) -> None:
    lut = np.repeat(SRGB.inverse(np.arange(256) / 255) / SRGB.inverse(128 / 255), 3)
    numbers = ", ".join(f"{value:.9g}" for value in lut)
    crf = tmp_path / "crf"  # recognised by content
    crf.write_text(
        f'%YAML:1.0\n---\nresponse: !!opencv-matrix\n   rows: 256\n   cols: 1\n   dt: "3f"\n'
        f"   data: [ {numbers} ]\n"
    )
    output = tmp_path / "merged.exr"

    done = chartless("merge", *bracket(), "-c", crf, "-o", output, "--times", "1/8,1/2,2")

    assert (done.status, done.err) == (0, "")
    found = read_values(output).values
    assert found.mean(axis=0) == pytest.approx(scene.mean(axis=0), rel=0.05)


def test_remarks_of_the_calibration_and_the_frames_are_shown(
    bracket: Bracket, chartless: Chartless, tmp_path: Path
) -> None:
    numbers = ", ".join(
        [".Nan", *(f"{value:.9g}" for value in SRGB.inverse(np.arange(1, 256) / 255))]
    )
    crf = tmp_path / "crf.yml"
    crf.write_text(
        f"%YAML:1.0\n---\nr: !!opencv-matrix\n   rows: 256\n   cols: 1\n   dt: f\n"
        f"   data: [ {numbers} ]\n"
    )
    frames = bracket()
    levels = opened(frames[0])[0]
    opaque = np.full((*levels.shape[:2], 1), 255, dtype=np.uint8)
    write(frames[0], np.concatenate([levels, opaque], axis=2), exif(TIMES[0]))

    done = chartless("merge", *frames, "-c", crf, "-o", tmp_path / "merged.exr")

    first, second = done.err.splitlines()
    assert first == f"chartless: note: {crf}: channel Y: filled 1 levels without value"
    assert second.startswith(f"chartless: note: {frames[0]}: dropped the alpha channel")


# What else the file says


def test_exr_keeps_unit_exposures_and_settings(
    bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "merged.exr"
    frames = bracket(attributes=lambda t: exif(t, Make="Maker", Model="One", Orientation=6))

    chartless("merge", *frames, "-c", camera, "-o", output)

    values, spec = opened(output)
    assert values.dtype == np.float32
    exposures = np.array(TIMES) * 200 / 16
    assert spec.getattribute("chartless:exposures") == pytest.approx(exposures)
    assert spec.getattribute("chartless:radianceUnit") == "N^2/(ISO s), by EXIF"
    assert spec.getattribute("chartless:referenceExposure") == pytest.approx(exposures[1])
    assert spec.getattribute("ExposureTime") == 0.5
    assert spec.getattribute("FNumber") == 4
    assert spec.getattribute("Exif:PhotographicSensitivity") == 200
    assert spec.getattribute("Model") == "Maker One"
    assert spec.getattribute("Orientation") == 6
    assert "N^2/(ISO s)" in spec.getattribute("ImageDescription")


@pytest.mark.parametrize(
    ("options", "unit"),
    [((), "1/s, by EXIF"), (("--times", "1,4,16"), "1/time, as --times gives it")],
)
def test_the_unit_follows_from_where_the_exposures_come_from(  # noqa: PLR0917 - fixtures
    options: tuple[str, ...],
    unit: str,
    bracket: Bracket,
    camera: Path,
    chartless: Chartless,
    tmp_path: Path,
) -> None:
    output = tmp_path / "merged.tif"
    frames = bracket(attributes=lambda t: {"ExposureTime": t})

    done = chartless("merge", *frames, "-c", camera, "-o", output, "--json", *options)

    assert done.json["unit"] == unit
    assert unit in opened(output)[1].getattribute("ImageDescription")


def test_json(bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path) -> None:
    output = tmp_path / "merged.exr"

    told = chartless("merge", *bracket(), "-c", camera, "-o", output, "--json").json

    assert told["output"] == str(output)
    assert told["size"] == [48, 128]
    assert told["exposures"] == pytest.approx([t * 200 / 16 for t in TIMES])
    assert (told["saturated"], told["black"]) == (0, 0)
    assert told["dynamic_range_stops"] == pytest.approx(8.7, abs=0.3)


def test_three_lines_for_people(
    bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / "merged.exr"

    done = chartless("merge", *bracket(), "-c", camera, "-o", output)

    first, second, third = done.out.splitlines()
    assert first == f"{output}: 48 × 128, a bracket of 3 exposures, 1 to 16 by EXIF"
    assert second.startswith("radiance  over 8.")
    assert "in N^2/(ISO s), by EXIF" in second
    assert third.startswith("clipped   ")


def test_a_grey_bracket_in_every_format(
    bracket: Bracket, grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    frames = bracket(n_channels=1)
    for extension, n_channels in (("exr", 1), ("tif", 1), ("hdr", 3)):
        output = tmp_path / f"merged.{extension}"

        assert chartless("merge", *frames, "-c", grey_camera, "-o", output).status == 0
        assert opened(output)[0].shape == (128, 48, n_channels)


def test_a_radiance_file_is_upright(
    bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    frames = bracket(attributes=lambda t: exif(t, Orientation=6))

    chartless("merge", *frames, "-c", camera, "-o", tmp_path / "merged.hdr")

    assert opened(tmp_path / "merged.hdr")[0].shape == (48, 128, 3)


def test_white_and_bloom_are_passed_on(
    bracket: Bracket, camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    frames, output = bracket(), tmp_path / "merged.exr"
    plain = chartless("merge", *frames, "-c", camera, "-o", output, "--json").json["saturated"]
    before = read_values(output).values

    dim = chartless("merge", *frames, "-c", camera, "-o", output, "--json", "--white", 180).json
    chartless("merge", *frames, "-c", camera, "-o", output, "--bloom-radius", 4)

    assert dim["saturated"] > plain + 0.1
    changed = np.any(read_values(output).values != before, axis=(0, 2))
    assert 0 < changed.sum() < 20


# Refusals


def test_one_frame_alone_is_refused(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    (frame, *_) = bracket()

    line = refusal("merge", frame, "-c", camera, "-o", tmp_path / "merged.exr", "--json")

    assert line == f"{frame} alone is not a bracket: give two or more exposures of one scene"


def test_unknown_exposures_are_refused(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    frames = bracket(attributes=lambda _: {})
    arguments = ("merge", *frames, "-c", camera, "-o", tmp_path / "merged.exr")

    assert refusal(*arguments) == (
        f"{frames[0]} records no exposure: give --times, one for each frame"
    )
    assert "merging needs the exposures" in refusal(*arguments, "--times", "unknown")
    assert not (tmp_path / "merged.exr").exists()


@pytest.mark.parametrize("radius", [25, 99_999])
def test_a_bloom_radius_that_takes_most_of_the_picture_is_refused(
    radius: int, bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    output = tmp_path / "merged.exr"
    line = refusal("merge", *bracket(), "-c", camera, "-o", output, "--bloom-radius", radius)

    assert line.startswith(
        "bloom_radius must be a whole number between 0 and 24 pixels, half the smaller side"
    )
    assert line.endswith(f"not {radius}")
    assert not output.exists()


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ("1,2", "2 times were given for 3 frames"),
        ("1,0,4", "must be above 0, not 0"),
        ("1e-40,2e-40,4e-40", "must be between 1e-18 and 1e+18, not 1e-40"),
        ("1e308,1,1e-308", "must be between 1e-18 and 1e+18, not 1e+308"),
        ("1,2,1/0", "--times must be numbers or fractions"),
        ("1,2,nan", "--times must be numbers or fractions"),
        ("1,,2", "--times must be numbers or fractions"),
        ("2,2,2", "all 3 frames have the same exposure: give different exposures"),
        ("1,2,1e999", "--times must be numbers or fractions"),
    ],
)
def test_times_without_a_meaning_are_refused(  # noqa: PLR0917 - fixtures
    times: str, message: str, bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    line = refusal(
        "merge", *bracket(), "-c", camera, "-o", tmp_path / "merged.exr", "--times", times
    )

    assert message in line


def test_frames_of_one_exposure_are_refused(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    line = refusal("merge", *bracket((1.0, 1.0)), "-c", camera, "-o", tmp_path / "merged.exr")

    assert line == "all 2 frames have the same exposure: give different exposures of one scene"


def test_a_frame_given_twice_is_refused(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    a, b, _ = bracket()

    line = refusal("merge", a, b, a, "-c", camera, "-o", tmp_path / "merged.exr")

    assert "are the same file: give each frame once" in line


def test_no_input_is_overwritten(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    frames = bracket()
    frames[1] = write(tmp_path / "shot.tif", opened(frames[1])[0], exif(TIMES[1]))
    before = frames[1].read_bytes()
    exr = tmp_path / "camera.exr"
    shutil.copy(camera, exr)

    assert "is one of the frames" in refusal("merge", *frames, "-c", camera, "-o", frames[1])
    assert "is the calibration" in refusal("merge", *frames, "-c", exr, "-o", exr)
    assert frames[1].read_bytes() == before


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("merged.png", "a .png file does not hold float samples: use .exr, .tif, .tiff, .hdr"),
        ("merged.jpg", "pictures are written as .exr"),
        ("none/merged.exr", "does not exist: create it first"),
    ],
)
def test_a_place_where_nothing_can_be_written_is_refused_before_any_work(  # noqa: PLR0917
    output: str, message: str, bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    frames = bracket()
    frames[0].write_bytes(b"unread")

    assert message in refusal("merge", *frames, "-c", camera, "-o", tmp_path / output)


def test_a_frame_that_breaks_leaves_an_older_result_alone(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    frames, output = bracket(), tmp_path / "merged.exr"
    output.write_bytes(b"older")
    content = frames[2].read_bytes()
    frames[2].write_bytes(content[: len(content) // 2])

    line = refusal("merge", *frames, "-c", camera, "-o", output)

    assert str(frames[2]) in line
    assert output.read_bytes() == b"older"
    assert not list(tmp_path.glob(".chartless-*"))


def test_frames_of_other_sizes_and_calibrations_that_are_none_are_refused(
    bracket: Bracket, camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    frames, output = bracket(), tmp_path / "merged.exr"
    grey = tmp_path / "grey.yml"
    grey.write_text("%YAML:1.0\n---\nr: !!opencv-matrix\n   rows: 2\n   dt: f\n   data: [ 1. ]\n")

    assert "not a sound OpenCV response file" in refusal("merge", *frames, "-c", grey, "-o", output)
    assert "not a calibration file" in refusal("merge", *frames, "-c", frames[0], "-o", output)
    write(frames[1], np.zeros((8, 8, 3), dtype=np.uint8), exif(0.5))
    assert "differ in size" in refusal("merge", *frames, "-c", camera, "-o", output)


# Real brackets


def test_a_real_bracket(
    camera: Path, data_path: Path, chartless: Chartless, tmp_path: Path
) -> None:
    """No curve is right for it; but the merge spans what no exposure does, without specks."""
    frames = sorted((data_path / "bracket_canon_t2i_room").glob("*.jpg"))
    output = tmp_path / "room.exr"

    told = chartless("merge", *frames, "-c", camera, "-o", output, "--json").json

    assert told["size"] == [640, 427]
    assert told["exposures"][0] == pytest.approx(2 * 200 / 4.5**2)
    assert told["dynamic_range_stops"] > 14
    values = read_values(output).values
    screen = values[140:280, 5:95, 1]
    assert np.mean(screen < np.median(screen) / 20) < 0.001
