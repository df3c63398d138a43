"""Rank correlation."""

import numpy as np
import numpy.typing as npt

from chartless.types import Floats


def rank_correlation(one: npt.ArrayLike, other: npt.ArrayLike) -> float:
    """Spearman's correlation, with mean ranks of ties; 1 if one set is constant or empty.

    As `scipy.stats.spearmanr` has it, which takes longer to import than most comparisons.

    Parameters
    ----------
    one, other : array-like, shape (N,)
    """
    first, second = (_ranks(values) for values in (one, other))
    if first.size == 0:
        return 1.0
    first, second = first - first.mean(), second - second.mean()
    size = float(np.sqrt((first @ first) * (second @ second)))
    return float(first @ second) / size if size else 1.0


def _ranks(values: npt.ArrayLike) -> Floats:
    """Ranks from 1, shape (N,)."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    ranks: Floats = (np.cumsum(counts) - (counts - 1) / 2)[place]
    return ranks
