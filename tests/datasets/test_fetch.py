"""Where data sets are found, and what a download leaves behind when it fails."""

import hashlib
import http.server
import pickle
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pooch
import pytest

from chartless.datasets import DATASETS, DatasetError, fetch, locate
from chartless.errors import ChartlessError, UnknownNameError

CONTENT = b"two hundred and one curves"


class Server(http.server.ThreadingHTTPServer):
    """Answers at three addresses of this computer; counts what it was asked."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Answers)
        self.asked: list[str] = []

    def url(self, name: str) -> str:
        return f"http://127.0.0.1:{self.server_port}/{name}"


class Answers(http.server.BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        self.server.asked.append(self.path)
        if self.path == "/gone.zip":
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Length", str(len(CONTENT)))
        self.end_headers()
        self.wfile.write(CONTENT[:10] if self.path == "/half.zip" else CONTENT)

    def log_message(self, *_: Any) -> None:
        pass


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    monkeypatch.setenv("NO_PROXY", "*")
    with Server() as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache in place of the user's; the folder of dorf in it."""
    monkeypatch.delenv("CHARTLESS_DATA", raising=False)
    monkeypatch.setattr(pooch, "os_cache", lambda project: tmp_path / "cache" / project)
    return tmp_path / "cache" / "chartless" / "dorf"


@pytest.fixture
def publish(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Put another address in place of the published one."""

    def publish(url: str, content: bytes = CONTENT) -> None:
        digest = hashlib.sha256(content).hexdigest()
        archive = replace(DATASETS["dorf"], url=url, sha256=digest)
        monkeypatch.setitem(DATASETS._items, "dorf", archive)

    return publish


Publish = Callable[..., None]


def files_in(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


# Looking


def test_the_folder_of_the_user_comes_before_the_cache(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert locate("dorf") is None

    cache.mkdir(parents=True)
    (cache / "dorfCurves.zip").touch()
    assert locate("dorf") == cache / "dorfCurves.zip"

    own = tmp_path / "own"
    monkeypatch.setenv("CHARTLESS_DATA", str(own))
    assert locate("dorf") == cache / "dorfCurves.zip"

    (own / "dorf").mkdir(parents=True)
    (own / "dorf" / "SOURCE.txt").touch()
    (own / "dorf" / "dorfCurves.zip").mkdir()
    assert locate("dorf") == cache / "dorfCurves.zip"

    for name in ("dorf_b.npz", "dorf_a.npz", "dorfCurves.txt"):
        (own / "dorf" / name).touch()
    assert locate("dorf") == own / "dorf" / "dorfCurves.txt"

    (own / "dorf" / "dorfCurves.txt").unlink()
    assert locate("dorf") == own / "dorf" / "dorf_a.npz"


def test_an_unknown_name_is_refused_with_a_suggestion(cache: Path) -> None:
    for ask in (locate, fetch):
        with pytest.raises(UnknownNameError, match=r"unknown data set 'drof'.*'dorf'"):
            ask("drof")


def test_what_is_pinned_is_complete() -> None:
    for name, archive in DATASETS.items():
        assert archive.name == name
        assert archive.url.startswith("https://")
        assert archive.url.endswith(f"/{archive.file_name}")
        assert len(bytes.fromhex(archive.sha256)) == 32


# Downloading


def test_a_download_goes_to_the_cache_once(
    server: Server, publish: Publish, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(server.url("dorfCurves.zip"))
    logger, said = pooch.get_logger(), list[str]()
    level = logger.level
    monkeypatch.setattr(logger, "handle", lambda record: said.append(record.getMessage()))

    for _ in range(2):
        path = fetch("dorf")
        assert path == cache / "dorfCurves.zip"
        assert path.read_bytes() == CONTENT

    assert server.asked == ["/dorfCurves.zip"]
    assert files_in(cache.parent) == [path]
    assert said == []
    assert logger.level == level


def test_nothing_is_downloaded_that_is_there(
    server: Server, publish: Publish, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(server.url("dorfCurves.zip"))
    path = tmp_path / "own" / "dorf" / "dorf_named.npz"
    path.parent.mkdir(parents=True)
    path.touch()
    monkeypatch.setenv("CHARTLESS_DATA", str(tmp_path / "own"))

    assert fetch("dorf") == path
    assert server.asked == []


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("gone.zip", CONTENT, "the server answered 404 Not Found"),
        ("half.zip", CONTENT, "there is no connection to the server, or it broke off"),
        ("dorfCurves.zip", b"else", "the server sent a different file: its SHA-256 differs"),
    ],
)
def test_a_failed_download_says_what_to_do_and_leaves_nothing(
    *,
    name: str,
    content: bytes,
    why: str,
    server: Server,
    publish: Publish,
    cache: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    publish(server.url(name), content)

    with pytest.raises(DatasetError) as caught:
        fetch("dorf")

    assert str(caught.value) == (
        f"dorf cannot be fetched: {why}; download {server.url(name)} by hand and save it as "
        f"{cache / 'dorfCurves.zip'}, or set CHARTLESS_DATA to a folder that has it as "
        "dorf/dorfCurves.zip"
    )
    assert files_in(cache.parent) == []
    assert locate("dorf") is None
    assert capfd.readouterr() == ("", "")


def test_a_refused_connection(publish: Publish, cache: Path, server: Server) -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        port = closed.getsockname()[1]
    publish(f"http://127.0.0.1:{port}/dorfCurves.zip")

    with pytest.raises(DatasetError, match="dorf cannot be fetched: there is no connection"):
        fetch("dorf")

    assert files_in(cache.parent) == []


def test_a_cache_that_cannot_be_made(server: Server, publish: Publish, cache: Path) -> None:
    publish(server.url("dorfCurves.zip"))
    cache.parent.parent.mkdir()
    cache.parent.touch()

    with pytest.raises(DatasetError, match=f"Not a directory: {cache}; download "):
        fetch("dorf")


def test_a_cache_that_cannot_be_written(
    server: Server, publish: Publish, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError

    publish(server.url("dorfCurves.zip"))
    monkeypatch.setattr(pooch, "retrieve", refuse)

    with pytest.raises(DatasetError, match=f"the folder {cache} cannot be written; download "):
        fetch("dorf")


def test_the_error_is_one_of_ours_and_survives_pickling() -> None:
    error = pickle.loads(pickle.dumps(DatasetError("nowhere")))

    assert isinstance(error, ChartlessError)
    assert isinstance(error, OSError)
    assert str(error) == "nowhere"
