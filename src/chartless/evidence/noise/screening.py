"""Screening of frames: whether they are fit for calibration, and doubts.

Calibration by noise uses the difference of two frames, which must be pixel noise and
nothing else. So each check measures the share of the squared difference that something
else explains: the frames were displaced, the brightness changed, patches of the scene
moved. A share above `GROSS` is refused, one above `SUSPICIOUS` flagged.

Effects that are corrected later count less here: patches and neighbours are measured
without the drift of brightness (module `drift`) and without the pixels that changed far
more than noise explains (`outliers`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from chartless.errors import UnfitFramesError
from chartless.evidence._limits import GOOD_COVERAGE, LEAST_COVERAGE, MANY_CLIPPED, SUSPICIOUS
from chartless.evidence._pair_check import PairCheck
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.drift import LARGE, drift_share
from chartless.evidence.noise.outliers import SOME_MOVERS, without_outliers
from chartless.flags import Flag

GROSS = 0.5
"""Share of the difference explained by something other than noise above which frames
are refused."""
DRIFTING = 0.02
"""Share explained by a change of brightness above which frames are flagged: 5 % in
bright parts."""
CORRELATED = 0.15
"""Correlation of noise between neighbours or channels above which frames are flagged;
raw has 0."""
MOST_MOVERS = 0.1
"""Share of pixels that changed far more than noise explains, above which frames are refused."""
LEAST_RESEMBLANCE = 0.25
"""Correlation of the levels of two frames below which they show no common scene, and are refused.

Of 153 pairs of different photographs, those that pass every other check have 0.05 at
most; at this limit noise has three times the variance of the scene."""
EMPTY = 0.04
"""Share of unused levels between used ones above which frames are flagged."""
MOST_CLIPPED = 0.9
"""Share of black and white pixels above which frames are refused."""
LEAST_PAIRS, FEW_PAIRS = 10, 100
"""Numbers of pairs per level below which frames are refused, and flagged."""
LEAST_NOISE = 0.3
"""Noise deviation in steps between used levels below which rounding hides most of it.

