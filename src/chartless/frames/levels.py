"""Numbers of levels, and reducing the levels of a file to fewer."""

import numpy as np

from chartless.errors import ParameterError
from chartless.types import Levels

MIN_LEVELS = 16
"""Fewer levels than this hide the noise of any camera worth calibrating."""
MAX_LEVELS = 1024
"""More take gigabytes and minutes, and say no more about the curve."""


def level_table(white: int, n_levels: int) -> Levels:
    """Look-up table that reduces the levels of a file to `n_levels`.

    The reduced level is the nearest on a uniform grid, ``round(level (L − 1)/white)``, so
    brightness level/(L − 1) keeps its meaning and the reduced level k stands for brightness
    (k ± ½)/(L − 1).

    Parameters
    ----------
    white : int
        Largest level of the file: 2^b − 1 of b bits.
    n_levels : int
        L, between `MIN_LEVELS` and the smaller of white + 1 and `MAX_LEVELS`.

    Returns
    -------
    ndarray of uint8 or uint16, shape (white + 1,)

    Raises
    ------
    ParameterError
        If `n_levels` is out of range.
    """
    require_levels(white, n_levels)
    reduced = (np.arange(white + 1, dtype=np.int64) * (n_levels - 1) * 2 + white) // (2 * white)
    if n_levels <= 256:  # noqa: PLR2004 - a byte's values
        return reduced.astype(np.uint8)
    return reduced.astype(np.uint16)


def require_levels(white: int, n_levels: int) -> None:
    """Raise `ParameterError` if frames with such a white have no such number of levels."""
    most = min(white + 1, MAX_LEVELS)
    if not isinstance(n_levels, int | np.integer):
        msg = f"levels must be a whole number, not {n_levels!r}"
        raise ParameterError(msg)
    if not MIN_LEVELS <= n_levels <= most:
        msg = (
            f"levels must lie between {MIN_LEVELS} and {most} for {white.bit_length()}-bit frames, "
            f"not {n_levels}"
        )
        raise ParameterError(msg)
