"""Curves in characters: solid dots of braille for the curve, every second dot for its band."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chartless.result.response import Response
from chartless.types import Bools, Floats, Indices

if TYPE_CHECKING:
    from rich.text import Text

_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bits of a braille character, by row and column."""
_EMPTY = 0x2800
_COLOURS = {"R": "red", "G": "green", "B": "blue"}
_MARGIN = 4


def drawn_curves(
    channels: Sequence[Response], width: int, height: int, *, ascii_only: bool = False
) -> "Text":
    """Brightness over light with axes; the thicker a line, the less is known of it.

    Parameters
    ----------
    channels : sequence of Response
        None draws the axes alone.
    width, height : int
        Size of the whole, in characters.
    ascii_only : bool
        Whether to make do with ASCII: ``*`` for the curve, ``:`` for its band.

    Returns
    -------
    rich.text.Text
        In the colour of a channel where it is alone.
    """
    from rich.text import Text

    rows, columns = max(1, height - 2), max(1, width - _MARGIN)
    dotted = [_dots(each, rows * _DOTS.shape[0], columns * _DOTS.shape[1]) for each in channels]
    curves, bands = ([_characters(each[part]) for each in dotted] for part in (0, 1))
    owners = [_COLOURS.get(each.name, "") for each in channels]
    side, corner, flat = "|+-" if ascii_only else "│└─"
    text = Text(no_wrap=True)
    for row in range(rows):
        text.append(f"{'1' if row == 0 else ' '} {side}")
        for column in range(columns):
            curve, band = ([int(each[row, column]) for each in part] for part in (curves, bands))
            mine = [each for each, *bits in zip(owners, curve, band, strict=True) if any(bits)]
            if ascii_only:
                character = "*" if any(curve) else ":" if any(band) else " "
            else:
                both = int(np.bitwise_or.reduce([0, *curve, *band]))
                character = chr(_EMPTY + both) if both else " "
            text.append(character, mine[0] if len(mine) == 1 else "")
        text.append("\n")
    text.append(f"0 {corner}{flat * columns}\n")
    text.append(f"   0{'light':^{columns - 2}}1")
    return text


def _dots(response: Response, rows: int, columns: int) -> tuple[Bools, Bools]:
    """Where the curve is, and every second place of its band, shapes (rows, columns)."""
    curve = np.zeros((rows, columns), bool)
    light, brightness = _centres(columns), 1 - _centres(rows)
    inverse = response.curve.inverse(brightness)
    # Steep parts are closed from row to row, flat ones from column to column.
    curve[_places(1 - response.curve.response(light), rows), np.arange(columns)] = True
    curve[np.arange(rows), _places(inverse, columns)] = True
    if response.inverse_lut_std is None:
        return curve, np.zeros_like(curve)
    level = np.linspace(0, 1, response.n_levels)
    std = np.interp(brightness, level, response.inverse_lut_std)
    first, last = (_places(inverse + way * std, columns)[:, np.newaxis] for way in (-1, 1))
    row, column = np.ogrid[:rows, :columns]
    return curve, (first <= column) & (column <= last) & ((row + column) % 2 == 0)


def _centres(n: int) -> Floats:
    return (np.arange(n) + 0.5) / n


def _places(values: Floats, n: int) -> Indices:
    """Which of n parts of 0 … 1 a value is in."""
    return np.clip(np.floor(values * n), 0, n - 1).astype(np.intp)


def _characters(dots: Bools) -> Indices:
    """Bits of the characters that dots make up, shape (rows / 4, columns / 2)."""
    down, across = _DOTS.shape
    rows, columns = dots.shape
    cells = dots.reshape(rows // down, down, columns // across, across)
    return np.asarray(np.einsum("rdca,da->rc", cells, _DOTS))
