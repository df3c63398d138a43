"""Tables of numbers as text: a line for each entry."""

from collections.abc import Iterable, Sequence

import numpy as np

from chartless.formats._base import Source
from chartless.formats._tables import MOST_LEVELS
from chartless.types import Floats

_MOST_LINES = 5 * MOST_LEVELS  # three channels and their weights, with room for headers
_LONGEST_LINE = 1000


def rows_of(table: Floats) -> str:
    """Lines of a table, to the 9 digits that distinguish float32 values; without a line end."""
    return "\n".join(" ".join(f"{each:.9g}" for each in row) for row in table)


def lines_of(source: Source) -> list[str]:
    """Lines of a text that are not blank, without the blanks at their ends.

    Raises
    ------
    ValueError
        If it is not text, or has more or longer lines than tables have.
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
