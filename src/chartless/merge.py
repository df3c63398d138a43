r"""Exposures of one scene in, one map of its radiance out.

A frame of exposure t shows a pixel at level z, so the sensor saw the irradiance g of that level
and the scene has the radiance g/t. Of the frames that show the pixel properly the maximum
likelihood mean is taken,

.. math:: \hat x = \sum w_k x_k / \sum w_k,\quad x_k = g_k/t_k,\quad w_k = t_k^2/\sigma_k^2,
   \quad \sigma^2 = u I + v + \Delta^2/12 + s^2,

with u and v the sensor's noise, Δ the irradiance that a level covers and s the calibration's own
error: the inverse variance weights of [1]_ and [2]_ in place of a hat function of the level [3]_.

**What the weights are taken at.** A level that noise pushed down has a smaller variance by this
formula than one that it pushed up, so weights at the shown levels pull the mean down: of two
frames of equal exposure by half the squared relative noise, 4 % where that is 0.3. Hence two
sweeps over the frames: the first weighs by the shown level, the second by uI + v at I = t x̂ of
the first. To first order in the variance nothing is left of the bias. Δ and s stay those of the
level: where they matter, the level is not noisy, or they change slowly.

**What clipping does.** Near white, noise that raises a level makes it saturate and drop out, and
what stays is too dark; near black what is clipped at 0 is too bright. So the second sweep also
decides by what is expected and not by what is shown which frames serve: those with t x̂ at least
three deviations from white and from black, if there is one. With inverse variance weights the
mean does not depend on how the frames scatter around it, so choosing by the mean of all does not
bias it; choosing by the mean of the chosen would, so there is no third sweep.
What is saturated counts as saturated in all exposures a quarter longer and more, whatever they
show.

References
----------
.. [1] Granados et al. (2010), "Optimal HDR reconstruction with linear digital cameras", CVPR,
   doi:10.1109/CVPR.2010.5540208.
.. [2] Hasinoff, Durand & Freeman (2010), "Noise-optimal capture for high dynamic range
   photography", CVPR, doi:10.1109/CVPR.2010.5540167.
.. [3] Debevec & Malik (1997), "Recovering high dynamic range radiance maps from photographs",
   SIGGRAPH, doi:10.1145/258734.258884.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.exposures import require_exposures
from chartless.frames.bloom import near_saturated
from chartless.frames.channels import require_alike
from chartless.frames.frame import Frame
from chartless.frames.same_scene import Glimpse, compare_scenes, glimpse
from chartless.noise import TYPICAL_8BIT, AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.types import Bools, Floats, Floats32, Levels

DEFAULT_NOISE = AffineNoise.from_8bit(*TYPICAL_8BIT)
"""For calibrations that tell no noise. It is a camera's at high ISO: it trusts long exposures more
than short ones, which costs little where it is wrong."""
DEVIATIONS = 3.0
"""Distance of the expected irradiance from white and black at which a frame is trusted."""
_HUGE = 1e30  # beyond any irradiance, and still a number
_CLEARLY_LONGER = 1.25
_END = 1 - 1e-6  # irradiance of levels that are white
_MOST_AT_WHITE = 0.01  # share of the longest exposure at its highest level that looks like white
_DISPLACED = 0.5  # pixels: still frames are measured at 0.3 at most
_RANGE = (0.1, 99.9)  # percentiles
_STRIP = 1 << 14  # pixels that are worked on at a time
_SAMPLE = 1 << 21  # radiances that percentiles are taken of

# How well a frame serves a sample of a pixel. Only frames of the best rank are used.
_SATURATED, _DISCOLOURED, _BLOOMING, _UNCLIPPED, _TRUSTED = range(5)


@dataclass(frozen=True, slots=True, eq=False)
class RadianceMap:
    """Radiance of a scene, up to a factor that is one for each channel."""

    values: Floats32
    """Irradiance over exposure, 0 and up, all finite, shape (height, width, channels). Unit:
    saturation irradiance over the unit of the exposures."""
    std: Floats32
    """Deviation of `values` by noise, quantisation and the calibration, same shape; infinite where
    all exposures are saturated."""
    saturated: Bools
    """Pixels of which a channel is saturated in all exposures, shape (height, width). Its value is
    the largest lower bound there is, white of the shortest exposure."""
    black: Bools
    """Pixels of which a channel is at level 0 in all exposures, shape (height, width). Its value is
    half the upper bound: the middle of what level 0 of the longest exposure covers."""
    orientation: int = 1
    """EXIF orientation of the shortest exposure."""
    remarks: tuple[str, ...] = ()
    """What the user should know about the frames."""

    @property
    def dynamic_range_stops(self) -> float | None:
        """log₂ of the 99.9th over the 0.1st percentile of what is neither saturated nor black.

        None if there is nothing.
        """
        measured = self.values[~(self.saturated | self.black)]
        measured = measured[measured > 0]
        if not measured.size:
            return None
        low, high = np.percentile(measured[:: 1 + measured.size // _SAMPLE], _RANGE)
        return float(np.log2(high / low))


def merge_frames(
    frames: Sequence[Frame],
    exposures: Sequence[float] | Floats,
    calibration: Calibration,
    *,
    white: int | None = None,
    bloom_radius: int = 0,
    sweeps: int = 2,
    balanced: bool = True,
    on_frame: Callable[[int, int], None] | None = None,
) -> RadianceMap:
    """Merge exposures of one still scene.

    Memory does not grow with the number of frames: beside one frame there are 16 bytes for each
    sample of a picture.

    Parameters
    ----------
    frames : sequence of Frame
        Two or more of one camera, in any order; an exposure may be repeated. Each is taken once in
        every sweep and forgotten, so the sequence may read files as they are asked for.
    exposures : sequence of float, shape (K,)
        Of each frame, relative to each other: t, or t · ISO/N² where these differ.
    calibration : Calibration
        Of the camera. One of luma serves every channel. Without noise, `DEFAULT_NOISE` is taken.
    white : int, optional
        Level from which on a channel is saturated, for cameras whose white lies below the highest
        level. Without, the highest, or where the curve reaches 1.
    bloom_radius : int
        Pixels this close to a saturated one are not used if another exposure serves.
    sweeps : int
        2, or 1, which weighs by the shown levels, takes each frame once and is biased; see the
        module.
    balanced : bool
        Whether a pixel that the camera shows as middle grey is grey (`grey_factors`). Each curve is
        known up to a factor of its own, the irradiance at which its channel saturates.
    on_frame : callable, optional
        Called with the number of frames taken so far and the number in all, over all sweeps.

    Returns
    -------
    RadianceMap

    Raises
    ------
    UnfitFramesError
        If there are fewer than two frames, they differ in more than exposure, or they do not show
        one scene.
    ParameterError
        If a setting is out of range or the calibration has other channels.

    Notes
    -----
    For a channel of a pixel a frame is, from best to worst, one

    1. in which all channels are expected between white and black (see the module);
    2. in which no channel is saturated;
    3. the same within `bloom_radius` of a saturated pixel;
    4. in which another channel is saturated: using it for the others, which need not be, and not
       for this one would mix exposures and colour the highlights wherever exposures are not exact.

    Only frames of the best rank there is are averaged. Where the channel is saturated in all, its
    value is the bound.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from chartless.curves import SrgbCurve
    >>> from chartless.result.response import Status
    >>> curve = SrgbCurve()
    >>> response = Response(
    ...     name="Y", curve=curve, noise=None, n_levels=256, observed_levels=(0, 255), n_pairs=0,
    ...     method="srgb", status=Status.CONVERGED,
    ... )
    >>> camera = Calibration(channels=(response,), bit_depth=8)
    >>> scene = np.array([[[0.02], [0.2], [2.0]]])
    >>> frames = [
    ...     Frame(Path(), np.rint(255 * curve.response(scene * t)).astype(np.uint8))
    ...     for t in (0.25, 1, 4)
    ... ]
    >>> merge_frames(frames, (0.25, 1, 4), camera).values.ravel().round(2)
    array([0.02, 0.2 , 2.01], dtype=float32)
    """
    times = _checked(frames, exposures, sweeps)
    relative = times / times.max()
    order = np.argsort(times, kind="stable")
    first = frames[int(order[0])]
    shape = first.levels.shape
    tables = _tables(calibration, first, white)
    lit = np.zeros(shape, dtype=bool)
    clipped = _Clipped.none(shape, relative[order])
    whites, scenes = _Whites(), _Scenes()
    earlier: Floats32 | None = None
    for sweep in range(sweeps):
        sums = _Sums.zeros(shape)
        for turn, place in enumerate(order):
            frame = frames[int(place)]
            if sweep == 0:
                require_alike(first, frame, one_exposure=False)
                lit |= frame.levels > 0
                whites.see(frame.levels)
                scenes.see(frame)
            _add(sums, frame.levels, turn, clipped, tables, bloom_radius, earlier)
            if on_frame is not None:
                on_frame(1 + turn + sweep * order.size, sweeps * order.size)
        if sweep + 1 < sweeps:
            earlier = _mean(sums)
    remarks = (*scenes.remarks, *whites.remarks(tables, first.channel_names))
    merged = _finished(sums, lit, tables, times, orientation=first.orientation, remarks=remarks)
    if not balanced or len(calibration.channels) == 1:
        return merged
    factors = grey_factors(calibration).astype(np.float32)
    return replace(merged, values=merged.values * factors, std=merged.std * factors)


def grey_factors(calibration: Calibration) -> Floats:
    """Factors on the irradiance of each channel that make middle grey grey, shape (C,).

    The middle channel keeps its own. Debevec & Malik (1997) set their channels likewise.
    """
    middle = np.array([float(each.curve.inverse(0.5)) for each in calibration.channels])
    return np.asarray(middle[middle.size // 2] / middle)


def _checked(frames: Sequence[Frame], exposures: Sequence[float] | Floats, sweeps: int) -> Floats:
    times = np.asarray(exposures, dtype=np.float64)
    if len(frames) < 2:  # noqa: PLR2004 - exposures
        msg = f"{len(frames)} frame is no bracket: give two or more exposures of one scene"
        raise UnfitFramesError(msg)
    if times.shape != (len(frames),):
        msg = f"{times.size} exposures were given for {len(frames)} frames: give one for each"
    elif sweeps not in (1, 2):
        msg = f"there are one or two sweeps, not {sweeps}"
    else:
        require_exposures(times, [f"exposure {place}" for place in range(1, 1 + times.size)])
        return times
    raise ParameterError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class _Tables:
    """What a level means, for each channel: tables of all channels one after the other."""

    offsets: npt.NDArray[np.intp]
    """Place of level 0 of each channel, shape (C,)."""
    light: Floats32
    """Middle of the irradiance that a level covers, shape (C · L,)."""
    rest: Floats32
    """Variance that is not the sensor's noise: Δ²/12 + s², shape (C · L,)."""
    saturated: Bools
    """Shape (C · L,)."""
    slope: Floats32
    """u, shape (C,)."""
    floor: Floats32
    """v, shape (C,)."""
    bound: Floats
    """Irradiance at white, shape (C,)."""
    lowest: Floats32
    """Expected irradiance from which a frame is trusted, shape (C,)."""
    highest: Floats32
    """And up to which."""

    @property
    def whites(self) -> npt.NDArray[np.intp]:
        """First saturated level of each channel, shape (C,)."""
        return np.asarray(self.saturated.reshape(self.offsets.size, -1).argmax(axis=1))


