"""``chartless show``: a calibration as a table, JSON or picture."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chartless import Calibration, load, named_curve, rmse, save
from chartless.errors import with_options
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.misfit import Pattern
from chartless.flags import Flag

Chartless = Callable[..., Any]
Refusal = Callable[..., str]


def test_the_table_is_aligned(colour_camera: Path, chartless: Chartless) -> None:
    done = chartless("show", colour_camera)

    assert done.status == 0
    header, *rows, blank, verdict = done.out.splitlines()
    assert blank == ""
    assert verdict.startswith("do not trust: ")
    assert header.startswith("channel ")
    assert [row.split()[0] for row in rows] == ["R", "G", "B"]
    assert len({len(line) for line in (header, *rows)}) == 1
    for row in rows:
        assert row.split()[1:6] == ["0.0300", "16.00", "3", "to", "250"]
    assert [row.split()[-1] for row in rows] == ["converged", "converged", "doubtful"]
    assert done.err.startswith("chartless: note: misfit (B): ")
    assert done.err.count("\n") == 1


def test_nothing_doubtful_nothing_said(grey_camera: Path, chartless: Chartless) -> None:
    assert chartless("show", grey_camera).err == ""


def test_a_misfit_is_followed_by_its_patterns(
    colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    patterns = (Pattern.FAR_TAILS, None, Pattern.PEAKED)
    channels = tuple(
        replace(each, flags=(Flag.MISFIT,), accounts=(account_of_pairs(None, pattern=pattern),))
        for each, pattern in zip(load(colour_camera).channels, patterns, strict=True)
    )
    save(Calibration(channels=channels, bit_depth=8), tmp_path / "misfit.json")

    done = chartless("show", tmp_path / "misfit.json")

    flag, tails, peaked = done.err.splitlines()
    assert flag.startswith("chartless: note: misfit (R, G, B): ")
    tails_advice, peaked_advice = (
        with_options(each.advice) for each in (Pattern.FAR_TAILS, Pattern.PEAKED)
    )
    assert tails == f"chartless: note: R: the pattern is far-tails: {tails_advice}"
    assert peaked == f"chartless: note: B: the pattern is peaked: {peaked_advice}"


def test_it_says_what_dark_frames_would_bring(
    grey_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    account = account_of_pairs(None, errors_by_dark=(0.01697, 0.00849))
    camera = replace(
        load(grey_camera).channel("Y"),
        accounts=(account,),
        flags=(Flag.DARK_LEVELS_UNSEEN,),
    )
    save(Calibration(channels=(camera,), bit_depth=8), tmp_path / "bright.json")

    done = chartless("show", tmp_path / "bright.json")

    flag, worth = done.err.splitlines()
    assert flag.startswith("chartless: note: dark-levels-unseen (Y): the scene has no dark parts")
    assert worth == (
        "chartless: note: two frames with the lens covered (--dark) would bring the error from "
        "± 0.017 to ± 0.008"
    )


@pytest.mark.parametrize("truth", ["srgb", "linear", "gamma:0.45", "ameegc1:-0.8,1.5"])
def test_the_error_against_a_named_truth(
    truth: str, colour_camera: Path, chartless: Chartless
) -> None:
    done = chartless("show", colour_camera, "--truth", truth)

    header, *rows, _, _ = done.out.splitlines()
    assert header.split()[:2] == ["channel", "RMSE"]
    for row, response in zip(rows, load(colour_camera).channels, strict=True):
        assert float(row.split()[1]) == pytest.approx(
            rmse(response.curve, named_curve(truth)), abs=6e-5
        )


def test_the_error_against_a_measured_truth(
    colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    response = load(colour_camera).channel("R")
    curve = tmp_path / "truth.csv"
    rows = [f"{x / 1023},{y}" for x, y in enumerate(response.response_lut)]
    curve.write_text("\n".join(["irradiance,brightness", *rows]))

    done = chartless("show", colour_camera, "--truth", curve, "--json")

    errors = done.json["truth"]["rmse"]
    assert len(errors) == 3
    assert errors[0] == pytest.approx(0, abs=1e-12)
    assert errors[1] > 0.01


def test_json_is_the_file(colour_camera: Path, chartless: Chartless) -> None:
    assert chartless("show", colour_camera, "--json").json == json.loads(colour_camera.read_text())


# Evidence of a kind that is not registered here, as a newer or another program writes it.
WEDGE_ACCOUNT = {
    "kind": "wedge",
    "facts": [
        {"code": "patches", "label": "Patches", "value": [1.0, 2.0, 4.0], "form": ".1f"},
        {"code": "maker", "label": "Maker", "value": "Stouffer", "form": ""},
    ],
    "fits": [
        {
            "code": "gap", "label": "Gap between patches", "value": 0.25, "form": ".1%",
            "good": 0.1, "bad": None, "remark": "The patches of the wedge have gaps.",
        },
    ],
    "details": {"misfit": "the wedge was tilted"},
    "share": 0.5,
    "record": {"patches": [{"seen": True, "level": 3}], "note": None},
}  # fmt: skip
WEDGE_READING = {
    "kind": "wedge",
    "title": "patches of a wedge",
    "sentence": "a wedge of three patches",
    "inputs": [],
    "example": None,
    "tables": [
        {
            "code": "patches",
            "title": "Patches",
            "columns": [{"code": "level", "label": "Level", "form": ".0f"}],
            "rows": [[3.0], [None]],
        },
    ],
}


@pytest.fixture
def wedge_camera(grey_camera: Path) -> Path:
    content = json.loads(grey_camera.read_text())
    content["channels"][0]["accounts"] = [WEDGE_ACCOUNT]
    content["channels"][0]["flags"] = ["misfit"]
    content["evidence"] = [WEDGE_READING]
    grey_camera.write_text(json.dumps(content))
    return grey_camera


def test_kinds_that_are_not_known_are_shown_as_they_are(
    wedge_camera: Path, chartless: Chartless
) -> None:
    shown = chartless("show", wedge_camera, "--json").json

    assert shown["channels"][0]["accounts"] == [WEDGE_ACCOUNT]
    assert shown["evidence"] == [WEDGE_READING]


def test_kinds_that_are_not_known_have_their_say(wedge_camera: Path, chartless: Chartless) -> None:
    done = chartless("show", wedge_camera)

    (row,) = (line for line in done.out.splitlines() if line.startswith("Y "))
    assert "gap 25.0%" in row
    assert "The patches of the wedge have gaps." in done.out
    assert done.err.splitlines()[-1] == "chartless: note: the wedge was tilted"


@pytest.mark.slow
def test_kinds_that_are_not_known_do_not_hinder_pictures(
    wedge_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    page = tmp_path / "wedge.html"

    done = chartless("show", wedge_camera, "-o", tmp_path / "wedge.png", "--report", page)

    assert done.status == 0
    assert "Stouffer" in page.read_text()


def test_a_file_of_version_1_is_shown_as_one_of_version_2(
    grey_camera: Path, chartless: Chartless
) -> None:
    content = json.loads(grey_camera.read_text())
    del content["evidence"], content["channels"][0]["accounts"]
    content["channels"][0]["similarity"] = 0.98765
    grey_camera.write_text(json.dumps({**content, "version": 1}))

    shown = chartless("show", grey_camera, "--json").json

    assert shown["version"] == 2
    (channel,) = shown["channels"]
    assert [each["kind"] for each in channel["accounts"]] == ["noise"]
    assert "similarity 0.988" in chartless("show", grey_camera).out


@pytest.mark.parametrize(
    ("extension", "magic"),
    [
        ("png", b"\x89PNG"),
        pytest.param("svg", b"<?xml", marks=pytest.mark.slow),
        pytest.param("pdf", b"%PDF", marks=pytest.mark.slow),
        pytest.param("PNG", b"", marks=pytest.mark.slow),
    ],
)
def test_a_picture_is_drawn(
    extension: str, magic: bytes, colour_camera: Path, chartless: Chartless, tmp_path: Path
) -> None:
    output = tmp_path / f"plot.{extension}"

    done = chartless("show", colour_camera, "-o", output, "--truth", "srgb")

    assert done.status == 0
    assert done.out.splitlines()[-1] == f"picture written to {output}"
    assert output.read_bytes().startswith(magic)
    assert output.stat().st_size > 5000


@pytest.mark.parametrize(
    ("output", "why"),
    [
        ("plot.gif", "figures are written as .png, .svg, .pdf, not as '.gif'"),
        ("plot", "figures are written as .png, .svg, .pdf"),
        ("missing/plot.png", "does not exist: create it first"),
    ],
)
def test_a_picture_that_cannot_be_written(
    output: str, why: str, colour_camera: Path, refusal: Refusal, tmp_path: Path
) -> None:
    line = refusal("show", colour_camera, "-o", tmp_path / output, "--json")

    assert line.startswith(f"{tmp_path / output}: ")
    assert why in line
    assert sorted(tmp_path.iterdir()) == [colour_camera]


def test_the_calibration_is_not_drawn_over(colour_camera: Path, refusal: Refusal) -> None:
    before = colour_camera.read_bytes()

    refusal("show", colour_camera, "-o", colour_camera)

    assert colour_camera.read_bytes() == before


@pytest.mark.parametrize(
    ("truth", "why"),
    [
        ("sgrb", "unknown response 'sgrb'. Did you mean 'srgb'?"),
        ("gamma", "gamma takes 1 finite parameter"),
        ("gamma:0.4,2", "gamma takes 1 finite parameter"),
        ("gamma:-1", "gamma > 0"),
        ("gamma:x", "must be numbers separated by commas, not 'x'"),
        ("gamma:nan", "gamma takes 1 finite parameter"),
        ("missing.csv", "missing.csv: cannot be read"),
        ("missing.json", "missing.json: cannot be read"),
        (".csv", ".csv"),
    ],
)
def test_a_truth_that_is_none(truth: str, why: str, colour_camera: Path, refusal: Refusal) -> None:
    assert why in refusal("show", colour_camera, "--truth", truth)


def test_parameters_of_a_response_that_has_none(colour_camera: Path, refusal: Refusal) -> None:
    line = refusal("show", colour_camera, "--truth", "srgb:2.4")

    assert "parameter" in line
    assert "unknown" not in line


def test_a_file_that_is_no_calibration(refusal: Refusal, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_text('{"name": "package", "version": 1}')

    line = refusal("show", other, "--json")

    assert line.startswith(f"{other}: not a calibration file")


def test_a_binary_file_is_no_calibration(refusal: Refusal, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_bytes(bytes(range(256)))

    assert refusal("show", other).startswith(f"{other}: not a calibration file")


def test_a_folder_is_no_calibration(refusal: Refusal, tmp_path: Path) -> None:
    assert refusal("show", tmp_path).startswith(f"{tmp_path}: cannot be read")


def test_a_newer_version_is_named(colour_camera: Path, refusal: Refusal) -> None:
    content = json.loads(colour_camera.read_text())
    colour_camera.write_text(json.dumps({**content, "version": 3}))

    line = refusal("show", colour_camera)

    assert line.startswith(f"{colour_camera}: written in version 3 of the format")
