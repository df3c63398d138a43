"""Comparagrams from exposures of one scene.

Each frame is read once, and an even sample of its pixels is kept: single pixels, never
means, as the mean of a saturated pixel and its neighbour is a level that no curve
explains. Each exposure is then compared with the next three, pixel by pixel; more pairs
take longer and add little (on nine real cameras the median error is 0.0059 with
neighbours alone, 0.0055 with the next two, 0.0051 with the next three).

Lossy files, such as JPEG, blur clipping: a pixel in a block with white pixels is not
evidence of its level, and levels next to white and black may be clipped or not. Levels
err as much as light, in both exposures, so pairs are compared both ways, with errors of
opposite sign (docs/design/0011-jpeg.md).

Coloured pixels get less weight than grey ones. Colour processing beyond the curve (a
matrix, a gamut, a film look) shifts red, green and blue against each other, but leaves
neutral pixels unchanged. Where the scene has no greys, coloured pixels still count.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np
from typing_extensions import override

from chartless.curves.populations import measured_prior
from chartless.curves.prior import irradiance_at_edges
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence._pair_check import PairCheck, check_pair
from chartless.evidence.base import AbstractEvidence
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.likelihood import Comparagram, ExposureCounts, pooled
from chartless.evidence.bracket.transfer import brightness_transfer
from chartless.frames.bloom import near_saturated
from chartless.frames.channels import planes_of, require_alike, require_mask
from chartless.frames.compression import JPEG_BLOCK, Blocks, former_blocks
from chartless.frames.frame import Frame, FrameSource
from chartless.frames.same_scene import Glimpse, SceneChain, chained, glimpse
from chartless.types import Bools, Counts, Floats, Floats32, Levels

MOST_LEVELS = 256
"""Levels at which exposures are compared; a finer curve is interpolated."""
LEAST_STEP = math.log(1.05)
"""Least difference of ln of the exposure; below it, two exposures count as one."""
LOSSY_MARGIN = 3
"""Number of levels next to black and white that lossy compression makes of clipped
pixels."""
UNALIGNED_WHITE = 0.15
"""Relative deviation of the light at white where levels of lossy files are matched by rank: blocks
that hold white cannot be left out then (benchmarks/files.py, row unaligned)."""
SAMPLE = 1 << 18
"""Largest number of pixels of a frame that are kept."""
GREY_PIXELS, COLOURED_PIXELS = 1000.0, 100.0
"""Largest numbers of pixels counted for a level of the longer exposure."""
COLOURED_TRUST = 0.1
"""Weight of a coloured pixel relative to that of a grey one."""
NEUTRAL = 0.12
"""Largest difference between channels of a grey pixel, as a share of the largest
channel."""
_APART = (1, 2, 3)  # steps between the exposures that are compared
_DARK, _BRIGHT = 0.08, 0.96  # range in which the colour cast of the light is measured
_LEAST_CAST = 100  # pixels
_DIM, _GROUPS, _ENOUGH = 8, 2, 100  # least level; groups per stop; pixels per group


@final
@dataclass(frozen=True, slots=True, eq=False)
class BracketEvidence(AbstractEvidence):
    """Evidence from the exposures of one still scene."""

    tables: dict[str, tuple[Comparagram, ...]]
    """Weighted tables of each channel, by name: one for each pair of exposures."""
    log_exposures: Floats
    """ln of the exposures as given or, if unknown, as for an average camera, shape
    (K,)."""
    exposure_error: float
    """Deviation of each ln t; 0 if they are exact."""
    histograms: dict[str, Counts]
    """Counts of each level among the compared pixels of each exposure, shape (K, L)."""
    clipped: Floats
    """Shares of black and white in each exposure, over all channels, shape (K, 2). They
    are of whole frames, although blocks with white are not compared in lossy files."""
    checks: tuple[PairCheck, ...]
    """Checks of each exposure and the next, with levels matched."""
    overlaps: tuple[float, ...]
    """Share of usable pixels that are neither black nor white in an exposure and the next."""
    brightenings: tuple[float, ...]
    """Change of ln of the level of such pixels from an exposure to the next, where it
    is largest; NaN if there are too few."""
    bit_depth: int
    """Bit depth of the frames as read."""
    sources: tuple[FrameSource, ...]
    """One for each exposure, in the order given."""
    scenes: SceneChain | None = None
    """Whether exposures show one scene and how far they are displaced; None if not compared."""
    aligned: bool = True
    """Whether levels were compared pixel by pixel."""
    white_error: float = 0.0
    """See `ExposureCounts.white_error`."""

    @property
    def lossy(self) -> bool:
        """Whether files were compressed with loss."""
        return all(self.counts(name).lossy for name in self.tables)

    @property
    @override
    def channels(self) -> tuple[str, ...]:
        return tuple(self.tables)

    @override
    def channel(self, name: str) -> ExposurePairs:
        return ExposurePairs(self.counts(name))

    def counts(self, channel: str) -> ExposureCounts:
        """Return the evidence of one channel, prepared for the likelihood."""
        return ExposureCounts(
            self.tables[channel],
            self.log_exposures,
            exposure_error=self.exposure_error,
            white_error=self.white_error,
            aligned=self.aligned,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """Pixels kept of a frame until all have been read."""

    levels: dict[str, Levels]
    """Levels of the chosen pixels by channel, shape (N,)."""
    usable: Bools
    """Whether they lie in the mask and away from saturated pixels, shape (N,)."""
    touched: Bools
    """Whether they lie in a block that holds white, shape (N,): not usable if the file is lossy."""
    chroma: Floats32
    """Distance from grey, shape (N,)."""


def bracket_evidence(
    frames: Iterable[Frame],
    log_exposures: Floats | None,
    *,
    exposure_error: float = 0.0,
    channels: str = "auto",
    n_levels: int = MOST_LEVELS,
    mask: Bools | None = None,
    bloom_radius: int = 0,
    aligned: bool = True,
    on_frame: Callable[[Frame], None] | None = None,
) -> BracketEvidence:
    """Compare the levels of exposures of one scene, channel by channel.

    Parameters
    ----------
    frames : iterable of Frame
        One for each exposure, consumed one by one.
    log_exposures : ndarray, shape (K,), or None
        ln of their exposures, up to a constant; None if unknown.
    exposure_error : float
        Deviation of each ln t; 0 if they are exact.
    channels : str
        As for `chartless.frames.channels.planes_of`.
    n_levels : int
        Levels are reduced to this many, and to `MOST_LEVELS`.
    mask : ndarray of bool, shape (M, N), optional
        Only pixels where it is True are used.
    bloom_radius : int
        Radius around saturated pixels that is left out of an exposure, in pixels, at
        most half the smaller side of a frame; 0 if not `aligned`.
    aligned : bool
        Whether a pixel shows the same spot in all frames. If not, levels are matched by
        their rank: the brightest tenth of one exposure is the brightest tenth of the
        other (Grossberg & Nayar 2003, "Determining the camera response from images:
        what is knowable?", doi:10.1109/TPAMI.2003.1240119).
    on_frame : callable, optional
        Called with each frame when it has been read.

    Raises
    ------
    UnfitFramesError
        If there are fewer than two exposures, or the frames differ in more than exposure.
    ParameterError
        If `channels`, `n_levels`, `bloom_radius` or the mask does not suit the frames.
    """
    n_levels = min(n_levels, MOST_LEVELS)
    _require_same_pixels(bloom_radius, aligned=aligned)
    reading = _Reading(n_levels, channels, mask, bloom_radius, aligned)
    for frame in frames:
        reading.read(frame)
        if on_frame is not None:
            on_frame(frame)
    samples = reading.samples
    if len(samples) < 2:  # noqa: PLR2004 - exposures to compare
        msg = "a bracket needs two or more frames of one scene at different exposures"
        raise UnfitFramesError(msg)
    lossy = reading.history.lossy
    whole = stacked = _all_histograms(samples, n_levels)
    if lossy and aligned:
        samples = [replace(each, usable=each.usable & ~each.touched) for each in samples]
        stacked = _all_histograms(samples, n_levels)
    inner = [_inner(sample, n_levels) for sample in samples]
    if log_exposures is None:
        log_exposures = _guessed(samples, inner, n_levels)
    pairs = _pairs(log_exposures)
    if not pairs:
        msg = (
            "the exposures do not differ: give frames of different exposures, or "
            "`evidence='noise'` for frames of one exposure"
        )
        raise UnfitFramesError(msg)
    if lossy:
        pairs += [(longer, shorter) for shorter, longer in pairs]
    margin = LOSSY_MARGIN if lossy else 0
    if aligned:
        tables = _compared(samples, pairs, stacked, margin)
    else:
        tables = {name: _matched(rows, pairs, margin) for name, rows in stacked.items()}
    if exposure_error == 0:
        tables = {name: pooled(each, log_exposures) for name, each in tables.items()}
    return BracketEvidence(
        tables=tables,
        log_exposures=log_exposures,
        exposure_error=exposure_error,
        histograms=stacked,
        clipped=_clipped(whole),
        checks=tuple(reading.checks),
        overlaps=_overlaps(samples, inner),
        white_error=UNALIGNED_WHITE if lossy and not aligned else 0.0,
        brightenings=_brightenings(samples, inner),
        bit_depth=reading.bit_depth,
        sources=tuple(reading.sources),
        scenes=chained(reading.glimpses),
        aligned=aligned,
    )


class _Reading:
    """Accumulator of frames that are read one by one."""

    def __init__(
        self,
        n_levels: int,
        channels: str,
        mask: Bools | None,
        bloom_radius: int,
        aligned: bool,  # noqa: FBT001
    ) -> None:
        self._n_levels, self._channels, self._mask = n_levels, channels, mask
        self._bloom_radius, self._aligned = bloom_radius, aligned
        self._first: Frame | None = None
        self._before: dict[str, Levels] = {}
        self.samples: list[_Sample] = []
        self.sources: list[FrameSource] = []
        self.checks: list[PairCheck] = []
        self.glimpses: list[Glimpse] = []
        self.history = _History()

    @property
    def bit_depth(self) -> int:
        """Bit depth of the frames."""
        assert self._first is not None
        return self._first.bit_depth

    def read(self, frame: Frame) -> None:
        """Add the next frame; raises like `bracket_evidence`."""
        if self._first is None:
            require_mask(self._mask, frame)
            _require_one_curve(frame, self._channels)
            self._first = frame
        require_alike(self._first, frame, one_exposure=False)
        n_levels, mask = self._n_levels, self._mask
        planes = planes_of(frame, self._channels, n_levels)
        blocks = self.history.blocks(frame)
        usable = np.broadcast_to(True, frame.levels.shape[:2]) if mask is None else mask
        white = np.any([plane == n_levels - 1 for plane in planes.values()], axis=0)
        if self._bloom_radius != 0:
            usable = usable & ~near_saturated(white, self._bloom_radius)
        self.samples.append(_sample(planes, n_levels, usable, blocks.touched(white)))
        middle = list(planes)[len(planes) // 2]
        self.glimpses.append(glimpse(planes[middle], n_levels - 1, mask))
        if self._aligned and self._before:
            one, other = (sample.levels[middle] for sample in self.samples[-2:])
            follows = _followed(one, other, n_levels)
            check = check_pair(self._before[middle], planes[middle], mask, follows=follows)
            self.checks.append(check)
        self._before = planes
        self.sources.append(frame.source)


def _inner(sample: _Sample, n_levels: int) -> Bools:
    """Pixels that are usable, and neither black nor white in any channel."""
    inner = sample.usable
    for levels in sample.levels.values():
        inner = inner & (levels > 0) & (levels < n_levels - 1)
    return inner


def _overlaps(samples: list[_Sample], inner: list[Bools]) -> tuple[float, ...]:
    return tuple(
        float((a & b).sum() / max((one.usable & other.usable).sum(), 1))
        for (one, other), (a, b) in zip(pairwise(samples), pairwise(inner), strict=True)
    )


def _brightenings(samples: list[_Sample], inner: list[Bools]) -> tuple[float, ...]:
    return tuple(
        _brightening(
            *(np.concatenate([levels[a & b] for levels in each.levels.values()]) for each in pair)
        )
        for pair, (a, b) in zip(pairwise(samples), pairwise(inner), strict=True)
    )


def _brightening(before: Levels, after: Levels) -> float:
    """Largest rise or fall of ln of the level; NaN if there are too few pixels.

    Pixels are grouped by the sum of both levels, so that a rise by noise does not
    affect the group. A hard shoulder hides the rise in some groups, not in all.
    """
    one, other = before.astype(np.float64), after.astype(np.float64)
    shown = one + other >= 2 * _DIM
    group = np.log2((one + other)[shown] / _DIM) * _GROUPS
    rise = np.log(other[shown] / one[shown])
    found, way = math.nan, math.copysign(1.0, float(np.sign(rise).sum()))
    for own in range(int(group.max(initial=0.0)) + 1):
        rises = rise[group.astype(np.intp) == own]
        if rises.size < _ENOUGH:
            continue
        middle = way * float(np.median(rises))
        # Medians of Gaussian values have √(π/2) times the deviation of means; 1.4826
        # turns a median absolute deviation into a standard deviation.
        spread = 1.4826 * float(np.median(np.abs(rises - middle)))
        sure = max(middle - 2 * (np.pi / 2 / rises.size) ** 0.5 * spread, 0.0)
        found = sure if math.isnan(found) else max(found, sure)
    return way * found


def _guessed(samples: list[_Sample], inner: list[Bools], n_levels: int) -> Floats:
    """Ln of the exposures for an average camera, shape (K,)."""
    edges = irradiance_at_edges(measured_prior(n_levels).mean)
    log_light = np.log((edges[1:] + edges[:-1]) / 2)
    steps = [0.0]
    for (one, other), (a, b) in zip(pairwise(samples), pairwise(inner), strict=True):
        both = a & b
        ratios = [
            np.median(log_light[other.levels[name][both]] - log_light[one.levels[name][both]])
            for name in one.levels
        ]
        steps.append(float(np.mean(ratios)) if both.any() else 0.0)
    return np.cumsum(steps)


def _all_histograms(samples: list[_Sample], n_levels: int) -> dict[str, Counts]:
    return {name: _histograms(samples, name, n_levels) for name in samples[0].levels}


def _histograms(samples: list[_Sample], channel: str, n_levels: int) -> Counts:
    rows = [
        np.bincount(sample.levels[channel][sample.usable], minlength=n_levels) for sample in samples
    ]
    return np.stack(rows).astype(np.int64)


def _clipped(histograms: dict[str, Counts]) -> Floats:
    """Shares of black and white in each exposure, over all channels, shape (K, 2)."""
    counts = np.sum([*histograms.values()], axis=0)
    total = np.maximum(counts.sum(axis=1, keepdims=True), 1)
    return np.asarray(counts[:, [0, -1]] / total)


def _followed(first: Levels, second: Levels, n_levels: int) -> Levels:
    """Level of the second exposure that corresponds to each of the first: (L,)."""
    counts = np.bincount(first.astype(np.intp) * n_levels + second, minlength=n_levels**2)
    inner = counts.reshape(n_levels, n_levels).astype(np.float64)
    inner[:, [0, -1]] = 0
    level, follows = brightness_transfer(inner)
    if level.size == 0:
        return np.arange(n_levels).astype(np.uint16)
    rising = np.maximum.accumulate(follows)
    brought: Levels = np.rint(np.interp(np.arange(n_levels), level, rising)).astype(np.uint16)
    return brought


def _pairs(log_exposures: Floats) -> list[tuple[int, int]]:
    """Pairs of exposures to compare, as numbers of the shorter and the longer one."""
    order = np.argsort(log_exposures, kind="stable")
    steps = [(a, b) for apart in _APART for a, b in zip(order, order[apart:], strict=False)]
    return [(int(a), int(b)) for a, b in steps if log_exposures[b] - log_exposures[a] > LEAST_STEP]


class _History:
    """Detector of lossy compression in frames that are read one by one."""

    def __init__(self) -> None:
        self.lossy = False
        self._blocks = Blocks(JPEG_BLOCK, JPEG_BLOCK)
        self._sure = False

    def blocks(self, frame: Frame) -> Blocks:
        """Return the blocks coded together in a frame, if known to be from a JPEG."""
        if frame.blocks is not None:
            self.lossy = True
            return frame.blocks
        if not self._sure:  # frames of a bracket share one history
            found, self._sure = former_blocks(frame.levels)
            if found is not None:
                self.lossy, self._blocks = True, found
        return self._blocks


def _require_same_pixels(bloom_radius: int, *, aligned: bool) -> None:
    if bloom_radius != 0 and not aligned:
        msg = (
            "bloom_radius excludes different pixels from each exposure, but unaligned "
            "exposures are matched by all of their pixels: use one or the other"
        )
        raise ParameterError(msg)


def _require_one_curve(frame: Frame, channels: str) -> None:
    """Refuse luma of coloured frames: its mix of three curves depends on colour."""
    levels = frame.levels
    if channels == "luma" and levels.shape[-1] > 1 and np.any(levels != levels[..., :1]):
        msg = (
            f"{frame.path} is a colour picture, and luma of differently coloured pixels is "
            "not a single function of light: use channels 'auto' or 'rgb' for exposures of "
            "colour pictures"
        )
        raise ParameterError(msg)


def _sample(planes: dict[str, Levels], n_levels: int, usable: Bools, touched: Bools) -> _Sample:
    height, width = usable.shape
    excess = max(1.0, height * width / SAMPLE)
    down = int(np.sqrt(excess))
    right = int(np.ceil(excess / down))
    chosen = np.s_[down // 2 :: down, right // 2 :: right]
    levels = {name: plane[chosen].ravel() for name, plane in planes.items()}
    return _Sample(
        levels,
        usable[chosen].ravel(),
        touched[chosen].ravel(),
        _chroma([*levels.values()], n_levels),
    )


def _chroma(planes: list[Levels], n_levels: int) -> Floats32:
    """Difference of extreme channels over the largest, with the cast removed."""
    if len(planes) == 1:
        return np.zeros(planes[0].size, dtype=np.float32)
    top = n_levels - 1
    least, largest = np.minimum.reduce(planes), np.maximum.reduce(planes)
    (shown,) = np.nonzero((least > _DARK * top) & (largest < _BRIGHT * top))
    colours = [plane.astype(np.float32) for plane in planes]
    if shown.size >= _LEAST_CAST:
        middle = colours[1][shown]
        colours = [colour / np.median(colour[shown] / middle) for colour in colours]
    brightest = np.maximum.reduce(colours)
    away = brightest - np.minimum.reduce(colours)
    return np.asarray(away / np.maximum(brightest, 1.0))


def _compared(
    samples: list[_Sample],
    pairs: list[tuple[int, int]],
    histograms: dict[str, Counts],
    margin: int,
) -> dict[str, tuple[Comparagram, ...]]:
    """Comparagrams of each channel from pixels at the same place."""
    tables: dict[str, list[Comparagram]] = {name: [] for name in histograms}
    most = np.array([GREY_PIXELS, COLOURED_PIXELS])[:, np.newaxis]
    for shorter, longer in pairs:
        a, b = samples[shorter], samples[longer]
        usable, grey = a.usable & b.usable, (a.chroma + b.chroma) / 2 <= NEUTRAL
        kinds = np.flatnonzero(usable & grey), np.flatnonzero(usable & ~grey)
        for name, seen in histograms.items():
            n_levels = seen.shape[1]
            # Cell numbers fit 16 bits, as there are no more than 256 levels.
            cell = b.levels[name].astype(np.uint16) * np.uint16(n_levels) + a.levels[name]
            counts = np.stack([np.bincount(cell[kind], minlength=n_levels**2) for kind in kinds])
            counts = counts.reshape(2, n_levels, n_levels)
            n_pixels = counts.sum(axis=2)
            weight = np.minimum(1.0, most / np.maximum(n_pixels, 1))
            effective = weight * n_pixels
            share = effective[0] / np.maximum(effective.sum(axis=0), 1e-9)
            tables[name].append(
                Comparagram(
                    shorter,
                    longer,
                    counts=np.einsum("kji,kj->ji", counts, weight),
                    trust=share + COLOURED_TRUST * (1 - share),
                    histogram=seen[longer].astype(np.float64),
                    margin=margin,
                )
            )
    return {name: tuple(each) for name, each in tables.items()}


def _matched(
    histograms: Counts, pairs: list[tuple[int, int]], margin: int
) -> tuple[Comparagram, ...]:
    """Comparagrams from pixels of the same rank."""
    tables = []
    for shorter, longer in pairs:
        below = [np.cumsum(histograms[each]) / histograms[each].sum() for each in (longer, shorter)]
        ranks = np.unique(np.concatenate([[0.0], *below]))
        middle = (ranks[1:] + ranks[:-1]) / 2
        rows, columns = (np.searchsorted(each, middle) for each in below)
        counts = np.zeros((histograms.shape[1],) * 2)
        np.add.at(counts, (rows, columns), np.diff(ranks) * histograms[longer].sum())
        trust = np.full(len(counts), COLOURED_TRUST)
        weighted = _weighted(counts, COLOURED_PIXELS)
        seen = histograms[longer].astype(np.float64)
        tables.append(Comparagram(shorter, longer, weighted, trust, seen, margin=margin))
    return tuple(tables)


def _weighted(counts: Counts | Floats, most: float) -> Floats:
    """Scale counts so that no row exceeds `most`."""
    return np.asarray(
        counts * np.minimum(1.0, most / np.maximum(counts.sum(axis=1), 1e-9)[:, np.newaxis])
    )
