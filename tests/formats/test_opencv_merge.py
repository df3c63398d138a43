"""OpenCV itself reads our responses and merges pictures with them."""

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera

from chartless.curves import AbstractCurve, ModelCurve
from chartless.formats import export_response, import_response

LEVELS = np.arange(256, dtype=np.uint8)
Floats32 = npt.NDArray[np.float32]


def response_of(path: Path, *curves: AbstractCurve) -> Floats32:
    export_response(make_camera(*curves), path, "opencv")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    matrix = file.getNode("response").mat()
    file.release()
    return matrix


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
@pytest.mark.parametrize("curves", [CURVES, CURVES[:1]])
def test_file_storage_reads_each_language(
    suffix: str, curves: tuple[AbstractCurve, ...], tmp_path: Path
) -> None:
    matrix = response_of(tmp_path / f"camera.{suffix}", *curves)

    assert matrix.dtype == np.float32
    assert matrix.shape == ((256, 1, 3) if len(curves) == 3 else (256, 1))
    columns = matrix.reshape(256, -1).T[::-1]
    for curve, column in zip(curves, columns, strict=True):
        wanted = curve.inverse(LEVELS / 255)
        assert column[1:] * wanted[128] == pytest.approx(wanted[1:], rel=1e-6)
        assert 0 < column[0] <= column[1]


@pytest.mark.parametrize("curves", [CURVES, (ModelCurve("ameegc2-exact", (-1.0, 2.0, -1.0)),) * 3])
def test_merge_debevec_makes_a_picture_linear(
    curves: tuple[AbstractCurve, ...], tmp_path: Path
) -> None:
    """Of one picture it is the response alone, whatever the weight."""
    response = response_of(tmp_path / "camera.yml", *curves)
    blue, green, red = LEVELS, np.roll(LEVELS, 85), np.roll(LEVELS, 170)
    picture = np.stack([blue, green, red], axis=-1)[np.newaxis]

    seen = cv2.createMergeDebevec().process(
        [picture], np.ones(1, np.float32), np.ascontiguousarray(response)
    )

    linear = make_camera(*curves).linearize(picture[..., ::-1])[0]
    for c in range(3):
        column, wanted = seen[0, :, ::-1][:, c], linear[:, c]
        light = wanted > 0  # black is above 0 in our file, for its logarithm
        scale = column[np.argmax(wanted)]
        assert column[light] / scale == pytest.approx(wanted[light], rel=1e-5)


def test_merge_debevec_agrees_with_the_light_of_a_simulated_bracket(tmp_path: Path) -> None:
    """Levels are exact roundings of the curve, so that only their steps remain."""
    response = response_of(tmp_path / "camera.yml", *CURVES)
    light = np.geomspace(0.1, 0.9, 400)
    times = np.array([0.25, 0.5, 1, 2, 4], dtype=np.float32)
    frames = [
        np.stack(
            [np.rint(255 * curve.response(np.minimum(light * t, 1))) for curve in CURVES[::-1]],
            axis=-1,
        ).astype(np.uint8)[np.newaxis]
        for t in times
    ]

    seen = cv2.createMergeDebevec().process(frames, times, np.ascontiguousarray(response))

    for c in range(3):
        ratio = seen[0, :, c] / light
        assert ratio / np.median(ratio) == pytest.approx(np.ones(400), abs=0.03)


def test_what_opencv_calibrates_and_stores_is_read(tmp_path: Path) -> None:
    light = np.geomspace(0.01, 1, 300)
    times = np.array([0.25, 0.5, 1, 2], dtype=np.float32)
    gamma = ModelCurve("gamma", (0.5,))
    frames = [
        np.repeat(np.rint(255 * gamma.response(np.minimum(light * t, 1))), 3)
        .reshape(1, 300, 3)
        .astype(np.uint8)
        for t in times
    ]
    found = cv2.createCalibrateDebevec(300).process(frames, times)
    file = cv2.FileStorage(str(tmp_path / "theirs.yml"), cv2.FILE_STORAGE_WRITE)
    file.write("crf", found)
    file.release()

    camera = import_response(tmp_path / "theirs.yml")

    for response, column in zip(camera.channels, found[:, 0, ::-1].T, strict=True):
        wanted = np.maximum.accumulate(column)
        assert response.inverse_lut[1:] == pytest.approx(wanted[1:] / wanted[-1], abs=1e-6)
