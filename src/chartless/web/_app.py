"""What each address of the page does."""

import asyncio
import errno
import json
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from chartless.errors import ChartlessError, with_options
from chartless.formats.calibration_file import to_text
from chartless.web import _page
from chartless.web._guard import Guard, cookie_of
from chartless.web._limits import Limits
from chartless.web._live import MOST_BYTES, LiveView, Shape
from chartless.web._workers import Workers
from chartless.web._workspace import ROLES, Camera, LimitError, Workspace

Handler = Callable[[Request, Workspace], Awaitable[Response]]

_LARGEST_OPTIONS = 10_000  # bytes
_PATIENCE = 60.0  # seconds for the next bytes of a file or frame
_FULL = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}
_REPORT_POLICY = (
    "sandbox allow-downloads; default-src 'none'; style-src 'unsafe-inline'; img-src data:"
)


def make_app(
    folder: Path,
    *,
    port: int,
    hosts: frozenset[str] | None,
    token: str | None = None,
    limits: Limits | None = None,
) -> Guard:
    """Make the application that answers the page's requests.

    Parameters
    ----------
    folder : Path
        Folder for files of all browsers; it exists, and what is in it is removed at the end.
    port : int
        Port in the names of cookies, which all ports of a computer share.
    hosts, token
        See `chartless.web._guard.Guard`.
    limits : Limits, optional
    """
    limits = limits or Limits()
    desk = _Desk(folder, limits, f"chartless-{port}")

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        await desk.workers.start()
        yield
        await desk.close()

    def route(path: str, handler: Handler, *methods: str) -> Route:
        async def endpoint(request: Request) -> Response:
            return await handler(request, desk.workspace(request))

        return Route(path, endpoint, methods=list(methods))

    async def index(_: Request) -> Response:
        page = _page.document(is_shared=token is not None)
        return Response(page, media_type="text/html")

    async def session(request: Request) -> Response:
        return desk.begin(request)

    app = Starlette(
        routes=[
            Route("/", index, methods=["GET"]),
            Route("/page.js", _script, methods=["GET"]),
            Route("/live.js", _script, methods=["GET"]),
            Route("/page.css", _style, methods=["GET"]),
            Route("/api/session", session, methods=["POST"]),
            route("/api/state", _state, "GET"),
            route("/api/files", _add_file, "PUT"),
            route("/api/files", _remove_files, "DELETE"),
            route("/api/files/{file}", _remove_file, "DELETE"),
            route("/api/files/{file}", _change_file, "PATCH"),
            route("/api/cameras", _calibrate, "POST"),
            route("/api/cameras/{camera}", _remove_camera, "DELETE"),
            route("/api/cameras/{camera}/camera.json", _calibration, "GET"),
            route("/api/cameras/{camera}/report.html", _report, "GET"),
            route("/api/cameras/{camera}/export/{format}", _export, "GET"),
            route("/api/comparison", _comparison, "GET"),
            route("/api/live", _begin_live, "POST"),
            route("/api/live/{view}/frames", _add_live_frame, "POST"),
            route("/api/live/{view}/save", _save_live, "POST"),
        ],
        exception_handlers={
            LimitError: _too_much,
            ChartlessError: _bad_input,
            FileNotFoundError: _removed,
            OSError: _impossible,
            ClientDisconnect: _gone,
            HTTPException: _http_error,
            Exception: _internal,
        },
        lifespan=lifespan,
    )
    return Guard(app, hosts=hosts, token=token, cookie=f"chartless-token-{port}")


