"""The page: everything a reader wants to know, put into the template."""

import base64
import math
import re
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup, escape

from chartless.formats import FORMATS
from chartless.frames.frame import Frame
from chartless.report._captions import unbroken
from chartless.report._downloads import downloads
from chartless.report._figures import drawings
from chartless.report._pictures import previews
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.result.summary import (
    Line,
    account_lines,
    doubts,
    error_text,
    n_frames,
    noise_text,
    white_text,
)
from chartless.result.verdict import Grade, verdict
from chartless.types import JsonObject

_MARKS = {Grade.GOOD: "✓", Grade.CARE: "!", Grade.DISTRUST: "✕"}
_SHARES = np.array([0, 16, 32, 48, 64, 96, 128, 160, 192, 224, 240, 255]) / 255
_OF_SEARCH = ("Levels seen", "Pixels compared", "The search")
_IN_WORDS = {
    "weight": "weight of a pixel pair, 1 for a perfect model",
    "noise_prior": "noise expected, in u and v",
    "populations": "how common populations of cameras are before any evidence",
}
_DIGITS = 12  # of an SHA-256
_FEW = 8  # inputs; more are folded away


def render(calibration: Calibration, frame: Frame | None = None) -> str:
    """Make the report of a calibration, one HTML page that loads nothing.

    Parameters
    ----------
    calibration : Calibration
    frame : Frame, optional
        A picture of the camera, shown before and after linearisation.

    Returns
    -------
    str
        A whole document, below 2 MB.

    Raises
    ------
    ParameterError
        If the frame's channels are not those of the calibration.
    """
    judged = verdict(calibration.channels)
    return environment().get_template("page.html").render(
        style=Markup(stylesheet()),  # noqa: S704 - ours
        verdict=judged,
        grade=judged.grade.name.lower(),
        mark=_MARKS[judged.grade],
        doubts=doubts(calibration),
        channels=calibration.channels,
        figures=drawings(calibration.channels),
        numbers=_numbers(calibration.channels),
        levels=_levels(calibration.channels),
        tables=[table for each in calibration.evidence for table in each.tables],
        pictures=[] if frame is None else previews(calibration, frame),
        provenance=_provenance(calibration),
        downloads=downloads(calibration),
    )  # fmt: skip


def part(name: str) -> str:
    """Text of a template or style beside this file."""
    return files("chartless.report").joinpath(name).read_text(encoding="utf-8")


def stylesheet() -> str:
    """Style of reports, for screens in light and dark and for paper."""
    return part("page.css")


def environment() -> Environment:
    """Templates as all pages here use them."""
    made = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=FunctionLoader(part),
    )
    made.filters["data_uri"] = _data_uri
    made.filters["unbroken"] = unbroken
    made.filters["arguments"] = _arguments
    return made


def _arguments(text: str) -> Markup:
    """Text in which arguments, which messages put in backquotes, are set as code."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))  # noqa: S704


def _data_uri(content: bytes, media_type: str) -> str:
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


def _numbers(channels: Sequence[Response]) -> list[Line]:
    """What is known of each channel; quantities that the method gives for none are left out."""

    def line(name: str, text: Callable[[Response], str]) -> Line:
        return Line(name, tuple(map(text, channels)))

    rows = [
        line("Error of the light", lambda each: error_text(each.inverse_lut_std)),
        line("… of its shape alone", lambda each: error_text(each.shape_std)),
        line("… at white, relative", white_text),
        line("Noise slope U", lambda each: noise_text("slope", each, 3)),
        line("Noise floor V", lambda each: noise_text("floor", each, 1)),
        *account_lines(channels),
        line("Levels seen", lambda each: "{} to {}".format(*each.observed_levels)),
        line("Pixels compared", lambda each: f"{each.n_pairs:,}"),
        line("The search", lambda each: each.status.value),
    ]
    if all(each.n_pairs == 0 for each in channels):  # of another program's file
        rows = [row for row in rows if row.name not in _OF_SEARCH]
    return [row for row in rows if set(row.values) != {"-"}]


def _levels(channels: Sequence[Response]) -> list[Line]:
    """Light at a dozen levels."""
    last = channels[0].n_levels - 1
    return [
        Line(str(level), tuple(_light(each, level) for each in channels))
        for level in np.rint(_SHARES * last).astype(int)
    ]


def _light(response: Response, level: int) -> str:
    light = f"{response.inverse_lut[level]:.3f}"
    std = response.inverse_lut_std
    return light if std is None else f"{light} ± {std[level]:.3f}"


def _provenance(calibration: Calibration) -> JsonObject:
    """Where the calibration is from; what another program's file does not say is left out."""
    known = calibration.provenance
    first = calibration.channels[0]
    settings = {
        "method": first.method,
        **known.get("settings", {}),
        "bit depth": calibration.bit_depth,
        "chartless": known.get("chartless"),
        "created": known.get("created"),
    }
    inputs = [
        {"name": Path(each["file"]).name, "digest": each["sha256"][:_DIGITS]}
        for each in known.get("inputs", [])
    ]
    return {
        "settings": {
            _IN_WORDS.get(name, name): _text(value) for name, value in settings.items() if value
        },
        "named": settings.get("name", "") if first.status is Status.ASSUMED else "",
        "foreign": first.method if first.method in FORMATS else "",
        "n_pictures": n_frames(calibration),
        "what": _what(calibration),
        "inputs": inputs[:_FEW],
        "more": inputs[_FEW:],
        "remarks": known.get("remarks", []),
    }


def _what(calibration: Calibration) -> str:
    """What the inputs are called."""
    readings = calibration.evidence
    are_files = readings and all(each.example is None for each in readings)
    name = "file" if are_files else "picture"
    return name if n_frames(calibration) == 1 else f"{name}s"


def _text(value: Any) -> str:  # noqa: ANN401 - JSON
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(each)}" for name, each in value.items())
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, float) and math.isfinite(value):
        return f"{value:g}"
    return "yes" if value is True else str(value)
