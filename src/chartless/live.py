"""Evidence from a running camera: frames arrive one by one, old pairs are dropped.

Each frame is compared with the previous one. Pairs between which something moved are
left out. The others are counted into a ring of a few blocks, each a table of integers,
and the oldest block is dropped as a whole: the evidence is exactly the sum of the
tables of the pairs kept.

A camera left to itself changes its exposure. That is useful: the curve stays the same,
and the noise depends on the brightness alone, so pairs before and after add up and show
more of the range. A change of gain is harmful: it changes the noise at all brightnesses
(noise variance uI + v becomes g u I + g² v), and the sum of both tables would bend the
curve. So the noise of each pair is compared with that of the oldest, and once it
differs all earlier pairs are dropped. In simulated cameras the noise levels of equal
gain agree within 4 %, whatever the scene and the exposure; a gain of 1.1 changes them
by 16 %; pairs of gains 1 and 2 together gave errors up to three times the band.
"""

from collections import Counter, deque
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from chartless._numeric.threads import one_blas_thread
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence._pair_check import PairCheck
from chartless.evidence.noise.cooccurrence import Cooccurrence, difference_moments
from chartless.evidence.noise.gather import NoiseEvidence, compare_pair
from chartless.evidence.noise.outliers import difference_deviation
from chartless.evidence.noise.screening import doubts_about, screen, unfit
from chartless.evidence.noise.still import MOST_LEVELS
from chartless.flags import Flag
from chartless.frames.channels import planes_of, require_alike
from chartless.frames.frame import Frame
from chartless.methods import NoiseLevelSearch
from chartless.result.calibration import Calibration
from chartless.result.provenance import provenance
from chartless.result.verdict import GRAVE, WORST_BAND, Grade, band, verdict
from chartless.types import Floats, Levels

WINDOW = 100
"""Default number of pairs of frames kept: more add little."""
LEAST = 10
"""Fewest pairs for a curve to be good enough: a single one may be lucky."""
_BLOCKS = 5
_MOVED = {Flag.MOTION, Flag.STRUCTURED_DIFFERENCE}
# Change of the log noise variance: median over the brightnesses that both pairs show.
_OTHER_GAIN = 0.25
_FEWEST_PAIRS, _FEWEST_SUMS = 100, 16  # pairs of pixels per noise level; noise levels


class Outcome(Enum):
    """Outcome of adding a frame; people are shown the value."""

    FIRST = "no earlier frame to compare with"
    USED = "used"
    RESTARTED = "the noise changed: earlier frames are dropped"
    """The frame was used as the first after a restart."""
    MOVED = "something moved"
    LIGHT_CHANGED = "the light changed"
    REPEATED = "repeats the previous one"

    @property
    def is_used(self) -> bool:
        """Whether the frame and the one before it were counted."""
        return self in {Outcome.USED, Outcome.RESTARTED}


class _NoiseLevel(NamedTuple):
    """Noise of a pair at each sum of two levels, shape (2L − 1,)."""

    pixels: Floats
    deviation: Floats

    def differs(self, other: "_NoiseLevel") -> bool:
        """Whether the noise differs at the brightnesses that both show."""
        both = np.minimum(self.pixels, other.pixels) >= _FEWEST_PAIRS
        both[[0, -1]] = False  # clipped
        if np.count_nonzero(both) < _FEWEST_SUMS:
            return False
        change = 2 * np.log(self.deviation[both] / other.deviation[both])
        return bool(abs(np.median(change)) > _OTHER_GAIN)


@dataclass(slots=True)
class _Block:
    """Pairs that are dropped together."""

    first: int
    """Number of the first frame."""
    last: int
    noise: _NoiseLevel
    """Noise of the first pair."""
    tables: dict[str, Cooccurrence]
    checks: list[PairCheck]


