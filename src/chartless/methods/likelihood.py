"""The exact likelihood of level pairs: any curve or a family, the noise ratio integrated out."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.curves.prior import CurvePrior, measured_prior
from chartless.curves.space import (
    AbstractCurveSpace,
    FamilyCurve,
    FreeCurve,
    free_curve,
    free_curve_with_shoulder,
)
from chartless.errors import ParameterError
from chartless.evidence.bracket.likelihood import ExposureCounts, ExposureModel
from chartless.evidence.bracket.transfer import brightness_transfer, transfer_curve
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.likelihood import PairCounts, with_scene
from chartless.evidence.noise.misfit import misfit_pattern
from chartless.evidence.noise.outliers import SOME_MOVERS, Cleaned, without_outliers
from chartless.evidence.noise.start import noise_level_start
from chartless.flags import Flag
from chartless.inference.posterior import (
    PAIR_WEIGHT,
    RATIOS,
    RIDGE_PAIRS,
    Mode,
    Posterior,
    State,
    belief,
    covariance_of,
    integrated,
    maximise,
    ridge,
    ridge_share,
    std_with_dark,
    weighted,
)
from chartless.inference.terms import ExposureFit, ExposureTerm, PairFit, PairTerm
from chartless.methods._base import (
    CALIBRATORS,
    AbstractCalibrator,
    ChannelEvidence,
    ChannelProgress,
)
from chartless.models import AbstractModel
from chartless.noise import SENSORS, AffineNoise, NoisePrior
from chartless.result.response import ExposureEstimate, NoiseError, Response, SeenTransfer, Status
from chartless.types import Counts, Floats

# Deviance, as a multiple of what chance gives, above which pairs are not explained.
_POOR = 1.5
# Deviation of ln γ above which the power of a curve is an open question; deviations of exposures
# from what they are said to be; relative scatter above which they do not belong together.
_UNSURE_EXPONENT, _FAR_OFF, _MUCH_SCATTER = 0.05, 3.0, 0.15
_UNKNOWN = 0.5  # error of exposures above which they count as unknown
# Deviation of ln γ that repeats cannot undercut: by how the noise between exposures and the
# shoulder are taken, γ moved by 0.01 to 0.05, on photographs and on scenes whose density is the
# inverse of light.
_EXPONENT_LIMIT = 0.03
# And where nothing but the prior tells γ (benchmarks/files.py, row unknown).
_EXPONENT_BY_PRIOR = 0.3
# Of ln t, against those given, so small that rounded shutters stay below; and as a share of the
# extent of ln t, where lossy files are 3 % off though exposures are right.
_OTHER_EXPOSURES, _OTHER_BY_LOSSY = 0.05, 0.1
# Deviation of the light above the highest level that shows, as a share of what the prior expects
# there: of digital cameras it is up to two and a half times that, and of lossy files the highest
# levels hold least of what is bright (benchmarks/files.py, PNG and JPEG).
_UNSEEN, _UNSEEN_LOSSY = 0.5, 1.5
# Levels of lossy files err together, not pixel by pixel, and so do those that are matched by rank.
# Deviation of their shape, as a multiple of what independent pixels would leave; beyond it, in
# levels and as a share of the noise. Chosen on sixteen cases of benchmarks/files.py, JPEG at three
# noise levels, checked on sixteen others.
_TOGETHER_TIMES, _TOGETHER_LEVELS, _TOGETHER_NOISE = 2.0, 1.0, 0.2
# Where blocks that hold white are left out, noise chooses what is compared beside white: relative
# deviations of the shape and of the light at white, in those of the noise at white. Of eighteen
# other brackets, grey JPEG of quality 92 by soft curves, they hold what was off by five.
_CHOSEN_SHAPE, _CHOSEN_WHITE = 1.5, 3.0
# Root mean square by which a curve misses what different exposures show, from which it is a misfit.
_WRONG = 0.02
# Raised by level pairs of one exposure.
_OF_PAIRS = (Flag.MISFIT, Flag.MOVERS, Flag.SEARCH_UNFINISHED)
_QUIET_8BIT = (0.01, 0.5)  # noise at the start: brackets are taken at low ISO
_NO_PART = 10.0  # nats
_FIRST_SETTLED = 5.0  # nats: the first look is only to weigh what is looked at next
_FIRST_SCATTER = 0.05  # of exposures: wider than most, so that no row is out of reach at the start
_SCENE_STEPS = 8  # of expectation maximisation, for a first scene
# Flagged where dark frames would narrow the band by a tenth: that of twenty photographs by 0.3 % at
# most, of scenes without anything below an irradiance of 0.2 by 13 % in the median; the error
# itself fell from 0.017 to 0.007 there (14 measured cameras, means).
_WORTH_DARK = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The modes of one channel, and nothing judged."""

    space: AbstractCurveSpace
    modes: list[Mode]
    share: float
    """Weight of the pairs' evidence along the ridge."""
    still: Cleaned | None
    """The table of one exposure, if there is one, without what moved."""
    exposures: ExposureCounts | None
    alone: "Found | None" = None
    """What different exposures alone show of any curve, where a family was asked for: whether it
    fits."""

    @property
    def settled(self) -> bool:
        """Whether all searches came to their end, of modes that have a part in the result."""
        evidence = [weighted(mode, self.share) for mode in self.modes]
        least = max(evidence) - _NO_PART
        return all(
            mode.settled for mode, each in zip(self.modes, evidence, strict=True) if each > least
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodSearch(AbstractCalibrator):
    """Posterior of curve and noise given level pairs, of one exposure, of several or of both.

    Of one exposure, the noise level gives the start; Fisher scoring finds the most probable
    curve, noise and scene at each of several ratios r = u/v; curves are averaged over the ratios
    by their evidence. Different exposures tell the curve without r: there the transfer of
    brightness gives the start, and one search finds the mode. Where there are both, the sum of
    the two log-likelihoods is maximised; where the exposures are known, the curve is that of the
    exposures alone. Deterministic.

    Parameters
    ----------
    model : AbstractModel, optional
        Family of curves; without, any curve at all, with a prior learned from cameras.
    prior : CurvePrior, optional
        Of the log slopes, instead of `chartless.curves.prior.measured_prior`: for experiments
        that leave cameras out.
    noise_prior : NoisePrior
        Of the noise of one exposure, which hardly tells the ratio u/v itself.
    weight : float
        Of a pair of pixels in the likelihood. Below 1 it allows for what the model
        leaves out: the histogram of the scene between its nodes, digitised curves.

    Raises
    ------
    ParameterError
        If a setting has no meaning.
    """

    takes: ClassVar[frozenset[str]] = frozenset({"noise", "exposures"})
    uses_dark: ClassVar[bool] = True

    model: AbstractModel | None = None
    prior: CurvePrior | None = None
    noise_prior: NoisePrior = SENSORS
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
            evidence.pairs,
            exposures=evidence.bracket,
            n_frames=evidence.n_frames,
            dark=evidence.dark,
            progress=progress,
        )
        response = self._response(evidence.channel, found, [])
        bracket = evidence.bracket
        if evidence.pairs is None or bracket is None or not bracket.settled:
            return response
        alone = self._response(evidence.channel, self.search(exposures=bracket), [])
        return _with_noise_of(alone, response)

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
        a gain g on the light multiplies u by g and v by g². What the pairs of the other channels
        tell of the ratio is added to what a channel tells itself.

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
            self._response(name, own, [each.modes for each in found.values() if each is not own])
            for name, own in found.items()
        )

    def search(
        self,
        table: Cooccurrence | None = None,
        *,
        exposures: ExposureCounts | None = None,
        n_frames: int = 2,
        dark: Counts | None = None,
        progress: ChannelProgress | None = None,
    ) -> Found:
        """Find the modes, those along the ridge of a table alone; arguments as for `calibrate`."""

        def on_mode(done: int) -> None:
            if progress is not None:
                progress(done / len(RATIOS))

        still = None if table is None else without_outliers(table)
        if exposures is not None:
            found = self._of_exposures(exposures, still, n_frames, dark, on_mode)
            if self.model is not None:
                alone = replace(self, model=None).search(exposures=exposures)
                found = replace(found, alone=alone)
        else:
            assert still is not None
            found = self._of_noise(still, n_frames, dark, on_mode)
        if progress is not None:
            progress(1.0)
        return found

    def _of_noise(
        self,
        still: Cleaned,
        n_frames: int,
        dark: Counts | None,
        on_mode: Callable[[int], None],
    ) -> Found:
        weight = self.weight * independent_share(n_frames)
        counts = PairCounts.of(still.table, dark=dark, weight=weight)
        space = self._space(counts.n_levels)
        usual = self.noise_prior.centre
        start, scene = noise_level_start(counts, self._prior(counts.n_levels), usual)
        term = PairTerm(counts, scene.nodes.size)
        begin = State.at_ratio(
            usual.ratio, space.nearest(start.edges), start.log_floor, (scene.log_weights,)
        )
        first = maximise([term], space, begin, noise_prior=self.noise_prior)
        share = ridge_share(counts, space) * belief(first, space)
        modes = ridge(
            [term], space, first.state, share, noise_prior=self.noise_prior, on_mode=on_mode
        )
        return Found(space, modes, share, still, None)

    def _of_exposures(
        self,
        exposures: ExposureCounts,
        still: Cleaned | None,
        n_frames: int,
        dark: Counts | None,
        on_mode: Callable[[int], None],
    ) -> Found:
        prior = self._prior(exposures.n_levels)
        space = self._space(exposures.n_levels, shoulder=True)
        start = transfer_curve(exposures, prior)
        exposures = replace(exposures, own_noise=still is not None)
        noise = AffineNoise.from_8bit(*_QUIET_8BIT)
        own, first = exposures.own_mean.copy(), exposures.first_change
        own[0] = np.log(_FIRST_SCATTER)
        own[1:first] = np.log([noise.slope, noise.floor])[: first - 1]
        own[first:] = start.log_exposure_changes[: own.size - first]
        begin = State(space.nearest(start.edges), np.log([noise.slope, noise.floor]), (own,))
        # Of a shorter exposure that is given the noise is multiplied: first the others alone.
        forward = ExposureTerm(replace(exposures, tables=exposures.forward))
        look = maximise([forward], space, begin, hold_ratio=False, tolerance=_FIRST_SETTLED)
        (fit,), (own,) = look.fits, look.state.own
        assert isinstance(fit, ExposureFit)
        noise = fit.model.noise
        exposures, own = ExposureModel(exposures, look.edges, noise, own).informed()
        term = ExposureTerm(exposures)
        if still is None:
            begin = replace(look.state, own=(own,))
            modes = [maximise([term], space, begin, hold_ratio=False)]
            return Found(space, modes, 1.0, still, exposures)
        # One search for all: pairs count as they would along the ridge, which begins where the
        # noise of the bracket is.
        weight = self.weight * independent_share(n_frames)
        most = RIDGE_PAIRS / max(still.table.n_pairs, 1)
        counts = PairCounts.of(still.table, dark=dark, weight=min(weight, most))
        noise = AffineNoise(
            max(noise.slope, RATIOS[0] * noise.floor), max(noise.floor, noise.slope / RATIOS[-1])
        )
        scene = with_scene(look.edges, noise, counts, _SCENE_STEPS).scene
        log_weights = scene.log_weights - scene.log_weights.mean()
        begin = State(
            look.state.coordinates, np.log([noise.slope, noise.floor]), (own, log_weights)
        )
        terms = [term, PairTerm(counts, scene.nodes.size)]
        modes = ridge(terms, space, begin, 1.0, noise_prior=self.noise_prior, on_mode=on_mode)
        return Found(space, modes, 1.0, still, exposures)

    def _response(self, channel: str, found: Found, others: list[list[Mode]]) -> Response:
        posterior = integrated(
            found.modes,
            found.space,
            found.share,
            others=others,
            skewed=found.exposures is not None,
        )
        best = posterior.best
        slope, floor = np.exp(posterior.log_noise)
        curve: AbstractCurve = SampledCurve.from_inverse(posterior.inverse)
        covariance = None
        if isinstance(found.space, FamilyCurve):
            parameters = found.space.parameters(best.state.coordinates)
            curve = ModelCurve(found.space.model.name, tuple(map(float, parameters)))
            covariance = found.space.parameter_covariance(posterior.coordinate_covariance)
        response = Response(
            name=channel,
            curve=curve,
            noise=AffineNoise(float(slope), float(floor)),
            noise_error=NoiseError.from_covariance(posterior.log_noise_covariance),
            n_levels=posterior.inverse.size,
            observed_levels=(0, posterior.inverse.size - 1),
            n_pairs=0,
            method=self.method,
            status=Status.CONVERGED if found.settled else Status.LIMIT_REACHED,
            log_evidence=best.log_evidence,
            inverse_lut_std=posterior.inverse_std,
            shape_std=None if posterior.spread is None else posterior.spread.shape,
            white_std=None if posterior.spread is None else posterior.spread.log_scale,
            parameter_covariance=covariance,
        )
        for fit in best.fits:
            if isinstance(fit, PairFit) and found.still is not None:
                response = _judged_pairs(response, found, fit, posterior)
        if found.exposures is not None:
            response = _judged_exposures(response, found, posterior.mode_weights)
        doubts = (
            (Flag.SEARCH_UNFINISHED, not found.settled),
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(response.response_lut) < 0))),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))

    def _prior(self, n_levels: int) -> CurvePrior:
        return self.prior or measured_prior(n_levels)

    def _space(self, n_levels: int, *, shoulder: bool = False) -> AbstractCurveSpace:
        if self.model is not None:
            return FamilyCurve(self.model, n_levels)
        if self.prior is not None:
            return FreeCurve(self.prior.with_shoulder() if shoulder else self.prior)
        return free_curve_with_shoulder(n_levels) if shoulder else free_curve(n_levels)


