"""``chartless calibrate`` on exposure brackets: what is told, refused, doubted and written."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does
import pytest
from calibration_content import fact_of
from slow_cases import slow_but

from chartless import load, named_curve, rmse
from chartless.errors import with_options

Pixels = npt.NDArray[Any]
Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot
EXPOSURES = (1.0, 4.0, 16.0)
SMALL = ("--levels", "64")
"""Levels enough where the curve does not matter."""


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Without ``-o`` the result goes to the current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def bracket(shoot: Shoot) -> Callable[..., list[Path]]:
    """Takes frames at several exposures, with EXIF or without."""

    def take(
        exposures: Sequence[float] = EXPOSURES,
        *,
        exif: Sequence[dict[str, Any]] | None = None,
        extension: str = "png",
        n_channels: int = 1,
    ) -> list[Path]:
        scene = np.exp(6 * (shoot.scene(96, 128, n_channels) - 1))
        files = []
        for place, exposure in enumerate(exposures):
            light = 1.2 * scene * exposure / 16
            (levels,) = shoot.frames(light, n_frames=1, seed=place)
            path = shoot.folder / f"{place}.{extension}"
            if exif is None and extension == "png":
                shoot.write(path.name, levels)
            else:
                write_with_exif(path, levels, {} if exif is None else exif[place])
            files.append(path)
        return files

    return take


Bracket = Callable[..., list[Path]]


def write_with_exif(path: Path, levels: Pixels, exif: dict[str, Any]) -> None:
    height, width, n_channels = levels.shape
    spec = oiio.ImageSpec(width, height, n_channels, "uint8")
    spec.attribute("Compression", "jpeg:100" if path.suffix == ".jpg" else "zip")
    for name, value in exif.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(levels), output.geterror()
    output.close()


def settings(time: float, iso: float = 100.0, f_number: float = 8.0, **more: Any) -> dict[str, Any]:
    return {
        "ExposureTime": time,
        "FNumber": f_number,
        "Exif:PhotographicSensitivity": int(iso),
        **more,
    }


def evidence(done: Any) -> str:
    (line,) = (line for line in done.err.splitlines() if "note: evidence: " in line)
    return str(line.removeprefix("chartless: note: evidence: "))


# What is read


def test_times_make_a_bracket(bracket: Bracket, chartless: Chartless) -> None:
    done = chartless("calibrate", *bracket(), "--times", "1,4,16")

    assert done.status == 0
    assert evidence(done) == "a bracket of 3 exposures, 1 to 16 by --times"
    assert done.out.splitlines()[-1] == "calibration of 3 frames written to camera.json"
    calibration = load("camera.json")
    (response,) = calibration.channels
    assert rmse(response.curve, named_curve("srgb")) < 0.015
    assert response.account("bracket")["exposures"] == pytest.approx(EXPOSURES)
    provenance = calibration.provenance
    assert [Path(each["file"]).name for each in provenance["inputs"]] == ["0.png", "1.png", "2.png"]
    assert with_options(provenance["settings"]["evidence"]) == evidence(done)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "n_unused"),
    [
        ((), 0),
        (("--evidence", "bracket"), 2),
        (("--method", "debevec"), 2),
        (("--method", "debevec", "--times", "a,b,b,b,c"), 2),
    ],
)
def test_all_frames_that_were_given_are_counted(
    how: tuple[str, ...], n_unused: int, bracket: Bracket, chartless: Chartless
) -> None:
    """Also those that repeat an exposure where noise is not read: they are named as not used."""
    files = bracket((1.0, 4.0, 4.0, 4.0, 16.0))

    done = chartless("calibrate", *files, "--times", "1,4,4,4,16", *SMALL, *how)

    assert done.out.splitlines()[-1] == "calibration of 5 frames written to camera.json"
    inputs = load("camera.json").provenance["inputs"]
    assert sorted(Path(each["file"]).name for each in inputs) == [each.name for each in files]
    assert len({each["sha256"] for each in inputs}) == 5
    unused = [Path(each["file"]).name for each in inputs if each.get("used") == 0]
    assert unused == ["2.png", "3.png"][:n_unused]
    assert ("2 frames repeat an exposure and were not used" in done.err) == bool(n_unused)
    assert ("noise of 1 repeated" in evidence(done)) == (not n_unused)


@pytest.mark.slow
@pytest.mark.parametrize(
    "times", ["2,8,32", "1/60,1/15,4/15", "1/60,1/15,0.26666667"], ids=["2", "1/60", "mixed"]
)
def test_times_may_be_fractions(times: str, bracket: Bracket, chartless: Chartless) -> None:
    done = chartless("calibrate", *bracket(), "--times", times, *SMALL, "--json")

    (channel,) = done.json["channels"]
    assert fact_of(channel, "bracket", "exposures") == pytest.approx(EXPOSURES)
    assert not Path("camera.json").exists()


def test_times_may_be_a_file(bracket: Bracket, chartless: Chartless) -> None:
    Path("times.txt").write_text("# exposures\n0.png 1/100\n1.png  1/25 # middle\n\n2.png 0.16\n")

    done = chartless("calibrate", *bracket(), "--times", "times.txt", *SMALL, "--json")

    (channel,) = done.json["channels"]
    assert fact_of(channel, "bracket", "exposures") == pytest.approx(EXPOSURES)


@pytest.mark.parametrize("extension", slow_but(["jpg", "tif"], "tif"))
def test_exif_makes_a_bracket(extension: str, bracket: Bracket, chartless: Chartless) -> None:
    """Where TIFF files are written here, they lose their ISO: times alone will do."""
    last = settings(1 / 16, 400) if extension == "jpg" else settings(1 / 4)
    exif = [settings(1 / 64), settings(1 / 16), last]
    frames = bracket(exif=exif, extension=extension)

    done = chartless("calibrate", *frames, "--json")

    assert evidence(done) == "a bracket of 3 exposures, 1 to 16 by EXIF"
    (channel,) = done.json["channels"]
    # Those of JPEGs are not refined: shutters are better known than what such files tell of them.
    within = 1e-6 if extension == "jpg" else 0.1
    assert fact_of(channel, "bracket", "exposures") == pytest.approx(EXPOSURES, rel=within)
    assert fact_of(channel, "bracket", "exponent_error") > 0
    truth = named_curve("srgb").response(np.linspace(0, 1, 1024))
    # Of JPEG white is left to the prior, and the band says so.
    error = np.sqrt(np.mean((channel["response_lut"] - truth) ** 2))
    assert error < (0.07 if extension == "jpg" else 0.03)
    off = channel["inverse_lut"] - named_curve("srgb").inverse(np.linspace(0, 1, 256))
    assert np.mean(np.abs(off) <= 2 * np.array(channel["inverse_lut_std"])) > 0.75


@pytest.mark.slow
def test_exposures_of_jpegs_that_are_far_from_what_they_say_are_flagged(
    bracket: Bracket, chartless: Chartless
) -> None:
    exif = [settings(1 / 64), settings(1 / 16), settings(1 / 2)]
    frames = bracket(exif=exif, extension="jpg")

    done = chartless("calibrate", *frames, "--json")

    (channel,) = done.json["channels"]
    assert "exposures-off" in channel["flags"]
    assert fact_of(channel, "bracket", "exposures") == pytest.approx([1, 4, 32])


def test_shutter_speeds_are_read_exactly(bracket: Bracket, chartless: Chartless) -> None:
    """A camera calls 1/64 s 1/60 s, and 1/4096 s what is no longer near."""
    exif = [
        settings(1 / 60, **{"Exif:ShutterSpeedValue": 6.0}),
        settings(1 / 15, **{"Exif:ShutterSpeedValue": 4.0}),
        settings(1 / 4, **{"Exif:ShutterSpeedValue": 12.0}),
    ]

    frames = bracket(exif=exif, extension="tif")

    done = chartless("calibrate", *frames, "--time-error", 0, *SMALL, "--json")

    (channel,) = done.json["channels"]
    assert fact_of(channel, "bracket", "exposures") == pytest.approx(EXPOSURES)


def test_an_exposure_that_is_repeated_tells_both(bracket: Bracket, chartless: Chartless) -> None:
    frames = bracket([1.0, 4.0, 4.0, 16.0])

    done = chartless("calibrate", *frames, "--times", "1,4,4,16", *SMALL, "--json")

    assert evidence(done) == (
        "a bracket of 3 exposures, 1 to 16 by --times, and noise of 1 repeated exposure"
    )
    (channel,) = done.json["channels"]
    assert fact_of(channel, "noise", "deviance") == pytest.approx(1, abs=0.2)
    noise = channel["noise"]
    assert abs(math.log(noise["U"] / 0.03)) < 3 * noise["std"]["log_slope"] < 2
    assert len(fact_of(channel, "bracket", "exposures")) == 3
    # Every frame is named once: of each exposure one, then repeats.
    inputs = [Path(each["file"]).name for each in done.json["provenance"]["inputs"]]
    assert inputs == ["0.png", "1.png", "3.png", "2.png"]


@pytest.mark.slow
def test_the_evidence_may_be_chosen(bracket: Bracket, chartless: Chartless) -> None:
    frames = bracket([1.0, 4.0, 4.0, 16.0])
    times = ("--times", "1,4,4,16", *SMALL, "--json")

    exposures = chartless("calibrate", *frames, *times, "--evidence", "bracket")
    both = chartless("calibrate", *frames, *times, "--evidence", "both")
    noise = chartless("calibrate", *frames[1:3], "--evidence", "noise", *SMALL, "--json")

    assert evidence(exposures) == "a bracket of 3 exposures, 1 to 16 by --times"
    kinds = [
        {each["kind"] for each in done.json["channels"][0]["accounts"]}
        for done in (exposures, both, noise)
    ]
    assert kinds == [{"bracket"}, {"bracket", "noise"}, {"noise"}]
    assert evidence(noise) == "noise, as requested"


def test_exif_that_disagrees_is_not_heard_if_a_bracket_is_asked_for(
    bracket: Bracket, chartless: Chartless
) -> None:
    frames = bracket(exif=[settings(1 / 60)] * 3, extension="tif")

    asked = ("--times", "1,4,16", "--evidence", "bracket")
    done = chartless("calibrate", *frames, *asked, *SMALL, "--json")

    assert done.status == 0
    assert fact_of(done.json["channels"][0], "bracket", "exposures") == pytest.approx(EXPOSURES)


def test_unknown_exposures_are_found_and_doubted(bracket: Bracket, chartless: Chartless) -> None:
    done = chartless("calibrate", *bracket(), "--times", "unknown", *SMALL, "--strict", "--json")

    assert done.status == 3
    (channel,) = done.json["channels"]
    assert "exponent-unknown" in channel["flags"]
    relative = fact_of(channel, "bracket", "exposures")
    assert math.log(relative[2]) / math.log(relative[1]) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
def test_unknown_exposures_may_be_named(bracket: Bracket, chartless: Chartless) -> None:
    """Repeats of one of them tell the exponent."""
    frames = bracket([1.0, 4.0, 4.0, 16.0])

    done = chartless("calibrate", *frames, "--times", "a,b,b,c", *SMALL, "--json")

    assert evidence(done) == (
        "a bracket of 3 exposures, their ratios unknown, and noise of 1 repeated exposure"
    )
    (channel,) = done.json["channels"]
    error = fact_of(channel, "bracket", "exponent_error")
    assert 0 < error < 0.2
    relative = fact_of(channel, "bracket", "exposures")
    # The scene grows darker by the light's inverse: the model's first order is 2 % off there.
    assert math.log(relative[2]) / math.log(16) == pytest.approx(1, abs=0.04)


@pytest.mark.parametrize("method", slow_but(["debevec", "mitsunaga", "robertson"], "debevec"))
def test_methods_of_exposures(method: str, bracket: Bracket, chartless: Chartless) -> None:
    frames = bracket(n_channels=3)

    done = chartless("calibrate", *frames, "--times", "1,4,16", "--method", method)

    assert done.status == 0
    calibration = load("camera.json")
    assert [response.name for response in calibration.channels] == ["R", "G", "B"]
    for response in calibration.channels:
        assert rmse(response.curve, named_curve("srgb")) < 0.08
        assert response.noise is None
        assert response.method == method
    # Without noise and error bars there are dashes.
    (row,) = [line.split() for line in done.out.splitlines() if line.startswith("R ")]
    assert row[:3] == ["R", "-", "-"]


def test_a_method_of_exposures_leaves_repeats_aside(bracket: Bracket, chartless: Chartless) -> None:
    frames = bracket([1.0, 4.0, 4.0, 16.0])

    done = chartless("calibrate", *frames, "--times", "1,4,4,16", "--method", "debevec", "--json")

    assert done.status == 0
    assert done.json["channels"][0]["noise"] is None


@pytest.mark.slow
def test_the_order_of_the_files_makes_no_difference(bracket: Bracket, chartless: Chartless) -> None:
    frames = bracket()
    runs = [
        chartless(
            "calibrate",
            *(frames[place] for place in order),
            "--times",
            ",".join(str(EXPOSURES[place]) for place in order),
            *SMALL,
            "--json",
        ).json["channels"]
        for order in ((0, 1, 2), (2, 0, 1))
    ]

    assert runs[0] == runs[1]


@pytest.mark.slow
def test_unaligned_frames_are_matched_by_their_histograms(
    bracket: Bracket, chartless: Chartless, shoot: Shoot
) -> None:
    frames = bracket()
    for shift, path in enumerate(frames):
        levels = oiio.ImageInput.open(str(path)).read_image("uint8")
        shoot.write(path.name, np.roll(levels, 4 * shift, axis=(0, 1)))

    still = chartless("calibrate", *frames, "--times", "1,4,16", *SMALL, "--json")
    matched = chartless("calibrate", *frames, "--times", "1,4,16", "--unaligned", *SMALL, "--json")

    truth = named_curve("srgb").response(np.linspace(0, 1, 1024))
    errors = [
        float(np.sqrt(np.mean((done.json["channels"][0]["response_lut"] - truth) ** 2)))
        for done in (matched, still)
    ]
    assert errors[0] < 0.02
    assert errors[0] < errors[1]
    assert "motion" not in matched.json["channels"][0]["flags"]


# What is refused


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ("1,4", "2 times were given for 3 frames: give one for each"),
        ("1,4,16,64", "4 times were given for 3 frames"),
        ("1,0,16", "1.png must be above 0, not 0"),
        ("1e308,1,1e-308", "0.png must be between 1e-18 and 1e+18, not 1e+308"),
        ("5e-324,1,16", "0.png must be between 1e-18 and 1e+18, not 4.94066e-324"),
        ("1,1e12,1e-12", "more than 64 stops apart"),
        ("1,-4,16", "1.png must be above 0, not -4"),
        ("1,4,nan", "--times must be numbers or fractions"),
        ("1,four,16", "--times must be numbers or fractions such as 1/30,1/8,1/2, not '1,four,16'"),
        ("1,4/0,16", "times must be numbers"),
        ("", "times must be numbers"),
        (
            "missing.txt",
            "--times must be numbers or fractions such as 1/30,1/8,1/2, not 'missing.txt'",
        ),
        ("times.txt", "times.txt: --times must be numbers"),
        ("empty.txt", "0 times were given for 3 frames"),
        ("binary.txt", "binary.txt: --times must be numbers"),
        ("16,4,1", "1.png is darker than"),
    ],
)
def test_times_without_meaning(
    times: str, message: str, bracket: Bracket, refusal: Refusal, in_folder: Path
) -> None:
    Path("times.txt").write_text("0.png 1/60\n1.png about 1/15 s\n")
    Path("empty.txt").write_text("\n# nothing\n")
    Path("binary.txt").write_bytes(bytes(range(1, 256)))
    frames = bracket()
    before = sorted(in_folder.iterdir())

    line = refusal("calibrate", *frames, f"--times={times}")

    assert message in line
    assert sorted(in_folder.iterdir()) == before


def exif_of(kind: str) -> list[dict[str, Any]]:
    same, rising = [settings(1 / 60)] * 3, [settings(t) for t in (1 / 64, 1 / 16, 1 / 4)]
    return {
        "none": [{}] * 3,
        "same": same,
        "rising": rising,
        "partly": [rising[0], {}, rising[2]],
        "two cameras": [{**each, "Model": f"A{k // 2}"} for k, each in enumerate(rising)],
    }[kind]


@pytest.mark.parametrize(
    ("kind", "arguments", "message"),
    [
        (
            "same",
            ["--method", "debevec"],
            "debevec uses bracket only; a bracket needs ",
        ),
        (
            "none",
            ["--method", "robertson"],
            "; the files record no exposure settings: give ",
        ),
        ("rising", ["--method", "nlf"], "nlf uses noise only; no exposure is repeated"),
        (
            "rising",
            ["--method", "ism-bin"],
            "ism-bin uses noise only; no exposure is ",
        ),
        ("none", ["--evidence", "bracket"], "the files record no exposure settings: give --times"),
        ("partly", ["--evidence", "bracket"], "the files record no exposure settings"),
        ("same", ["--evidence", "bracket"], "a bracket needs two or more frames of one scene at"),
        ("rising", ["--evidence", "both"], "no exposure is repeated, so there is no noise"),
        *(
            ("rising", ["--method", name, "--model", "gamma"], f"{name} fits a curve of its own")
            for name in ("debevec", "mitsunaga", "robertson")
        ),
        ("rising", ["--jobs", "2"], "--jobs has no effect on"),
        ("rising", ["--scheduler", "tcp://a:1"], "--scheduler has no effect on"),
        ("rising", ["--dark", "0.png"], "--dark has no effect on"),
        ("same", ["--unaligned"], "--unaligned has no effect on"),
        (
            "none",
            ["--bloom-radius", "2", "--time-error", "0.1"],
            "--bloom-radius and --time-",
        ),
        ("rising", ["--evidence", "noise"], "the frames differ in exposure: "),
        ("rising", ["--evidence", "much"], "evidence must be auto or some of raw, bracket, "),
        ("rising", ["--times", "1,2,4"], "EXIF exposure is 1.0 stops from --times"),
        ("rising", ["--time-error", "-1"], "time_error must be a number, 0 or above"),
        ("rising", ["--time-error", "nan"], "time_error must be a number"),
        (
            "rising",
            ["--time-error", "1e300"],
            "time_error must be a number, 0 or above, and at most",
        ),
        ("rising", ["--levels", "99999999"], "levels must lie between 16 and 256 for 8-bit frames"),
        ("rising", ["--bloom-radius", "-1"], "--bloom-radius"),
        (
            "rising",
            ["--bloom-radius", "99999"],
            "bloom_radius must be a whole number between 0 and 48 pixels",
        ),
        (
            "rising",
            ["--shared-noise", "--method", "debevec"],
            "unknown setting of debevec",
        ),
        (
            "rising",
            ["--shared-noise"],
            "--shared-noise has no effect on",
        ),
        ("same", ["--times", "1,1,1", "--evidence", "noise"], "omit --times or --evidence noise"),
        ("two cameras", [], "the frames differ in camera: "),
    ],
)
def test_a_bracket_that_is_refused(
    kind: str, arguments: list[str], message: str, bracket: Bracket, refusal: Refusal
) -> None:
    frames = bracket(exif=exif_of(kind), extension="jpg")
    before = sorted(Path.cwd().iterdir())

    line = refusal("calibrate", *frames, *arguments)

    assert message in line
    assert sorted(Path.cwd().iterdir()) == before


def test_a_bloom_radius_that_leaves_nothing_of_an_exposure_is_refused(
    bracket: Bracket, refusal: Refusal
) -> None:
    frames = bracket([1.0, 4.0, 160.0])

    line = refusal("calibrate", *frames, "--times", "1,4,160", "--bloom-radius", "40")

    assert line.startswith(f"{frames[2]}: all pixels are within bloom_radius, 40 pixels, of")


def test_one_frame_is_no_bracket(bracket: Bracket, refusal: Refusal) -> None:
    (only,) = bracket([4.0])

    assert "two or more frames" in refusal("calibrate", only, "--times", "unknown")
    assert "two or more frames" in refusal("calibrate", only, "--times", "1", "--json")


def flat(shoot: Shoot, *levels: int) -> list[Path]:
    rng = np.random.default_rng(3)
    noise = rng.integers(-2, 3, (len(levels), 96, 128, 1))
    return [
        shoot.write(f"{k}.png", (level + noise[k]).clip(0, 255).astype(np.uint8))
        for k, level in enumerate(levels)
    ]


@pytest.mark.parametrize(
    ("levels", "message"),
    [
        (
            (400, 400, 400),
            ("0.png is 100% white: two exposures must have unclipped pixels; give shorter"),
        ),
        pytest.param(
            (-90, -90, -90),
            "0.png is 100% black: two exposures must have unclipped pixels; give longer",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            (-90, 100, 400), "two exposures must have unclipped pixels", marks=pytest.mark.slow
        ),
        pytest.param((20, 40, 60), "too few for a curve (least 25%)", marks=pytest.mark.slow),
        ((120, 100, 40), "2.png is darker than "),
    ],
)
def test_pictures_that_are_no_bracket(
    levels: tuple[int, ...], message: str, shoot: Shoot, refusal: Refusal
) -> None:
    line = refusal("calibrate", *flat(shoot, *levels), "--times", "1,2,4")

    assert message in line


def test_exposures_too_far_apart(shoot: Shoot, refusal: Refusal) -> None:
    """Where one shows something the other is black or white."""
    left = np.arange(128)[np.newaxis, :, np.newaxis] < 64
    ramp = np.linspace(30, 220, 96)[:, np.newaxis, np.newaxis]
    frames = [
        shoot.write(f"{name}.png", np.where(left, *sides).astype(np.uint8))
        for name, sides in (("short", (ramp, 0 * ramp)), ("long", (255 + 0 * ramp, ramp)))
    ]

    line = refusal("calibrate", *frames, "--times", "1,4000")

    assert "no two neighbouring exposures show a pixel between black and white in both" in line


def test_unknown_exposures_that_do_not_differ(shoot: Shoot, refusal: Refusal) -> None:
    frames = shoot(shoot.scene(96, 128))

    line = refusal("calibrate", *frames, "--times", "unknown")

    assert "the exposures do not differ" in line


# One scene


@pytest.mark.parametrize(
    "how",
    slow_but(
        [("--times", "1,4,16"), ("--times", "unknown"), ("--evidence", "noise")],
        ("--times", "1,4,16"),
    ),
)
def test_different_photographs_are_refused(
    how: tuple[str, ...], data_path: Path, refusal: Refusal
) -> None:
    frames = sorted((data_path / "scenery_1600x900").glob("*.jpg"))[:3]
    if len(frames) < 3:
        pytest.skip("no scenery among the data")

    line = refusal("calibrate", *frames, *how)

    assert "do not show the same scene: give " in line
