"""Addresses on the internet where a file is asked for."""

from pathlib import Path
from typing import Any

import pytest

from chartless import load
from chartless._files import make_folder, require_writable
from chartless._files.given import address_in
from chartless.curves.file import read_curve
from chartless.errors import ChartlessError
from chartless.formats import load_calibration
from chartless.frames.sequence import expanded
from chartless.images import read_frame, read_video

ADDRESS = "https://example.org/shots/a.jpg"


@pytest.mark.parametrize("given", [ADDRESS, Path(ADDRESS)])
def test_an_address_keeps_its_slashes(given: str | Path) -> None:
    assert address_in(given) == ADDRESS


@pytest.mark.parametrize("given", ["a.jpg", "C:/a.jpg", "/dev/video0", "a:b/c.jpg", "../http"])
def test_a_file_is_no_address(given: str) -> None:
    assert address_in(given) is None


def test_a_folder_may_have_a_strange_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("http:").mkdir()
    Path("http:/a.jpg").touch()

    assert address_in("http:/a.jpg") is None


def test_whatever_reads_a_file_says_that_an_address_is_none() -> None:
    readers = (
        read_frame,
        load,
        load_calibration,
        read_curve,
        lambda path: list(read_video(path)),
        lambda path: expanded([Path(path)]),
    )
    for reader in readers:
        for address in (ADDRESS, "http://example.org/a.jpg?size=2"):
            with pytest.raises(ChartlessError) as caught:
                reader(address)
            assert str(caught.value) == (
                f"{address}: is an address, not a file: download it and give the name of the file"
            )


@pytest.mark.parametrize("reader", [load, load_calibration, read_curve])
def test_a_file_that_is_none_comes_with_advice(reader: Any, tmp_path: Path) -> None:
    with pytest.raises(ChartlessError, match=r"Is a directory: name a file in it$"):
        reader(tmp_path)
    with pytest.raises(ChartlessError, match=r"No such file or directory: check the name$"):
        reader(tmp_path / "missing.csv")


@pytest.mark.parametrize("writer", [require_writable, make_folder])
def test_nothing_is_written_to_an_address(writer: object) -> None:
    assert callable(writer)
    with pytest.raises(ChartlessError, match=r"https://example\.org/shots/a\.jpg: is an address"):
        writer(Path(ADDRESS))