def _with_noise_of(response: Response, joint: Response) -> Response:
    """Response of exposures alone, with what level pairs of one exposure say of the noise.

    Of the curve they tell nothing that known exposures do not tell better, and of the light at
    white they tell wrong: off by 0.004 alone, by 0.03 together (medians of four cases of
    benchmarks/files.py, PNG, an exposure repeated).
    """
    assert joint.noise is not None
    scale = float(response.inverse_lut @ joint.inverse_lut / np.sum(joint.inverse_lut**2))
    noise = AffineNoise(joint.noise.slope * scale, joint.noise.floor * scale**2)
    unfinished = joint.status is not Status.CONVERGED
    low, high = zip(response.observed_levels, joint.observed_levels, strict=True)
    return replace(
        response,
        noise=noise,
        noise_error=joint.noise_error,
        observed_levels=(min(low), max(high)),
        n_pairs=joint.n_pairs,
        deviance=joint.deviance,
        pattern=joint.pattern,
        outliers=joint.outliers,
        table=joint.table,
        status=joint.status if unfinished else response.status,
    ).with_flags(*(flag for flag in joint.flags if flag in _OF_PAIRS))


def _judged_pairs(response: Response, found: Found, fit: PairFit, posterior: Posterior) -> Response:
    """Response with what level pairs of one exposure say of themselves."""
    assert found.still is not None
    table, pairs = found.still.table, fit.counts.pairs
    deviance = fit.model.relative_deviance(fit.counts)
    pattern = misfit_pattern(pairs, fit.model.pairs * pairs.sum()) if deviance > _POOR else None
    widened = max(1.0, deviance)  # a misfit is noise that the model does not know
    std, with_dark = posterior.inverse_std * np.sqrt(widened), None
    if isinstance(found.space, FreeCurve) and not fit.counts.dark.any():
        with_dark = std_with_dark(posterior, found.space) * np.sqrt(widened)
    covariance = response.parameter_covariance
    judged = replace(
        response,
        observed_levels=table.observed_levels,
        n_pairs=table.n_pairs,
        deviance=deviance,
        pattern=pattern,
        inverse_lut_std=std,
        inverse_lut_std_with_dark=with_dark,
        parameter_covariance=None if covariance is None else widened * covariance,
        outliers=found.still.fraction,
        table=table,
    )
    doubts = (
        (Flag.DARK_LEVELS_UNSEEN, with_dark is not None and _worth(std, with_dark)),
        (Flag.MISFIT, deviance > _POOR),
        (Flag.MOVERS, found.still.fraction > SOME_MOVERS),
    )
    return judged.with_flags(*(flag for flag, holds in doubts if holds))


