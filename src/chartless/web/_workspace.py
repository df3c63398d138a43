"""What one browser has given and got: files, calibrations, and the tasks that make them."""

import asyncio
import contextlib
import os
import re
import secrets
import shutil
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath

from chartless.errors import ChartlessError, ImageError, ParameterError
from chartless.plan import parsed_times
from chartless.sequence import naturally_sorted
from chartless.types import JsonObject
from chartless.web._limits import Limits
from chartless.web._live import LiveView
from chartless.web._workers import TaskError, Workers

ROLES = ("frame", "dark", "unused")
_ODD = re.compile(r"[^\w .,()+@=-]")  # in names of files
_LONGEST = 100  # name of a file
_MEGA = 1e6


class LimitError(ChartlessError):
    """More than the page takes."""


@dataclass(slots=True)
class Upload:
    """A file in the workspace."""

    id: str
    name: str
    size: int
    kind: str
    """picture, raw or video."""
    pixels: tuple[int, int] | None = None
    """Width and height of a picture."""
    role: str = "frame"
    """One of `ROLES`."""


@dataclass(slots=True)
class Camera:
    """A calibration, made or being made."""

    id: str
    title: str
    folder: Path
    """With camera.json and report.html when it is done."""
    pixels: tuple[int, int] | None = None
    """Width and height of its pictures, if that is known."""
    stage: str = "waiting"
    share: float = 0.0
    error: str = ""
    result: JsonObject | None = None
    task: "asyncio.Task[None] | None" = None

    @property
    def state(self) -> str:
        """Running, failed or done."""
        if self.result is not None:
            return "done"
        return "failed" if self.error else "running"

    def to_json(self) -> JsonObject:
        """What the page shows of it."""
        return {
            "id": self.id,
            "title": self.title,
            "state": self.state,
            "stage": self.stage,
            "share": self.share,
            "error": self.error,
            "result": self.result,
        }


@dataclass(slots=True)
class Workspace:
    """Files and calibrations of one browser, in a folder of their own."""

    folder: Path
    workers: Workers
    limits: Limits
    uploads: dict[str, Upload] = field(default_factory=dict)
    cameras: dict[str, Camera] = field(default_factory=dict)
    live: LiveView | None = None
    last_used: float = 0.0
    _arriving: dict[str, int] = field(default_factory=dict)
    """Bytes so far of files that are being sent, by name."""

    def __post_init__(self) -> None:
        self.folder.mkdir(mode=0o700)
        self.files.mkdir(mode=0o700)

    @property
    def files(self) -> Path:
        """Folder of the uploaded files, each by its own name."""
        return self.folder / "files"

    def to_json(self) -> JsonObject:
        """What the page shows."""
        return {
            "files": [
                {"id": each.id, "name": each.name, "size": each.size, "kind": each.kind,
                 "role": each.role}
                for each in self._sorted()
            ],
            "cameras": [each.to_json() for each in self.cameras.values()],
        }  # fmt: skip

    async def upload(self, name: str, chunks: AsyncIterator[bytes]) -> Upload | Camera:
        """Take a file in: a frame or, of any program, a calibration.

        Parameters
        ----------
        name : str
            As the browser calls it; only its last part is used, as a label.
        chunks : async iterator of bytes

        Raises
        ------
        LimitError
            If there are too many files, or too large ones.
        ChartlessError
            If it is no file that chartless reads.
        """
        name = self._free(_cleaned(name))
        if len(self.uploads) + len(self._arriving) >= self.limits.files:
            msg = f"{name}: there are {self.limits.files} files already: remove some"
            raise LimitError(msg)
        path = self.files / name
        try:
            await self._write(path, chunks)
            kind, pixels = await asyncio.to_thread(_kind, path, self.limits)
        except BaseException as error:
            path.unlink(missing_ok=True)
            if isinstance(error, ChartlessError):
                raise _without_folder(error, self.files) from error
            raise
        finally:
            size = self._arriving.pop(name, 0)
        if kind == "calibration":
            return self._imported(path)
        added = Upload(secrets.token_hex(8), name, size, kind, pixels)
        self.uploads[added.id] = added
        return added

    async def _write(self, path: Path, chunks: AsyncIterator[bytes]) -> None:
        self._arriving[path.name] = 0
        with path.open("xb") as file:
            async for chunk in chunks:
                self._arriving[path.name] += len(chunk)
                together = sum(each.size for each in self.uploads.values())
                together += sum(self._arriving.values())
                is_large = self._arriving[path.name] > self.limits.file_bytes
                if is_large or together > self.limits.total_bytes:
                    msg = (
                        f"{path.name}: a file may have {self.limits.file_bytes / _MEGA:g} MB and "
                        f"all together {self.limits.total_bytes / _MEGA:g} MB: give fewer or "
                        "smaller files, or use chartless calibrate in a terminal"
                    )
                    raise LimitError(msg)
                file.write(chunk)

    def _free(self, name: str) -> str:
        """The name, or the name with a number if there is such a file."""
        path, number = Path(name), 1
        while (self.files / name).exists():
            number += 1
            name = f"{path.stem} ({number}){path.suffix}"
        return name

    def remove_file(self, key: str) -> None:
        """Remove a file; nothing if there is none."""
        upload = self.uploads.pop(key, None)
        if upload is not None:
            (self.files / upload.name).unlink(missing_ok=True)

    def calibrate(self, options: JsonObject) -> Camera:
        """Begin to calibrate from the files that are here.

        Parameters
        ----------
        options : dict
            method, model, channels, evidence, times (a text), shared_noise and unaligned, as the
            command line has them. Empty ones and others are left away.

        Raises
        ------
        ChartlessError
            If there are no frames, or an option is no good.
        """
        arguments = _arguments(options)
        by_role: dict[str, list[str]] = {"frame": [], "dark": [], "raw": [], "unused": []}
        files = self._sorted()
        stems = {Path(each.name).stem.lower() for each in files if each.kind == "picture"}
        for each in files:
            beside = each.kind == "raw" and Path(each.name).stem.lower() in stems
            by_role["raw" if beside and each.role == "frame" else each.role].append(each.name)
        frames, dark, raw = by_role["frame"], by_role["dark"], by_role["raw"]
        if not frames:
            msg = "there are no frames yet: drop two or more shots of one still scene"
            raise ParameterError(msg)
        if dark:
            arguments["dark"] = dark
        if raw:
            arguments["raw"] = raw
        what = frames[0] if len(frames) == 1 else f"{frames[0]} and {len(frames) - 1} more"
        how = [arguments.get("method"), arguments.get("model")]
        title = ", ".join([what, *(str(each) for each in how if each)])
        camera = self._new_camera(title)
        camera.pixels = next((each.pixels for each in files if each.name == frames[0]), None)
        self._run(camera, {"arguments": {"frames": frames, **arguments}})
        return camera

    def _imported(self, path: Path) -> Camera:
        camera = self._new_camera(path.name)
        kept = camera.folder / path.name
        path.replace(kept)
        self._run(camera, {"calibration": str(kept)})
        return camera

    def keep(self, title: str, text: str) -> Camera:
        """Take in a calibration file that was made elsewhere in this program."""
        camera = self._new_camera(title)
        kept = camera.folder / "given.json"
        kept.write_text(text, encoding="utf-8")
        self._run(camera, {"calibration": str(kept)})
        return camera

    def _new_camera(self, title: str) -> Camera:
        if len(self.cameras) >= self.limits.cameras:
            msg = f"there are {self.limits.cameras} results already: remove some"
            raise LimitError(msg)
        key = secrets.token_hex(8)
        camera = Camera(key, title, self.folder / f"camera-{key}")
        camera.folder.mkdir(mode=0o700)
        self.cameras[key] = camera
        return camera

    def _run(self, camera: Camera, task: JsonObject) -> None:
        camera.task = asyncio.create_task(self._watched(camera, task))

    async def _watched(self, camera: Camera, task: JsonObject) -> None:
        def progress(stage: str, share: float) -> None:
            camera.stage, camera.share = stage, share

        task |= {
            "folder": str(self.files),
            "results": str(camera.folder),
            "worker_bytes": self.limits.worker_bytes,
        }
        try:
            camera.result = await self.workers.run(task, progress)
        except TaskError as error:
            camera.error = str(error).replace(f"{camera.folder}{os.sep}", "")
        except (OSError, ValueError) as error:  # no process, or none that speaks as ours do
            camera.error = f"the calculation could not be run ({error}): try again"

    async def remove_camera(self, key: str) -> None:
        """Remove a calibration; one that is being made is given up."""
        camera = self.cameras.pop(key, None)
        if camera is None:
            return
        await _cancelled(camera)
        shutil.rmtree(camera.folder, ignore_errors=True)

    async def close(self) -> None:
        """Give up what is running and remove everything."""
        for camera in self.cameras.values():
            await _cancelled(camera)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _sorted(self) -> list[Upload]:
        """Files in the order of their numbers, as a camera counts them."""
        return naturally_sorted(self.uploads.values(), key=lambda each: each.name)


