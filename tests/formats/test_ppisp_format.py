"""Responses of PPISP: the numbers that it trains, and its formula with them."""

import json
from pathlib import Path

import numpy as np
import pytest
from cameras import CURVES, make_camera

from chartless.cli import main
from chartless.curves import AbstractCurve, ModelCurve, SrgbCurve
from chartless.errors import CalibrationFileError
from chartless.formats import encode_response, export_response, import_response
from chartless.formats.calibration_file import save
from chartless.types import Floats

GRID = np.linspace(0, 1, 1024)
MEMBERS = (
    ModelCurve("ppisp", (1.5, 1.8, -1.1, -2.5)),
    ModelCurve("ppisp", (2.3, 0.9, -1.3, -1.9)),
    ModelCurve("ppisp", (0.7, 3.2, -0.7, -2.6)),
)


def trained(light: Floats, numbers: list[float]) -> Floats:
    """Brightness as PPISP computes it from the four numbers of a channel."""
    toe, shoulder, gamma = np.array([0.3, 0.3, 0.1]) + np.log1p(np.exp(numbers[:3]))
    center = 1 / (1 + np.exp(-numbers[3]))
    a = shoulder * center / (toe + center * (shoulder - toe))
    low = a * (np.minimum(light, center) / center) ** toe
    high = 1 - (1 - a) * ((1 - np.maximum(light, center)) / (1 - center)) ** shoulder
    return np.where(light <= center, low, high) ** gamma


def content_of(*curves: AbstractCurve) -> dict[str, list]:
    return json.loads(encode_response(make_camera(*curves), "ppisp").content)


def test_the_program_draws_the_curve_within_the_error_that_is_told() -> None:
    curves = (SrgbCurve(), MEMBERS[0], CURVES[2])
    encoded = encode_response(make_camera(*curves), "ppisp")
    content = json.loads(encoded.content)

    (camera,) = content["crf_params"]
    assert np.shape(content["crf_params"]) == (1, 3, 4)
    assert content["parameters"] == ["toe", "shoulder", "gamma", "center"]
    errors = [
        trained(GRID, numbers) - curve.response(GRID)
        for numbers, curve in zip(camera, curves, strict=True)
    ]
    rms = np.sqrt(np.mean(np.square(errors), axis=1))
    assert content["rmse"] == pytest.approx(rms, abs=1e-9)
    assert rms.max() < 0.02
    (told,) = encoded.lost
    assert told.startswith(f"what four parameters cannot follow: rms {rms.max():.4f}, max ")
    assert told.endswith(f" ({'RGB'[int(rms.argmax())]})")


def test_members_of_the_family_are_written_as_they_are() -> None:
    content = content_of(*MEMBERS)

    assert content["crf_params"] == [[list(each.parameters) for each in MEMBERS]]
    assert content["rmse"] == [0, 0, 0]


def test_members_are_found_in_look_up_tables_too(tmp_path: Path) -> None:
    save(make_camera(*MEMBERS), tmp_path / "camera.json")

    assert main(["export", str(tmp_path / "camera.json"), "--to", "ppisp"]) == 0

    (found,) = json.loads((tmp_path / "camera.ppisp.json").read_text())["crf_params"]
    for numbers, member in zip(found, MEMBERS, strict=True):
        assert trained(GRID, numbers) == pytest.approx(member.response(GRID), abs=1e-6)


def test_a_grey_camera_has_three_equal_channels() -> None:
    (camera,) = content_of(SrgbCurve())["crf_params"]

    assert camera[0] == camera[1] == camera[2]


def test_what_was_trained_is_read(tmp_path: Path) -> None:
    path = tmp_path / "trained.json"
    path.write_text(json.dumps({"crf_params": [[list(each.parameters) for each in MEMBERS]]}))

    camera = import_response(path)

    assert [each.method for each in camera.channels] == ["ppisp"] * 3
    assert [each.curve for each in camera.channels] == list(MEMBERS)
    assert camera.flags == {}


def test_the_name_tells_the_format(tmp_path: Path) -> None:
    save(make_camera(SrgbCurve()), tmp_path / "camera.json")

    assert (
        main(["export", str(tmp_path / "camera.json"), "-o", str(tmp_path / "a.ppisp.json")]) == 0
    )

    lost, _ = export_response(make_camera(*MEMBERS), tmp_path / "b.ppisp.json", "ppisp")
    assert "the error band" in lost
    assert (tmp_path / "a.ppisp.json").exists()


ROW = [0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("params", "message"),
    [
        (
            [[ROW] * 3] * 2,
            "crf_params are 1 × 3 × 4 numbers, toe, shoulder, gamma and center, not 2 × 3 × 4",
        ),
        ([ROW] * 3, "not 3 × 4"),
        ([[ROW[:3]] * 3], "not 1 × 3 × 3"),
        ([[[0, 0, 0, float("nan")]] * 3], "crf_params must be numbers up to 1000"),
        ([[[0, 0, 0, 1e4]] * 3], "crf_params must be numbers up to 1000"),
        ([[["a"] * 4] * 3], "could not convert string to float"),
    ],
)
def test_damaged_files_are_refused(params: list, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps({"crf_params": params}))

    with pytest.raises(CalibrationFileError) as caught:
        import_response(path)

    assert message in str(caught.value)