def _judged_exposures(response: Response, found: Found, weights: Floats) -> Response:
    """Response with what level pairs of different exposures say of themselves."""
    counts = found.exposures
    assert counts is not None
    low, high = counts.observed_levels
    others = response.observed_levels if response.table is not None else (low, high)
    log_exposures, error = _exposures_found(counts, found.modes, weights)
    unknown = counts.exposure_error > _UNKNOWN
    least = 0.0
    if counts.lossy and counts.exposure_error > 0 and not counts.held:
        least = _EXPONENT_LIMIT
    if unknown:
        least = _EXPONENT_BY_PRIOR if found.still is None else _EXPONENT_LIMIT
    error = float(np.hypot(error, least))
    scatter = float(np.exp(weights @ [mode.state.own[0][0] for mode in found.modes]))
    relative = np.exp(log_exposures - log_exposures.min())
    judged = replace(
        response,
        observed_levels=(min(low, others[0]), max(high, others[1])),
        n_pairs=response.n_pairs + counts.n_pixels,
        exposures=ExposureEstimate(
            tuple(relative.tolist()), error, scatter, _transfers(counts, log_exposures)
        ),
    )
    white_error = float(np.hypot(counts.white_error, _unseen_error(counts, response)))
    judged = judged.with_exponent_error(least).with_white_error(white_error)
    missed = np.zeros(counts.n_levels)
    if found.alone is not None:
        missed = _missed(judged, found.alone)
        judged = judged.with_level_errors(missed)
    for holds in (counts.lossy, not counts.aligned):
        if holds:
            judged = judged.with_level_errors(_errors_together(judged))
    if counts.lossy and counts.aligned:
        judged = _with_noise_beside_white(judged)
    doubts = (
        (Flag.MISFIT, float(np.sqrt(np.mean(missed**2))) > _WRONG),
        (Flag.EXPONENT_UNKNOWN, (unknown and found.still is None) or error > _UNSURE_EXPONENT),
        (Flag.EXPOSURES_OFF, _are_off(counts, log_exposures)),
        (Flag.SCATTER, scatter > _MUCH_SCATTER),
    )
    return judged.with_flags(*(flag for flag, holds in doubts if holds))


