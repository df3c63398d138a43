"""Files that a report holds, to be saved from it."""

from dataclasses import replace
from typing import NamedTuple

from chartless.formats import FORMATS, AbstractFormat, ExportSettings
from chartless.formats.calibration_file import to_text
from chartless.result.calibration import Calibration

_MOST_BYTES = 600_000  # of a file; in the page it takes a third more
_MOST_EXPORTED = 60_000  # of a file in another format
_TYPES = {".csv": "text/csv"}
_EXPORTED = ("csv", "cube", "spi1d", "clf", "opencv")
"""Formats that need nothing but a calibration and are the same whenever they are written."""


class Download(NamedTuple):
    """A file inside the page."""

    label: str
    name: str
    media_type: str
    content: bytes


def downloads(calibration: Calibration) -> list[Download]:
    """Every file that a report offers: what `chartless export` would write, if it is small."""
    exported = (_exported(calibration, FORMATS[name]) for name in _EXPORTED)
    return [*_as_json(calibration), *filter(_is_small, exported)]


def _exported(calibration: Calibration, each: AbstractFormat) -> Download:
    content = each.encode(calibration, ExportSettings()).content
    return Download(
        f"{each.suffix} – {each.title}",
        f"camera{each.suffix}",
        _TYPES.get(each.suffix, "text/plain"),
        content,
    )


def _is_small(download: Download) -> bool:
    return len(download.content) <= _MOST_EXPORTED


def _as_json(calibration: Calibration) -> list[Download]:
    """The calibration file; without the records of evidence, or not at all, if it is too large."""
    bare = [
        replace(each, accounts=tuple(replace(account, record=None) for account in each.accounts))
        for each in calibration.channels
    ]
    choices = {
        "calibration": calibration,
        "calibration without records of the evidence": replace(calibration, channels=tuple(bare)),
    }
    for label, choice in choices.items():
        content = to_text(choice).encode()
        if len(content) <= _MOST_BYTES:
            return [Download(f"JSON, {label}", "camera.json", "application/json", content)]
    return []
