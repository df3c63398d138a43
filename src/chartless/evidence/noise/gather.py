"""Co-occurrence tables from frames: the only loop over every pixel.

Each frame is compared with the next: consecutive frames are closest in time, so that
light and camera have drifted least; each frame serves in at most two pairs, which keeps
the pairs nearly independent; and the cost grows with the number of frames, not its
square. Comparing all pairs of 10 frames instead of two frames improves the estimate by
a fifth at best: the limit is the unknown ratio of the noise parameters, not the number
of counts.

A small change of brightness within a pair is removed before its table is added: lamps
flicker up and down, so over many pairs it would look like noise.

Only two frames at a time and the tables are held in memory.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.errors import UnfitFramesError
from chartless.evidence._pair_check import PairCheck, channel_correlation, check_pair
from chartless.evidence.base import AbstractEvidence
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.doubt import frame_errors
from chartless.evidence.noise.drift import Drift, compensated, estimated_drift
from chartless.evidence.noise.outliers import outlying
from chartless.evidence.noise.screening import EMPTY, empty_share, resemblance, unfit
from chartless.frames.channels import planes_of, require_alike, require_mask
from chartless.frames.compression import former_blocks
from chartless.frames.frame import Frame, FrameSource, Origin
from chartless.frames.same_scene import compare_scenes, glimpse
from chartless.types import Bools, Counts, Levels

_OF_FILES = {Origin.UNKNOWN, Origin.CAMERA}  # which may have been JPEG before
_DARKEST = 0.25  # share of the range: steep curves lift the noise of black


@final
@dataclass(frozen=True, slots=True, eq=False)
class NoiseEvidence(AbstractEvidence):
    """Evidence from the frames of one still scene."""

    tables: dict[str, Cooccurrence]
    """Co-occurrence table of each channel, by name."""
    checks: tuple[PairCheck, ...]
    """One for each pair of consecutive frames."""
    bit_depth: int
    """Bit depth of the frames as read."""
    sources: tuple[FrameSource, ...]
    """One for each frame, in order."""
    n_frames: int
    """Number of frames of one exposure: one more than consecutive pairs."""

    dark: Mapping[str, Counts] = field(default_factory=dict)
    """Counts of each level in frames taken with the lens covered, by channel; empty
    without such frames."""

    @property
    @override
    def channels(self) -> tuple[str, ...]:
        return tuple(self.tables)

    @override
    def channel(self, name: str) -> LevelPairs:
        table = self.tables[name]
        n_pixels = max(table.n_pairs / max(len(self.checks), 1), 1)
        errors = frame_errors(self.checks, n_pixels=n_pixels, lossy=self.lossy)
        return LevelPairs(table, self.n_frames, self.dark.get(name), errors)

    @property
    def lossy(self) -> bool:
        """Whether compression changed the noise."""
        return any(source.lossy for source in self.sources)

    @property
    def n_levels(self) -> int:
        """Number of levels of the tables."""
        return next(iter(self.tables.values())).n_levels


def noise_evidence(
    frames: Iterable[Frame],
    *,
    channels: str = "auto",
    n_levels: int = 256,
    mask: npt.NDArray[np.bool_] | None = None,
    on_frame: Callable[[Frame], None] | None = None,
) -> NoiseEvidence:
    """Count the level pairs of consecutive frames, channel by channel.

    Parameters
    ----------
    frames : iterable of Frame
        Two or more, consumed one by one.
    channels : str
        "auto" (those of the frames), "rgb" or "luma".
    n_levels : int
        Levels are reduced to this many (see `chartless.frames.levels.level_table`).
    mask : ndarray of bool, shape (M, N), optional
        Only pixels where it is True are used.
    on_frame : callable, optional
        Called with each frame when it has been counted.

    Returns
    -------
    NoiseEvidence

    Raises
    ------
    UnfitFramesError
        If there are fewer than two frames, if they differ in size, channels, bit depth or
        exposure, or if two have identical pixels.
    ParameterError
        If `channels` or `n_levels` does not suit the frames, or the mask their size.
    """
    tables: dict[str, Cooccurrence] = {}
    checks: list[PairCheck] = []
    sources: list[FrameSource] = []
    before: tuple[Frame, dict[str, Levels]] | None = None
    frame: Frame | None = None
    for frame in frames:
        if before is not None:
            require_alike(before[0], frame)
        else:
            require_mask(mask, frame)
        planes = planes_of(frame, channels, n_levels)
        if before is not None:
            if np.array_equal(before[0].levels, frame.levels):
                msg = (
                    f"{before[0].path} and {frame.path} show identical pixels, so there is no "
                    "noise to measure: give different shots of the scene"
                )
                raise UnfitFramesError(msg)
            pairs, check = compare_pair(before[1], planes, n_levels, mask)
            for name, pair in pairs.items():
                tables[name] = tables[name] + pair if name in tables else pair
            if unfit(check) is not None:
                check = _explained(check, before[1], planes, n_levels, mask)
            checks.append(check)
        source = frame.source
        if before is None and frame.origin in _OF_FILES and former_blocks(frame.levels).blocks:
            source = replace(source, lossy=True)  # frames of a burst share one history
        before = frame, planes
        sources.append(source)
        if on_frame is not None:
            on_frame(frame)
    if frame is None or not checks:
        given = "none" if frame is None else f"only {frame.path}"
        msg = (
            f"calibration needs two or more frames of the same still scene, {given} was given: "
            "photograph it again with the same settings"
        )
        raise UnfitFramesError(msg)
    return NoiseEvidence(tables, tuple(checks), frame.bit_depth, tuple(sources), len(sources))


def joined(
    earlier: NoiseEvidence, later: NoiseEvidence, *, continued: bool = True
) -> NoiseEvidence:
    """Add up the evidence of two runs.

    Parameters
    ----------
    earlier, later : NoiseEvidence
        Counted with the same channels and levels.
    continued : bool
        Whether the second begins with the last frame of the first; if not, it is of another
        exposure.

    Returns
    -------
    NoiseEvidence
        Evidence of both runs as if counted as one.
    """
    return NoiseEvidence(
        {name: table + later.tables[name] for name, table in earlier.tables.items()},
        earlier.checks + later.checks,
        earlier.bit_depth,
        earlier.sources + (later.sources[1:] if continued else later.sources),
        earlier.n_frames + later.n_frames - 1
        if continued
        else max(earlier.n_frames, later.n_frames),
    )


def compare_pair(
    first: dict[str, Levels], second: dict[str, Levels], n_levels: int, mask: Bools | None
) -> tuple[dict[str, Cooccurrence], PairCheck]:
    """Compare the channels of two frames.

    Parameters
    ----------
    first, second : dict of str to ndarray, shape (M, N)
        See `chartless.frames.channels.planes_of`.
    n_levels : int
    mask : ndarray of bool, shape (M, N), or None

    Returns
    -------
    dict of str to Cooccurrence
        Table of each channel, with a small drift of brightness removed.
    PairCheck
        Differences of the frames other than noise.
    """
    tables: dict[str, Cooccurrence] = {}
    drifts: dict[str, Drift | None] = {}
    middle = list(second)[len(second) // 2]
    most, share = 0.0, 0.0
    for name, plane in second.items():
        table = Cooccurrence.of_pair(first[name], plane, n_levels=n_levels, mask=mask)
        # A comb of used levels leaves nothing to interpolate.
        drift = None if empty_share(table) > EMPTY else estimated_drift(table)
        if drift is not None:
            most, share = max(most, drift.relative), max(share, drift.share)
        drifts[name] = drift
        tables[name] = table
    far = outlying(tables[middle])
    drift = drifts[middle]
    check = check_pair(
        first[middle],
        second[middle],
        mask,
        drift=drift.levels if drift is not None and drift.is_small else None,
        outlying=far,
    )
    check = replace(
        check,
        channel_correlation=channel_correlation([*first.values()], [*second.values()], mask),
        outliers=float(tables[middle].counts[far].sum() / max(1, tables[middle].n_pairs)),
        drift=most,
        drift_share=share,
        resemblance=resemblance(tables[middle]),
    )
    for name, drift in drifts.items():
        if drift is not None and drift.is_small:
            tables[name] = compensated(tables[name], drift)
    return tables, check


def _explained(
    check: PairCheck,
    first: dict[str, Levels],
    second: dict[str, Levels],
    n_levels: int,
    mask: Bools | None,
) -> PairCheck:
    """Check whether unfit frames show one scene, and how far they are displaced."""
    middle = list(second)[len(second) // 2]
    match = compare_scenes(
        *(glimpse(planes[middle], n_levels - 1, mask) for planes in (first, second))
    )
    # Up to a pixel, least squares of the difference are the better measure.
    displacement = match.displacement if match.displacement > 1 else check.displacement
    return replace(check, one_scene=match.one_scene, displacement=displacement)


def dark_histograms(
    frames: Iterable[Frame], names: Collection[str], channels: str, n_levels: int
) -> dict[str, Counts]:
    """Count the levels in frames taken with the lens covered, by channel.

    Parameters
    ----------
    frames : iterable of Frame
        Any number of frames.
    names : collection of str
        Channels of the lit frames.
    channels, n_levels
        As for `noise_evidence`.

    Returns
    -------
    dict of str to ndarray of int64, shape (L,)
        Empty without frames.

    Raises
    ------
    UnfitFramesError
        If the channels are not those of the lit frames, or a frame is not dark.
    """
    histograms: dict[str, Counts] = {}
    for frame in frames:
        planes = planes_of(frame, channels, n_levels)
        if planes.keys() != set(names):
            msg = (
                f"{frame.path} has the channels {', '.join(planes)}, the lit frames "
                f"{', '.join(names)}: give dark frames of the same camera and settings"
            )
            raise UnfitFramesError(msg)
        for name, plane in planes.items():
            counts = np.bincount(plane.ravel(), minlength=n_levels).astype(np.int64)
            if np.median(plane) > _DARKEST * (n_levels - 1):
                msg = (
                    f"{frame.path} is not dark (median level {np.median(plane):.0f} of "
                    f"{n_levels - 1}): cover the lens"
                )
                raise UnfitFramesError(msg)
            histograms[name] = histograms[name] + counts if name in histograms else counts
    return histograms
