"""What a search means for level pairs of one exposure: goodness of fit, flags, and wider bands."""

from typing import Any

import numpy as np

from chartless.curves.space import AbstractCurveSpace, FreeCurve
from chartless.evidence._base import Judgement
from chartless.evidence.noise.dark import std_with_dark
from chartless.evidence.noise.misfit import misfit_pattern
from chartless.evidence.noise.outliers import SOME_MOVERS, Cleaned
from chartless.evidence.noise.term import PairFit
from chartless.flags import Flag
from chartless.inference.estimate import CurveEstimate
from chartless.inference.posterior import Posterior
from chartless.types import Floats

# Deviance, as a multiple of what chance gives, above which pairs are not explained.
_POOR = 1.5
# Flagged where dark frames would narrow the band by a tenth: that of twenty photographs by 0.3 % at
# most, of scenes without anything below an irradiance of 0.2 by 13 % in the median; the error
# itself fell from 0.017 to 0.007 there (14 measured cameras, means).
_WORTH_DARK = 0.1


def judged_alone(
    estimate: CurveEstimate, posterior: Posterior, space: AbstractCurveSpace, still: Cleaned
) -> Judgement:
    """Judge a search that had level pairs alone: a misfit widens the bands.

    Parameters
    ----------
    estimate : CurveEstimate
    posterior : Posterior
    space : AbstractCurveSpace
    still : Cleaned
        The table of the pairs, without what moved.
    """
    (fit,) = posterior.best.mode.fits
    assert isinstance(fit, PairFit)
    findings, flags = _told(still, fit)
    widened = float(np.sqrt(max(1.0, findings["deviance"])))  # noise that the model does not know
    estimate = estimate.scaled(widened)
    if isinstance(space, FreeCurve) and not fit.counts.dark.any():
        with_dark = std_with_dark(posterior, space) * widened
        findings["inverse_lut_std_with_dark"] = with_dark
        if _worth(estimate.std, with_dark):
            flags = (*flags, Flag.DARK_LEVELS_UNSEEN)
    return Judgement(estimate, flags, findings)


def judged_beside(estimate: CurveEstimate, still: Cleaned, fit: PairFit) -> Judgement:
    """Judge level pairs of which the curve was told by other evidence."""
    findings, flags = _told(still, fit)
    return Judgement(estimate, flags, findings)


def _told(still: Cleaned, fit: PairFit) -> tuple[dict[str, Any], tuple[Flag, ...]]:
    pairs = fit.counts.pairs
    deviance = fit.model.relative_deviance(fit.counts)
    pattern = misfit_pattern(pairs, fit.model.pairs * pairs.sum()) if deviance > _POOR else None
    findings = {
        "deviance": deviance,
        "pattern": pattern,
        "outliers": still.fraction,
        "table": still.table,
    }
    doubts = ((Flag.MISFIT, deviance > _POOR), (Flag.MOVERS, still.fraction > SOME_MOVERS))
    return findings, tuple(flag for flag, holds in doubts if holds)


def _worth(std: Floats, with_dark: Floats) -> bool:
    """Whether dark frames are worth taking, by root mean squares."""
    return float(np.linalg.norm(with_dark)) < (1 - _WORTH_DARK) * float(np.linalg.norm(std))