class LiveEvidence:
    """Level pairs of the latest frames of a camera, in constant memory.

    Not thread-safe.

    Parameters
    ----------
    channels : str
        "auto" (those of the frames), "rgb" or "luma".
    n_levels : int, optional
        Number of levels after reduction. By default 256 or as many as the frames have.
    window : int
        Most pairs kept, at least `LEAST`. A fifth is dropped at a time.

    Raises
    ------
    ParameterError
        If `window` is less than `LEAST`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from chartless import AffineNoise, named_curve, simulate_frames
    >>> scene = np.random.default_rng(1).uniform(size=(300, 400, 1))
    >>> noise = AffineNoise.of_sensor(1_500, 5)
    >>> live = LiveEvidence()
    >>> for levels in simulate_frames(scene, named_curve("srgb"), noise, n_frames=4):
    ...     outcome = live.add(Frame(Path("camera"), levels))
    >>> outcome, live.n_frames, live.n_kept
    (<Outcome.USED: 'used'>, 4, 3)
    >>> calibration = live_calibration(live)
    >>> abs(calibration.channel("Y").curve.response(0.18) - 0.46) < 0.08
    np.True_
    """

    def __init__(
        self, *, channels: str = "auto", n_levels: int | None = None, window: int = WINDOW
    ) -> None:
        if window < LEAST:
            msg = f"the window must hold {LEAST} pairs of frames or more, not {window}"
            raise ParameterError(msg)
        self.channels, self.n_levels, self.window = channels, n_levels, window
        self.outcomes: Counter[Outcome] = Counter()
        """Number of frames by outcome."""
        self.last: Frame | None = None
        """The latest frame."""
        self._planes: dict[str, Levels] = {}
        self._blocks: deque[_Block] = deque(maxlen=_BLOCKS)

    @property
    def n_frames(self) -> int:
        """Number of frames added."""
        return self.outcomes.total()

    @property
    def n_used(self) -> int:
        """Number of pairs counted, including those dropped since."""
        return sum(count for outcome, count in self.outcomes.items() if outcome.is_used)

    @property
    def n_kept(self) -> int:
        """Number of pairs of frames in the evidence."""
        return sum(len(block.checks) for block in self._blocks)

    @property
    def account(self) -> str:
        """Outcomes of the frames in words; `evidence` raises if none is used."""
        restarts = self.outcomes[Outcome.RESTARTED]
        parts = (
            f"{self.n_frames} frames, {self.n_used} pairs used",
            f"the last {self.n_kept} kept" if self.n_kept < self.n_used else "",
            f"left out: {self._left_out}" if self._left_out and self.n_kept else "",
            f"restarted {restarts} times because the noise changed" if restarts else "",
        )
        return "; ".join(part for part in parts if part)

    @property
    def _left_out(self) -> str:
        return ", ".join(
            f"{outcome.value} {self.outcomes[outcome]}×"
            for outcome in (Outcome.MOVED, Outcome.LIGHT_CHANGED, Outcome.REPEATED)
            if self.outcomes[outcome]
        )

    def add(self, frame: Frame) -> Outcome:
        """Compare a frame with the previous one and count the pair.

        Parameters
        ----------
        frame : Frame
            Frame from a file or an array: ``Frame(Path("camera"), levels)``. It is kept
            until the next one arrives, so its levels must not change.

        Returns
        -------
        Outcome

        Raises
        ------
        UnfitFramesError
            If its size, channels or bit depth differ from those of the frames before;
            the evidence stays as it is.
        ParameterError
            If `channels` or `n_levels` does not fit the frame.
        """
        outcome = self._compared(frame)
        self.outcomes[outcome] += 1
        return outcome

    def _compared(self, frame: Frame) -> Outcome:
        if self.last is None:
            self.n_levels = self.n_levels or min(MOST_LEVELS, frame.white + 1)
        else:
            require_alike(self.last, frame, one_exposure=False)
            if np.array_equal(self.last.levels, frame.levels):
                return Outcome.REPEATED
        assert self.n_levels is not None
        before, planes = self._planes, planes_of(frame, self.channels, self.n_levels)
        self.last, self._planes = frame, planes
        if not before:
            return Outcome.FIRST
        tables, check = compare_pair(before, planes, self.n_levels, None)
        doubts = doubts_about(check)
        if unfit(check) is not None or doubts & _MOVED:
            return Outcome.LIGHT_CHANGED if Flag.BRIGHTNESS_DRIFT in doubts else Outcome.MOVED
        return self._count(tables, check)

    def _count(self, tables: dict[str, Cooccurrence], check: PairCheck) -> Outcome:
        middle = tables[list(tables)[len(tables) // 2]]
        pixels, _, _ = difference_moments(middle.counts)
        noise = _NoiseLevel(pixels, difference_deviation(middle))
        outcome = Outcome.USED
        if self._blocks and noise.differs(self._blocks[0].noise):
            self._blocks.clear()
            outcome = Outcome.RESTARTED
        if not self._blocks or len(self._blocks[-1].checks) == self.window // _BLOCKS:
            number = self.n_frames
            self._blocks.append(_Block(number, number + 1, noise, tables, [check]))
            return outcome
        block = self._blocks[-1]
        block.last = self.n_frames + 1
        block.tables = {name: table + tables[name] for name, table in block.tables.items()}
        block.checks.append(check)
        return outcome

    def evidence(self) -> NoiseEvidence:
        """Sum of the tables kept.

        Returns
        -------
        NoiseEvidence
            Evidence with one source, whose remarks give the number of frames used.

        Raises
        ------
        UnfitFramesError
            If there is no pair yet.
        """
        if self.last is None:
            msg = "there are no frames yet: connect the camera"
            raise UnfitFramesError(msg)
        if not self._blocks:
            reason = self._left_out or "there is only one"
            msg = (
                f"{self.last.path}: no two frames are still ({reason}): put the camera on a tripod "
                "in front of a still scene in steady light"
            )
            raise UnfitFramesError(msg)
        first, *others = self._blocks
        tables = first.tables
        for block in others:
            tables = {name: table + block.tables[name] for name, table in tables.items()}
        checks = tuple(check for block in self._blocks for check in block.checks)
        source = replace(
            self.last.source,
            remarks=(*self.last.remarks, self.account),
            span=(first.first, self._blocks[-1].last),
            n_used=len(checks) + 1,
        )
        return NoiseEvidence(tables, checks, self.last.bit_depth, (source,), len(checks) + 1)


def live_calibration(live: LiveEvidence) -> Calibration:
    """Calibrate from the noise level of the pairs kept, in milliseconds per channel.

    Parameters
    ----------
    live : LiveEvidence

    Returns
    -------
    Calibration
        Calibration by the method nlf.

    Raises
    ------
    UnfitFramesError
        If nothing can be learned from the frames so far; the message says what to do.
    """
    evidence = live.evidence()
    flags = screen(evidence.tables, evidence.checks)
    search = NoiseLevelSearch()
    with one_blas_thread():
        responses = tuple(
            search.calibrate(evidence.channel(name), channel=name).with_flags(*flags[name])
            for name in evidence.channels
        )
    settings = {
        "method": search.method,
        "model": search.family,
        "evidence": "noise of a running camera",
        "channels": live.channels,
        "levels": live.n_levels,
        "window": live.window,
        **search.settings,
    }
    return Calibration(
        channels=responses,
        bit_depth=evidence.bit_depth,
        provenance=provenance(evidence.sources, settings, responses),
    )


def is_enough(live: LiveEvidence, calibration: Calibration, until: float = WORST_BAND) -> bool:
    """Whether to stop and save: enough pairs, no grave flag, a band of at most `until`.

    Parameters
    ----------
    live : LiveEvidence
    calibration : Calibration
        Calibration from `live`.
    until : float
        Largest band, see `chartless.result.verdict.band`.
    """
    return not lacking(live, calibration, until)


def lacking(live: LiveEvidence, calibration: Calibration, until: float = WORST_BAND) -> str:
    """Reason not to stop and save yet, and whether more frames can help.

    Parameters
    ----------
    live, calibration, until
        As for `is_enough`.

    Returns
    -------
    str
        Reason, empty if there is none.
    """
    known = band(calibration.channels)
    if live.n_kept < LEAST:
        return f"not good enough yet: fewer than {LEAST} pairs"
    if known is None:
        return "not good enough: its error is unknown"
    if known <= WORST_BAND and verdict(calibration.channels).grade is Grade.DISTRUST:
        grave = [flag for flag in Flag if flag in GRAVE and flag in calibration.flags]
        reasons = ", ".join(flag.code.replace("-", " ") for flag in grave)
        return f"not good enough, and more frames will hardly help: {reasons}"
    wanted = min(until, WORST_BAND)
    return "" if known <= wanted else f"not good enough yet: the error is above ± {wanted:g}"
