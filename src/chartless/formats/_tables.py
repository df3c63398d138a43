"""Between calibrations and tables of irradiance at uniform brightness.

Nearly every format is such a table: a row for each level, a column for each channel.
"""

import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from chartless._version import __version__
from chartless.curves import AbstractCurve, SampledCurve
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.formats._base import Source
from chartless.frames.channels import LUMA
from chartless.frames.levels import MIN_LEVELS
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.result.verdict import known_verdict
from chartless.types import Floats, Floats32, JsonObject

RGB, GREY = ("R", "G", "B"), ("Y",)
MOST_LEVELS = 1 << 16
UNMEASURED_VIGNETTING = "vignetting, which was not measured"
"""What is lost in a format that wants it."""

_VERDICT = "Verdict of chartless: "
_RECORDED = re.compile(f"{_VERDICT}([ !#-;=-~]{{1,400}})")  # printable, up to a tag or quote
_LEVELS_OF_CURVE = 256
_LARGEST = 1e38
"""Largest value, as float32 has it; beyond are gaps, and irradiance below its inverse is none."""
_RISE = 1e-9
_LIFTED = 1e-3
_SMALLEST = 1e-37  # float32 has fewer digits from 1.2e-38 on


def noted_verdict(calibration: Calibration) -> str:
    """How far to trust a calibration, in a line of ASCII for the file; empty if nothing is known.

    `recorded_verdict` finds it again.
    """
    judged = known_verdict(calibration.channels)
    if judged is None:
        return ""
    return f"{_VERDICT}{judged.brief}".replace("± ", "+-").encode("ascii", "replace").decode()


def recorded_verdict(source: Source) -> str:
    """What `noted_verdict` wrote into a file, without its mark; empty if it did not."""
    found = _RECORDED.search(source.head)
    return "" if found is None else found[1].strip()


def inverse_table(calibration: Calibration, n_levels: int | None = None) -> Floats:
    """Irradiance of each channel at uniform brightness, shape (n_levels, channels).

    Parameters
    ----------
    calibration : Calibration
    n_levels : int, optional
        Entries, 2 … 65536; without, the levels that were calibrated.

    Raises
    ------
    ParameterError
        If there are no tables of so many entries.
    """
    n_levels = calibration.channels[0].n_levels if n_levels is None else n_levels
    _require_entries(n_levels)
    brightness = np.linspace(0.0, 1.0, n_levels)
    return np.column_stack([each.curve.inverse(brightness) for each in calibration.channels])


def table_through_levels(calibration: Calibration, n_rows: int, *, nearest: bool = False) -> Floats:
    """Table of a grid on which the calibrated levels do not lie, yet which keeps them.

    Straight lines between its rows, which most readers draw, meet the curve at every level: rows on
    either side of a level lie on a line through it, no steeper than the curve is beside it.

    Parameters
    ----------
    calibration : Calibration
    n_rows : int
        2 … 65536. If fewer than two for each level, this is `inverse_table`.
    nearest : bool
        For readers that take the nearest row: both rows beside a level have its irradiance.

    Returns
    -------
    ndarray, shape (n_rows, channels)

    Raises
    ------
    ParameterError
        If there are no tables of so many rows.
    """
    _require_entries(n_rows)
    n_levels = calibration.channels[0].n_levels
    if n_rows - 1 < 2 * (n_levels - 1):
        return inverse_table(calibration, n_rows)
    levels = inverse_table(calibration)
    place = np.linspace(0.0, n_rows - 1.0, n_levels)
    table = np.column_stack([np.interp(np.arange(n_rows), place, each) for each in levels.T])
    slopes = np.diff(levels, axis=0) * (n_levels - 1) / (n_rows - 1)
    (between,) = np.nonzero(place % 1)
    gentle = 0.0 if nearest else np.minimum(slopes[between - 1], slopes[between])
    below = place[between].astype(int)
    for row in (below, below + 1):
        table[row] = levels[between] + gentle * (row - place[between])[:, np.newaxis]
    return table


def in_colour(table: Floats) -> Floats:
    """Return three columns, equal ones for a single channel."""
    return np.broadcast_to(table, (len(table), len(RGB)))


def above_zero(table: Floats, calibration: Calibration) -> Floats:
    """Same table with the irradiance in the middle of black's half bin for black.

    For readers that take logarithms. Pixels of level 0 have brightness between 0 and half a level.
    """
    quarter = 0.25 / (len(table) - 1)
    black = [each.curve.inverse(quarter) for each in calibration.channels]
    raised = table.copy()
    raised[0] = np.minimum(black, table[1])
    return np.maximum(raised, _SMALLEST)


def luma(table: Floats) -> Floats:
    """Return one column; for three, that of the picture made grey, exact where it has no colour."""
    if table.shape[1] == 1:
        return table
    return np.average(table, axis=1, weights=LUMA)[:, np.newaxis]


def strictly_increasing(table: Floats) -> Floats32:
    """Nearest float32 that increase down each column; entries of 0 and more.

    An entry that would not exceed the one before by two steps of float32 is put so much above.
    None but 0 is so small that parsers of text may stop at it, as they do at 1e-38.
    """
    normal = np.maximum(table.T, np.arange(len(table)) * _SMALLEST)
    rising = np.ascontiguousarray(normal, dtype=np.float32)
    # Floats of one sign are in the order of their bits read as integers.
    steps = 2 * np.arange(rising.shape[1], dtype=np.int64)
    ordinals = rising.view(np.int32).astype(np.int64)
    apart = np.maximum.accumulate(ordinals - steps, axis=1) + steps
    return apart.astype(np.int32).view(np.float32).T


