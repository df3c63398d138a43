"""Starting and stopping the page's server."""

import contextlib
import ipaddress
import logging
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import mkdtemp
from threading import Timer
from types import FrameType

from chartless.errors import ParameterError, how_to_install
from chartless.web._limits import Limits

_LOOPBACK = "127.0.0.1"
_ELSEWHERE = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}  # RFC 5737, RFC 3849
_PATIENCE = 2  # seconds for requests that are being answered when the server stops
_UNTIL_OPEN = 0.3  # seconds from start to the browser


def serve(
    *,
    host: str = _LOOPBACK,
    port: int = 0,
    browser: bool = True,
    limits: Limits | None = None,
    on_start: Callable[[str], None] | None = None,
) -> None:
    """Serve the page until the program is interrupted.

    Parameters
    ----------
    host : str
        Address to listen on. Any but this computer's own (127.0.0.1, ::1, localhost) lets others
        in who know the token, which is then part of the page's address.
    port : int
        0 for any that is free.
    browser : bool
        Whether to open the page in a browser.
    limits : Limits, optional
    on_start : callable, optional
        Called with the address of the page.

    Raises
    ------
    ParameterError
        If the host is none, the port is in use, or Starlette and Uvicorn are not installed.
    """
    try:
        import starlette  # noqa: F401 - what else `_app` imports comes with chartless
        import uvicorn
    except ImportError as error:
        msg = f"the page needs {error.name}, which is an extra: {how_to_install('web')}"
        raise ParameterError(msg) from error
    with _listening(host, port) as listener, _folder() as folder, _terminable():
        from chartless.web._app import make_app

        port = listener.getsockname()[1]
        is_local = _is_loopback(host)
        token = None if is_local else secrets.token_urlsafe(24)
        name = _name_for_others(listener, host)
        own = f"[{name}]" if ":" in name else name
        app = make_app(
            folder,
            port=port,
            hosts=frozenset(f"{each}:{port}" for each in (own, "localhost")) if is_local else None,
            token=token,
            limits=limits,
        )
        address = f"http://{own}:{port}/" + (f"?token={token}" if token else "")
        if on_start is not None:
            on_start(address)
        if browser:
            opener = Timer(_UNTIL_OPEN, webbrowser.open, (address,))
            opener.daemon = True
            opener.start()
        logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # as Uvicorn's
        server = uvicorn.Server(
            uvicorn.Config(
                app,
                http="h11",  # which bounds headers
                log_level="critical",  # what goes wrong is answered, in one line
                access_log=False,
                server_header=False,
                proxy_headers=False,
                ws="none",
                timeout_graceful_shutdown=_PATIENCE,
            )
        )
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listener])


@contextlib.contextmanager
def _listening(host: str, port: int) -> Iterator[socket.socket]:
    """Listen at an address, or say why that is impossible."""
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (socket.gaierror, UnicodeError) as error:
        msg = f"{host!r} is not an address of this computer: omit --host to use {_LOOPBACK}"
        raise ParameterError(msg) from error
    with socket.socket(family, kind, protocol) as listener:
        if sys.platform != "win32":  # there it would share the port with others
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(place)
            listener.listen()
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            msg = (
                f"cannot listen on {host}, port {port} ({reason}): choose another --port, or "
                "use --port 0 for any free one"
            )
            raise ParameterError(msg) from error
        yield listener


def _name_for_others(listener: socket.socket, host: str) -> str:
    """The address itself or, for one that stands for all, that of this computer."""
    if not ipaddress.ip_address(listener.getsockname()[0]).is_unspecified:
        return host
    with socket.socket(listener.family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((_ELSEWHERE[listener.family], 9))  # asks for the way, and sends nothing
        except OSError:  # without a network nobody else is there
            return "localhost"
        name: str = probe.getsockname()[0]
        return name


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """A folder that is gone afterwards, even if this program is killed."""
    folder = Path(mkdtemp(prefix="chartless-"))
    janitor = subprocess.Popen(  # noqa: S603 - ourselves
        [sys.executable, "-P", "-m", "chartless.web._janitor", str(folder)],
        stdin=subprocess.PIPE,
        start_new_session=True,
    )
    try:
        yield folder
    finally:
        if janitor.stdin is not None:
            janitor.stdin.close()
        janitor.wait()
        shutil.rmtree(folder, ignore_errors=True)  # it may have been killed


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM end the program as Ctrl-C does."""

    def interrupt(_: int, __: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
