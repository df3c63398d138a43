"""Longest still part of a video, counted while it is read.

Each frame is compared with the one before; runs of frames between which nothing moved
are counted as they arrive, and the longest is kept. So the video is decoded once and
never stored. Still is meant as in module `screening`: a pair shows no sign of a shift,
of patches or of a change of brightness or, where there is no such run, it is at least
not refused.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np

from chartless.errors import UnfitFramesError
from chartless.evidence._pair_check import PairCheck
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.gather import NoiseEvidence, compare_pair
from chartless.evidence.noise.screening import doubts_about, unfit
from chartless.flags import Flag
from chartless.frames.channels import planes_of, require_alike, require_mask
from chartless.frames.frame import Frame, FrameSource, TimedFrame
from chartless.types import Bools, Levels

ENOUGH = 300
"""Frames of a still run after which reading stops: 10 seconds. More add hardly
anything."""
MOST = 20 * ENOUGH
"""Frames after which reading stops in any case: webcams never end."""
MOST_LEVELS = 256
"""Largest number of levels of a video, unless more are requested."""
_FEW = 10  # frames of a run without doubts, below which a longer one is used
_UNEVEN, _MOST_UNEVEN = 0.25, 0.05  # deviation of an interval from the usual one, share of such
_MOVED = {Flag.MOTION, Flag.STRUCTURED_DIFFERENCE, Flag.BRIGHTNESS_DRIFT}


@dataclass(slots=True)
class _Run:
    """Growing run of consecutive frames between which nothing moves."""

    first: int
    """Number of its first frame in the video, from 1."""
    start: float | None
    """Time of its first frame, in seconds."""
    last: int
    end: float | None
    n_frames: int = 1
    tables: dict[str, Cooccurrence] = field(default_factory=dict)
    checks: list[PairCheck] = field(default_factory=list)

    def __str__(self) -> str:
        frames = f"frames {self.first} to {self.last}"
        if self.start is None or self.end is None:
            return frames
        return f"{self.start:.2f} to {self.end:.2f} s ({frames})"


class _Longest:
    """Longest run of pairs that satisfy a condition, with the one that grows."""

    def __init__(self, is_still: Callable[[PairCheck], bool], time: float | None) -> None:
        self._is_still = is_still
        self._growing = self.run = _Run(1, time, 1, time)

    def add(
        self, number: int, time: float | None, pairs: dict[str, Cooccurrence], check: PairCheck
    ) -> None:
        """Add the next frame, compared with the one before."""
        if not self._is_still(check):
            self._growing = _Run(number, time, number, time)
            return
        run = self._growing
        run.last, run.end, run.n_frames = number, time, run.n_frames + 1
        for name, pair in pairs.items():
            run.tables[name] = run.tables[name] + pair if name in run.tables else pair
        run.checks.append(check)
        if run.n_frames > self.run.n_frames:
            self.run = run


def still_evidence(
    video: Iterable[TimedFrame],
    *,
    channels: str = "auto",
    n_levels: int | None = None,
    mask: Bools | None = None,
    sha256: str = "",
    on_frame: Callable[[Frame], None] | None = None,
) -> NoiseEvidence:
    """Count the level pairs of the longest part of a video in which nothing moves.

    Parameters
    ----------
    video : iterable of TimedFrame
        Consumed one by one; two are held. Reading stops after `ENOUGH` still frames, or `MOST`
        in all.
    channels, mask
        As for `chartless.evidence.noise.gather.noise_evidence`.
    n_levels : int, optional
        Levels are reduced to this many; by default to 256, or as many as the video has.
    sha256 : str
        Digest of the file.
    on_frame : callable, optional
        Called with each frame when it has been counted.

    Returns
    -------
    NoiseEvidence
        Evidence with the video as its only source, whose remarks give the seconds used.

    Raises
    ------
    UnfitFramesError
        If no two different frames follow each other without motion, if the frame rate varies,
        or as `chartless.evidence.noise.gather.noise_evidence` does.
    ParameterError
        If `channels` or `n_levels` does not suit the frames, or the mask their size.
    """
    before: dict[str, Levels] | None = None
    clear = fit = _Longest(_is_clear, None)
    seen = _Seen()
    for time, frame in _distinct(islice(video, MOST), seen):
        n_levels = min(MOST_LEVELS, frame.white + 1) if n_levels is None else n_levels
        planes = planes_of(frame, channels, n_levels)
        if before is None:
            require_mask(mask, frame)
            clear, fit = _Longest(_is_clear, time), _Longest(_is_fit, time)
        else:
            pairs, check = compare_pair(before, planes, n_levels, mask)
            clear.add(seen.n_frames, time, pairs, check)
            fit.add(seen.n_frames, time, pairs, check)
            seen.reason = unfit(check) or seen.reason
        before = planes
        if on_frame is not None:
            on_frame(frame)
        if clear.run.n_frames >= ENOUGH:
            break
    run = clear.run if clear.run.n_frames >= min(_FEW, fit.run.n_frames) else fit.run
    return _evidence(run, seen, sha256)


@dataclass(slots=True)
class _Seen:
    """State of the reading of a video."""

    last: Frame | None = None
    """Last frame that differs from the one before."""
    n_frames: int = 0
    n_repeated: int = 0
    times: list[float] = field(default_factory=list)
    reason: str = ""
    """Reason why two frames are not still, as given by
    `chartless.evidence.noise.screening.unfit`."""


def _distinct(video: Iterable[TimedFrame], seen: _Seen) -> Iterator[TimedFrame]:
    """Yield frames that differ from the one before, and update `seen`."""
    for timed in video:
        seen.n_frames += 1
        if timed.time is not None:
            seen.times.append(timed.time)
        if seen.last is not None:
            require_alike(seen.last, timed.frame)
            if np.array_equal(seen.last.levels, timed.frame.levels):
                seen.n_repeated += 1
                continue
        seen.last = timed.frame
        yield timed


def _evidence(run: _Run, seen: _Seen, sha256: str) -> NoiseEvidence:
    if seen.last is None:
        msg = "the video has no frames: record it again"
        raise UnfitFramesError(msg)
    path = seen.last.path
    if seen.n_repeated and seen.n_repeated == seen.n_frames - 1:
        msg = (
            f"{path}: all frames show identical pixels, so there is no noise to measure: record "
            "the camera itself, with little compression"
        )
        raise UnfitFramesError(msg)
    _require_steady(path, seen.times)
    if not run.checks:
        reason = f"the last two{seen.reason}" if seen.reason else "there is only one"
        msg = f"{path}: no two frames are still; {reason}"
        raise UnfitFramesError(msg)
    remarks = [*seen.last.remarks, f"used {run}, the longest still part of {seen.n_frames} read"]
    if seen.n_repeated:
        remarks.append(f"left out {seen.n_repeated} frames that repeat the previous one")
    source = FrameSource(
        path, sha256, tuple(remarks), (run.first, run.last), origin=seen.last.origin
    )
    checks = tuple(run.checks)
    return NoiseEvidence(run.tables, checks, seen.last.bit_depth, (source,), run.n_frames)


def _is_fit(check: PairCheck) -> bool:
    return unfit(check) is None


def _is_clear(check: PairCheck) -> bool:
    return unfit(check) is None and not doubts_about(check) & _MOVED


def _require_steady(path: Path, times: list[float]) -> None:
    """Refuse a varying frame rate: a camera that lengthens its intervals exposes for longer."""
    intervals = np.diff(times)
    if not intervals.size:
        return
    usual = float(np.median(intervals))
    uneven = np.abs(intervals - usual) > _UNEVEN * usual
    if uneven.mean() > _MOST_UNEVEN:
        msg = (
            f"{path}: the frame rate varies (intervals of {1e3 * intervals.min():.0f} to "
            f"{1e3 * intervals.max():.0f} ms), and with it perhaps the exposure: record at a "
            "constant rate, with the exposure set by hand"
        )
        raise UnfitFramesError(msg)