async def _cancelled(camera: Camera) -> None:
    if camera.task is not None:
        camera.task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await camera.task


def _cleaned(name: str) -> str:
    """Last part of a name, without what could be a path, a hidden file or a control character."""
    last = PureWindowsPath(PurePosixPath(name).name).name
    cleaned = _ODD.sub("_", last).strip(" .")
    path = Path(cleaned)
    return f"{path.stem[:_LONGEST]}{path.suffix[:_LONGEST]}" if cleaned else "file"


def _kind(path: Path, limits: Limits) -> tuple[str, tuple[int, int] | None]:
    """Whether a file is a picture, raw, video or calibration, and the size of a picture.

    Raises
    ------
    ImageError
        If it is none of these, or a picture of more pixels than allowed.
    """
    from chartless.calibration_file import FORMAT
    from chartless.images import is_raw, is_video, read_settings, read_size
    from chartless.luts import is_foreign

    if is_video(path):
        return "video", None
    if is_raw(path):
        read_settings(path, raw=True)
        return "raw", None
    try:
        width, height = read_size(path)
    except ImageError:
        with path.open("rb") as file:
            is_own = FORMAT.encode() in file.read(4096)
        if not is_own and not is_foreign(path):
            raise
        if path.stat().st_size > limits.calibration_bytes:
            msg = "is larger than any calibration: give the pictures that it is made from"
            raise ImageError(str(path), msg) from None
        return "calibration", None
    if width * height > limits.pixels:
        msg = f"has {width} × {height} pixels, larger than this page takes: crop it"
        raise ImageError(str(path), msg)
    return "picture", (width, height)


def _without_folder(error: ChartlessError, folder: Path) -> ChartlessError:
    """The same error about a file by its name alone."""
    if isinstance(error, LimitError):
        return error
    return ParameterError(str(error).replace(f"{folder}{os.sep}", ""))


def _arguments(options: JsonObject) -> JsonObject:
    """Arguments of `chartless.workflow.calibrate`; only those that a page may choose."""
    arguments: JsonObject = {}
    for name in ("method", "model", "channels", "evidence"):
        if options.get(name):
            arguments[name] = str(options[name])
    if options.get("times"):
        arguments["times"] = parsed_times(str(options["times"]).split(","))
    if options.get("shared_noise"):
        arguments["shared_noise"] = True
    if options.get("unaligned"):
        arguments["aligned"] = False
    return arguments
