"""Curve from the noise level alone by generalised least squares, in milliseconds."""

from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.curves import SampledCurve
from chartless.curves.populations import measured_prior
from chartless.curves.prior import CurvePrior
from chartless.curves.space import free_curve
from chartless.evidence.base import ChannelEvidence
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.likelihood import PairCounts, PairModel
from chartless.evidence.noise.misfit import is_gaussian
from chartless.evidence.noise.outliers import SOME_MOVERS
from chartless.evidence.noise.start import noise_level_start
from chartless.flags import Flag
from chartless.inference.posterior import at_levels, deviations_at_levels
from chartless.inference.stabilised import warped
from chartless.methods._base import CALIBRATORS, AbstractChannelCalibrator, ChannelProgress
from chartless.noise import SENSORS, NoisePrior
from chartless.result.response import Response, Status


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseLevelSearch(AbstractChannelCalibrator):
    """Curve from the noise level at a typical ratio u/v of the noise parameters.

    The error bars allow for the ratio, which the noise level does not determine. Noise
    that is not Gaussian is flagged as a misfit.

    Parameters
    ----------
    prior : CurvePrior, optional
        Prior of the log slopes, instead of that of DoRF
        (`chartless.curves.populations.measured_prior`): for experiments that leave
        cameras out. A mixture of populations would make the band too wide, as nothing
        weighs them here.
    noise_prior : NoisePrior
        Prior of the noise, whose median ratio the curve has.
    """

    prior: CurvePrior | None = None
    noise_prior: NoisePrior = SENSORS

    @property
    @override
    def method(self) -> str:
        return "nlf"

    @override
    def _estimate(self, evidence: ChannelEvidence, progress: ChannelProgress | None) -> Response:
        pairs = evidence[LevelPairs]
        table = pairs.table
        prior = self.prior or measured_prior(table.n_levels)
        still, outliers = pairs.still
        counts = PairCounts.of(still)
        fit, scene = noise_level_start(counts, prior, self.noise_prior.centre)
        ratio = self.noise_prior.centre.ratio
        model = PairModel(fit.edges, fit.noise(ratio), scene)
        inverse = at_levels(fit.edges)
        space = free_curve(prior)
        spread = self.noise_prior.ratio_spread
        low, high = (
            at_levels(warped(fit.edges, ratio, ratio * float(np.exp(step))))
            for step in (-spread, spread)
        )
        within = deviations_at_levels(space.pull(fit.log_slopes), fit.covariance, table.n_levels)
        if progress is not None:
            progress(1.0)
        response = Response(
            name=evidence.channel,
            curve=SampledCurve.from_inverse(inverse),
            noise=fit.noise(ratio),
            n_levels=table.n_levels,
            observed_levels=table.observed_levels,
            n_pairs=table.n_pairs,
            method=self.method,
            status=Status.CONVERGED,
            inverse_lut_std=np.hypot(within, 0.5 * (high - low)),
            accounts=(account_of_pairs(still, outliers=outliers),),
        )
        doubts = (
            (Flag.MOVERS, outliers > SOME_MOVERS),
            (Flag.MISFIT, not is_gaussian(counts.pairs, model.pairs * counts.pairs.sum())),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))


CALIBRATORS.register("nlf", NoiseLevelSearch)
