"""MAT files for HDR Toolbox: SciPy reads ours, and what SciPy writes is read."""

import io
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cameras import CURVES, make_camera
from scipy.io import loadmat, savemat

from chartless.curves import AbstractCurve
from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, export_response, import_response

LEVELS = np.arange(256, dtype=np.uint8)
TABLE = (np.arange(256) / 255)[:, np.newaxis] ** [2.2, 2.0, 1.8]


def content_of(*curves: AbstractCurve, n_levels: int | None = None) -> bytes:
    camera = make_camera(*curves)
    return FORMATS["hdrtoolbox"].encode(camera, ExportSettings(n_levels=n_levels)).content


def test_the_nearest_row_makes_every_level_linear(tmp_path: Path) -> None:
    export_response(make_camera(*CURVES), tmp_path / "camera.mat", "hdrtoolbox")

    lin_fun = loadmat(tmp_path / "camera.mat")["lin_fun"]

    assert lin_fun.dtype == np.float64
    assert lin_fun.shape == (256, 3)
    picture = np.stack([LEVELS] * 3, axis=-1)[np.newaxis]
    nearest = np.rint(LEVELS / 255 * (len(lin_fun) - 1)).astype(int)
    assert lin_fun[nearest] == pytest.approx(make_camera(*CURVES).linearize(picture)[0], abs=1e-7)
    assert content_of(*CURVES) == (tmp_path / "camera.mat").read_bytes()


def test_a_grey_camera_has_three_columns_and_other_sizes_are_written() -> None:
    lin_fun = loadmat(io.BytesIO(content_of(CURVES[0], n_levels=1024)))["lin_fun"]

    assert lin_fun.shape == (1024, 3)
    for column in lin_fun.T:
        assert column == pytest.approx(CURVES[0].inverse(np.linspace(0, 1, 1024)))


def saved(folder: Path, variables: dict[str, Any], **options: Any) -> Path:
    savemat(folder / "theirs.mat", variables, **options)
    return folder / "theirs.mat"


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("dtype", ["f8", "f4", "u2", "u1"])
def test_a_file_with_other_variables(compressed: bool, dtype: str, tmp_path: Path) -> None:
    table = TABLE if dtype[0] == "f" else np.rint(TABLE * np.iinfo(dtype).max)
    variables = {
        "stack": np.zeros((4, 5, 3)),
        "times": {"first": [1.0, 2.0], "name": "a"},
        "lin_fun": table.astype(dtype),
        "weights": "Gauss",
    }
    path = saved(tmp_path, variables, do_compression=compressed)

    camera = import_response(path)

    assert [each.name for each in camera.channels] == ["R", "G", "B"]
    for response, column in zip(camera.channels, variables["lin_fun"].T, strict=True):
        assert response.method == "hdrtoolbox"
        assert response.inverse_lut == pytest.approx(column / column[-1], abs=1e-7)


def test_a_file_of_a_machine_of_the_other_byte_order(tmp_path: Path) -> None:
    """Assembled by the published layout; the name is of the small kind of elements, then not."""

    def element(kind: int, data: bytes) -> bytes:
        return np.array([kind, len(data)], ">u4").tobytes() + data + bytes(-len(data) % 8)

    parts = [
        element(6, np.array([6, 0], ">u4").tobytes()),
        element(5, np.array([256, 1], ">i4").tobytes()),
        element(1, b"lin_fun"),
        element(9, TABLE[:, 0].astype(">f8").tobytes()),
    ]
    small = [
        parts[0],
        element(5, np.array([1, 1], ">i4").tobytes()),
        np.array([1 << 16 | 1], ">u4").tobytes() + b"t\0\0\0",
        np.array([1 << 16 | 2], ">u4").tobytes() + b"\7\0\0\0",
    ]
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    body = element(14, b"".join(small)) + element(14, b"".join(parts))
    path = tmp_path / "big.mat"
    path.write_bytes(header + body)
    assert loadmat(path)["lin_fun"][:, 0] == pytest.approx(TABLE[:, 0])

    (response,) = import_response(path).channels

    assert response.name == "Y"
    assert response.inverse_lut == pytest.approx(TABLE[:, 0], abs=2e-9)


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"other": TABLE}, "holds no variable lin_fun"),
        ({"lin_fun": "text"}, "lin_fun is not a matrix of numbers"),
        ({"lin_fun": {"a": 1}}, "lin_fun is not a matrix of numbers"),
        ({"lin_fun": np.zeros((2, 3, 4))}, "lin_fun is not a matrix of numbers"),
        ({"lin_fun": TABLE.T}, "256 channels, not 1 or 3"),
        ({"lin_fun": np.zeros((70_000, 1))}, "lin_fun has 70000 rows, more than 65536"),
        ({"lin_fun": np.zeros((0, 3))}, "lin_fun is not a matrix of numbers"),
    ],
)
def test_other_content_is_refused(variables: dict[str, Any], message: str, tmp_path: Path) -> None:
    for compressed in (False, True):
        path = saved(tmp_path, variables, do_compression=compressed)
        with pytest.raises(CalibrationFileError, match=message):
            import_response(path)


def test_a_file_of_version_7_3_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF")

    with pytest.raises(CalibrationFileError, match=r"save\('file.mat', 'lin_fun', '-v7'\)"):
        import_response(tmp_path / "new.mat")


def test_a_variable_that_inflates_without_end_is_cut(tmp_path: Path) -> None:
    bomb = zlib.compress(bytes(64 << 20))
    header = content_of(CURVES[0])[:128]
    tag = np.array([15, len(bomb)], "<u4").tobytes()
    (tmp_path / "bomb.mat").write_bytes(header + 20 * (tag + bomb))

    with pytest.raises(CalibrationFileError, match="holds no variable lin_fun"):
        import_response(tmp_path / "bomb.mat")


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, {"lin_fun": TABLE}, do_compression=True)
    whole = path.read_bytes()
    messages = []
    for content in (whole[:140], whole[:2000], whole[:126] + b"XX" + whole[128:]):
        path.write_bytes(content)
        with pytest.raises(CalibrationFileError) as caught:
            import_response(path)
        messages.append(str(caught.value))

    assert [each.rpartition("file: ")[2] for each in messages][2] == "its header is damaged"