def _tables(calibration: Calibration, frame: Frame, white: int | None) -> _Tables:
    n_levels, n_channels = frame.white + 1, frame.levels.shape[2]
    if white is not None and not n_levels // 2 <= white < n_levels:
        msg = f"white must be a level between {n_levels // 2} and {n_levels - 1}, not {white}"
        raise ParameterError(msg)
    responses = calibration.channels
    if len(responses) not in (1, n_channels):
        msg = (
            f"the calibration has the channels {', '.join(each.name for each in responses)}, "
            f"{frame.path} has {n_channels}"
        )
        raise ParameterError(msg)
    if len(responses) == 1:
        responses = responses * n_channels
    channels = [_channel_table(each, n_levels, white) for each in responses]
    noises = [each.noise or DEFAULT_NOISE for each in responses]
    margin = np.array([DEVIATIONS * noise.std(1.0) for noise in noises])
    edges = np.array([each.white_edge for each in channels])
    return _Tables(
        offsets=np.arange(n_channels) * n_levels,
        light=np.concatenate([each.light for each in channels]).astype(np.float32),
        rest=np.concatenate([each.rest for each in channels]).astype(np.float32),
        saturated=np.concatenate([each.saturated for each in channels]),
        slope=np.array([noise.slope for noise in noises], dtype=np.float32),
        floor=np.array([noise.floor for noise in noises], dtype=np.float32),
        bound=np.array([each.bound for each in channels]),
        lowest=np.array([DEVIATIONS * noise.std(0.0) for noise in noises], dtype=np.float32),
        highest=(edges - margin).astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _ChannelTable:
    light: Floats
    rest: Floats
    saturated: Bools
    bound: float
    white_edge: float
    """Irradiance at which white begins."""


def _channel_table(response: Response, n_levels: int, white: int | None) -> _ChannelTable:
    level = np.arange(n_levels)
    top = n_levels - 1
    centres = response.curve.inverse(level / top)
    edges = response.curve.inverse(
        np.append(level, n_levels).clip(0.5, top + 0.5) / top - 0.5 / top
    )
    edges[-1] = 1.0
    rest = np.diff(edges) ** 2 / 12
    if response.inverse_lut_std is not None:
        known = np.linspace(0.0, 1.0, response.n_levels)
        rest += np.interp(level / top, known, response.inverse_lut_std) ** 2
    # A curve that is 1 from a level on says that this level is white.
    first = min(top if white is None else white, int(np.argmax(centres >= _END)))
    return _ChannelTable(
        light=(edges[:-1] + edges[1:]) / 2,
        rest=rest,
        saturated=level >= first,
        bound=float(centres[first]),
        white_edge=float(edges[first]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
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
    def zeros(cls, shape: tuple[int, ...]) -> "_Sums":
        return cls(
            np.zeros(shape, dtype=np.float32),
            np.zeros(shape, dtype=np.float32),
            np.full(shape, _SATURATED, dtype=np.uint8),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Clipped:
    """From which exposure on samples are saturated, whatever longer exposures show.

    Compression leaves ripples below white in the midst of what is saturated, and some cameras
    darken it: taken at their word such levels would outweigh all that is right.
    """

    exposures: Floats
    """Of the frames from the shortest, the longest being 1."""
    since: npt.NDArray[np.uint16]
    """Number in this order of the first frame in which the sample is saturated."""

    @classmethod
    def none(cls, shape: tuple[int, ...], exposures: Floats) -> "_Clipped":
        return cls(exposures, np.full(shape, np.iinfo(np.uint16).max, dtype=np.uint16))

    def clearly_longer_than(self, turn: int) -> int:
        """Number of the frames that are so much shorter that noise is no excuse."""
        return int(np.searchsorted(self.exposures, self.exposures[turn] / _CLEARLY_LONGER, "right"))


def _add(  # noqa: PLR0917 - the state of a sweep
    sums: _Sums,
    levels: Levels,
    turn: int,
    clipped: _Clipped,
    tables: _Tables,
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


def _blooming(levels: Levels, tables: _Tables, radius: int) -> Bools | None:
    """Pixels close to a saturated one, shape (height, width)."""
    if radius == 0:
        return None
    return near_saturated(np.any(levels >= tables.whites, axis=-1), radius)


def _strips(height: int, width: int) -> Iterator[slice]:
    """Rows that are worked on together, so that intermediate results stay small."""
    step = max(1, _STRIP // width)
    for start in range(0, height, step):
        yield slice(start, start + step)


def _mean(sums: _Sums) -> Floats32:
    """Weighted mean in place of the weighted sum; huge where all frames are saturated."""
    nothing = sums.rank == _SATURATED
    sums.weight[nothing] = 1.0
    np.divide(sums.weighted, sums.weight, out=sums.weighted)
    sums.weighted[nothing] = _HUGE
    return sums.weighted


def _finished(
    sums: _Sums,
    lit: Bools,
    tables: _Tables,
    times: Floats,
    **about: Any,  # noqa: ANN401 - fields of the map
) -> RadianceMap:
    values, std = _mean(sums), sums.weight
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


class _Scenes:
    """Compares each frame with the next longer exposure."""

    def __init__(self) -> None:
        self._before: tuple[str, Glimpse] | None = None
        self.remarks: tuple[str, ...] = ()
        """Where frames are displaced."""

    def see(self, frame: Frame) -> None:
        """Take the next frame, from the shortest exposure to the longest."""
        seen = glimpse(frame.levels[..., frame.levels.shape[2] // 2], frame.white)
        if self._before is not None:
            path, before = self._before
            match = compare_scenes(before, seen)
            if not match.one_scene:
                msg = (
                    f"{path} and {frame.path} do not show the same scene: give exposures of one "
                    "scene"
                )
                raise UnfitFramesError(msg)
            if match.displacement > _DISPLACED:
                text = (
                    f"{frame.path} is displaced by {match.displacement:.1f} pixels against {path}: "
                    "edges are doubled; use a tripod, or align the frames first"
                )
                self.remarks = (*self.remarks, text)
        self._before = str(frame.path), seen


class _Whites:
    """Finds channels that seem to saturate below white."""

    def __init__(self) -> None:
        self._highest = np.zeros(0, dtype=np.int64)
        self._longest = (np.zeros(0, dtype=np.int64), np.zeros(0))

    def see(self, levels: Levels) -> None:
        """Take the next frame, from the shortest exposure to the longest."""
        highest = levels.max(axis=(0, 1)).astype(np.int64)
        self._highest = np.maximum(self._highest, highest) if self._highest.size else highest
        self._longest = highest, np.mean(levels == highest, axis=(0, 1))

    def remarks(self, tables: _Tables, names: tuple[str, ...]) -> tuple[str, ...]:
        longest, shares = self._longest
        alike = np.asarray(self._highest == longest)
        found = zip(names, longest, shares, alike, tables.whites, strict=True)
        return tuple(
            f"channel {name}: no level is above {level}, where {100 * share:.1f} % of the longest "
            f"exposure lie: if that is this camera's white, merge with `white={level}`"
            for name, level, share, same, white in found
            if same and level < white and share > _MOST_AT_WHITE
        )
