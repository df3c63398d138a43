"""Responses of radical, byte by byte as its source reads them."""

import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from cameras import CURVES, make_camera

from chartless.curves import AbstractCurve
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, import_response

LEVELS = np.arange(256, dtype=np.uint8)


def radical(content: bytes) -> npt.NDArray[np.float32]:
    """Table of the library, shape (256, 3), blue first; it wants one row of three floats."""
    assert struct.unpack("<IIIII", content[:20]) == (0xC4A1FDD9, 21, 2, 1, 256)
    assert len(content) == 3092
    return np.array(struct.unpack("<768f", content[20:])).astype(np.float32).reshape(256, 3)


def content_of(*curves: AbstractCurve) -> bytes:
    camera = make_camera(*curves)
    return FORMATS["radical"].encode(camera, ExportSettings()).content


def test_the_library_makes_every_level_linear_and_finds_it_again() -> None:
    table = radical(content_of(*CURVES))

    assert table[128] == pytest.approx(1)
    linear = make_camera(*CURVES).linearize(np.stack([LEVELS] * 3, axis=-1)[np.newaxis])[0]
    assert table[1:, ::-1] == pytest.approx(linear[1:] / linear[128], rel=1e-6)
    assert np.all(np.isfinite(np.log(table)))
    for column in table.T:
        assert np.array_equal(np.searchsorted(column[:255], column), LEVELS)


def test_a_grey_camera_has_three_equal_channels() -> None:
    table = radical(content_of(CURVES[0]))

    assert np.all(table == table[:, :1])


@pytest.mark.parametrize("shape", [(1, 256), (256, 1)])
def test_either_shape_is_read(shape: tuple[int, int], tmp_path: Path) -> None:
    content = content_of(*CURVES)
    path = tmp_path / "camera.crf"
    path.write_bytes(content[:12] + struct.pack("<II", *shape) + content[20:])

    camera = import_response(path)

    for response, curve in zip(camera.channels, CURVES, strict=True):
        assert response.inverse_lut == pytest.approx(curve.inverse(LEVELS / 255), abs=2e-7)


@pytest.mark.parametrize(
    ("place", "value"), [(4, 5), (4, 13), (12, 2), (16, 255), (12, 0xFFFFFFFF)]
)
def test_other_matrices_are_refused(place: int, value: int, tmp_path: Path) -> None:
    content = bytearray(content_of(*CURVES))
    struct.pack_into("<I", content, place, value)
    (tmp_path / "bad.crf").write_bytes(content)

    with pytest.raises(CalibrationFileError, match="does not hold 256 × 3 numbers of 32 bits"):
        import_response(tmp_path / "bad.crf")


@pytest.mark.parametrize("size", [10, 21, 3091, 3093])
def test_files_of_another_length_are_refused(size: int, tmp_path: Path) -> None:
    (tmp_path / "bad.crf").write_bytes((content_of(*CURVES) + b"\0")[:size])

    with pytest.raises(CalibrationFileError, match="not a sound radical response file"):
        import_response(tmp_path / "bad.crf")


def test_nan_is_a_gap(tmp_path: Path) -> None:
    values = np.frombuffer(content_of(*CURVES)[20:], "<f4").reshape(256, 3).copy()
    values[250:, 0] = np.nan
    values.view(np.uint32)[255, 0] = 0x7F800001  # one that signals
    (tmp_path / "gap.crf").write_bytes(content_of(*CURVES)[:20] + values.tobytes())

    camera = import_response(tmp_path / "gap.crf")

    assert camera.channel("B").observed_levels == (0, 249)
    assert camera.provenance["remarks"][0].endswith("channel B: filled 6 levels without value")
