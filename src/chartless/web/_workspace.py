"""What one browser has given and got: files, calibrations, and the tasks that make them."""

import asyncio
import os
import re
import secrets
import shutil
from collections.abc import AsyncIterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from tempfile import TemporaryDirectory

from chartless.errors import ChartlessError, ParameterError
from chartless.evidence.exposures import parsed_times
from chartless.evidence.options import all_options
from chartless.frames.sequence import naturally_sorted
from chartless.types import JsonObject
from chartless.web._limits import Limits
from chartless.web._live import LiveView
from chartless.web._workers import TaskError, Workers

ROLES = ("frame", "dark", "unused")
_TEXTS = ("method", "model", "channels", "evidence", "times")
_OF_KINDS = {each.flag: each for each in all_options().values() if each.option.page}
_TICKS = {"shared_noise": "shared noise", **{flag: flag.replace("-", " ") for flag in _OF_KINDS}}
_ODD = re.compile(r"[^\w .,()+@=-]")  # in names of files
_LONGEST, _LONGEST_SUFFIX = 150, 50  # bytes of the name of a file; systems have room for 255
_LONGEST_TIMES = 100  # characters, in a title
_MEGA = 1e6
_FILE = "camera.json"  # of a calibration
_PART = "comparison.html"


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
    """Folder with camera.json and report.html when it is done."""
    frames: tuple[Upload, ...] = ()
    """What it is made from, with the roles of then."""
    options: JsonObject | None = None
    """Options that were chosen; None for a calibration that was not made here from files."""
    stage: str = "waiting"
    share: float = 0.0
    error: str = ""
    result: JsonObject | None = None
    task: "asyncio.Task[None] | None" = None

    @property
    def given(self) -> Path:
        """Folder with what it is made from, as long as it is being made."""
        return self.folder / "given"

    @property
    def pixels(self) -> tuple[int, int] | None:
        """Width and height of its pictures, if that is known."""
        return next((each.pixels for each in self.frames if each.pixels), None)

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
            "options": self.options,
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
    live_lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held by who sends a live frame or asks for the calibration."""
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

    @property
    def is_busy(self) -> bool:
        """Whether a file is being sent or a calibration being made."""
        running = any(each.state == "running" for each in self.cameras.values())
        return running or bool(self._arriving)

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
        self._arriving[name] = 0
        try:
            await self._write(path, chunks)
            seen = await self._inspect(name)
            if seen["kind"] == "calibration":
                return self._imported(path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        finally:
            size = self._arriving.pop(name)
        pixels = seen["pixels"] and tuple(seen["pixels"])
        added = Upload(secrets.token_hex(8), name, size, seen["kind"], pixels)
        self.uploads[added.id] = added
        return added

    async def _inspect(self, name: str) -> JsonObject:
        task = {
            "task": "inspect",
            "folder": str(self.files),
            "file": name,
            "most_pixels": self.limits.pixels,
            "most_bytes": self.limits.calibration_bytes,
        }
        try:
            return await self.workers.run_briefly(task)
        except TaskError as error:
            text = str(error).removeprefix(f"{name}: ")
            msg = f"{name}: {text}"
            raise ParameterError(msg) from error

    async def _write(self, path: Path, chunks: AsyncIterator[bytes]) -> None:
        with path.open("xb") as file:
            async for chunk in chunks:
                self._arriving[path.name] += len(chunk)
                self._require_room(path.name)
                file.write(chunk)

    def _require_room(self, name: str) -> None:
        """Raise LimitError if a file that is being sent is too much."""
        held = {each.id: each.size for each in self.uploads.values()}
        for camera in self.cameras.values():
            if camera.state == "running":
                held |= {each.id: each.size for each in camera.frames}
        together = sum(held.values()) + sum(self._arriving.values())
        if self._arriving[name] > self.limits.file_bytes or together > self.limits.total_bytes:
            msg = (
                f"{name}: a file may have {self.limits.file_bytes / _MEGA:g} MB and "
                f"all together {self.limits.total_bytes / _MEGA:g} MB: give fewer or "
                "smaller files, or use chartless calibrate in a terminal"
            )
            raise LimitError(msg)

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
        """Begin to calibrate from the files that are here, unless the same was done already.

        Parameters
        ----------
        options : dict
            method, model, channels, evidence, times (a text), shared_noise and flags of kinds of
            evidence, as the command line has them. Empty ones and others are left out.

        Returns
        -------
        Camera
            New, or the one that was made or is being made from the same files by the same options.

        Raises
        ------
        ChartlessError
            If there are no frames, too many results, or an option is no good.
        """
        options = _chosen(options)
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
        used = tuple(replace(each) for each in files if each.role != "unused")
        for camera in self.cameras.values():
            if (camera.frames, camera.options) == (used, options) and camera.state != "failed":
                return camera
        what = frames[0] if len(frames) == 1 else f"{frames[0]} and {len(frames) - 1} more"
        caps = ["lens caps"] if dark else []
        camera = self._new_camera(", ".join([what, *_words(options), *caps]))
        camera.frames, camera.options = used, options
        for each in camera.frames:  # they may be removed while they are read
            os.link(self.files / each.name, camera.given / each.name)
        self._run(camera, {"task": "calibrate", "arguments": {"frames": frames, **arguments}})
        return camera

    def _imported(self, path: Path) -> Camera:
        camera = self._new_camera(path.name)
        path.replace(camera.given / path.name)
        self._run(camera, {"task": "import", "file": path.name})
        return camera

    def keep(self, title: str, text: str) -> Camera:
        """Take in a calibration file that was made elsewhere in this program."""
        camera = self._new_camera(title)
        (camera.given / _FILE).write_text(text, encoding="utf-8")
        self._run(camera, {"task": "import", "file": _FILE})
        return camera

    def _new_camera(self, title: str) -> Camera:
        if len(self.cameras) >= self.limits.cameras:
            msg = f"there are {self.limits.cameras} results already: remove some"
            raise LimitError(msg)
        key = secrets.token_hex(8)
        camera = Camera(key, title, self.folder / f"camera-{key}")
        camera.folder.mkdir(mode=0o700)
        camera.given.mkdir(mode=0o700)
        return camera

    def _run(self, camera: Camera, task: JsonObject) -> None:
        self.cameras[camera.id] = camera
        camera.task = asyncio.create_task(self._watched(camera, task))

    async def _watched(self, camera: Camera, task: JsonObject) -> None:
        def progress(stage: str, share: float) -> None:
            camera.stage, camera.share = stage, share

        try:
            task["folder"] = str(camera.given)
            camera.result = await self.workers.run(task, progress)
        except TaskError as error:
            camera.error = str(error)
        except Exception as error:  # noqa: BLE001 - else the page would wait for ever
            what = getattr(error, "strerror", None) or error  # without a path
            camera.error = f"the calculation could not be run ({what}): try again"
        finally:
            shutil.rmtree(camera.given, ignore_errors=True)

    async def export(self, camera: Camera, name: str) -> tuple[str, bytes, str]:
        """Name and content of the file of another program, and what it does not hold.

        Raises
        ------
        TaskError
            If there is no such format, or it cannot hold the calibration.
        """
        task: JsonObject = {"task": "export", "format": name, "size": camera.pixels}
        with TemporaryDirectory(dir=camera.folder) as folder:
            task |= {"folder": folder, "camera": f"../{_FILE}"}
            done = await self.workers.run_briefly(task)
            return done["file"], (Path(folder) / done["file"]).read_bytes(), done["lost"]

    async def compare(self, cameras: list[Camera]) -> str:
        """Curves of several cameras in one figure, as a part of a page."""
        named = [(each.title, f"../{each.folder.name}/{_FILE}") for each in cameras]
        with TemporaryDirectory(dir=self.folder) as folder:
            task = {"task": "compare", "folder": folder, "cameras": named, "file": _PART}
            await self.workers.run_briefly(task)
            return (Path(folder) / _PART).read_text(encoding="utf-8")

    async def remove_camera(self, key: str) -> None:
        """Remove a calibration; one that is being made is given up."""
        camera = self.cameras.pop(key, None)
        if camera is None:
            return
        await _cancelled(camera)
        shutil.rmtree(camera.folder, ignore_errors=True)

    async def close(self) -> None:
        """Give up what is running and remove everything."""
        for camera in list(self.cameras.values()):
            await _cancelled(camera)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _sorted(self) -> list[Upload]:
        """Files in the order of their numbers, as a camera counts them."""
        return naturally_sorted(self.uploads.values(), key=lambda each: each.name)


async def _cancelled(camera: Camera) -> None:
    if camera.task is not None:
        camera.task.cancel()
        await asyncio.wait([camera.task])


def _cleaned(name: str) -> str:
    """Last part of a name, without what could be a path, a hidden file or a control character."""
    last = PureWindowsPath(PurePosixPath(name).name).name
    cleaned = _ODD.sub("_", last).strip(" .")
    path = Path(cleaned)
    stem, suffix = _cut(path.stem, _LONGEST), _cut(path.suffix, _LONGEST_SUFFIX)
    return f"{stem}{suffix}" if cleaned else "file"


def _cut(text: str, n_bytes: int) -> str:
    return text.encode()[:n_bytes].decode(errors="ignore")


def _chosen(options: JsonObject) -> JsonObject:
    """Options that a page may choose and that are not as they are without."""
    chosen: JsonObject = {name: str(options[name]) for name in _TEXTS if options.get(name)}
    chosen |= {name: True for name in _TICKS if options.get(name)}
    if "times" in chosen:
        chosen["times"] = ", ".join(each.strip() for each in chosen["times"].split(","))
    return chosen


def _arguments(chosen: JsonObject) -> JsonObject:
    """Arguments of `chartless.workflow.calibrate`."""
    arguments = dict(chosen)
    if "times" in arguments:
        arguments["times"] = parsed_times(arguments["times"].split(", "))
    for flag, asked in _OF_KINDS.items():
        if arguments.pop(flag, False):
            arguments[asked.name] = not asked.default
    return arguments


def _words(chosen: JsonObject) -> list[str]:
    """Options in a title."""
    words = dict(chosen)
    if "evidence" in words:
        words["evidence"] = f"evidence {words['evidence']}"
    if len(words.get("times", "")) > _LONGEST_TIMES:
        words["times"] = f"{words['times'][:_LONGEST_TIMES]}…"
    if "times" in words:
        words["times"] = f"times {words['times']}"
    return [_TICKS.get(name, text) for name, text in words.items()]
