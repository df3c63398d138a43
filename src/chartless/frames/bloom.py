"""Pixels around saturated ones, into which these spill light or charge."""

import numpy as np

from chartless.errors import ParameterError
from chartless.types import Bools


def near_saturated(saturated: Bools, radius: int) -> Bools:
    """Pixels within a radius of a saturated one.

    Parameters
    ----------
    saturated : ndarray of bool, shape (M, N)
    radius : int
        In pixels. The time does not depend on it.

    Returns
    -------
    ndarray of bool, shape (M, N)
        The saturated ones among them.

    Raises
    ------
    ParameterError
        If the radius is below 0, or beyond half the smaller side of the picture: one saturated
        pixel would then take away most of it.

    Examples
    --------
    >>> near_saturated(np.array([[False, False, True, False, False]] * 2), 1).astype(int)
    array([[0, 1, 1, 1, 0],
           [0, 1, 1, 1, 0]])
    """
    most = min(saturated.shape) // 2
    if not isinstance(radius, int | np.integer) or not 0 <= radius <= most:
        height, width = saturated.shape
        msg = (
            f"bloom_radius must be a whole number between 0 and {most} pixels, half the "
            f"smaller side of these {width} × {height}, not {radius}"
        )
        raise ParameterError(msg)
    near = saturated.copy()
    rows, columns = (np.flatnonzero(saturated.any(axis=axis)) for axis in (1, 0))
    if radius == 0 or not rows.size:
        return near
    from scipy.ndimage import distance_transform_edt

    reached = tuple(
        slice(max(int(each[0]) - radius, 0), int(each[-1]) + radius + 1) for each in (rows, columns)
    )
    near[reached] = distance_transform_edt(~saturated[reached]) <= radius
    return near
