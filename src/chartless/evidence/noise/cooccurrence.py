"""Co-occurrence tables: counts of level pairs of pixels in consecutive frames.

The co-occurrence table is all that calibration by noise keeps of the pictures: L × L
integers for any number of frames. Tables of different frames, tiles or machines add up,
so each frame is read once, counted and discarded.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.frames.levels import MAX_LEVELS
from chartless.result.account import AbstractRecord
from chartless.types import Counts, Floats, Indices, JsonObject, Levels

_FEWEST_PAIRS = 100
_MOST_CELLS = 200_000  # in a file: more take megabytes


@dataclass(frozen=True, slots=True, eq=False)
class Cooccurrence(AbstractRecord):
    """Counts of level pairs over frames of one still scene; tables add with ``+``.

    Parameters
    ----------
    counts : ndarray of int64, shape (L, L)
        ``counts[i, j]`` pixels showed level i in the earlier frame of a pair and level j in
        the later one. Kept as counted, not symmetrised: a drift between frames shows as
        asymmetry. The order of the two frames carries no other information, so estimators
        use `symmetric`.

    Examples
    --------
    >>> first = np.array([[0, 1], [2, 3]], dtype=np.uint8)
    >>> table = Cooccurrence.of_pair(first, first[::-1], n_levels=4)
    >>> table.counts[0, 2], table.n_pairs
    (np.int64(1), 4)
    """

    counts: Counts

    def __post_init__(self) -> None:
        if self.counts.ndim != 2 or self.counts.shape[0] != self.counts.shape[1]:  # noqa: PLR2004
            msg = f"a co-occurrence table is square, not of shape {self.counts.shape}"
            raise ParameterError(msg)

    @classmethod
    def zeros(cls, n_levels: int = 256) -> "Cooccurrence":
        """Return an empty table, to which others can be added."""
        return cls(np.zeros((n_levels, n_levels), dtype=np.int64))

    @classmethod
    def of_pair(
        cls,
        first: Levels,
        second: Levels,
        *,
        n_levels: int = 256,
        mask: npt.NDArray[np.bool_] | None = None,
    ) -> "Cooccurrence":
        """Count the level pairs of two frames.

        Parameters
        ----------
        first, second : ndarray of uint8 or uint16, equal shapes
            Levels of one channel, each below `n_levels` (see `level_table`).
        n_levels : int
        mask : ndarray of bool, optional
            Same shape; only pixels where it is True are counted.
        """
        if mask is not None:
            first, second = first[mask], second[mask]
        if first.shape != second.shape:
            msg = f"frames to compare must have one size, not {first.shape} and {second.shape}"
            raise ParameterError(msg)
        if n_levels <= np.iinfo(first.dtype).max and first.size:
            highest = max(first.max(), second.max())
            if highest >= n_levels:
                msg = f"level {highest} is above {n_levels - 1}: reduce the levels first"
                raise ParameterError(msg)
        # Two bytes make a 16-bit index: a quarter of the memory traffic of int64.
        index_type = np.uint16 if n_levels <= 256 else np.uint32  # noqa: PLR2004 - a byte's values
        index = np.multiply(first, n_levels, dtype=index_type)
        index += second
        counts = np.bincount(index.ravel(), minlength=n_levels**2)
        return cls(counts.reshape(n_levels, n_levels).astype(np.int64, copy=False))

    def __add__(self, other: "Cooccurrence") -> "Cooccurrence":
        if self.n_levels != other.n_levels:
            msg = f"tables of {self.n_levels} and {other.n_levels} levels cannot be added"
            raise ParameterError(msg)
        return Cooccurrence(self.counts + other.counts)

    @classmethod
    def from_json(cls, content: JsonObject, n_levels: int) -> Self:
        """Read the output of `to_json`; raise ValueError if it is damaged."""
        if n_levels > MAX_LEVELS:
            msg = f"a co-occurrence table has {MAX_LEVELS} levels at most, not {n_levels}"
            raise ValueError(msg)
        table = np.zeros((n_levels, n_levels), dtype=np.int64)
        for row, first, counts in zip(table, content["first"], content["counts"], strict=True):
            values = np.asarray(counts, dtype=np.int64)
            if not 0 <= first <= first + values.size <= n_levels or np.any(values < 0):
                msg = "its co-occurrence table holds impossible counts"
                raise ValueError(msg)
            row[first : first + values.size] = values
        return cls(table)

    @override
    def to_json(self) -> JsonObject | None:
        """Encode each row as its first level with counts, and the counts from there."""
        first, rows = [], []
        for row in self.counts:
            (seen,) = np.nonzero(row)
            span = slice(seen[0], seen[-1] + 1) if seen.size else slice(0)
            first.append(int(span.start or 0))
            rows.append(row[span].tolist())
        return None if sum(map(len, rows)) > _MOST_CELLS else {"first": first, "counts": rows}

    @property
    def n_levels(self) -> int:
        """Number of levels L."""
        return len(self.counts)

    @property
    def n_pairs(self) -> int:
        """Number of pixel pairs counted."""
        return int(self.counts.sum())

    @property
    def symmetric(self) -> Counts:
        """Counts regardless of the order of the frames: C + Cᵀ, shape (L, L)."""
        return self.counts + self.counts.T

    @property
    def histogram(self) -> Counts:
        """Counts of each level in either frame, shape (L,)."""
        histogram: Counts = self.counts.sum(axis=0) + self.counts.sum(axis=1)
        return histogram

    @property
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level that occur; (0, -1) for an empty table."""
        (seen,) = np.nonzero(self.histogram)
        return (int(seen[0]), int(seen[-1])) if seen.size else (0, -1)


