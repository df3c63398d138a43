"""Judgement of a search with measured points: factor, scatter and flags."""

import numpy as np

from chartless.evidence.base import Judgement
from chartless.evidence.points.account import SeenPoints, account_of_points, doubts
from chartless.evidence.points.term import PointFit, PointTerm, points_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate

# Between points the prior expects smoother curves than digital cameras have. Factor on
# the deviations of the likelihood: doubled, they held at 0.99 of the levels of sixty
# cameras (benchmarks/together.py).
_TIMES = 2.0
# Deviation of the light above the brightest point, as a share of what the prior expects there.
_UNSEEN = 1.0


def judged(
    estimate: CurveEstimate, found: ChannelMode, term: PointTerm, *, unit: float
) -> Judgement:
    """Judge a search.

    Parameters
    ----------
    estimate, found, term
        As for `AbstractCurveEvidence.judged`.
    unit : float
        Irradiance in the table that the term takes as 1.
    """
    scale, scatter = np.exp(found.mode.values[points_name(found.channel)])
    model = term.model
    if not term.absolute:  # the estimated curve is a mean, with another factor
        scale = np.median(estimate.curve.inverse(model.brightness) / model.irradiance)
    seen = SeenPoints(tuple((scale * model.irradiance).tolist()), tuple(model.brightness.tolist()))
    account = account_of_points(seen=seen, white=unit / float(scale), scatter=float(scatter))
    estimate = estimate.scaled(_TIMES)
    alone = all(isinstance(fit, PointFit) for fit in found.mode.fits)
    if alone and not term.absolute:  # other evidence may show what points do not
        unseen = 1.0 - float(estimate.curve.inverse(model.brightness.max()))
        estimate = estimate.with_white_error(_UNSEEN * unseen)
    return Judgement(estimate, doubts(account), (account,))
