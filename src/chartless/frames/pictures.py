"""What users give for a list of pictures: files, arrays, or one of them by mistake."""

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chartless.errors import ParameterError
from chartless.frames.frame import Frame
from chartless.types import Levels

_COLOURS = (1, 3)


def listed(name: str, items: Sequence[Any]) -> list[Any]:
    """The items of a sequence of files and arrays.

    Parameters
    ----------
    name : str
        Name of the argument, for messages.
    items : sequence of str, path or ndarray

    Returns
    -------
    list

    Raises
    ------
    ParameterError
        If it is one file or one picture, whose letters or rows would be taken for frames, or if an
        item is neither file nor array.

    Examples
    --------
    >>> listed("frames", ("a.jpg", "b.jpg"))
    ['a.jpg', 'b.jpg']
    """
    what = _alone(items)
    if what is not None:
        msg = f"{name} must be a list of files or arrays, not {what}"
        raise ParameterError(msg)
    try:
        taken = list(items)
    except TypeError:
        msg = f"{name} must be a list of files or arrays, not {type(items).__name__}"
        raise ParameterError(msg) from None
    for place, item in enumerate(taken):
        if not isinstance(item, str | os.PathLike | np.ndarray):
            msg = (
                f"{name}[{place}] must be the name of a file or an array of levels, not "
                f"{type(item).__name__}"
            )
            raise ParameterError(msg)
    return taken


def array_frame(levels: Levels, number: int) -> Frame:
    """Frame of an array, called by its number.

    Raises
    ------
    ParameterError
        If it is no picture of 8 or 16 bits.
    """
    name = Path(f"frame {number}")
    if levels.dtype not in (np.uint8, np.uint16):
        msg = f"{name}: levels must be uint8 or uint16, not {levels.dtype}"
        raise ParameterError(msg)
    if levels.ndim == 2:  # noqa: PLR2004 - (M, N)
        levels = levels[..., np.newaxis]
    if levels.ndim != 3 or levels.shape[-1] not in (1, 3) or levels.size == 0:  # noqa: PLR2004
        msg = f"{name}: a picture has the shape (M, N) or (M, N, 3), not {levels.shape}"
        raise ParameterError(msg)
    digest = hashlib.sha256(levels.tobytes()).hexdigest()
    return Frame(name, levels.copy(order="C"), sha256=digest)


def _alone(items: object) -> str | None:
    """What a single file or picture is called; None if it may be a sequence of them."""
    if isinstance(items, str | bytes | os.PathLike):
        kind = "one string" if isinstance(items, str | bytes) else "one path"
        return f"{kind}: write [{os.fspath(items)!r}]"
    if isinstance(items, np.ndarray) and items.dtype.kind not in "OSU":
        shape = items.shape
        one = len(shape) < 3 or (len(shape) == 3 and shape[-1] in _COLOURS)  # noqa: PLR2004
        if one:
            return f"one array of shape {shape}: write [first, second]"
    return None
