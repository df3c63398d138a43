"""A calibration as a page for people: one HTML file that needs no network.

`page.html` is the Jinja template and `page.css` its style; what they are given is in `_page.py`.
"""

import os
from pathlib import Path

from chartless._files import require_writable, write_text
from chartless.errors import ChartlessError, OutputError
from chartless.frames.frame import Frame
from chartless.report._comparison import comparison as comparison
from chartless.report._notebook import card as card
from chartless.report._overview import overview as overview
from chartless.report._page import environment as environment
from chartless.report._page import render as render
from chartless.report._page import stylesheet as stylesheet
from chartless.result.calibration import Calibration

_SUFFIXES = (".html", ".htm")


def save(
    calibration: Calibration, path: str | os.PathLike[str], frame: Frame | None = None
) -> None:
    """Write the report of a calibration; the file appears whole or not at all.

    Parameters
    ----------
    calibration : Calibration
    path : path-like
        ``.html``.
    frame : Frame, optional
        See `render`; `example_frame` finds one.

    Raises
    ------
    OutputError
        If the extension is another, or the folder is missing or not writable.
    ParameterError
        If the frame's channels are not those of the calibration.
    """
    require_page(path)
    write_text(path, render(calibration, frame))


def require_page(path: str | os.PathLike[str]) -> None:
    """Raise `OutputError` if no report could be written there, before work goes into it."""
    if Path(path).suffix.lower() not in _SUFFIXES:
        msg = "a report is a page: name it .html"
        raise OutputError(os.fspath(path), msg)
    require_writable(path)


def example_frame(calibration: Calibration) -> Frame | None:
    """Read an input of a calibration again: the first, or the one that shows most of the scene.

    Returns
    -------
    Frame or None
        None if the file is gone or has changed, or where there was no file.
    """
    from chartless.images import read_frame

    known = calibration.provenance
    inputs = known.get("inputs", [])
    examples = [each.example for each in calibration.evidence if each.example is not None]
    if not calibration.evidence:
        examples = [0]
    if not examples or not inputs:
        return None
    chosen = inputs[examples[0]]
    try:
        frame = read_frame(chosen["file"])
    except ChartlessError:
        return None
    return frame if frame.sha256 == chosen["sha256"] else None
