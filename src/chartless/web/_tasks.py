"""What is done with what browsers send, in processes of their own: `_worker` runs them.

A task is a JSON object that says its kind, one of `TASKS`, and the folder in which it is done, so
that names are those that the user knows. What has been sent is opened here and nowhere else.
"""

import time
import zipfile
from collections.abc import Callable
from pathlib import Path

from chartless.errors import ImageError
from chartless.formats import (
    FORMATS,
    ExportSettings,
    export_response,
    is_calibration,
    load_calibration,
)
from chartless.formats.calibration_file import load, save
from chartless.frames.frame import Frame
from chartless.images import is_raw, is_video, read_settings, read_size
from chartless.report import comparison, example_frame
from chartless.report import save as save_report
from chartless.result.calibration import Calibration
from chartless.result.verdict import verdict
from chartless.types import JsonObject
from chartless.workflow import calibrate

Send = Callable[[JsonObject], None]
"""Called with how far a task is: ``stage`` and ``share``, 0 … 1."""

_INTERVAL = 0.1  # seconds between two reports of progress
_RESULTS = Path("..")  # of a camera, beside the folder of what it is made from


def _inspect(task: JsonObject, _: Send) -> JsonObject:
    """Whether a file is a picture, raw, video or calibration, and the size of a picture.

    Raises
    ------
    ImageError
        If it is none of these, or larger than the task allows.
    """
    path = Path(task["file"])
    if is_video(path):
        return {"kind": "video", "pixels": None}
    if is_raw(path):
        read_settings(path, raw=True)
        return {"kind": "raw", "pixels": None}
    try:
        width, height = read_size(path)
    except ImageError:
        if not is_calibration(path):
            raise
        if path.stat().st_size > task["most_bytes"]:
            msg = "is larger than any calibration: give the pictures that it is made from"
            raise ImageError(str(path), msg) from None
        return {"kind": "calibration", "pixels": None}
    if width * height > task["most_pixels"]:
        msg = f"has {width} × {height} pixels, larger than this page takes: crop it"
        raise ImageError(str(path), msg)
    return {"kind": "picture", "pixels": (width, height)}


def _calibrate(task: JsonObject, send: Send) -> JsonObject:
    """Make a calibration, its file and its report."""
    calibration = calibrate(progress=_Progress(send), **task["arguments"])
    return _kept(calibration, example_frame(calibration), send)


def _import(task: JsonObject, send: Send) -> JsonObject:
    """Take in a calibration that somebody else made, as if it was made here."""
    # It may name any other file: a frame is shown of our own alone.
    return _kept(load_calibration(Path(task["file"])), None, send)


def _kept(calibration: Calibration, frame: Frame | None, send: Send) -> JsonObject:
    save(calibration, _RESULTS / "camera.json")
    send({"stage": "drawing the report", "share": 1.0})
    save_report(calibration, _RESULTS / "report.html", frame)
    return {"grade": verdict(calibration.channels).grade.name.lower()}


def _export(task: JsonObject, _: Send) -> JsonObject:
    """Write the file of another program, of several a ZIP archive; its name and what was lost."""
    name, size = task["format"], task["size"]
    target = Path(f"camera{FORMATS[name].suffix}")
    settings = ExportSettings(size=size and tuple(size))
    lost, written = export_response(load(task["camera"]), target, name, settings)
    if len(written) > 1:
        target = Path(f"camera-{name}.zip")
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in written:
                archive.write(path)
    return {"file": target.name, "lost": lost}


def _compare(task: JsonObject, _: Send) -> JsonObject:
    """Write curves of several cameras in one figure, as a part of a page."""
    part = comparison([(title, load(path)) for title, path in task["cameras"]])
    Path(task["file"]).write_text(part, encoding="utf-8")
    return {}


TASKS: dict[str, Callable[[JsonObject, Send], JsonObject]] = {
    "inspect": _inspect,
    "calibrate": _calibrate,
    "import": _import,
    "export": _export,
    "compare": _compare,
}


class _Progress:
    """Says how far a calibration is, but not too often."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._stage, self._said = "", 0.0

    def __call__(self, stage: str, share: float) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._said > _INTERVAL:
            self._stage, self._said = stage, now
            self._send({"stage": stage, "share": round(share, 3)})
