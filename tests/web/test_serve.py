"""``chartless serve`` as a program: how it starts, and that nothing is left when it ends."""

import contextlib
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from web_client import PATIENCE, Client

from chartless.web import _janitor

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX systems")

Start = Callable[..., "Server"]
_PROGRAM = [sys.executable, "-m", "chartless"]


class Server:
    """A running program, its temporary files in a folder of their own."""

    def __init__(self, process: subprocess.Popen[bytes], folder: Path) -> None:
        self.process, self.folder = process, folder
        assert process.stdout is not None
        self.line = process.stdout.readline().decode()

    @property
    def client(self) -> Client:
        found = re.search(r":(\d+)/", self.line)
        assert found, self.line
        return Client(int(found[1])).begin()

    def end(self, number: int) -> tuple[int, str, str]:
        """Status and output after a signal."""
        self.process.send_signal(number)
        return self.rest()

    def rest(self) -> tuple[int, str, str]:
        """Status and the output that was not read yet, at its end."""
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out.decode(), err.decode()

    def is_cleared(self) -> bool:
        """Whether soon nothing is left: no files, and no process that works there."""
        for _ in range(100):
            if not any(self.folder.iterdir()) and not list(workers(self.folder)):
                return True
            time.sleep(0.1)
        return False


def workers(folder: Path) -> Iterator[int]:
    """Processes that run in a folder, or are told of it."""
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            told = str(folder).encode() in (process / "cmdline").read_bytes()
            inside = str((process / "cwd").readlink()).startswith(str(folder))
            if told or inside:
                yield int(process.name)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    started: list[subprocess.Popen[bytes]] = []

    def run(*arguments: str, **environment: str) -> Server:
        folder = tmp_path / "temporary"
        folder.mkdir(exist_ok=True)
        process = subprocess.Popen(
            [*_PROGRAM, "serve", "--no-browser", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,  # what a line read ahead would be lost to communicate()
            env=os.environ | {"TMPDIR": str(folder)} | environment,
        )
        started.append(process)
        return Server(process, folder)

    yield run
    for process in started:
        process.kill()
        process.communicate()


def busy(server: Server, frames: list[Path]) -> Client:
    """A client for whom a calibration is being made."""
    client = server.client
    for path in frames:
        client.put(path.name, path.read_bytes())
    client.ask("POST", "/api/cameras", {"method": "ism-bin"})
    for _ in range(200):
        (camera,) = client.state["cameras"]
        if camera["stage"] == "estimating":
            return client
        assert camera["state"] == "running"
        time.sleep(0.05)
    pytest.fail("the calibration did not begin")


@pytest.mark.slow
def test_it_says_where_the_page_is_and_listens_there_alone(start: Start) -> None:
    server = start()

    assert re.fullmatch(r"page at http://127\.0\.0\.1:\d+/\n", server.line)
    assert server.client.ask("GET", "/").status == 200
    listening = Path("/proc/net/tcp").read_text()
    port = f"{server.client.port:04X}"
    assert f"0100007F:{port}" in listening
    assert f"00000000:{port}" not in listening


@pytest.mark.slow
@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 here")
def test_an_address_of_the_next_kind(start: Start) -> None:
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        pytest.skip("no IPv6 here")
    server = start("--host", "::1")
    found = re.fullmatch(r"page at (http://\[::1\]:\d+/)\n", server.line)
    assert found

    with urllib.request.urlopen(found[1], timeout=PATIENCE) as answer:
        assert b"<title>chartless</title>" in answer.read()


@pytest.mark.slow
def test_another_address_takes_a_token(start: Start) -> None:
    server = start("--host", "0.0.0.0")
    found = re.search(r"http://(.+):(\d+)/\?token=([\w-]{20,})", server.line)
    assert found is not None
    name, port, token = found.groups()
    client = Client(int(port))

    assert name != "0.0.0.0"
    socket.create_connection((name, int(port))).close()
    assert client.ask("GET", "/").status == 403
    assert client.ask("GET", f"/?token={token}").status == 303
    assert client.ask("GET", "/").status == 200


@pytest.mark.slow
def test_with_others_on_the_network_it_says_what_is_true(start: Start) -> None:
    """On the terminal and on the page; without them, that files stay here."""
    own, shared = start(), start("--host", "0.0.0.0")
    found = re.search(r":(\d+)/\?token=([\w-]+)", shared.line)
    assert found is not None
    client = Client(int(found[1]))
    client.ask("GET", f"/?token={found[2]}")

    pages = [" ".join(each.ask("GET", "/").body.decode().split()) for each in (own.client, client)]
    _, told_own, _ = own.end(signal.SIGINT)
    _, told, _ = shared.end(signal.SIGINT)

    assert "Files stay on this computer." in pages[0]
    assert "on the network" not in pages[0] + told_own
    assert "Files stay on this computer" not in pages[1]
    assert "Others on the network who have its address with the token can send files" in pages[1]
    assert told.splitlines()[:2] == [
        "others on the network who have this address can send files here, unencrypted",
        "files are kept on this computer until it stops",
    ]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_what_is_sent_takes_no_memory_of_the_server(start: Start) -> None:
    """A picture in 1 kB that is decoded to tell its size, bytes of nothing, a table of 8 MB."""
    server = start()
    client = server.client
    client.put("a.txt", b"no picture")
    others = list(workers(server.folder))
    before = peak_kilobytes(server.process.pid), sum(map(peak_kilobytes, others))
    picture = io.BytesIO()
    Image.fromarray(np.zeros((4_000, 4_000), np.uint8)).save(picture, "JPEG2000")
    assert client.put("a.jp2", picture.getvalue()).status == 201
    assert client.put("a.bin", bytes(50_000_000)).status == 422

    key = client.put("table.json", calibration_of_levels(1024)).json["id"]
    assert client.finished(key)["error"] == ""
    assert client.ask("GET", f"/api/cameras/{key}/export/cube").status == 200
    assert client.ask("GET", f"/api/comparison?cameras={key}").status == 200

    assert sum(map(peak_kilobytes, others)) - before[1] > 60_000
    assert peak_kilobytes(server.process.pid) - before[0] < 30_000


def calibration_of_levels(n_levels: int) -> bytes:
    """A small file of ours with pairs of so many levels, of which each is seen once."""
    entry = {
        "name": "Y",
        "parameters": None,
        "inverse_lut": np.linspace(0, 1, n_levels).tolist(),
        "inverse_lut_std": None,
        "noise": None,
        "observed_levels": [0, n_levels - 1],
        "pairs": n_levels,
        "status": "converged",
        "flags": [],
        "cooccurrence": {"first": list(range(n_levels)), "counts": [[1]] * n_levels},
    }
    content = {
        "format": "chartless-calibration",
        "version": 1,
        "bit_depth": 16,
        "levels": n_levels,
        "method": "nlf",
        "model": None,
        "channels": [entry],
        "provenance": {},
    }
    return json.dumps(content).encode()


def peak_kilobytes(process: int) -> int:
    """Memory that a process had at most."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{process}/status").read_text())
    assert found
    return int(found[1])


@pytest.mark.slow
def test_headers_without_end(start: Start) -> None:
    server = start()
    with socket.create_connection(("127.0.0.1", server.client.port), PATIENCE) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\n")
        with contextlib.suppress(ConnectionError):
            for number in range(100_000):
                connection.sendall(f"X-{number}: {'x' * 1000}\r\n".encode())
            pytest.fail("100 MB of headers were taken")

    assert server.client.ask("GET", "/").status == 200


@pytest.mark.slow
def test_many_connections_that_say_nothing(start: Start) -> None:
    client = start().client
    with contextlib.ExitStack() as opened:
        for _ in range(300):
            opened.enter_context(socket.create_connection(("127.0.0.1", client.port)))

        assert client.ask("GET", "/").status == 200


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="sets limits of another process")
def test_more_connections_than_the_computer_has_room_for(start: Start) -> None:
    resource = pytest.importorskip("resource")
    server = start()
    client = server.client
    resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (40, 40))
    with contextlib.ExitStack() as opened:
        for _ in range(60):
            opened.enter_context(socket.create_connection(("127.0.0.1", client.port)))

    assert client.ask("GET", "/").status == 200
    assert server.end(signal.SIGINT)[::2] == (0, "")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_without_the_process_that_clears_it_is_cleared(start: Start) -> None:
    server = start()
    assert server.client.state == {"files": [], "cameras": []}
    (janitor,) = (
        each
        for each in workers(server.folder)
        if b"_janitor" in Path(f"/proc/{each}/cmdline").read_bytes()
    )
    os.kill(janitor, signal.SIGKILL)

    assert server.end(signal.SIGINT)[::2] == (0, "")
    assert server.is_cleared()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_in_the_middle_of_a_job_it_ends_at_once(
    start: Start, frames: list[Path], number: int
) -> None:
    server = start()
    busy(server, frames)
    begun = time.monotonic()

    status, out, err = server.end(number)

    assert time.monotonic() - begun < 10
    assert (status, err) == (0, "")
    assert out.endswith("stopped\n")
    assert server.is_cleared()


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
def test_killed_in_the_middle_of_a_job_it_leaves_nothing(start: Start, frames: list[Path]) -> None:
    server = start()
    busy(server, frames)
    assert list(workers(server.folder))

    server.end(signal.SIGKILL)

    assert server.is_cleared()


@pytest.mark.slow
def test_interrupted_while_a_file_is_sent_it_ends(start: Start) -> None:
    server = start()
    with server.client.half_sent("a.png", 1_000_000, b"\x89PNG"):
        time.sleep(0.3)

        status, _, err = server.end(signal.SIGINT)

    assert (status, err) == (0, "")
    assert server.is_cleared()


def test_a_port_in_use(start: Start) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        server = start("--port", str(port))
        status, out, err = server.rest()

    assert status == 2
    assert server.line + out == ""
    assert err.startswith(f"chartless: error: cannot listen on 127.0.0.1, port {port}")
    assert err.count("\n") == 1
    assert not any(server.folder.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("host", ["no.such.host.invalid", "8.8.8.8", "a" * 300])
def test_an_address_of_another_computer(start: Start, host: str) -> None:
    server = start("--host", host)
    status, _, err = server.rest()

    assert status == 2
    assert err.startswith("chartless: error: ")
    assert err.count("\n") == 1


def test_without_its_extra_it_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['uvicorn'] = None; from chartless.cli import main;"
        "sys.exit(main(['serve', '--no-browser']))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert run.returncode == 2
    assert "in the folder of chartless, run pip install '.[web]'" in run.stderr
    assert run.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_browser_that_does_not_open_is_no_error(start: Start) -> None:
    server = start("--browser", BROWSER="/does/not/exist %s")
    time.sleep(1)

    assert server.client.ask("GET", "/").status == 200
    assert server.end(signal.SIGINT)[0] == 0


def test_its_help_has_examples() -> None:
    run = subprocess.run([*_PROGRAM, "serve", "--help"], capture_output=True, text=True, check=True)

    assert "chartless serve --port 8000 --no-browser" in run.stdout


def test_the_folder_goes_even_if_others_remove_parts_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "desk"
    (folder / "files").mkdir(parents=True)
    remove = os.rmdir

    def disturbed(path: str, **settings: int | None) -> None:
        monkeypatch.setattr(os, "rmdir", remove)
        raise FileNotFoundError(path)

    monkeypatch.setattr(os, "rmdir", disturbed)
    monkeypatch.setattr("sys.stdin", io.StringIO())
    _janitor.main(str(folder))

    assert not folder.exists()