class _Desk:
    """The workspaces of all browsers."""

    def __init__(self, folder: Path, limits: Limits, cookie: str) -> None:
        self.workers = Workers(folder, limits.worker_bytes)
        self._folder = folder
        self._limits = limits
        self._cookie = cookie
        self._workspaces: dict[str, Workspace] = {}
        self._closing: set[asyncio.Task[None]] = set()

    def begin(self, request: Request) -> Response:
        """Give a browser its workspace, or leave it the one that it has."""
        if cookie_of(request.scope, self._cookie) in self._workspaces:
            return JSONResponse({"new": False})
        if len(self._workspaces) >= self._limits.sessions:
            self._forget_one()
        key = secrets.token_urlsafe(32)
        place = self._folder / secrets.token_hex(8)
        self._workspaces[key] = Workspace(
            place, self.workers, self._limits, last_used=time.monotonic()
        )
        answer = JSONResponse({"new": True})
        answer.set_cookie(self._cookie, key, httponly=True, samesite="strict")
        return answer

    def _forget_one(self) -> None:
        """Close the workspace that was quiet longest; raises LimitError if none was for long."""
        latest = time.monotonic() - self._limits.quiet_seconds
        quiet = {
            key: each.last_used
            for key, each in self._workspaces.items()
            if each.last_used <= latest and not each.is_busy
        }
        if not quiet:
            msg = "too many browsers are using this page: try again later"
            raise LimitError(msg)
        quietest = self._workspaces.pop(min(quiet, key=quiet.__getitem__))
        closing = asyncio.create_task(quietest.close())
        self._closing.add(closing)
        closing.add_done_callback(self._closing.discard)

    def workspace(self, request: Request) -> Workspace:
        """Workspace of the browser that asks."""
        found = self._workspaces.get(cookie_of(request.scope, self._cookie))
        if found is None:
            raise HTTPException(401, "This page has expired: load it again.")
        found.last_used = time.monotonic()
        return found

    async def close(self) -> None:
        for workspace in list(self._workspaces.values()):
            await workspace.close()
        await self.workers.stop()


async def _script(request: Request) -> Response:
    return Response(_page.part(request.url.path[1:]), media_type="text/javascript")


async def _style(_: Request) -> Response:
    return Response(_page.style(), media_type="text/css")


async def _state(_: Request, workspace: Workspace) -> Response:
    return JSONResponse(workspace.to_json())


async def _add_file(request: Request, workspace: Workspace) -> Response:
    added = await workspace.upload(request.query_params.get("name", ""), _chunks(request))
    return JSONResponse({"id": added.id, "is_camera": isinstance(added, Camera)}, 201)


async def _remove_file(request: Request, workspace: Workspace) -> Response:
    workspace.remove_file(request.path_params["file"])
    return Response(status_code=204)


async def _remove_files(_: Request, workspace: Workspace) -> Response:
    for key in list(workspace.uploads):
        workspace.remove_file(key)
    return Response(status_code=204)


async def _change_file(request: Request, workspace: Workspace) -> Response:
    upload = workspace.uploads.get(request.path_params["file"])
    role = (await _options(request)).get("role")
    if upload is None or role not in ROLES:
        raise HTTPException(404, "There is no such file.")
    upload.role = role
    return Response(status_code=204)


async def _calibrate(request: Request, workspace: Workspace) -> Response:
    camera = workspace.calibrate(await _options(request))
    return JSONResponse({"id": camera.id}, 202)


async def _remove_camera(request: Request, workspace: Workspace) -> Response:
    await workspace.remove_camera(request.path_params["camera"])
    return Response(status_code=204)


async def _calibration(request: Request, workspace: Workspace) -> Response:
    path = _finished(workspace, request.path_params["camera"]).folder / "camera.json"
    return FileResponse(
        path, media_type="application/json", filename=path.name, stat_result=path.stat()
    )


async def _report(request: Request, workspace: Workspace) -> Response:
    """The report; to keep with ?keep."""
    path = _finished(workspace, request.path_params["camera"]).folder / "report.html"
    headers = {"content-security-policy": _REPORT_POLICY}
    name = path.name if "keep" in request.query_params else None
    return FileResponse(
        path, media_type="text/html", filename=name, headers=headers, stat_result=path.stat()
    )


async def _export(request: Request, workspace: Workspace) -> Response:
    """A file of another program; the header X-Lost says what it does not hold."""
    camera = _finished(workspace, request.path_params["camera"])
    name, content, lost = await workspace.export(camera, request.path_params["format"])
    headers = {
        "content-disposition": f'attachment; filename="{name}"',
        "x-lost": quote(with_options(lost)),
    }
    return Response(content, media_type="application/octet-stream", headers=headers)


async def _comparison(request: Request, workspace: Workspace) -> Response:
    """Curves of several cameras in one figure, as a part of a page."""
    chosen = request.query_params.get("cameras", "").split(",")
    cameras = [_finished(workspace, key) for key in dict.fromkeys(chosen)]
    return Response(await workspace.compare(cameras), media_type="text/html")


