from pathlib import Path

import pytest

from chartless.errors import ImageError
from chartless.frames.sequence import expanded


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("shot10.png", "shot2.png", "shot1.png", "f_0002.png", "f_0010.png", "f_10000.png"):
        (tmp_path / name).touch()
    (tmp_path / "deep" / "er").mkdir(parents=True)
    (tmp_path / "deep" / "er" / "shot3.png").touch()
    return tmp_path


def names(paths: list[Path]) -> list[str]:
    return [path.name for path in paths]


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("shot*.png", ["shot1.png", "shot2.png", "shot10.png"]),
        ("shot?.png", ["shot1.png", "shot2.png"]),
        ("shot[13-9].png", ["shot1.png"]),
        ("**/shot*.png", ["shot3.png", "shot1.png", "shot2.png", "shot10.png"]),
        ("f_%04d.png", ["f_0002.png", "f_0010.png", "f_10000.png"]),
        ("shot%d.png", ["shot1.png", "shot2.png", "shot10.png"]),
        ("shot%01d.png", ["shot1.png", "shot2.png", "shot10.png"]),
        ("f_%d.png", ["f_0002.png", "f_0010.png", "f_10000.png"]),
    ],
)
def test_patterns_become_files_in_order(pattern: str, found: list[str], folder: Path) -> None:
    assert names(expanded([folder / pattern])) == found


@pytest.mark.parametrize(("width", "left_out"), [("02", "shot1.png"), ("0004", "shot1.png")])
def test_numbers_of_fewer_digits_are_not_left_out(width: str, left_out: str, folder: Path) -> None:
    pattern = folder / f"shot%{width}d.png"

    with pytest.raises(ImageError) as caught:
        expanded([pattern])

    assert str(caught.value) == (
        f"{pattern}: leaves out {left_out}, whose number has fewer digits: write shot%d.png for "
        "numbers of any digits"
    )


def test_names_stay_as_given_and_where_they_are(folder: Path) -> None:
    missing = folder / "none.png"

    assert names(expanded([missing, folder / "shot?.png", folder / "shot10.png"])) == [
        "none.png", "shot1.png", "shot2.png", "shot10.png",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["a[1].png", "50%d.png"])
def test_a_file_named_like_a_pattern_is_that_file(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    (tmp_path / "a1.png").touch()

    assert expanded([tmp_path / name]) == [tmp_path / name]


def test_a_folder_is_no_picture_of_a_pattern(folder: Path) -> None:
    (folder / "shot7.png").mkdir()

    assert "shot7.png" not in names(expanded([folder / "shot*.png"]))


@pytest.mark.parametrize("pattern", ["*.jpg", "g_%03d.png", "none/*.png", "none/%d.png"])
def test_a_pattern_without_files_is_refused(pattern: str, folder: Path) -> None:
    with pytest.raises(ImageError) as caught:
        expanded([folder / pattern])

    assert str(caught.value) == f"{folder / pattern}: no file matches this pattern: check it"
