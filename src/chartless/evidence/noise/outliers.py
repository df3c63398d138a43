"""Removal of pixels that changed far more than noise explains, in the table alone.

Moving objects change pixels by any amount, and a few such pairs of levels outweigh the
noise of all others. At each sum of the two levels the deviation of their difference is
estimated from the pairs within a few deviations of zero, in rounds until cut and
deviation agree; pairs far outside are outliers. Sums with few pairs borrow from their
neighbours, so that a sum with only movers is not mistaken for noise.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.types import Bools, Counts, Floats

FAR = 6.0
"""Deviations of the difference beyond which a pair is not noise."""
SOME_MOVERS = 1e-3
"""Share of the pairs left out above which a result is flagged."""
# Deviations c within which pairs are used, and the part of the variance of a normal
# distribution within them, 1 − 2cφ(c)/(2Φ(c) − 1).
_CORE, _CORE_VARIANCE = 2.5, 0.9113
_ROUNDS = 20  # in each the core may grow by a half
_AGREED = 1e-3  # relative change of the deviations
_LEAST_STEPS = 2.0  # steps between used levels that are never outliers
_REACH = 4.0  # levels over which noise is assumed similar
_MEDIAN_TO_DEVIATION = 1.4826  # of a normal distribution


class Cleaned(NamedTuple):
    """A table without its outliers."""

    table: Cooccurrence
    fraction: float
    """Share of the pairs that were left out, 0 … 1."""


def without_outliers(table: Cooccurrence) -> Cleaned:
    """Leave out the pairs that noise does not explain.

    Parameters
    ----------
    table : Cooccurrence

    Returns
    -------
    Cleaned
        A table of the same size and type, and the share of pairs left out.

    Notes
    -----
    More than half of the pairs must be noise. Simulated photographs lose less than one
    pair in a million, also with steep curves, clipping and few levels; almost black
    pictures on the toe of a film lose up to 2 in 10⁴, as their noise is far from
    normal. Movers within 6 deviations remain.
    """
    counts: Counts = np.where(outlying(table), 0, table.counts)
    left_out = table.n_pairs - int(counts.sum())
    return Cleaned(Cooccurrence(counts), left_out / max(1, table.n_pairs))


def outlying(table: Cooccurrence) -> Bools:
    """Whether pairs of levels are further apart than noise explains, shape (L, L)."""
    level = np.arange(table.n_levels)
    earlier = level[:, np.newaxis]
    deviation = difference_deviation(table)
    # Where the noise changes quickly with level, that at both levels differs from that
    # between.
    apart = np.hypot(deviation[2 * earlier], deviation[2 * level]) / np.sqrt(2)
    noise = np.maximum(apart, deviation[earlier + level])
    step = _step(table)
    # Rounding of either frame adds up to half a step.
    far = np.abs(earlier - level) > np.maximum(FAR * noise + step, _LEAST_STEPS * step)
    return np.asarray(far)


def difference_deviation(table: Cooccurrence) -> Floats:
    """Deviation of the difference at each sum of two levels, of the bulk of pairs.

    Parameters
    ----------
    table : Cooccurrence

    Returns
    -------
    ndarray of float, shape (2L − 1,)
        In levels, rounding included.
    """
    n_levels = table.n_levels
    seen = table.counts.copy()
    seen[0, 0] = seen[-1, -1] = 0  # clipped twice: their noise is hidden
    earlier, later = np.nonzero(seen)
    if earlier.size == 0:
        return np.full(2 * n_levels - 1, float(n_levels))
    pairs = np.zeros((2 * n_levels - 1, n_levels))
    np.add.at(pairs, (earlier + later, np.abs(later - earlier)), seen[earlier, later])
    below = np.cumsum(pairs, axis=1)
    squares = np.cumsum(pairs * np.arange(n_levels) ** 2.0, axis=1)

    median = np.searchsorted(below.sum(axis=0), 0.5 * below[:, -1].sum()) + 0.5
    deviation = np.full(2 * n_levels - 1, _MEDIAN_TO_DEVIATION * median)
    least = _LEAST_STEPS * _step(table)
    sums = np.arange(2 * n_levels - 1)
    nearness = _nearness(n_levels)
    for _ in range(_ROUNDS):
        core = np.maximum(_CORE * deviation, least).clip(max=n_levels - 1).astype(int)
        n, moment = nearness @ below[sums, core], nearness @ squares[sums, core]
        before, deviation = deviation, np.sqrt(moment / n / _CORE_VARIANCE)
        if np.all(np.abs(deviation - before) < _AGREED * before):
            break
    return deviation


@cache
def _nearness(n_levels: int) -> Floats:
    """Weights between sums of levels, shape (2L − 1, 2L − 1), all above 0."""
    sums = np.arange(2 * n_levels - 1)
    nearness = np.exp(-np.abs(sums[:, np.newaxis] - sums) / (2 * _REACH))
    return np.asarray(np.maximum(nearness, 1e-100))


def _step(table: Cooccurrence) -> float:
    """Typical distance between used levels: 1, more where a file has fewer bits than levels."""
    (used,) = np.nonzero(table.histogram)
    return float(np.median(np.diff(used))) if used.size > 1 else 1.0
