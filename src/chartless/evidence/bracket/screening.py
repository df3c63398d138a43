"""Screening of exposures: whether they are fit for calibration, and doubts."""

from itertools import pairwise

import numpy as np

from chartless.errors import UnfitFramesError
from chartless.evidence._limits import GOOD_COVERAGE, LEAST_COVERAGE, SUSPICIOUS
from chartless.evidence.bracket.gather import LEAST_STEP, BracketEvidence
from chartless.flags import Flag
from chartless.types import Counts, Floats, JsonObject

MOST_CLIPPED = 0.995
"""Share of black and white pixels above which an exposure is useless."""
LEAST_OVERLAP, GOOD_OVERLAP = 0.002, 0.05
"""Share of pixels between black and white that two neighbouring exposures must share:
below the first they are refused, below the second flagged."""
MOST_DISPLACED = 10.0
"""Largest displacement in pixels of neighbouring exposures compared pixel by pixel: at
10 the curve is off by 0.047 in the median, no better than assuming sRGB."""
SOME_UNALIGNED, MOST_UNALIGNED = 0.05, 0.1
"""Displacement as a share of the larger side above which exposures matched by rank are flagged,
and refused: at 0.01 curves are off by 0.005 in the median, at 0.05 by 0.013, at 0.1 by 0.03."""
SOME_MOVED = 0.03
"""Share of blocks that disagree above which exposures are flagged: 0 in real brackets, above it in
1 % of simulated pairs."""
_DARKER = 0.7  # share of the mean level of the shorter exposure
# Largest change of ln of the level, relative to that of ln of the exposure: 0.39 … 2.4
# in 700 simulated brackets with steps of 0.3 to 4 stops, 0.48 and more in real ones; in
# frames of one exposure said to be a stop apart, within 0.03 of 0 in 99 %, 0.065 at
# most.
_LEAST_RISE = 0.2
_FEW = 1e-4  # share of the pixels of an exposure from which a level counts as covered
_MOVED = 1.5  # pixels


def screen_bracket(evidence: BracketEvidence) -> dict[str, tuple[Flag, ...]]:
    """Refuse exposures from which nothing can be learned; flag what is doubtful.

    Returns
    -------
    dict of channel names to tuples of Flag

    Raises
    ------
    UnfitFramesError
        If nothing can be learned; the message says why and what to do.
    """
    for counts in evidence.histograms.values():
        _require_light(evidence, counts)
    _require_one_scene(evidence)
    _require_order(evidence)
    _require_overlap(evidence)
    common = _doubts(evidence)
    flags = {}
    for name, counts in evidence.histograms.items():
        covered = _coverage(counts)
        if covered < LEAST_COVERAGE:
            msg = (
                f"channel {name}: the exposures cover {covered:.0%} of the levels, too few "
                f"for a curve (least {LEAST_COVERAGE:.0%}): add longer or shorter exposures"
            )
            raise UnfitFramesError(msg)
        own = {*common, *([Flag.LEVELS_UNSEEN] if covered < GOOD_COVERAGE else [])}
        flags[name] = tuple(flag for flag in Flag if flag in own)
    return flags


def exposure_rows(evidence: BracketEvidence) -> list[JsonObject]:
    """Summary of each exposure, to be inspected before trusting a curve.

    Returns
    -------
    list of dict
        For each exposure, in order: ``file``; ``relative`` exposure as given; ``black`` and
        ``white``, shares of the pixels of all channels; ``overlap`` and ``displacement`` with the
        next exposure (share of pixels between black and white in both; pixels), None for the last.
    """
    relative = np.exp(evidence.log_exposures - evidence.log_exposures.min())
    following = [*evidence.overlaps, None]
    shifts = [*(_displacement(evidence, place) for place in range(len(evidence.overlaps))), None]
    return [
        {
            "file": str(source.path),
            "relative": float(relative[place]),
            "black": float(evidence.clipped[place, 0]),
            "white": float(evidence.clipped[place, 1]),
            "overlap": following[place],
            "displacement": shifts[place],
        }
        for place, source in enumerate(evidence.sources)
    ]


def _require_light(evidence: BracketEvidence, counts: Counts) -> None:
    clipped = (counts[:, 0] + counts[:, -1]) / np.maximum(counts.sum(axis=1), 1)
    if np.count_nonzero(clipped <= MOST_CLIPPED) < 2:  # noqa: PLR2004 - to compare
        worst = int(clipped.argmax())
        white = counts[worst, -1] > counts[worst, 0]
        colour, other = ("white", "shorter") if white else ("black", "longer")
        msg = (
            f"{evidence.sources[worst].path} is {clipped[worst]:.0%} {colour}: two exposures "
            f"must have unclipped pixels; give {other} ones"
        )
        raise UnfitFramesError(msg)


