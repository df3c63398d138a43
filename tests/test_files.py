"""Files that appear whole or not at all."""

import csv
import os
from pathlib import Path

import pytest

from chartless._files import atomic_path, make_folder, write_csv, write_text
from chartless.errors import ChartlessError, OutputError, ParameterError


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "notes.txt"


def test_what_is_written_appears_at_the_end(path: Path) -> None:
    with atomic_path(path) as temporary:
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
        assert not temporary.exists()
        temporary.write_text("new")
        assert not path.exists()

    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


def test_an_older_file_stays_until_the_end(path: Path) -> None:
    path.write_text("older")
    with atomic_path(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "older"

    assert path.read_text() == "new"


@pytest.mark.parametrize(
    "error", [ParameterError("no"), ValueError("no"), KeyboardInterrupt(), MemoryError()]
)
def test_a_failure_leaves_everything_as_it_was(error: BaseException, path: Path) -> None:
    path.write_text("older")

    def write() -> None:
        with atomic_path(path) as temporary:
            temporary.write_text("half of the ne")
            raise error

    with pytest.raises(type(error)):
        write()

    assert path.read_text() == "older"
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_is_an_output_error(path: Path) -> None:
    path.write_text("older")

    def write() -> None:
        with atomic_path(path) as temporary:
            temporary.write_text("half")
            raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match=r"cannot be written \(No space left on device\)$"):
        write()

    assert path.read_text() == "older"
    assert list(path.parent.iterdir()) == [path]


def test_a_body_that_writes_nothing_is_an_error(path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"), atomic_path(path):
        pass


def test_a_link_is_followed(path: Path) -> None:
    target = path.with_name("target.txt")
    target.write_text("older")
    path.symlink_to(target)

    with atomic_path(path) as temporary:
        temporary.write_text("new")

    assert path.is_symlink()
    assert target.read_text() == "new"


def test_a_link_to_nothing_is_followed(path: Path) -> None:
    path.symlink_to(path.with_name("target.txt"))

    with atomic_path(path) as temporary:
        temporary.write_text("new")

    assert path.with_name("target.txt").read_text() == "new"


def test_names_without_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    with atomic_path("notes.txt") as temporary:
        temporary.write_text("new")

    assert Path("notes.txt").read_text() == "new"


def refusal(path: Path) -> str:
    with pytest.raises(OutputError) as caught, atomic_path(path):
        pytest.fail("there is nothing to write to")
    assert isinstance(caught.value, ChartlessError)
    assert isinstance(caught.value, OSError)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value)


def test_a_missing_folder(tmp_path: Path) -> None:
    folder = tmp_path / "missing"

    assert f"output folder {folder} does not exist" in refusal(folder / "a.txt")
    assert not folder.exists()


def test_a_file_in_place_of_the_folder(path: Path) -> None:
    path.write_text("a file")

    assert f"{path} is a file, not a folder" in refusal(path / "a.txt")


def test_a_folder_in_place_of_the_file(tmp_path: Path) -> None:
    assert "is a folder: name a file in it" in refusal(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe(path: Path) -> None:
    os.mkfifo(path)

    assert "is not an ordinary file" in refusal(path)


def test_a_folder_that_is_not_writable(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path.parent.chmod(0o500)
    if os.geteuid() == 0:  # whom permissions do not stop
        monkeypatch.setattr(os, "access", lambda *_: False)

    assert f"output folder {path.parent} is not writable" in refusal(path)
    path.parent.chmod(0o700)


# Folders


def test_a_folder_is_made_once(tmp_path: Path) -> None:
    folder = tmp_path / "out"

    make_folder(folder)
    (folder / "kept.txt").touch()
    make_folder(folder)

    assert (folder / "kept.txt").exists()


def test_a_folder_in_a_missing_one(tmp_path: Path) -> None:
    folder = tmp_path / "missing" / "out"

    with pytest.raises(OutputError, match=f"^{folder}: its parent folder {folder.parent} does not"):
        make_folder(folder)

    assert not folder.parent.exists()


def test_a_folder_where_a_file_is(path: Path) -> None:
    path.write_text("here first")

    with pytest.raises(OutputError, match="is a file: choose another output folder"):
        make_folder(path)

    assert path.read_text() == "here first"


def test_a_folder_inside_a_file(path: Path) -> None:
    path.write_text("here first")

    with pytest.raises(OutputError, match="cannot be made"):
        make_folder(path / "out")


# Texts and tables


@pytest.mark.parametrize("text", ["", "one\ntwo\n", "no end of line", "a\r\nb\n", "Ω … – 🎞\n"])
def test_a_text_is_written_as_it_is(text: str, path: Path) -> None:
    write_text(path, text)

    assert path.read_bytes() == text.encode()
    assert list(path.parent.iterdir()) == [path]


def test_a_text_that_cannot_be_encoded_leaves_the_older_one(path: Path) -> None:
    path.write_text("older")

    with pytest.raises(UnicodeEncodeError):
        write_text(path, "half \ud800")

    assert path.read_text() == "older"
    assert list(path.parent.iterdir()) == [path]


def test_a_table_is_read_back_by_any_reader(path: Path) -> None:
    rows = [["plain", 1, 0.1 + 0.2], ['with, comma and "quotes"', -2, 5e-324], ["two\nlines", 0, 1]]

    write_csv(path, ["a name", "b", "c"], rows)

    with path.open(newline="", encoding="utf-8") as file:
        header, *read = csv.reader(file)
    assert header == ["a name", "b", "c"]
    assert [[name, int(whole), float(real)] for name, whole, real in read] == rows
    assert b"\r" not in path.read_bytes()


def test_a_table_may_be_empty_and_its_rows_an_iterator(path: Path) -> None:
    write_csv(path, ["a", "b"], [])
    assert path.read_text() == "a,b\n"

    write_csv(path, ["a", "b"], ((n, n**2) for n in range(2)))
    assert path.read_text() == "a,b\n0,0\n1,1\n"


def test_rows_that_fail_leave_the_older_table(path: Path) -> None:
    path.write_text("older")

    with pytest.raises(ZeroDivisionError):
        write_csv(path, ["a"], ([1 // n] for n in (1, 0)))

    assert path.read_text() == "older"
    assert list(path.parent.iterdir()) == [path]


def test_texts_and_tables_in_a_missing_folder(tmp_path: Path) -> None:
    for write in (lambda path: write_text(path, "a"), lambda path: write_csv(path, ["a"], [])):
        with pytest.raises(OutputError, match="create it first"):
            write(tmp_path / "missing" / "a.csv")

    assert list(tmp_path.iterdir()) == []