Rounding itself has 0.29."""
_MOVED = 0.5  # pixels
_COMB, _EXPECTED = 16, 10  # levels on either side, pixels at each: no chance gaps
_RARE = 1e-3  # share of pixels at either end that do not count as covered levels


def empty_share(table: Cooccurrence) -> float:
    """Share of unused levels among those whose neighbours are used.

    A picture stretched by a factor s, or of fewer bits than its file, leaves 1 − 1/s of its
    levels empty, like a comb. A level counts if the 16 on either side average 10 pixels:
    between two patches of a chart levels are empty for another reason.
    """
    histogram = table.histogram
    sums = np.concatenate([[0], np.cumsum(histogram)])
    level = np.arange(table.n_levels)
    below = sums[level] - sums[np.maximum(level - _COMB, 0)]
    above = sums[np.minimum(level + _COMB + 1, table.n_levels)] - sums[level + 1]
    counted = np.minimum(below, above) >= _COMB * _EXPECTED
    n_empty = int(np.count_nonzero(counted & (histogram == 0)))
    return n_empty / max(1, int(np.count_nonzero(counted)))


def resemblance(table: Cooccurrence) -> float:
    """Correlation of the levels of pixels in one frame and in the next.

    For frames of one still scene it is the scene's share of the variance, for different
    scenes about 0. Where the levels cover too little, as in a dark frame, it is 1, as
    only noise can be observed.
    """
    low, high = covered_levels(table)
    if high - low < LEAST_COVERAGE * (table.n_levels - 1):
        return 1.0
    level = np.arange(table.n_levels)
    n_pixels = float(table.n_pairs)
    earlier, later = table.counts.sum(axis=1), table.counts.sum(axis=0)
    means = earlier @ level / n_pixels, later @ level / n_pixels
    products = float(level @ (table.counts @ level)) / n_pixels - means[0] * means[1]
    variances = [
        float(each @ (level - mean) ** 2) / n_pixels
        for each, mean in zip((earlier, later), means, strict=True)
    ]
    return float(products / max(np.sqrt(variances[0] * variances[1]), 1e-9))


def covered_levels(table: Cooccurrence) -> tuple[int, int]:
    """Lowest and highest level of the scene, leaving out the rarest 0.1 % at either end."""
    cumulative = np.cumsum(table.histogram) / max(1, 2 * table.n_pairs)
    low = int(np.searchsorted(cumulative, _RARE))
    high = int(np.searchsorted(cumulative, 1.0 - _RARE))
    return low, min(high, table.n_levels - 1)


def screen(
    tables: Mapping[str, Cooccurrence],
    checks: Sequence[PairCheck],
    *,
    covering: bool = True,
    lossy: bool = False,
) -> Mapping[str, tuple[Flag, ...]]:
    """Refuse frames from which nothing can be learned; flag what is doubtful.

    Parameters
    ----------
    tables : mapping from channel names to Cooccurrence
    checks : sequence of PairCheck
        One per pair of consecutive frames, in their order.
    covering : bool
        Whether the levels must cover enough of the range.
    lossy : bool
        Whether compression changed the noise.

    Returns
    -------
    mapping from channel names to tuples of Flag

    Raises
    ------
    UnfitFramesError
        If nothing can be learned; the message says why and what to do.
    """
    for number, check in enumerate(checks, start=1):
        if not check.one_scene:
            _refuse(number, check)
    own = {name: _screen_table(name, table, covering) for name, table in tables.items()}
    common = _screen_frames(checks) | ({Flag.COMPRESSED} if lossy else set())
    return {
        name: tuple(flag for flag in Flag if flag in common.union(flags))
        for name, flags in own.items()
    }


def _screen_frames(checks: Sequence[PairCheck]) -> set[Flag]:
    doubts: set[Flag] = set()
    for number, check in enumerate(checks, start=1):
        _refuse(number, check)
        doubts |= doubts_about(check)
    return doubts


def _refuse(number: int, check: PairCheck) -> None:
    """Refuse a frame and the next if nothing can be learned from them."""
    reason = unfit(check)
    if reason is not None:
        msg = f"frames {number} and {number + 1}{reason}"
        raise UnfitFramesError(msg)


def unfit(check: PairCheck) -> str | None:  # noqa: PLR0911 - a reason each
    """Reason why frames are unfit, as the end of a sentence; None if they are fit."""
    if not check.one_scene:
        return (
            " do not show the same scene: give frames of one still scene, taken with one exposure"
        )
    moved = check.displacement > _MOVED and check.displacement_share > SUSPICIOUS
    if moved or check.displacement_share > GROSS:
        return (
            f" are displaced by about {check.displacement:.1f} pixels: the camera or "
            "the scene moved; use a tripod and a self-timer"
        )
    if check.drift > LARGE and check.drift_share > GROSS:
        return (
            f": the brightness changed ({check.drift:.0%} of the levels), or they show different "
            "scenes: fix exposure and white balance by hand and use steady light; for a bracket, "
            "give `times`, or `times='unknown'`"
        )
    if check.outliers > MOST_MOVERS:
        return (
            f": {check.outliers:.0%} of the pixels changed far more than noise "
            "explains: something moved; photograph a still scene"
        )
    if check.patch_share > GROSS:
        return (
            f" differ in large patches ({check.patch_share:.0%} of their difference): "
            "something moved or the light changed; photograph a still scene in steady light"
        )
    if check.resemblance < LEAST_RESEMBLANCE:
        return (
            f" have hardly anything in common (correlation {max(check.resemblance, 0):.2f}): they "
            "show different scenes, or noise hides the scene; photograph one still scene in more "
            "light"
        )
    return None


def doubts_about(check: PairCheck) -> set[Flag]:
    """Flags of two frames that are fit."""
    doubts = (
        (Flag.MOTION, check.displacement_share, SUSPICIOUS),
        (Flag.STRUCTURED_DIFFERENCE, check.patch_share, SUSPICIOUS),
        (Flag.CORRELATED_NOISE, check.neighbour_correlation, CORRELATED),
        (Flag.CORRELATED_CHANNELS, check.channel_correlation, CORRELATED),
        (Flag.BRIGHTNESS_DRIFT, check.drift_share, DRIFTING),
        (Flag.MOVERS, check.outliers, SOME_MOVERS),
    )
    return {flag for flag, measured, limit in doubts if measured > limit}


def _screen_table(name: str, table: Cooccurrence, covering: bool) -> list[Flag]:  # noqa: FBT001
    counts, top = table.counts, table.n_levels - 1
    if table.n_pairs == 0:
        msg = "the mask leaves no pixels to compare"
        raise UnfitFramesError(msg)
    per_level = table.n_pairs / np.count_nonzero(table.histogram)
    black, white = (float(table.histogram[end]) / (2 * table.n_pairs) for end in (0, top))
    if black + white > MOST_CLIPPED:
        which = "black" if black > white else "saturated"
        msg = (
            f"channel {name}: {black + white:.0%} of the pixels are clipped, most of them "
            f"{which}: change the exposure so that the scene fills the range"
        )
        raise UnfitFramesError(msg)
    if np.trace(counts) == table.n_pairs:
        msg = (
            f"channel {name}: the frames are identical, so there is no noise to measure: give "
            "different shots of the scene, not one picture twice"
        )
        raise UnfitFramesError(msg)
    if per_level < LEAST_PAIRS:
        msg = (
            f"channel {name}: {table.n_pairs} pairs of pixels are too few for "
            f"{np.count_nonzero(table.histogram)} levels: give larger frames"
        )
        raise UnfitFramesError(msg)
    low, high = covered_levels(table)
    coverage = (high - low) / top
    if covering and coverage < LEAST_COVERAGE:
        msg = (
            f"channel {name}: levels {low} to {high} of 0 to {top} cover {coverage:.0%} of the "
            f"range, too little for a curve (least {LEAST_COVERAGE:.0%}): photograph a "
            "scene with both dark and bright parts"
        )
        raise UnfitFramesError(msg)
    still = without_outliers(table).table
    empty = empty_share(table)
    drift = drift_share(still)
    if drift > GROSS:
        msg = (
            f"channel {name}: the brightness changed between frames ({drift:.0%} of their "
            "difference), or they show different scenes: fix exposure and white balance by hand "
            "and use steady light; for a bracket, give `times`, or `times='unknown'`"
        )
        raise UnfitFramesError(msg)
    doubts = (
        (Flag.BRIGHTNESS_DRIFT, drift > DRIFTING),
        (Flag.LEVELS_UNSEEN, coverage < GOOD_COVERAGE),
        (Flag.CLIPPED, black + white > MANY_CLIPPED),
        (Flag.FEW_PIXELS, per_level < FEW_PAIRS),
        (Flag.EMPTY_LEVELS, empty > EMPTY),
        (Flag.LOW_NOISE, _noise_in_levels(still) * (1 - empty) < LEAST_NOISE),
    )
    return [flag for flag, holds in doubts if holds]


def _noise_in_levels(table: Cooccurrence) -> float:
    """Root mean square of the noise of one frame, in levels, rounding included."""
    level = np.arange(table.n_levels)
    squared = (level[:, np.newaxis] - level) ** 2
    return float(np.sqrt((table.counts * squared).sum() / table.n_pairs / 2))
