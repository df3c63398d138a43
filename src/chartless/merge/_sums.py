"""Sums over the frames, taken strip by strip, and the map that they give."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from chartless.frames.bloom import near_saturated
from chartless.merge._map import RadianceMap
from chartless.merge._tables import Tables
from chartless.types import Bools, Floats, Floats32, Levels

_HUGE = 1e30  # beyond any irradiance, and still a number
_CLEARLY_LONGER = 1.25
_STRIP = 1 << 14  # pixels that are worked on at a time

# How well a frame serves a sample of a pixel. Only frames of the best rank are used.
_SATURATED, _DISCOLOURED, _BLOOMING, _UNCLIPPED, _TRUSTED = range(5)


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """What is kept of the frames; shapes are those of a frame.

    All that is added is positive, so that single precision loses no more than 6·10⁻⁸ for each
    frame.
    """

    weighted: Floats32
    """Σ w_k x_k over the frames of the best rank."""
    weight: Floats32
    """Σ w_k over the same."""
    rank: npt.NDArray[np.uint8]
    """The best so far."""

    @classmethod
    def zeros(cls, shape: tuple[int, ...]) -> "Sums":
        return cls(
            np.zeros(shape, dtype=np.float32),
            np.zeros(shape, dtype=np.float32),
            np.full(shape, _SATURATED, dtype=np.uint8),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Clipped:
    """From which exposure on samples are saturated, whatever longer exposures show.

    Compression leaves ripples below white in the midst of what is saturated, and some cameras
    darken it: taken at their word such levels would outweigh all that is right.
    """

    exposures: Floats
    """Exposures of the frames from the shortest, the longest being 1."""
    since: npt.NDArray[np.uint16]
    """Number in this order of the first frame in which the sample is saturated."""

    @classmethod
    def none(cls, shape: tuple[int, ...], exposures: Floats) -> "Clipped":
        return cls(exposures, np.full(shape, np.iinfo(np.uint16).max, dtype=np.uint16))

    def clearly_longer_than(self, turn: int) -> int:
        """Number of the frames that are so much shorter that noise is no excuse."""
        return int(np.searchsorted(self.exposures, self.exposures[turn] / _CLEARLY_LONGER, "right"))


def add(  # noqa: PLR0917 - the state of a sweep
    sums: Sums,
    levels: Levels,
    turn: int,
    clipped: Clipped,
    tables: Tables,
    bloom_radius: int,
    earlier: Floats32 | None,
) -> None:
    """Add a frame: start anew where it is better than all before, skip it where it is worse."""
    exposure = np.float32(clipped.exposures[turn])
    shorter = clipped.clearly_longer_than(turn)
    height, width, n_channels = levels.shape
    blooming = _blooming(levels, tables, bloom_radius)
    # Whole rows are one axis: NumPy is slow at steps of three.
    flat = (height, width * n_channels)
    offsets, slope, floor, lowest, highest = (
        np.tile(each, width)
        for each in (tables.offsets, tables.slope, tables.floor, tables.lowest, tables.highest)
    )
    shown, weighted, weights, ranks, since = (
        each.reshape(flat)
        for each in (levels, sums.weighted, sums.weight, sums.rank, clipped.since)
    )
    before = None if earlier is None else earlier.reshape(flat)
    for rows in _strips(height, width):
        index = shown[rows] + offsets
        saturated = tables.saturated.take(index)
        since[rows][saturated & (since[rows] > turn)] = turn
        saturated |= since[rows] < shorter
        rank = np.full(index.shape, _UNCLIPPED, dtype=np.uint8)
        light, variance = tables.light.take(index), tables.rest.take(index)
        seen = light
        if before is not None:
            seen = before[rows] * exposure
            trusted = ~_in_any_channel(seen > highest, n_channels)
            # What shows twice as much is not black, even if a level that should have been
            # saturated misled the sweep before.
            trusted &= (seen >= lowest) | (light >= 2 * lowest)
            rank[trusted] = _TRUSTED
        if blooming is not None:
            rank[np.repeat(blooming[rows], n_channels, axis=1)] = _BLOOMING
        if saturated.any():
            rank[_in_any_channel(saturated, n_channels)] = _DISCOLOURED
            rank[saturated] = _SATURATED
        variance += slope * seen + floor
        weight = exposure / variance  # of g = x t; times t once more below
        best = ranks[rows]
        _accumulate(weighted[rows], weight * light, rank, best)
        _accumulate(weights[rows], weight * exposure, rank, best)
        np.maximum(best, rank, out=best)


def _in_any_channel(truth: Bools, n_channels: int) -> Bools:
    """Whether it holds for a channel of the pixel, for each sample, shape of `truth`."""
    if n_channels == 1:
        return truth
    pixels = truth[:, 0::n_channels].copy()
    for channel in range(1, n_channels):
        pixels |= truth[:, channel::n_channels]
    return np.repeat(pixels, n_channels, axis=1)


def _accumulate(
    total: Floats32, added: Floats32, rank: npt.NDArray[np.uint8], best: npt.NDArray[np.uint8]
) -> None:
    total *= rank <= best
    added *= (rank >= best) & (rank > _SATURATED)
    total += added


def _blooming(levels: Levels, tables: Tables, radius: int) -> Bools | None:
    """Pixels close to a saturated one, shape (height, width)."""
    if radius == 0:
        return None
    return near_saturated(np.any(levels >= tables.whites, axis=-1), radius)


def _strips(height: int, width: int) -> Iterator[slice]:
    """Rows that are worked on together, so that intermediate results stay small."""
    step = max(1, _STRIP // width)
    for start in range(0, height, step):
        yield slice(start, start + step)


def mean(sums: Sums) -> Floats32:
    """Weighted mean in place of the weighted sum; huge where all frames are saturated."""
    nothing = sums.rank == _SATURATED
    sums.weight[nothing] = 1.0
    np.divide(sums.weighted, sums.weight, out=sums.weighted)
    sums.weighted[nothing] = _HUGE
    return sums.weighted


def finished(
    sums: Sums,
    lit: Bools,
    tables: Tables,
    times: Floats,
    **about: Any,  # noqa: ANN401 - fields of the map
) -> RadianceMap:
    values, std = mean(sums), sums.weight
    np.divide(1.0, np.sqrt(std, out=std), out=std)
    saturated = sums.rank == _SATURATED
    values[saturated] = 0.0  # huge before, and set to the bound below
    values /= times.max()
    std /= times.max()
    black = ~lit
    for c, bound in enumerate(tables.bound):
        values[..., c][saturated[..., c]] = bound / times.min()
        values[..., c][black[..., c]] = tables.light[tables.offsets[c]] / times.max()
    std[saturated] = np.inf
    return RadianceMap(
        values=values,
        std=std,
        saturated=np.asarray(saturated.any(axis=-1)),
        black=np.asarray(black.any(axis=-1)),
        **about,
    )
