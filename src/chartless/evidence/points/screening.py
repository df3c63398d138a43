"""Screening of measured points: whether they determine a curve, and doubts."""

from collections.abc import Mapping

import numpy as np

from chartless._numeric.ranks import rank_correlation
from chartless.errors import UnfitFramesError
from chartless.evidence._limits import GOOD_COVERAGE, LEAST_COVERAGE
from chartless.evidence.points.gather import PointsEvidence
from chartless.flags import Flag

LEAST_POINTS = 4
"""Points of a channel, neither black nor white, below which they are refused."""
LEAST_ORDER = 0.8
"""Rank correlation of irradiance and brightness below which they do not belong together."""


def screen_points(evidence: PointsEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
    """Refuse points from which no curve can be estimated; flag what is doubtful.

    Parameters
    ----------
    evidence : PointsEvidence
    alone : bool
        Whether there is no other kind, which might show the levels missing from the
        points.

    Returns
    -------
    mapping from channel names to tuples of Flag

    Raises
    ------
    UnfitFramesError
        If no curve can be estimated; the message says why and what to do.
    """
    names = evidence.channels
    return {name: _screened(evidence, name, alone=alone) for name in names}


def _screened(evidence: PointsEvidence, name: str, *, alone: bool) -> tuple[Flag, ...]:
    points = evidence.channel(name)
    path, number = evidence.sources[0].path, points.n_pixels
    if number < LEAST_POINTS:
        msg = (
            f"{path}: channel {name}: {number} points are neither black nor white, too few "
            f"for a curve (least {LEAST_POINTS}): measure more"
        )
        raise UnfitFramesError(msg)
    used = points.is_used
    light = points.irradiance[used]
    if evidence.absolute and light.max() > 1:
        msg = (
            f"{path}: an irradiance is {light.max():.3g} where brightness is below white, but 1 is "
            "white: omit `points_absolute`, or divide by the irradiance of white"
        )
        raise UnfitFramesError(msg)
    if np.unique(light).size < LEAST_POINTS:
        msg = (
            f"{path}: channel {name}: fewer than {LEAST_POINTS} points differ in irradiance: add "
            "darker or brighter ones"
        )
        raise UnfitFramesError(msg)
    if rank_correlation(points.irradiance[used], points.brightness[used]) < LEAST_ORDER:
        msg = (
            f"{path}: channel {name}: brightness does not rise with irradiance: check the order of "
            "the columns, and that densities are turned into irradiance (10^-density)"
        )
        raise UnfitFramesError(msg)
    low, high = points.observed_levels
    coverage = (high - low) / (points.n_levels - 1)
    if alone and coverage < LEAST_COVERAGE:
        msg = (
            f"{path}: channel {name}: the points cover {coverage:.0%} of the brightness "
            f"range, too little for a curve (least {LEAST_COVERAGE:.0%}): add darker or "
            "brighter ones"
        )
        raise UnfitFramesError(msg)
    return (Flag.LEVELS_UNSEEN,) if alone and coverage < GOOD_COVERAGE else ()
