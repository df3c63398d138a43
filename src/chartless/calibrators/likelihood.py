"""The exact likelihood of level pairs: any curve or a family, the noise ratio integrated out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.calibrators._base import (
    CALIBRATORS,
    AbstractCalibrator,
    ChannelEvidence,
    ChannelProgress,
)
from chartless.cooccurrence import Cooccurrence
from chartless.curve_space import AbstractCurveSpace, FamilyCurve, FreeCurve, free_curve
from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.likelihood import PairCounts, PairModel
from chartless.log_slopes import CurvePrior, measured_prior
from chartless.models import AbstractModel
from chartless.noise import AffineNoise
from chartless.noise_level import noise_level_start
from chartless.outliers import SOME_MOVERS, Cleaned, without_outliers
from chartless.posterior import (
    PAIR_WEIGHT,
    RATIOS,
    Mode,
    State,
    integrated,
    ridge,
    ridge_share,
)
from chartless.response import NoiseError, Response, Status
from chartless.types import Counts

# Deviance, as a multiple of what chance gives, above which pairs are not explained.
_POOR = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The ridge of one channel, and nothing judged."""

    still: Cleaned
    """The table, without what moved."""
    counts: PairCounts
    space: AbstractCurveSpace
    modes: list[Mode]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodSearch(AbstractCalibrator):
    """Posterior of curve and noise given the level pairs.

    The noise level gives the start; Fisher scoring finds the most probable curve, noise and
    scene at each of several ratios r = u/v; curves are averaged over the ratios by their
    evidence. Deterministic.

    Parameters
    ----------
    model : AbstractModel, optional
        Family of curves; without, any curve at all, with a prior learned from cameras.
    prior : CurvePrior, optional
        Of the log slopes, instead of `chartless.log_slopes.measured_prior`: for experiments
        that leave cameras out.
    weight : float
        Of a pair of pixels in the likelihood. Below 1 it allows for what the model
        leaves out: the histogram of the scene between its nodes, digitised curves.

    Raises
    ------
    ParameterError
        If a setting has no meaning.
    """

    uses_dark: ClassVar[bool] = True

    model: AbstractModel | None = None
    prior: CurvePrior | None = None
    weight: float = PAIR_WEIGHT

    def __post_init__(self) -> None:
        if not 0 < self.weight <= 1:
            msg = f"weight must lie above 0 and not above 1, not {self.weight!r}"
            raise ParameterError(msg)

    @property
    @override
    def method(self) -> str:
        return "likelihood"

    @override
    def _estimate(self, evidence: ChannelEvidence, progress: ChannelProgress | None) -> Response:
        found = self.search(
            evidence.table, n_frames=evidence.n_frames, dark=evidence.dark, progress=progress
        )
        return self._response(evidence.table, evidence.channel, found, [])

    def calibrate_together(
        self,
        tables: Mapping[str, Cooccurrence],
        *,
        n_frames: int = 2,
        dark: Mapping[str, Counts] | None = None,
        progress: ChannelProgress | None = None,
    ) -> tuple[Response, ...]:
        """Estimate channels that share the ratio u/v of their noise parameters.

        So they do where they come from one sensor and were not multiplied by different gains:
        a gain g on the light multiplies u by g and v by g². What the pairs of all channels tell
        of the ratio is added up, as if their curves were drawn from the prior one by one.

        Parameters
        ----------
        tables : mapping from channel names to Cooccurrence
        n_frames : int
        dark : mapping from channel names to ndarray of int64, optional
        progress : callable, optional
            As for `calibrate`.

        Returns
        -------
        tuple of Response
            In the order of the tables.
        """
        found: dict[str, Found] = {}
        for place, (name, table) in enumerate(tables.items()):

            def own_progress(share: float, done: int = place) -> None:
                if progress is not None:
                    progress((done + share) / len(tables))

            histogram = None if dark is None else dark.get(name)
            found[name] = self.search(
                table, n_frames=n_frames, dark=histogram, progress=own_progress
            )
        return tuple(
            self._response(
                tables[name], name, own, [each.modes for each in found.values() if each is not own]
            )
            for name, own in found.items()
        )

    def search(
        self,
        table: Cooccurrence,
        *,
        n_frames: int = 2,
        dark: Counts | None = None,
        progress: ChannelProgress | None = None,
    ) -> Found:
        """Walk the ridge of a table; arguments as for `calibrate`."""
        prior = self.prior or measured_prior(table.n_levels)
        still = without_outliers(table)
        counts = PairCounts.of(
            still.table, dark=dark, weight=self.weight * independent_share(n_frames)
        )
        start, scene = noise_level_start(counts, prior)
        space = self._space(table.n_levels)

        def on_mode(done: int) -> None:
            if progress is not None:
                progress(done / len(RATIOS))

        begin = State(space.nearest(start.edges), start.log_floor, scene)
        modes = ridge(counts, space, begin, on_mode=on_mode)
        if progress is not None:
            progress(1.0)
        return Found(still, counts, space, modes)

    def _response(
        self, table: Cooccurrence, channel: str, found: Found, others: list[list[Mode]]
    ) -> Response:
        share = ridge_share(found.counts, found.space)
        posterior = integrated(found.modes, found.space, share, others=others)
        best = posterior.best
        model = PairModel(best.edges, best.noise, best.state.scene)
        deviance = model.relative_deviance(found.counts)
        settled = all(mode.settled for mode in found.modes)
        curve: AbstractCurve = SampledCurve.from_inverse(posterior.inverse)
        if isinstance(found.space, FamilyCurve):
            parameters = found.space.parameters(best.state.coordinates)
            curve = ModelCurve(found.space.model.name, tuple(map(float, parameters)))
        slope, floor = np.exp(posterior.log_noise)
        response = Response(
            name=channel,
            curve=curve,
            noise=AffineNoise(float(slope), float(floor)),
            noise_error=NoiseError.from_covariance(posterior.log_noise_covariance),
            n_levels=table.n_levels,
            observed_levels=table.observed_levels,
            n_pairs=table.n_pairs,
            method=self.method,
            status=Status.CONVERGED if settled else Status.LIMIT_REACHED,
            deviance=deviance,
            log_evidence=best.log_evidence,
            # A misfit is noise that the model does not know.
            inverse_lut_std=posterior.inverse_std * np.sqrt(max(1.0, deviance)),
            outliers=found.still.fraction,
            table=found.still.table,
        )
        doubts = (
            (Flag.MISFIT, deviance > _POOR),
            (Flag.MOVERS, found.still.fraction > SOME_MOVERS),
            (Flag.SEARCH_UNFINISHED, not settled),
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(response.response_lut) < 0))),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))

    def _space(self, n_levels: int) -> AbstractCurveSpace:
        if self.model is not None:
            return FamilyCurve(self.model, n_levels)
        return free_curve(n_levels) if self.prior is None else FreeCurve(self.prior)


def independent_share(n_frames: int) -> float:
    """How much a pair of consecutive frames tells, as a share of an independent pair.

    The mean square of M − 1 successive differences of M values has the variance
    (3M − 4)/(M − 1)² σ⁴, not 2/(M − 1) σ⁴ (von Neumann et al. 1941, doi:10.1214/aoms/1177731746):
    1 for two frames, two thirds for many.
    """
    return 2 * (n_frames - 1) / (3 * n_frames - 4)


CALIBRATORS.register("likelihood", LikelihoodSearch)