def _missed(response: Response, alone: Found) -> Floats:
    """How far g is from what exposures alone show, beyond the deviation of that, shape (L,)."""
    any_curve = integrated(alone.modes, alone.space, alone.share, skewed=True)
    off = response.inverse_lut - any_curve.inverse
    return np.asarray(np.sqrt(np.maximum(off**2 - any_curve.inverse_std**2, 0.0)))


def _errors_together(response: Response) -> Floats:
    """Deviation of g at the levels beyond that by independent pixels, shape (L,)."""
    light = response.inverse_lut
    shape = response.inverse_lut_std if response.shape_std is None else response.shape_std
    assert shape is not None
    assert response.noise is not None
    variance = (
        (_TOGETHER_TIMES**2 - 1) * shape**2
        + (_TOGETHER_LEVELS * np.gradient(light)) ** 2
        + _TOGETHER_NOISE**2 * response.noise.variance(light)
    )
    variance[[0, -1]] = 0.0  # black and white are what they are by definition
    return np.asarray(np.sqrt(variance))


def _with_noise_beside_white(response: Response) -> Response:
    """Response whose bands hold what noise does where lossy blocks with white are left out."""
    assert response.noise is not None
    at_white = float(np.sqrt(response.noise.variance(np.array(1.0))))
    below_white = np.append(response.inverse_lut[:-1], 0.0)
    wider = response.with_level_errors(_CHOSEN_SHAPE * at_white * below_white)
    return wider.with_white_error(_CHOSEN_WHITE * at_white)


