"""Shape-preserving cubic interpolation, as `scipy.interpolate.PchipInterpolator` does it.

A copy of the idea and not an import: `scipy.interpolate` takes longer to import than a channel of
a small picture takes to calibrate.
"""

import numpy as np

from chartless.types import Floats


def pchip(x: Floats, y: Floats, wanted: Floats) -> Floats:
    """Interpolate without making an extremum that the points do not have.

    Parameters
    ----------
    x : ndarray, shape (N,)
        Increasing; N of 2 or more.
    y : ndarray, shape (N,)
    wanted : ndarray, shape (M,)
        Within the range of `x`.

    Returns
    -------
    ndarray, shape (M,)

    References
    ----------
    Fritsch and Butland (1984), "A method for constructing local monotone piecewise cubic
    interpolants", SIAM J. Sci. Stat. Comput. 5(2), doi:10.1137/0905021.
    """
    width, rise = np.diff(x), np.diff(y)
    secant = rise / width
    slopes = np.empty_like(y)
    if x.size == 2:  # noqa: PLR2004 - a straight line
        slopes[:] = secant
    else:
        left, right = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
        before, after = secant[:-1], secant[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = (left + right) / (left / before + right / after)
        slopes[1:-1] = np.where(before * after > 0, mean, 0.0)
        slopes[0] = _end_slope(width[0], width[1], secant[0], secant[1])
        slopes[-1] = _end_slope(width[-1], width[-2], secant[-1], secant[-2])
    place = np.clip(np.searchsorted(x, wanted, side="right") - 1, 0, x.size - 2)
    t = (wanted - x[place]) / width[place]
    start, end = slopes[place] * width[place], slopes[place + 1] * width[place]
    step = rise[place]
    return np.asarray(
        y[place] + t * (start + t * (3 * step - 2 * start - end + t * (start + end - 2 * step)))
    )


def _end_slope(width: float, next_width: float, secant: float, next_secant: float) -> float:
    """Three-point slope at an end, limited so that the shape is kept."""
    slope = ((2 * width + next_width) * secant - width * next_secant) / (width + next_width)
    if np.sign(slope) != np.sign(secant):
        return 0.0
    if np.sign(secant) != np.sign(next_secant) and abs(slope) > 3 * abs(secant):
        return 3 * secant
    return slope
