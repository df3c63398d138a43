"""Base of the methods that read exposures alone: a table of g becomes a response."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from typing_extensions import override

from chartless.curves import SampledCurve
from chartless.evidence.base import AbstractChannelEvidence, ChannelEvidence
from chartless.evidence.bracket.account import account_of_bracket
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.judgement import seen_transfers
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.flags import Flag
from chartless.methods._base import AbstractChannelCalibrator, ChannelProgress
from chartless.result.response import Response, Status
from chartless.types import Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class AbstractExposureCalibrator(AbstractChannelCalibrator):
    """Method from the literature, without noise or error bars."""

    takes: ClassVar[tuple[type[AbstractChannelEvidence], ...]] = (ExposurePairs,)

    @abstractmethod
    def inverse_lut(self, counts: ExposureCounts) -> tuple[Floats, bool]:
        """Irradiance at the levels up to a factor, shape (L,); whether it converged."""

    @override
    def _estimate(self, evidence: ChannelEvidence, progress: ChannelProgress | None) -> Response:
        counts = evidence[ExposurePairs].counts
        lut, settled = self.inverse_lut(counts)
        # Black and white are 0 and 1; such curves may fall in between, cameras never
        # do.
        lut = np.concatenate([[0.0], lut[1:-1], [lut[1:].max()]])
        rising = np.maximum.accumulate(np.maximum(lut, 0.0))
        curve = SampledCurve.from_inverse(rising / rising[-1])
        account = account_of_bracket(
            evidence.channel,
            curve,
            exposures=np.exp(counts.log_exposures - counts.log_exposures.min()).tolist(),
            transfers=seen_transfers(counts, counts.log_exposures),
        )
        response = Response(
            name=evidence.channel,
            curve=curve,
            noise=None,
            n_levels=counts.n_levels,
            observed_levels=counts.observed_levels,
            n_pairs=counts.n_pixels,
            method=self.method,
            status=Status.CONVERGED if settled else Status.LIMIT_REACHED,
            accounts=(account,),
        )
        doubts = (
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(lut[1:]) < 0))),
            (Flag.SEARCH_UNFINISHED, not settled),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))
