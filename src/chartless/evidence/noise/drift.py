"""Change of brightness between two frames: estimation, and removal in the table.

Lamps flicker by one to three per cent. A gain δ adds (δI)² to the mean squared
difference of two frames, which the search would mistake for noise that grows with
light. The drift can be measured in the table alone: at equal sum of its two levels the
difference has mean 0 when the frames are exchangeable, and its mean there is the drift,
free of regression to the mean.

Removal raises the darker frame to the brighter one, where it would have clipped too.
Counts move by fractions of a level with the weights of quadratic interpolation, which
change the mean and not the variance.
"""

from dataclasses import dataclass

import numpy as np

from chartless.evidence.noise.cooccurrence import (
    Cooccurrence,
    DifferenceMoments,
    difference_moments,
)
from chartless.evidence.noise.outliers import difference_deviation, without_outliers
from chartless.types import Counts, Floats

LARGE = 0.05
"""Change of level, relative to the level, above which drift is not removed."""
_NOTHING = 1e-3  # share of the squared difference that is ignored
_DEGREE = 3  # of the polynomial in the level, without a constant: black stays black
_CLEAR = 4.0  # least distance of a sum from its ends, in deviations


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """Increase of brightness from one frame to the next, by the sum of the levels."""

    levels: Floats
    """Mean of later minus earlier at each sum, smoothed, shape (2L − 1,)."""
    relative: float
    """Size of the change relative to the level, mean over the pairs; 0.01 is one per cent."""
    share: float
    """Share of the squared difference explained by the drift, 0 … 1."""

    @property
    def is_small(self) -> bool:
        """Whether the drift is small enough for `compensated`."""
        return self.relative <= LARGE


def drift_share(table: Cooccurrence) -> float:
    """Share of the squared difference explained by a change of brightness by level.

    The share explained by chance is subtracted, and three deviations of it: few pixels
    are no evidence of drift.
    """
    return _share(difference_moments(table.counts))


def _share(moments: DifferenceMoments) -> float:
    energy = float(moments.squares.sum())
    if energy == 0:
        return 0.0
    # n mean² estimates n drift² + variance: subtract the variance where it can be
    # estimated.
    several = moments.pairs > 1
    n, total, squares = (each[several] for each in moments)
    explained = total**2 / n
    by_chance = (squares - explained) / (n - 1)
    certain = explained.sum() - by_chance.sum() - 3 * np.sqrt(2 * (by_chance**2).sum())
    return max(0.0, float(certain / energy))


def estimated_drift(table: Cooccurrence) -> Drift | None:
    """Drift of a pair of frames; None if there is none beyond chance.

    Parameters
    ----------
    table : Cooccurrence
        Table of one pair: over many, ups and downs cancel.
    """
    if drift_share(table) <= _NOTHING:
        return None
    still = without_outliers(table).table
    moments = difference_moments(still.counts)
    if _share(moments) <= _NOTHING:
        return None
    n, total, squares = moments
    sums = np.arange(n.size)
    deviation = difference_deviation(still)
    # Near the ends clipping hides the drift.
    clear = np.minimum(sums, sums[-1] - sums) >= _CLEAR * deviation
    used = clear & (n > 0)
    if np.count_nonzero(used) <= _DEGREE:
        return None
    level = sums / sums[-1]
    powers = level[:, np.newaxis] ** np.arange(1, _DEGREE + 1)
    weight = np.sqrt(n[used]) / np.maximum(deviation[used], 1.0)
    found = np.linalg.lstsq(
        powers[used] * weight[:, np.newaxis], total[used] / n[used] * weight, rcond=None
    )[0]
    drift = powers @ found
    share = float(n @ drift**2 / squares.sum())
    if share <= _NOTHING:
        return None
    relative = float(n[used] @ np.abs(drift[used]) / (n[used] @ sums[used] / 2))
    return Drift(drift, relative, share)


def compensated(table: Cooccurrence, drift: Drift) -> Cooccurrence:
    """Table of the pair as if its frames were equally bright.

    Parameters
    ----------
    table : Cooccurrence
        Table of one pair.
    drift : Drift

    Returns
    -------
    Cooccurrence
        Table with the same number of pairs, in integers and reproducible: the rounding
        error of one cell is carried to the next.
    """
    top = table.n_levels - 1
    earlier, later = np.nonzero(table.counts)
    counts = table.counts[earlier, later].astype(np.float64)
    by = drift.levels[earlier + later]
    distance = np.abs(by)
    whole = np.rint(distance).astype(int)
    part = distance - whole
    moved = np.zeros(table.counts.shape)
    for step, weight in (
        (-1, part * (part - 1) / 2),
        (0, 1 - part**2),
        (1, part * (part + 1) / 2),
    ):
        up = whole + step
        to_earlier = np.where(by > 0, earlier + up, earlier).clip(0, top)
        to_later = np.where(by > 0, later, later + up).clip(0, top)
        np.add.at(moved, (to_earlier, to_later), counts * weight)
    return Cooccurrence(_whole(moved, table.n_pairs))


def _whole(counts: Floats, total: int) -> Counts:
    """Round to integers of a given sum, carrying rounding errors along each row."""
    positive = np.maximum(counts, 0.0)
    sums = np.cumsum(positive * (total / positive.sum()))
    sums[-1] = total
    rounded: Counts = np.diff(np.rint(sums), prepend=0.0).astype(np.int64)
    return rounded.reshape(counts.shape)