def _unseen_error(counts: ExposureCounts, response: Response) -> float:
    """Relative deviation of the light at white by what no level shows of it."""
    highest = min(counts.observed_levels[1], counts.n_levels - 2 - counts.margin)
    share = 1.0 - float(response.inverse_lut[highest])
    return (_UNSEEN_LOSSY if counts.lossy else _UNSEEN) * share


def _are_off(counts: ExposureCounts, found: Floats) -> bool:
    """Whether ln of the exposures found is not what was given."""
    off = float(np.ptp(found - counts.log_exposures))
    most = 2 * _FAR_OFF * counts.exposure_error
    if counts.lossy:
        return off > max(most, _OTHER_BY_LOSSY * float(np.ptp(counts.log_exposures)))
    return off > (most if counts.exposure_error > _UNKNOWN else min(most, _OTHER_EXPOSURES))


def _transfers(counts: ExposureCounts, log_exposures: Floats) -> tuple[SeenTransfer, ...]:
    """What the pictures show of the curve before any model, rounded for the file."""
    found = []
    for table in counts.forward:
        upper, lower = brightness_transfer(table.counts)
        ratio = float(np.exp(log_exposures[table.longer] - log_exposures[table.shorter]))
        found.append(SeenTransfer(ratio, tuple(upper.tolist()), tuple(lower.round(2).tolist())))
    return tuple(found)


