"""Account of level pairs of one exposure: goodness of fit, and pairs left out."""

import numpy as np

from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.misfit import Pattern
from chartless.flags import Flag
from chartless.result.account import Account, Fact, Fit

NAME = "noise"
"""Name of this kind of evidence."""
WORST_DEVIANCE = 2.0
"""Misfit, in multiples of chance, up to which the band held in simulated cameras
(docs/design/0008-report.md)."""
GOOD_DEVIANCE = 1.5
"""Deviance, as a multiple of what chance gives, above which pairs are not explained."""


def account_of_pairs(
    table: Cooccurrence | None,
    *,
    deviance: float | None = None,
    similarity: float | None = None,
    outliers: float | None = None,
    pattern: Pattern | None = None,
    counts_as: float = np.inf,
    errors_by_dark: tuple[float, float] | None = None,
) -> Account:
    """Account of the level pairs of a channel.

    Parameters
    ----------
    table : Cooccurrence or None
        Table without outliers; None where it is not kept.
    deviance : float, optional
        Deviance of the pairs, relative to chance: 1 if the model explains them.
    similarity : float, optional
        Image similarity as a share of what the true model would reach on so many pixels, 0 … 1.
    outliers : float, optional
        Share of the pairs left out because they changed far more than noise explains.
    pattern : Pattern, optional
        Pattern of the differences from the model, where they are a misfit.
    counts_as : float
        Number of independent pairs that they count as at most.
    errors_by_dark : (float, float), optional
        Deviation of the inverse response now, and after two frames with the lens covered.
    """
    facts: list[Fact] = []
    fits: list[Fit] = []
    details: dict[str, str] = {}
    if outliers is not None:
        facts.append(Fact("outliers", "Excluded pairs", outliers, ".2%"))
    if deviance is not None:
        label = "Deviance of the level pairs, relative to chance"
        fits.append(Fit("deviance", label, deviance, ".2f", GOOD_DEVIANCE, WORST_DEVIANCE))
    if similarity is not None:
        label = "Image similarity, relative to the truth"
        fits.append(Fit("similarity", label, similarity, ".3f"))
    if np.isfinite(counts_as):
        facts.append(Fact("counts_as", "Pairs count as at most", counts_as, ".0f"))
    if pattern is not None:
        facts.append(Fact("pattern", "Pattern of the misfit", pattern.code))
        details[Flag.MISFIT.code] = f"the pattern is {pattern.code}: {pattern.advice}"
    if errors_by_dark is not None:
        now, then = errors_by_dark
        facts.append(Fact("error_with_dark", "Error of the light with dark frames", then, ".3f"))
        details[Flag.DARK_LEVELS_UNSEEN.code] = (
            f"two frames with the lens covered (`dark`) would bring the error from ± {now:.3f} to "
            f"± {then:.3f}"
        )
    return Account(kind=NAME, facts=tuple(facts), fits=tuple(fits), details=details, record=table)
