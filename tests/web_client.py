"""The page's server in a thread, and a client that speaks to it as a browser's script would."""

import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

pytest.importorskip("starlette", reason="no Starlette: pip install '.[web]'")
uvicorn = pytest.importorskip("uvicorn", reason="no Uvicorn: pip install '.[web]'")

from chartless.web._app import make_app  # noqa: E402 - of the two above

PATIENCE = 60  # seconds


@dataclass(frozen=True)
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)

    @property
    def error(self) -> str:
        text: str = self.json["error"]
        return text


@dataclass
class Client:
    """Asks as the page's script does; headers may be added, or taken away with None."""

    port: int
    cookies: dict[str, str] = field(default_factory=dict)

    def ask(
        self,
        method: str,
        path: str,
        body: bytes | dict[str, Any] | None = None,
        **headers: str | None,
    ) -> Answer:
        sent = {
            "Host": f"127.0.0.1:{self.port}",
            "X-Chartless": "1",
            "Cookie": "; ".join(f"{name}={value}" for name, value in self.cookies.items()),
            **{name.replace("_", "-"): value for name, value in headers.items()},
        }
        content = json.dumps(body).encode() if isinstance(body, dict) else body
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        kept = {name: value for name, value in sent.items() if value is not None}
        try:
            connection.request(method, path, content, kept)
            answer = connection.getresponse()
            got = {name.lower(): value for name, value in answer.getheaders()}
            body = answer.read()
        finally:
            connection.close()
        if "set-cookie" in got:
            name, _, value = got["set-cookie"].split(";")[0].partition("=")
            self.cookies[name] = value
        return Answer(answer.status, got, body)

    def begin(self) -> "Client":
        assert self.ask("POST", "/api/session").status == 200
        return self

    def put(self, name: str, content: bytes) -> Answer:
        return self.ask("PUT", f"/api/files?name={quote(name)}", content)

    def half_sent(self, name: str, size: int, content: bytes) -> socket.socket:
        """Begin to send a file of that size; closing the connection gives it up."""
        return self.begun(f"PUT /api/files?name={quote(name)}", size, content)

    def begun(self, line: str, size: int, content: bytes) -> socket.socket:
        """Connection with a request of that size of which this much was sent."""
        connection = socket.create_connection(("127.0.0.1", self.port))
        cookies = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        head = (
            f"{line} HTTP/1.1",
            f"Host: 127.0.0.1:{self.port}",
            "X-Chartless: 1",
            f"Cookie: {cookies}",
            f"Content-Length: {size}",
        )
        connection.sendall(("\r\n".join(head) + "\r\n\r\n").encode() + content)
        return connection

    @property
    def state(self) -> Any:
        return self.ask("GET", "/api/state").json

    def finished(self, key: str) -> Any:
        """State of a calibration when it is done or has failed."""
        for _ in range(PATIENCE * 10):
            (camera,) = (each for each in self.state["cameras"] if each["id"] == key)
            if camera["state"] != "running":
                return camera
            time.sleep(0.1)
        pytest.fail("no calibration in time")


@contextmanager
def serving(folder: Path, **settings: Any) -> Iterator[Client]:
    """A server, and a client that has no workspace yet."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        hosts = frozenset({f"127.0.0.1:{port}", f"localhost:{port}"})
        app = make_app(folder, port=port, **{"hosts": hosts, **settings})
        server = uvicorn.Server(uvicorn.Config(app, log_level="critical"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        yield Client(port)
        server.should_exit = True
        thread.join(PATIENCE)
        assert not thread.is_alive()
