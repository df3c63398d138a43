"""Tables of numbers as text: a line for each entry."""

from collections.abc import Iterable, Sequence

import numpy as np

from chartless.calibration import Calibration
from chartless.luts._base import Source
from chartless.luts._tables import MOST_LEVELS, calibration_of
from chartless.types import Floats

_MOST_LINES = 5 * MOST_LEVELS  # three channels and their weights, with room for headers
_LONGEST_LINE = 1000
_WIDEST = 1e6
_RESAMPLED = 4096


def rows_of(table: Floats) -> str:
    """Lines of a table, to the 9 digits that tell float32 apart; without a line end."""
    return "\n".join(" ".join(f"{each:.9g}" for each in row) for row in table)


def lines_of(source: Source) -> list[str]:
    """Lines of a text that are not blank, without the blanks at their ends.

    Raises
    ------
    ValueError
        If it is no text, or has more or longer lines than tables have.
    """
    text = source.text
    if text.count("\n") > _MOST_LINES:
        msg = f"it has more lines than a table of {MOST_LEVELS} levels"
        raise ValueError(msg)
    lines = [line.strip() for line in text.split("\n")]
    longest = max(map(len, lines), default=0)
    if longest > _LONGEST_LINE:
        msg = f"it has a line of {longest} characters, which no row of a table needs"
        raise ValueError(msg)
    return [line for line in lines if line]


def columns_of(source: Source, columns: Sequence[int]) -> Floats:
    """Columns of comma-separated numbers below one line of names.

    Raises
    ------
    ValueError
        If they are none, or of fewer rows than 2 or more than a table has.
    """
    rows = lines_of(source)[1:]
    if not 2 <= len(rows) <= MOST_LEVELS:  # noqa: PLR2004 - a line needs two points
        msg = f"it has {len(rows)} rows, not 2 to {MOST_LEVELS}"
        raise ValueError(msg)
    return np.loadtxt(rows, comments=None, delimiter=",", usecols=columns, ndmin=2)


def without_comments(lines: Iterable[str]) -> list[str]:
    """Lines that do not begin with #."""
    return [line for line in lines if not line.startswith("#")]


def fields_of(lines: Iterable[str]) -> dict[str, str]:
    """What follows the first word of each line, by that word in capitals."""
    words = (line.split(maxsplit=1) for line in lines)
    return {first.upper(): "".join(rest) for first, *rest in words}


def floats(text: str, n_numbers: int) -> list[float]:
    """So many numbers; raises ValueError if there are not."""
    words = text.split()
    if len(words) != n_numbers:
        msg = f"{text[:40]!r} should be {n_numbers} numbers"
        raise ValueError(msg)
    return [float(word) for word in words]


def table_of(lines: list[str], n_entries: int, n_channels: int) -> Floats:
    """Table of numbers, shape (n_entries, n_channels).

    Raises
    ------
    ValueError
        If the lines are no such table.
    """
    if n_channels not in (1, 3):
        msg = f"has {n_channels} columns: the curves of a camera are 1 or 3"
        raise ValueError(msg)
    if len(lines) != n_entries:
        msg = f"should have {n_entries} entries, not {len(lines)}"
        raise ValueError(msg)
    if n_entries > MOST_LEVELS:
        msg = f"has {n_entries} entries, more than {MOST_LEVELS}"
        raise ValueError(msg)
    return np.array([floats(line, n_channels) for line in lines]).reshape(-1, n_channels)


def calibration_on(
    low: Iterable[float], high: Iterable[float], table: Floats, source: Source, method: str
) -> Calibration:
    """Calibration from a table on a domain of its own, as `calibration_of` from brightness.

    Parameters
    ----------
    low, high : iterable of float
        Brightness at the first and the last entry, one for each channel or one for all. If they
        are not 0 and 1 the table is read at 4096 levels by straight lines, its ends beyond.
    table : ndarray, shape (L, 1 or 3)
    source : Source
    method : str

    Raises
    ------
    ValueError
        If the domain is none, or as `calibration_of` does.
    """
    n_channels = table.shape[1]
    ends = np.array([np.broadcast_to(list(each), n_channels) for each in (low, high)])
    if np.array_equal(ends, [[0] * n_channels, [1] * n_channels]):
        return calibration_of(table, source, method)
    told = " … ".join(" ".join(f"{each:g}" for each in end) for end in ends)
    if not (np.abs(ends).max() <= _WIDEST and np.all(ends[0] < ends[1])):
        msg = f"its domain {told} is no range of brightness"
        raise ValueError(msg)
    brightness = np.linspace(0, 1, max(_RESAMPLED, len(table)))
    columns = [
        np.interp(brightness, np.linspace(first, last, len(table)), column)
        for first, last, column in zip(*ends, table.T, strict=True)
    ]
    remark = f"of its domain {told} the part 0 … 1 was read, at {len(brightness)} levels"
    return calibration_of(np.column_stack(columns), source, method, remarks=[remark])
