"""NumPy archives: NumPy reads ours, and what it says comes back."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cameras import CURVES, make_camera

from chartless.errors import CalibrationFileError
from chartless.formats import FORMATS, ExportSettings, export_response, import_response
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration

NOISE = AffineNoise(1e-4, 2e-5)


def camera_with_noise() -> Calibration:
    """Three channels, the last without noise and deviation, seen in part."""
    camera = make_camera(*CURVES, seen=(3, 250))
    *others, last = (replace(each, noise=NOISE) for each in camera.channels)
    return replace(camera, channels=(*others, replace(last, noise=None, inverse_lut_std=None)))


def arrays_of(camera: Calibration, n_levels: int | None = None) -> dict[str, Any]:
    content = FORMATS["npz"].encode(camera, ExportSettings(n_levels=n_levels)).content
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return dict(archive)


def test_numpy_reads_all_a_script_wants() -> None:
    camera = camera_with_noise()

    arrays = arrays_of(camera)

    assert arrays["channels"].tolist() == ["R", "G", "B"]
    levels = np.arange(256, dtype=np.uint8)
    picture = np.stack([levels] * 3, axis=-1)[np.newaxis]
    assert arrays["inverse_lut"] == pytest.approx(camera.linearize(picture)[0], abs=1e-7)
    assert arrays["brightness"] == pytest.approx(levels / 255)
    assert arrays["inverse_lut_std"][:, :2] == pytest.approx(0.01 * arrays["inverse_lut"][:, :2])
    assert np.all(np.isnan(arrays["inverse_lut_std"][:, 2]))
    assert arrays["observed_levels"].tolist() == [[3, 250]] * 3
    assert arrays["noise"][:2].tolist() == [[1e-4, 2e-5]] * 2
    assert np.all(np.isnan(arrays["noise"][2]))
    for response, shown in zip(camera.channels, arrays["response_lut"].T, strict=True):
        assert shown == pytest.approx(response.curve.response(arrays["irradiance"]))


def test_all_of_it_comes_back(tmp_path: Path) -> None:
    camera = camera_with_noise()
    export_response(camera, tmp_path / "camera.npz", "npz")

    again = import_response(tmp_path / "camera.npz")

    for had, has in zip(camera.channels, again.channels, strict=True):
        assert has.inverse_lut == pytest.approx(had.inverse_lut, abs=1e-9)
        assert (has.noise, has.observed_levels) == (had.noise, had.observed_levels)
        assert (has.inverse_lut_std is None) == (had.inverse_lut_std is None)
    assert again.channels[0].inverse_lut_std == pytest.approx(camera.channels[0].inverse_lut_std)


@pytest.mark.parametrize("n_levels", [4, 1024])
def test_other_numbers_of_levels(n_levels: int, tmp_path: Path) -> None:
    camera = camera_with_noise()
    export_response(camera, tmp_path / "camera.npz", "npz", ExportSettings(n_levels=n_levels))

    again = import_response(tmp_path / "camera.npz")

    assert arrays_of(camera, n_levels)["inverse_lut_std"].shape == (n_levels, 3)
    brightness = np.linspace(0, 1, n_levels)
    for had, has in zip(camera.channels, again.channels, strict=True):
        assert has.curve.inverse(brightness) == pytest.approx(
            had.curve.inverse(brightness), abs=1e-9
        )
        assert has.noise == had.noise


def written(path: Path, **changes: Any) -> Path:
    np.savez(path, **{**arrays_of(camera_with_noise()), **changes})
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"channels": np.array(["B", "G", "R"])}, "no column for each of Y, or of R, G and B"),
        ({"channels": np.array(["Y"])}, "no column for each of Y, or of R, G and B"),
        ({"channels": np.array([None])}, "channels is not a plain array of numbers or names"),
        (
            {"channels": np.array([1.0, 2.0, 3.0])},
            "channels is not a plain array of numbers or names",
        ),
        ({"channels": np.array(["R", "G"])}, "no column for each of Y, or of R, G and B"),
        ({"inverse_lut": np.zeros((5, 4, 3))}, "no column for each"),
        ({"inverse_lut": np.zeros((66_000, 3))}, "66000 levels, more than 65536"),
        ({"inverse_lut": np.zeros((300_000, 3))}, "7200128 bytes, more than any response curve"),
        ({"inverse_lut": np.zeros((256, 3))}, "channel R has no irradiance above 0"),
        ({"observed_levels": np.array([[9, 3]] * 3)}, "channel R was seen at levels 9 to 3 of 256"),
        ({"observed_levels": np.array([[0, 255]])}, "not a sound NumPy archive"),
        ({"noise": np.array([[-1.0, 1.0]] * 3)}, "noise needs a slope >= 0"),
        ({"noise": np.zeros(3)}, "not a sound NumPy archive"),
    ],
)
def test_other_content_is_refused(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = written(tmp_path / "bad.npz", **changes)

    with pytest.raises(CalibrationFileError, match=message) as caught:
        import_response(path)

    assert str(caught.value).startswith(f"{path}: ")


def test_objects_are_never_unpickled(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[Any, ...]:
            return (Path.touch, (tmp_path / "sprung",))

    path = written(tmp_path / "bad.npz", inverse_lut=np.array([Trap()], dtype=object))
    (tmp_path / "sprung").unlink(missing_ok=True)

    with pytest.raises(CalibrationFileError, match="is not a plain array"):
        import_response(path)

    assert not (tmp_path / "sprung").exists()


def rewritten(path: Path, name: str, content: bytes, **options: Any) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for member, values in arrays_of(camera_with_noise()).items():
            file = io.BytesIO()
            np.save(file, values)
            archive.writestr(
                f"{member}.npy", content if member == name else file.getvalue(), **options
            )
    return path


def npy(shape: str, data: bytes, descr: str = "<f8") -> bytes:
    header = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}".ljust(117)
    return b"\x93NUMPY\x01\x00" + (118).to_bytes(2, "little") + f"{header}\n".encode() + data


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (npy("256, 3", bytes(100)), "inverse_lut should have 6144 bytes, not 100"),
        (npy("9999999, 9999999", b""), "bytes, not 0"),
        (npy("256, 3", bytes(6144), "|O8"), "is not a plain array"),
        (npy("256, -3", bytes(6144)), "is not a plain array"),
        (npy("3,", b"\xff" * 12, "<U1"), "is not a plain array"),
        (b"", "is not a plain array"),
    ],
)
def test_arrays_that_lie_about_their_size(content: bytes, message: str, tmp_path: Path) -> None:
    path = rewritten(tmp_path / "bad.npz", "inverse_lut", content)

    with pytest.raises(CalibrationFileError, match=message):
        import_response(path)


def test_names_of_no_characters_are_refused(tmp_path: Path) -> None:
    """Code points beyond Unicode, of which Python makes no text."""
    path = rewritten(tmp_path / "bad.npz", "channels", npy("3,", b"\xff" * 12, "<U1"))

    with pytest.raises(CalibrationFileError, match="no column for each of Y, or of R, G and B"):
        import_response(path)


def test_bombs_are_refused_before_they_are_inflated(tmp_path: Path) -> None:
    bomb = bytes(100 << 20)
    path = rewritten(tmp_path / "bomb.npz", "noise", bomb, compress_type=zipfile.ZIP_DEFLATED)
    with pytest.raises(CalibrationFileError, match="104857600 bytes, more than any response"):
        import_response(path)

    path = rewritten(tmp_path / "lzma.npz", "", b"", compress_type=zipfile.ZIP_LZMA)
    with pytest.raises(CalibrationFileError, match="compressed in a way that NumPy does not use"):
        import_response(path)

    with zipfile.ZipFile(tmp_path / "many.npz", "w") as archive:
        for number in range(100):
            archive.writestr(f"{number}_inverse_lut.npy", b"")
    with pytest.raises(CalibrationFileError, match="has more than 64 members"):
        import_response(tmp_path / "many.npz")


def test_a_member_that_says_it_is_small_is_cut(tmp_path: Path) -> None:
    """The sizes in both headers are lies; what is read is what they say."""
    content = npy("256, 3", bytes(6144))
    path = rewritten(tmp_path / "bad.npz", "inverse_lut", content)
    size = len(content).to_bytes(4, "little")
    path.write_bytes(path.read_bytes().replace(size, (50).to_bytes(4, "little")))

    with pytest.raises(CalibrationFileError, match="not a sound NumPy archive"):
        import_response(path)


def test_a_file_cut_short(tmp_path: Path) -> None:
    path = written(tmp_path / "camera.npz")
    path.write_bytes(path.read_bytes()[:-100])

    with pytest.raises(CalibrationFileError, match="it is damaged"):
        import_response(path)