def calibration_of(
    table: npt.NDArray[np.number],
    source: Source,
    method: str,
    *,
    names: Sequence[str] | None = None,
    remarks: Sequence[str] = (),
) -> Calibration:
    """Calibration from a table of irradiance at uniform brightness.

    Parameters
    ----------
    table : ndarray, shape (L, 1 or 3)
        On any scale, each channel alone is scaled to 1 at white. Gaps (not finite) are filled by
        straight lines, those above the highest value known by that. Irradiance at black is 0,
        whatever the table has there.
    source : Source
        Where it was read.
    method : str
        Format of the file.
    names : sequence of str, optional
        Channel of each column; without, R, G and B, or Y. Three equal columns become Y only by
        the choice of the caller.
    remarks : sequence of str
        Remarks made when it was read.

    Returns
    -------
    Calibration
        Without noise. A curve that falls somewhere is held at its maximum so far and flagged
        `Flag.NOT_MONOTONE`. A table of fewer than 16 entries is drawn through 256 levels, one of
        more than 65,536 through so many.

    Raises
    ------
    ValueError
        If it has neither one nor three columns, or a channel has no light.
    """
    if table.ndim != 2 or len(table) < 2:  # noqa: PLR2004
        msg = "its table has fewer than two entries"
        raise ValueError(msg)
    with np.errstate(invalid="ignore", over="ignore"):  # what does not fit is a gap like others
        table = table.astype(np.float64)
    names = names or {1: GREY, 3: RGB}.get(table.shape[1])
    if names is None:
        msg = f"its table has {table.shape[1]} channels, not 1 or 3"
        raise ValueError(msg)
    notes = [f"{source.path}: {each}" for each in remarks]
    channels = {
        name: _response(source, method, name, column, notes)
        for name, column in zip(names, table.T, strict=True)
    }
    return Calibration(
        channels=tuple(channels[name] for name in (GREY if len(names) == 1 else RGB)),
        bit_depth=8 if len(table) <= 1 << 8 else 16,
        provenance=_provenance(source, method, notes),
    )


def calibration_of_curves(
    curves: Sequence[AbstractCurve],
    source: Source,
    method: str,
    *,
    remarks: Sequence[str] = (),
    falls: bool = False,
) -> Calibration:
    """Calibration of a file that holds curves, not a table of levels.

    Parameters
    ----------
    curves : sequence of AbstractCurve
        One for all channels, which becomes Y, or those of R, G and B; drawn through 256 levels.
    source, method, remarks
        As for `calibration_of`.
    falls : bool
        Whether they fall somewhere in the file.
    """
    channels = [
        Response(
            name=name,
            curve=curve,
            noise=None,
            n_levels=_LEVELS_OF_CURVE,
            observed_levels=(0, _LEVELS_OF_CURVE - 1),
            n_pairs=0,
            method=method,
            status=Status.CONVERGED,
        ).with_flags(*([Flag.NOT_MONOTONE] if falls else []))
        for name, curve in zip(GREY if len(curves) == 1 else RGB, curves, strict=True)
    ]
    return Calibration(
        channels=tuple(channels),
        bit_depth=8,
        provenance=_provenance(source, method, [f"{source.path}: {each}" for each in remarks]),
    )


def _provenance(source: Source, method: str, notes: list[str]) -> JsonObject:
    return {"chartless": __version__, **source.provenance(method), "remarks": notes}


def _require_entries(number: int) -> None:
    if not 2 <= number <= MOST_LEVELS:  # noqa: PLR2004 - a line needs two points
        msg = f"a table has between 2 and {MOST_LEVELS} levels, not {number}"
        raise ParameterError(msg)


def _response(source: Source, method: str, name: str, column: Floats, notes: list[str]) -> Response:
    (known,) = np.nonzero(np.abs(column) < _LARGEST)
    inside = known[known > 0]
    if not inside.size or not column[inside].max() > 1 / _LARGEST:
        msg = f"channel {name} has no irradiance above 0"
        raise ValueError(msg)
    level = np.arange(column.size)
    if known.size < column.size:
        missing = column.size - known.size
        notes.append(f"{source.path}: channel {name}: filled {missing} levels without value")
    white = column[inside].max()
    with np.errstate(over="ignore", invalid="ignore"):  # damaged files have any numbers
        share = np.maximum(column / white, -1.0)
    if known[0] == 0 and share[0] > _LIFTED:
        notes.append(f"{source.path}: channel {name}: black had {share[0]:.1%} of white, now 0")
    filled = np.interp(level, [0, *inside], [0.0, *share[inside]])
    rising = np.maximum.accumulate(np.maximum(filled, 0))
    # So little that it changes nothing keeps apart levels of one irradiance, which else would be
    # joined by a line to the next: white that begins below the top stays where it is.
    lut = rising / rising[-1] * (1 - _RISE) + _RISE * level / (column.size - 1)
    last = column.size - 1
    n_levels = column.size if MIN_LEVELS <= column.size <= MOST_LEVELS else MOST_LEVELS
    n_levels = 1 << 8 if column.size < MIN_LEVELS else n_levels
    seen = np.array([known[0], known[-1]]) * (n_levels - 1) // last
    response = Response(
        name=name,
        curve=SampledCurve.from_inverse(lut),
        noise=None,
        n_levels=n_levels,
        observed_levels=(int(seen[0]), int(seen[1])),
        n_pairs=0,
        method=method,
        status=Status.CONVERGED,
    )
    return response.with_flags(*([Flag.NOT_MONOTONE] if np.any(np.diff(filled) < 0) else []))
