"""Levels of pictures in one channel, which do not constrain the curve."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.evidence.base import AbstractCurveEvidence, Judgement
from chartless.evidence.typical.account import NAME, account_of_levels
from chartless.flags import Flag
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.constant import ConstantTerm, with_mode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.term import AbstractTerm
from chartless.types import Indices


@final
@dataclass(frozen=True, slots=True, eq=False)
class LevelCounts(AbstractCurveEvidence):
    """Histogram of the levels of pictures.

    Parameters
    ----------
    histogram : ndarray of int, shape (L,)
    """

    kind: ClassVar[str] = NAME
    constrains: ClassVar[bool] = False

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
        typical = with_mode(estimate, found)
        return Judgement(typical, (Flag.NO_EVIDENCE,), (account,))