async def _begin_live(_: Request, workspace: Workspace) -> Response:
    workspace.live = LiveView()
    return JSONResponse({"id": workspace.live.id}, 201)


async def _add_live_frame(request: Request, workspace: Workspace) -> Response:
    shape, until = _live_shape(request)
    async with workspace.live_lock:  # before the frame is read: there is never more than one
        view = _live(request, workspace)
        content = await _content(request, shape.n_bytes)
        return JSONResponse(await asyncio.to_thread(view.add, content, shape, until))


async def _save_live(request: Request, workspace: Workspace) -> Response:
    async with workspace.live_lock:
        calibration = await asyncio.to_thread(_live(request, workspace).calibration)
    camera = workspace.keep("camera, live", to_text(calibration))
    return JSONResponse({"id": camera.id}, 202)


def _live(request: Request, workspace: Workspace) -> LiveView:
    if workspace.live is None or workspace.live.id != request.path_params["view"]:
        raise HTTPException(404, "The camera was restarted, or never started: start it here.")
    return workspace.live


def _live_shape(request: Request) -> tuple[Shape, float]:
    """What the address says of a frame, and the error at which the curve is good enough."""
    given = request.query_params
    try:
        width, height = int(given["width"]), int(given["height"])
        shape = Shape(width, height, given["kind"], given["full"] == "1")
        until = float(given["until"])
    except (KeyError, ValueError) as error:
        raise HTTPException(400, "The address does not describe the frame.") from error
    if min(width, height) < 1 or shape.n_bytes > MOST_BYTES:
        raise HTTPException(413, "The camera's frames are too large for this page.")
    return shape, until


def _finished(workspace: Workspace, key: str) -> Camera:
    camera = workspace.cameras.get(key)
    if camera is None or camera.result is None:
        raise HTTPException(404, "There is no such result.")
    return camera


async def _options(request: Request) -> dict[str, Any]:
    """Content of a request, a small JSON object."""
    content = await _content(request, _LARGEST_OPTIONS)
    try:
        options = json.loads(content)
    except (ValueError, RecursionError):
        options = None
    if not isinstance(options, dict):
        raise HTTPException(400, "The options are not a JSON object.")
    return options


async def _content(request: Request, most: int) -> bytes:
    """Content of a request of at most so many bytes."""
    content = bytearray()
    async for chunk in _chunks(request):
        content += chunk
        if len(content) > most:
            raise HTTPException(413, "This is more than the page sends.")
    return bytes(content)


async def _chunks(request: Request) -> AsyncIterator[bytes]:
    """Content of a request as it comes; no more comes once the browser is gone without a word."""
    chunks = request.stream()
    while True:
        try:
            async with asyncio.timeout(_PATIENCE):
                chunk = await anext(chunks)
        except TimeoutError as error:
            raise HTTPException(408, "The rest of it did not arrive: send it again.") from error
        if not chunk:
            return
        yield chunk


def _error(status: int, text: str) -> Response:
    return JSONResponse({"error": with_options(" ".join(text.split()))}, status)


async def _too_much(_: Request, error: Exception) -> Response:
    return _error(413, str(error))


async def _bad_input(_: Request, error: Exception) -> Response:
    return _error(422, str(error))


async def _removed(_: Request, __: Exception) -> Response:
    return _error(404, "It was removed in the meantime.")


async def _impossible(_: Request, error: Exception) -> Response:
    """Without the error's own text, which has a path of this computer."""
    remedy = "make room on the disk" if getattr(error, "errno", None) in _FULL else "try again"
    what = getattr(error, "strerror", None) or error
    return _error(507, f"the computer cannot do it now ({what}): {remedy}")


async def _gone(_: Request, __: Exception) -> Response:
    return Response(status_code=499)  # nobody reads it


async def _http_error(_: Request, error: Exception) -> Response:
    if isinstance(error, HTTPException):
        return _error(error.status_code, error.detail)
    raise error


async def _internal(_: Request, error: Exception) -> Response:
    return _error(500, f"internal error: {type(error).__name__}: {error}; please report it")
