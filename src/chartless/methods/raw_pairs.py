"""Raw files beside the JPEGs of the same shots: the curve between the two, fitted directly."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.curves.prior import CurvePrior
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve, free_curve
from chartless.evidence.raw.fit import raw_fit
from chartless.flags import Flag
from chartless.inference.posterior import at_levels, deviations_at_levels
from chartless.methods._base import (
    CALIBRATORS,
    AbstractCalibrator,
    ChannelEvidence,
    ChannelProgress,
)
from chartless.models import AbstractModel
from chartless.result.response import RawEstimate, Response, Status

_MUCH_SCATTER = 0.06  # relative, of greys


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RawPairSearch(AbstractCalibrator):
    """Regression of the levels of JPEGs on the light of their raw files. Deterministic.

    Any curve may come out, with a prior learned from measured cameras, or a member of a family.
    `chartless.evidence.raw.fit` has the equation and what else it finds.

    Parameters
    ----------
    model : AbstractModel, optional
        Family of curves.
    prior : CurvePrior, optional
        Of the log slopes, instead of `chartless.curves.prior.measured_prior`: for experiments
        that leave cameras out.
    """

    takes: ClassVar[frozenset[str]] = frozenset({"raw"})

    model: AbstractModel | None = None
    prior: CurvePrior | None = None

    @property
    @override
    def method(self) -> str:
        return "raw"

    @override
    def _estimate(self, evidence: ChannelEvidence, progress: ChannelProgress | None) -> Response:
        blocks = evidence.blocks
        space = self._space(blocks.n_levels)
        fit = raw_fit(blocks, space)
        edges = space.edges(fit.coordinates)
        curve: AbstractCurve = SampledCurve.from_inverse(at_levels(edges))
        covariance = None
        if isinstance(space, FamilyCurve):
            parameters = space.parameters(fit.coordinates)
            curve = ModelCurve(space.model.name, tuple(map(float, parameters)))
            covariance = space.parameter_covariance(fit.covariance)
        pull = space.pull(fit.coordinates)
        std = deviations_at_levels(pull, fit.covariance, blocks.n_levels)
        red, green, blue = fit.matrix
        if progress is not None:
            progress(1.0)
        response = Response(
            name=evidence.channel,
            curve=curve,
            noise=None,
            n_levels=blocks.n_levels,
            observed_levels=blocks.observed_levels,
            n_pairs=blocks.level.size,
            method=self.method,
            status=Status.CONVERGED if fit.settled else Status.LIMIT_REACHED,
            inverse_lut_std=std,
            parameter_covariance=covariance,
            raw=RawEstimate(
                matrix=(float(red), float(green), float(blue)),
                gains=tuple(map(float, np.exp(fit.log_gains - fit.log_gains[0]))),
                corner_gain=float(np.exp(fit.falloff.sum())),
                scatter=fit.scatter,
            ),
        )
        doubts = (
            (Flag.UNEVEN_TONES, fit.scatter > _MUCH_SCATTER),
            (Flag.SEARCH_UNFINISHED, not fit.settled),
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(response.response_lut) < 0))),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))

    def _space(self, n_levels: int) -> AbstractCurveSpace:
        if self.model is not None:
            return FamilyCurve(self.model, n_levels)
        return free_curve(n_levels) if self.prior is None else FreeCurve(self.prior)


CALIBRATORS.register("raw", RawPairSearch)
