"""Matrices in Octave's text format, as the HDR programs of the pfstools family keep curves."""

import io

import numpy as np
import numpy.typing as npt

from chartless.formats._base import Source
from chartless.formats._tables import MOST_LEVELS
from chartless.formats._text import lines_of
from chartless.types import Floats


def matrix_text(table: npt.NDArray[np.floating], row_format: str, name: str = "") -> str:
    """Text of a matrix, with the lines that announce it."""
    rows = io.StringIO()
    np.savetxt(rows, table, fmt=row_format)
    named = f"# name: {name}\n" if name else ""
    n_rows, n_columns = table.shape
    return f"{named}# type: matrix\n# rows: {n_rows}\n# columns: {n_columns}\n{rows.getvalue()}\n"


def announces(source: Source, n_columns: int) -> bool:
    """Whether the first matrix of a file has so many columns."""
    head = source.head
    first = head.partition("# columns: ")[2].partition("\n")[0].strip()
    return "# rows: " in head and first == str(n_columns)


def matrices(source: Source, n_columns: int) -> list[Floats]:
    """Matrices of so many columns in a file, in their order, each of shape (rows, columns).

    Raises
    ------
    ValueError
        If one is damaged or has more rows than a curve.
    """
    lines, found, n_rows = lines_of(source), [], 0
    for at, line in enumerate(lines, start=1):
        key, _, value = line.removeprefix("# ").partition(": ")
        if key == "rows":
            n_rows = int(value)
        elif key == "columns" and int(value) == n_columns:
            found.append(_matrix(lines[at : at + max(n_rows, 0)], n_rows, n_columns))
    return found


def require_levels(column: Floats) -> None:
    """Raise ValueError if a column is not the levels 0, 1, 2 and so on."""
    if not np.array_equal(column, np.arange(column.size)):
        msg = "its levels are not 0, 1, 2 … in this order"
        raise ValueError(msg)


def _matrix(lines: list[str], n_rows: int, n_columns: int) -> Floats:
    if not 0 < n_rows <= MOST_LEVELS:
        msg = f"a matrix of {n_rows} rows is not a response curve"
        raise ValueError(msg)
    if len(lines) < n_rows:
        msg = f"a matrix of {n_rows} rows ends after {len(lines)}"
        raise ValueError(msg)
    values = np.loadtxt(lines, comments=None, ndmin=2)
    if values.shape[1] != n_columns:
        msg = f"a matrix has {values.shape[1]} columns, not {n_columns} as its header states"
        raise ValueError(msg)
    return values
