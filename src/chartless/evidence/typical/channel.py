"""Levels of pictures in one channel, which do not constrain the curve."""

from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import SampledCurve
from chartless.curves.prior import Population
from chartless.evidence.base import AbstractCurveEvidence, Judgement
from chartless.evidence.typical.account import NAME, account_of_levels
from chartless.evidence.typical.term import ConstantTerm
from chartless.flags import Flag
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.posterior import at_levels
from chartless.inference.term import AbstractTerm
from chartless.types import Indices


@final
@dataclass(frozen=True, slots=True, eq=False)
class Levels(AbstractCurveEvidence):
    """Histogram of the levels of pictures.

    Parameters
    ----------
    histogram : ndarray of int, shape (L,)
    """

    kind: ClassVar[str] = NAME
    constrains: ClassVar[bool] = False
    population: ClassVar[Population] = Population.DIGITAL

    histogram: Indices

    @property
    @override
    def n_levels(self) -> int:
        return self.histogram.size

    @property
    @override
    def observed_levels(self) -> tuple[int, int]:
        seen = np.flatnonzero(self.histogram)
        return int(seen[0]), int(seen[-1])

    @property
    @override
    def n_pixels(self) -> int:
        return int(self.histogram.sum())

    @override
    def term(self, channel: str, *, noise_known: bool) -> ConstantTerm:
        del noise_known
        return ConstantTerm(channel)

    @override
    def start(self, channel: str, edges: object) -> Values:
        del channel, edges
        return {}

    @override
    def judged(self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm) -> Judgement:
        del term
        black, white = (float(self.histogram[end] / self.n_pixels) for end in (0, -1))
        account = account_of_levels(black=black, white=white)
        # The typical curve is that of the mean log slopes. The mean of light is not: where
        # little is known, next to white, it is drawn up by the steepest curves.
        curve = SampledCurve.from_inverse(at_levels(found.edges))
        light = curve.inverse(np.linspace(0.0, 1.0, self.n_levels))
        typical = replace(estimate, curve=curve, inverse_lut=light)
        return Judgement(typical, (Flag.NO_EVIDENCE,), (account,))
