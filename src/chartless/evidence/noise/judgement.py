"""Judgement of a search with level pairs of one exposure: fit, flags and bands."""

import numpy as np

from chartless.curves.space import AbstractCurveSpace, FreeCurve
from chartless.evidence.base import Judgement
from chartless.evidence.noise.account import GOOD_DEVIANCE, account_of_pairs
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.dark import std_with_dark
from chartless.evidence.noise.misfit import misfit_pattern
from chartless.evidence.noise.outliers import SOME_MOVERS
from chartless.evidence.noise.term import PairFit
from chartless.evidence.trust import NEARLY_NOTHING
from chartless.flags import Flag
from chartless.inference.estimate import CurveEstimate
from chartless.inference.posterior import Posterior

# Flagged where dark frames would narrow the band by a tenth: they narrow it by 0.3 % at
# most for twenty photographs, and by 13 % in the median for scenes without irradiance
# below 0.2, where the error itself fell from 0.017 to 0.007 (14 measured cameras,
# means).
_WORTH_DARK = 0.1


def judged_alone(
    estimate: CurveEstimate, posterior: Posterior, space: AbstractCurveSpace, pairs: LevelPairs
) -> Judgement:
    """Judge a search with level pairs alone: a misfit widens the bands.

    Pairs that count as next to nothing have no goodness of fit: the curve is not theirs.

    Parameters
    ----------
    estimate : CurveEstimate
    posterior : Posterior
    space : AbstractCurveSpace
    pairs : LevelPairs
    """
    (fit,) = posterior.best.mode.fits
    assert isinstance(fit, PairFit)
    if pairs.counts_as < NEARLY_NOTHING:
        return _discounted(estimate, pairs)
    deviance = fit.model.relative_deviance(fit.counts)
    widened = float(np.sqrt(max(1.0, deviance)))  # noise missing from the model
    estimate = estimate.scaled(widened)
    errors_by_dark = None
    if isinstance(space, FreeCurve) and not fit.counts.dark.any():
        with_dark = std_with_dark(posterior, space) * widened
        now, then = (float(np.sqrt(np.mean(std**2))) for std in (estimate.std, with_dark))
        errors_by_dark = now, then
    return _judged(estimate, pairs, fit, deviance, errors_by_dark)


def judged_beside(estimate: CurveEstimate, pairs: LevelPairs, fit: PairFit) -> Judgement:
    """Judge level pairs where other evidence determined the curve."""
    return _judged(estimate, pairs, fit, fit.model.relative_deviance(fit.counts), None)


def _discounted(estimate: CurveEstimate, pairs: LevelPairs) -> Judgement:
    outliers = pairs.still.fraction
    account = account_of_pairs(pairs.still.table, outliers=outliers, counts_as=pairs.counts_as)
    movers = (Flag.MOVERS,) if outliers > SOME_MOVERS else ()
    return Judgement(estimate, (Flag.NOISE_DISCOUNTED, *movers), (account,))


def _judged(
    estimate: CurveEstimate,
    pairs: LevelPairs,
    fit: PairFit,
    deviance: float,
    errors_by_dark: tuple[float, float] | None,
) -> Judgement:
    still, seen, is_poor = pairs.still, fit.counts.pairs, deviance > GOOD_DEVIANCE
    account = account_of_pairs(
        still.table,
        deviance=deviance,
        outliers=still.fraction,
        pattern=misfit_pattern(seen, fit.model.pairs * seen.sum()) if is_poor else None,
        counts_as=pairs.counts_as,
        errors_by_dark=errors_by_dark,
    )
    doubts = (
        (Flag.MISFIT, is_poor),
        (Flag.MOVERS, still.fraction > SOME_MOVERS),
        (Flag.DARK_LEVELS_UNSEEN, errors_by_dark is not None and _is_worth_it(*errors_by_dark)),
    )
    return Judgement(estimate, tuple(flag for flag, holds in doubts if holds), (account,))


def _is_worth_it(now: float, then: float) -> bool:
    """Whether dark frames are worth taking, by the errors without and with them."""
    return then < (1 - _WORTH_DARK) * now