class DifferenceMoments(NamedTuple):
    """Moments of the differences of pairs by the sum of their levels, (2L − 1,)."""

    pairs: Floats
    """Number of pairs."""
    total: Floats
    """Sum of the differences, later minus earlier."""
    squares: Floats
    """Sum of the squared differences."""


def difference_moments(counts: Counts | Floats) -> DifferenceMoments:
    """Moments of the difference of level pairs, counted or expected, of shape (L, L).

    At equal sum the difference has mean 0 when the frames are exchangeable, free of
    regression to the mean, so drift and noise are measured there.
    """
    sums, difference, squared = _cells(len(counts))
    weight = np.asarray(counts, dtype=np.float64).ravel()

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(sums, values), dtype=np.float64)

    return DifferenceMoments(summed(weight), summed(weight * difference), summed(weight * squared))


@cache
def _cells(n_levels: int) -> tuple[Indices, Floats, Floats]:
    """Sum of the levels of each cell, their difference, and its square, shape (L²,)."""
    level = np.arange(n_levels)
    difference = (level - level[:, np.newaxis]).ravel().astype(np.float64)
    return (level[:, np.newaxis] + level).ravel(), difference, difference**2


def noise_level_function(counts: Counts | Floats) -> Floats:
    """Deviation of one frame around each mean level, from the differences of pairs.

    Parameters
    ----------
    counts : ndarray, shape (L, L)
        Level pairs, counted or expected: both are treated alike, so that clipping and
        rounding, which reduce the deviation near the ends, cancel in a comparison.

    Returns
    -------
    ndarray of float, shape (L,)
        In levels, rounding included; NaN where there are fewer than 100 pairs.
    """
    n_levels = len(counts)
    earlier, later = np.nonzero(counts)
    weight = counts[earlier, later].astype(np.float64)
    middle = (earlier + later + 1) // 2
    pairs = np.bincount(middle, weight, n_levels)
    squares = np.bincount(middle, weight * (later - earlier) ** 2.0, n_levels)
    with np.errstate(invalid="ignore", divide="ignore"):
        deviation = np.sqrt(squares / pairs / 2)
    return np.where(pairs >= _FEWEST_PAIRS, deviation, np.nan)
