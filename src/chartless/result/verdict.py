"""How far to trust a calibration, in one word and the reasons for it.

The rule is here and nowhere else, so that reports, notebooks and programs say the same. Its limits
were measured on simulated cameras with planted faults (docs/design/0008-report.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from chartless.flags import Flag
from chartless.result.response import Response, Status
from chartless.types import Floats, JsonObject

GOOD_BAND = 0.02
"""Deviation of the inverse response up to which a curve is good: brackets of real cameras come
closer (docs/brackets.md), noise alone does if the sensor is known (docs/how-sure.md)."""
GOOD_WHITE = 0.02
"""Relative deviation of the light at white up to which a curve is good in scale as well."""
WORST_BAND = 0.045
"""Deviation above which a curve is no better than simply assuming sRGB, which is off by as much
(docs/brackets.md)."""
GRAVE = frozenset({Flag.MISFIT, Flag.CORRELATED_NOISE, Flag.DISAGREEMENT, Flag.NOT_MONOTONE})
"""Flags with which the band does not hold: MISFIT unless all fits are within their limits for that,
and the others always."""

_ASSUMED_WITHIN = "The curve is assumed, not measured: its band is the spread among cameras."
_NO_ERROR = "The error of this curve is unknown."
_ASSUMED = "The curve is assumed, not measured: its error for this camera is not known."
_MOST_CHIEF = 2


class Grade(Enum):
    """How far to trust a calibration; the value is what people are shown."""

    GOOD = "good"
    CARE = "usable with care"
    DISTRUST = "do not trust"


@dataclass(frozen=True, slots=True)
class Verdict:
    """A grade and why."""

    grade: Grade
    reasons: tuple[str, ...]
    """Sentences."""
    chief: tuple[str, ...]
    """Those of the reasons that decided the grade."""

    def __str__(self) -> str:
        return f"{self.grade.value}: {' '.join(self.reasons)}"

    @property
    def brief(self) -> str:
        """Grade and chief reasons, in one line."""
        return f"{self.grade.value}: {' '.join(self.chief[:_MOST_CHIEF])}"

    def to_json(self) -> JsonObject:
        """Grade and reasons as JSON types."""
        return {"grade": self.grade.value, "reasons": list(self.reasons)}


def deviation(std: Floats) -> float:
    """Root mean square of the deviations of g at the levels."""
    return float(np.sqrt(np.mean(std**2)))


def band(channels: Sequence[Response]) -> float | None:
    """Deviation of the channel that is known worst; None if none is known.

    That of the shape where it is known apart from the light at white.
    """
    stds = [
        response.inverse_lut_std if response.shape_std is None else response.shape_std
        for response in channels
    ]
    return max((deviation(std) for std in stds if std is not None), default=None)


def verdict(channels: Sequence[Response]) -> Verdict:
    """Judge the channels of a camera by the worst of them.

    Use with care a curve that is assumed. Do not trust one with a grave flag, or one that is known
    no better than to `WORST_BAND`. Use with care one that is flagged otherwise, that is known to
    more than `GOOD_BAND`, of which the light at white is known to more than `GOOD_WHITE`, that
    explains a kind of evidence no better than that kind calls good, in the channel that `typical`
    chooses, or of which no error or no goodness of fit is known. Others are good.

    Parameters
    ----------
    channels : sequence of Response
        At least one.

    Examples
    --------
    >>> from chartless import Response, named_curve
    >>> from chartless.result.response import Status
    >>> bare = Response(
    ...     name="Y", curve=named_curve("srgb"), noise=None, n_levels=256,
    ...     observed_levels=(0, 255), n_pairs=1, method="debevec", status=Status.CONVERGED,
    ... )
    >>> print(verdict([bare]))
    usable with care: The error of this curve is unknown.
    """
    grave = {flag for response in channels for flag in _grave(response)}
    other = {flag for response in channels for flag in response.flags} - grave
    known = band(channels)
    widest = known or 0.0
    white = max((each.white_std for each in channels if each.white_std is not None), default=None)
    what = "curve" if white is None else "shape of the curve"
    how_sure = f"The {what} is known to ± {widest:.3f} of the light at white"
    bad, doubtful, fine = [], [], []
    if known is not None and all(response.status is Status.ASSUMED for response in channels):
        reasons = (_ASSUMED_WITHIN, f"{how_sure}.", *_of_white(white))
        return Verdict(Grade.CARE, reasons, reasons)
    if grave:
        bad.append(f"A curve and its noise do not explain the pictures: {_listed(grave)}.")
    if widest > WORST_BAND:
        bad.append(f"{how_sure}, no better than guessing.")
    elif grave and known is not None:
        bad.append(f"The error may be several times the given ± {widest:.3f}.")
    elif widest > GOOD_BAND:
        doubtful.append(f"{how_sure}; a good one is known to ± {GOOD_BAND:g} or better.")
    elif known is not None:
        fine.append(f"{how_sure}.")
    doubtful += _of_white(white)
    if any(response.inverse_lut_std is None for response in channels):
        assumed = any(response.status is Status.ASSUMED for response in channels)
        doubtful.append(_ASSUMED if assumed else _NO_ERROR)
    if any(_is_untested(response) for response in channels):
        doubtful.append("Whether curve and noise explain the pictures was not tested.")
    doubtful += _remarks(channels)
    if other:
        doubtful.append(f"Doubtful: {_listed(other)}.")
    grade = Grade.DISTRUST if bad else Grade.CARE if doubtful else Grade.GOOD
    return Verdict(grade, (*bad, *fine, *doubtful), tuple(bad or doubtful or fine))


def known_verdict(channels: Sequence[Response]) -> Verdict | None:
    """Verdict for those who use a calibration; None where there is nothing to say.

    The files of other programs hold no error, nor do standards, so "usable with care" is true of
    every curve of theirs and would only teach people not to read the line. A fault of such a curve,
    for example that it falls somewhere, is said all the same.
    """
    judged = verdict(channels)
    bare = judged.chief in ((_NO_ERROR,), (_ASSUMED,))
    return None if is_foreign(channels) and bare else judged


def is_foreign(channels: Sequence[Response]) -> bool:
    """Whether the curves are from elsewhere: of no picture chartless saw a pixel."""
    return not any(response.n_pairs for response in channels)


def typical(channels: Sequence[Response], kind: str, code: str) -> Response | None:
    """Channel by whose fit of this kind and name all are judged; None if none is known.

    The middle one by that fit, of two the worse: fewer levels of one channel may be seen, and be
    noisier.
    """
    known = [
        (account[code], response)
        for response in channels
        for account in response.accounts
        if account.kind == kind and code in account
    ]
    ranked = sorted(known, key=lambda pair: pair[0])
    return ranked[len(ranked) // 2][1] if ranked else None


def _remarks(channels: Sequence[Response]) -> list[str]:
    """What fits remark that are not good in the typical channel."""
    fits = [
        (response, account.kind, fit)
        for response in channels
        for account in response.accounts
        for fit in account.fits
        if fit.remark and fit.good is not None and fit.value > fit.good
    ]
    return [
        fit.remark for response, kind, fit in fits if typical(channels, kind, fit.code) is response
    ]


def _of_white(std: float | None) -> list[str]:
    """What an uncertain white means, if it is one."""
    if std is None or std <= GOOD_WHITE:
        return []
    sentence = (
        f"The light at white, and with it one factor for all levels of a channel, is known to "
        f"± {std:.0%}: use only ratios of light, and balance the channels again."
    )
    return [sentence]


def _grave(response: Response) -> set[Flag]:
    limits = [(fit.value, fit.bad) for fit in response.fits if fit.bad is not None]
    slight = bool(limits) and all(value <= bad for value, bad in limits)
    mild = {Flag.MISFIT} if slight else set()
    if Flag.NOISE_DISCOUNTED in response.flags:  # the curve is not that of the noise
        mild |= {Flag.CORRELATED_NOISE}
    return {flag for flag in response.flags if flag in GRAVE - mild}


def _is_untested(response: Response) -> bool:
    """Whether the method gives no goodness of fit."""
    unknown = any(not each.fits for each in response.accounts)
    said = {Flag.MISFIT, Flag.NOISE_DISCOUNTED} & set(response.flags)
    return unknown and not said


def _listed(flags: set[Flag]) -> str:
    return ", ".join(flag.code.replace("-", " ") for flag in Flag if flag in flags)
