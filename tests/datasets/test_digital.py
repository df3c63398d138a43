"""Responses of digital cameras from a file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless.datasets import DatasetError, find_digital, load_digital
from chartless.datasets.digital import FILE, MEASURED

LIGHT = np.linspace(0, 1, 5)


def saved(path: Path, **changes: Any) -> Path:
    content = {
        "E": LIGHT,
        "names": ["one", "other"],
        "f": [[0.1, 0.3, 0.2, 0.5, 0.9], LIGHT],
        **changes,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **{name: value for name, value in content.items() if value is not None})
    return path


def test_responses_go_from_black_to_white_and_never_fall(tmp_path: Path) -> None:
    cameras = load_digital(saved(tmp_path / "a.npz"))

    assert cameras.names == ("one", "other")
    np.testing.assert_allclose(cameras.curves[0], np.array([0, 0.2, 0.2, 0.4, 0.8]) / 0.8)
    np.testing.assert_array_equal(cameras.curves[1], LIGHT)
    np.testing.assert_array_equal(cameras.irradiance, LIGHT)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"E": None}, "cannot be read as responses of digital cameras: "),
        ({"E": LIGHT[::-1]}, "holds no responses f at increasing irradiances E, "),
        ({"names": ["one"]}, "holds no responses f at increasing irradiances E, "),
        ({"f": np.zeros((2, 5))}, "holds a response that does not increase"),
    ],
)
def test_anything_else_is_refused_with_its_name(
    tmp_path: Path, changes: dict[str, Any], reason: str
) -> None:
    path = saved(tmp_path / "a.npz", **changes)

    with pytest.raises(DatasetError) as refusal:
        load_digital(path)

    assert str(refusal.value).startswith(f"{path}: {reason}")


def test_a_file_that_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_text("no")

    with pytest.raises(DatasetError, match=r"a\.npz: cannot be read as responses"):
        load_digital(path)


def test_they_are_found_in_the_data_of_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHARTLESS_DATA", str(tmp_path))
    assert find_digital() is None
    saved(tmp_path / FILE)

    found = find_digital()

    assert found is not None
    assert found.names == ("one", "other")


def test_measured_cameras_are_in_the_data(data_path: Path) -> None:
    if not (data_path / FILE).is_file():
        pytest.skip(f"no {FILE} in {data_path}")
    assert set(MEASURED) < set(load_digital(data_path / FILE).names)