def _require_one_scene(evidence: BracketEvidence) -> None:
    """Refuse different scenes, and exposures too far displaced to be compared."""
    scenes = evidence.scenes
    if scenes is None:
        return
    mismatched = scenes.mismatched()
    if mismatched is not None:
        one, other = (evidence.sources[place].path for place in mismatched)
        msg = f"{one} and {other} do not show the same scene: give exposures of one scene"
        raise UnfitFramesError(msg)
    most = MOST_DISPLACED if evidence.aligned else MOST_UNALIGNED * scenes.width
    for place, (source, following) in enumerate(pairwise(evidence.sources)):
        displacement = scenes.displacement(place, place + 1)
        if displacement > most:
            msg = f"{source.path} and {following.path} are displaced by {displacement:.0f} pixels: "
            msg += (
                "use a tripod, align the frames first, or use unaligned matching (aligned=False)"
                if evidence.aligned
                else "give exposures that show the same part of the scene"
            )
            raise UnfitFramesError(msg)


def _displacement(evidence: BracketEvidence, place: int) -> float | None:
    """Displacement between an exposure and the next in pixels; None if not measured."""
    if evidence.scenes is not None:
        return evidence.scenes.displacement(place, place + 1)
    return evidence.checks[place].displacement if evidence.checks else None


def _require_order(evidence: BracketEvidence) -> None:
    """Refuse times that contradict the pictures."""
    order = np.argsort(evidence.log_exposures, kind="stable")
    for mean in _brightness(evidence):
        for shorter, longer in pairwise(order):
            if mean[longer] < _DARKER * mean[shorter]:
                _refuse_order(evidence, int(longer), int(shorter), "is darker")
    steps = np.diff(evidence.log_exposures)
    for place, (step, rise) in enumerate(zip(steps, evidence.brightenings, strict=True)):
        shows = evidence.overlaps[place] >= LEAST_OVERLAP
        if shows and abs(step) > LEAST_STEP and rise / step < _LEAST_RISE:
            longer, shorter = (place + 1, place) if step > 0 else (place, place + 1)
            _refuse_order(evidence, longer, shorter, "is hardly brighter")


def _brightness(evidence: BracketEvidence) -> list[Floats]:
    """Mean levels of the exposures, shape (K,) each.

    They are of whole frames where these were compared: histograms lack the pixels near
    white in lossy files, most of them in the longest exposures.
    """
    if evidence.scenes is not None:
        return [np.array(evidence.scenes.brightness)]
    return [
        counts @ np.arange(counts.shape[1]) / np.maximum(counts.sum(axis=1), 1)
        for counts in evidence.histograms.values()
    ]


def _refuse_order(evidence: BracketEvidence, longer: int, shorter: int, how: str) -> None:
    ratio = np.exp(evidence.log_exposures[longer] - evidence.log_exposures[shorter])
    msg = (
        f"{evidence.sources[longer].path} {how} than {evidence.sources[shorter].path}, though its "
        f"exposure is given as {ratio:.3g} times as long: check `times` and the order of the "
        "files, or give `evidence='noise'` if the exposure was the same"
    )
    raise UnfitFramesError(msg)


def _require_overlap(evidence: BracketEvidence) -> None:
    if max(evidence.overlaps) < LEAST_OVERLAP:
        msg = (
            "no two neighbouring exposures show a pixel between black and white in both: take "
            "exposures closer together"
        )
        raise UnfitFramesError(msg)


def _doubts(evidence: BracketEvidence) -> list[Flag]:
    shifts = [_displacement(evidence, place) or 0.0 for place in range(len(evidence.overlaps))]
    few = _MOVED
    if not evidence.aligned and evidence.scenes is not None:
        few = SOME_UNALIGNED * evidence.scenes.width
    moved = max(shifts) > few or any(
        check.displacement_share > 2 * SUSPICIOUS for check in evidence.checks
    )
    if evidence.scenes is not None:
        moved |= any(match.moved > SOME_MOVED for match in evidence.scenes.matches)
    doubts = (
        (Flag.MOTION, moved),
        (Flag.LITTLE_OVERLAP, min(evidence.overlaps) < GOOD_OVERLAP),
    )
    return [flag for flag, holds in doubts if holds]


def _coverage(counts: Counts) -> float:
    """Share of the range between the lowest and the highest level that an exposure shows."""
    inner = counts[:, 1:-1]
    enough = inner >= _FEW * counts.sum(axis=1, keepdims=True)
    (seen,) = np.nonzero(np.any(enough & (inner > 0), axis=0))
    return float(seen[-1] - seen[0] + 1) / inner.shape[1] if seen.size else 0.0