def _exposures_found(
    counts: ExposureCounts, modes: list[Mode], weights: Floats
) -> tuple[Floats, float]:
    """Ln of the exposures and the deviation of the exponent, within the modes and between them."""
    if counts.exposure_error == 0:
        return counts.log_exposures, 0.0
    first, size = counts.first_change, counts.log_exposures.size
    changes = np.array([mode.state.own[0][first:] for mode in modes])  # they are the first term
    ends = np.zeros(size)
    ends[counts.log_exposures.argmax()], ends[counts.log_exposures.argmin()] = 1.0, -1.0
    within = []
    for mode in modes:
        place = len(mode.factor) - sum(own.size for own in mode.state.own) + first
        within.append(ends @ covariance_of(mode, slice(place, place + size)) @ ends)
    extents = (counts.log_exposures + changes) @ ends
    extent = float(weights @ extents)
    variance = float(weights @ (np.array(within) + (extents - extent) ** 2))
    return counts.log_exposures + weights @ changes, float(np.sqrt(variance)) / extent


def _worth(std: Floats, with_dark: Floats) -> bool:
    """Whether dark frames are worth taking, by root mean squares."""
    return float(np.linalg.norm(with_dark)) < (1 - _WORTH_DARK) * float(np.linalg.norm(std))


def independent_share(n_frames: int) -> float:
    """How much a pair of consecutive frames tells, as a share of an independent pair.

    The mean square of M − 1 successive differences of M values has the variance
    (3M − 4)/(M − 1)² σ⁴, not 2/(M − 1) σ⁴ (von Neumann et al. 1941, doi:10.1214/aoms/1177731746):
    1 for two frames, two thirds for many.
    """
    return 2 * (n_frames - 1) / (3 * n_frames - 4)


CALIBRATORS.register("likelihood", LikelihoodSearch)
