"""Tables of measured points as evidence."""

import csv
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from typing_extensions import override

from chartless._files.given import read_text
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.base import AbstractEvidence
from chartless.evidence.points.channel import MeasuredPoints
from chartless.frames.frame import FrameSource

RGB, GREY = ("R", "G", "B"), ("Y",)
USUAL_STD = 0.5 / 255 / math.sqrt(3)
"""Deviation of brightness where none is given: that of rounding to 8 bits."""
_NAMES = ("irradiance", "brightness", "std", "channel")
_BITS = 8


class Point(NamedTuple):
    """A row of a table of points."""

    irradiance: float
    brightness: float
    std: float = USUAL_STD
    channel: str = ""
    """R, G, B or Y; empty if it applies to all channels."""


@dataclass(frozen=True, slots=True, eq=False)
class PointsEvidence(AbstractEvidence):
    """Measured points of all channels."""

    points: tuple[Point, ...]
    sources: tuple[FrameSource, ...]
    n_levels: int
    absolute: bool = False
    bit_depth: int = _BITS

    @property
    @override
    def channels(self) -> tuple[str, ...]:
        named = {point.channel for point in self.points}
        return RGB if named & set(RGB) else GREY

    @override
    def channel(self, name: str) -> MeasuredPoints:
        """Return the points of a channel, and those that apply to all.

        Raises
        ------
        UnfitFramesError
            If there are none.
        """
        own = [point for point in self.points if point.channel in ("", name)]
        if not own:
            named = ", ".join(sorted({point.channel for point in self.points}))
            msg = (
                f"{self.sources[0].path}: no point of channel {name}, only of {named}: add some, "
                "or leave the channel empty in points of all channels"
            )
            raise UnfitFramesError(msg)
        irradiance, brightness, std = np.array([point[:3] for point in own]).T
        return MeasuredPoints(irradiance, brightness, std, self.n_levels, absolute=self.absolute)


def read_points(path: str | os.PathLike[str]) -> tuple[Point, ...]:
    """Read a table of measured points.

    Parameters
    ----------
    path : path-like
        Text with a point in each row, cells separated by comma, semicolon or tab. The
        first row names the columns: ``irradiance`` (0 and above), ``brightness`` (0 to
        1) and, if known, ``std`` (standard deviation of the brightness) and ``channel``
        (R, G, B or Y; empty if it applies to all channels). Without names, columns are
        in this order. Lines that begin with ``#`` are skipped.

    Returns
    -------
    tuple of Point

    Raises
    ------
    ParameterError
        If the file cannot be read, or a row is not a point.
    """
    path = Path(path)
    text = read_text(path)
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        msg = f"{path}: holds no points; give rows of irradiance and brightness"
        raise ParameterError(msg)
    separator = max(",;\t", key=lines[0][1].count)
    try:
        rows = [(n, _cells(line, separator)) for n, line in lines]
    except csv.Error as error:
        msg = f"{path}: {error}"
        raise ParameterError(msg) from error
    names = [cell.lower() for cell in rows[0][1]]
    if "irradiance" in names or "brightness" in names:
        rows = rows[1:]
        missing = {"irradiance", "brightness"} - set(names)
        unknown = [name for name in names if name not in _NAMES]
        if missing or unknown or len(set(names)) < len(names):
            wrong = f"no {missing.pop()}" if missing else "others or some of them twice"
            msg = f"{path}: columns are {', '.join(_NAMES)}, of which the first two are needed; "
            msg += f"it has {wrong}"
            raise ParameterError(msg)
    else:
        names = list(_NAMES)
    if not rows:
        msg = f"{path}: holds no points; give rows of irradiance and brightness"
        raise ParameterError(msg)
    points = tuple(_point(path, number, cells, names) for number, cells in rows)
    named = {point.channel for point in points}
    if named & set(GREY) and named & set(RGB):
        msg = f"{path}: channels are R, G and B, or Y, not both"
        raise ParameterError(msg)
    return points


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _point(path: Path, line: int, cells: list[str], names: list[str]) -> Point:
    if len(cells) > len(names):
        msg = f"{path}: line {line} has {len(cells)} cells, not {len(names)} or fewer"
        raise ParameterError(msg)
    row = dict(zip(names, cells, strict=False))
    try:
        irradiance, brightness = float(row["irradiance"]), float(row["brightness"])
        std = float(row["std"]) if row.get("std") else USUAL_STD
    except (KeyError, ValueError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        msg = f"{path}: line {line} is not a point (irradiance, brightness): {what}"
        raise ParameterError(msg) from None
    channel = row.get("channel", "").upper()
    if not 0 <= irradiance < math.inf:
        msg = f"{path}: line {line}: irradiance must be 0 or above, not {irradiance:g}"
        raise ParameterError(msg)
    if not 0 <= brightness <= 1:
        msg = (
            f"{path}: line {line}: brightness must lie between 0 and 1, not {brightness:g}: divide "
            "levels by the highest, such as 255"
        )
        raise ParameterError(msg)
    if not 0 <= std < 1:
        msg = f"{path}: line {line}: std must lie between 0 and 1, not {std:g}"
        raise ParameterError(msg)
    if channel not in ("", *RGB, *GREY):
        msg = f"{path}: line {line}: channel must be R, G, B or Y, not {row['channel']!r}"
        raise ParameterError(msg)
    return Point(irradiance, brightness, std, channel)
