"""Joint posterior of curve and noise: free curve or family, any kinds of evidence."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple, final

import numpy as np
from typing_extensions import override

from chartless.curves.populations import PopulationWeights, population_prior
from chartless.curves.prior import CurvePrior, irradiance_at_edges
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve, free_curve
from chartless.errors import ParameterError
from chartless.evidence.base import (
    AbstractChannelEvidence,
    AbstractCurveEvidence,
    ChannelEvidence,
    Judgement,
)
from chartless.evidence.noise.channel import LevelPairs, independent_share
from chartless.evidence.noise.judgement import judged_alone, judged_beside
from chartless.evidence.noise.likelihood import PairCounts, with_scene
from chartless.evidence.noise.start import noise_given_curve, noise_level_start
from chartless.evidence.noise.term import (
    PAIR_WEIGHT,
    RIDGE_PAIRS,
    PairFit,
    PairTerm,
    ridge_share,
    scene_name,
)
from chartless.evidence.origins import weights_of
from chartless.flags import Flag
from chartless.frames.frame import Origin
from chartless.inference.block import Values, curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate, with_mean_bands
from chartless.inference.noise_block import NoiseBlock, affine, noise_name
from chartless.inference.populations import gains, in_space, with_evidence
from chartless.inference.posterior import (
    Posterior,
    at_levels,
    at_mode,
    integrated,
    noise_covariance,
)
from chartless.inference.ridge import RATIOS, at_ratio, belief, ridge
from chartless.inference.search import Mode, maximise, shares
from chartless.inference.term import AbstractTerm
from chartless.methods._base import (
    CALIBRATORS,
    AbstractCalibrator,
    ChannelProgress,
    share_of,
)
from chartless.methods._joint import MoreTerms, Parts, Searched, searched
from chartless.models import AbstractModel
from chartless.noise import SENSORS, AffineNoise, NoiseError, NoisePrior
from chartless.result.account import Account
from chartless.result.response import Response, Status
from chartless.types import Floats

# Root mean square difference of a family from a free curve that makes it a misfit.
_WRONG = 0.02
# Kinds disagree if the shape from one differs from that of all by more than this root
# mean square: in deviations of its band, plus about a level.
_FAR_APART, _ALIKE = 3.0, 0.005
_NO_PART = 10.0  # nats
_SCENE_STEPS = 8  # steps of expectation maximisation, for a first scene


@dataclass(frozen=True, slots=True, eq=False)
class Ridge:
    """Modes of one channel with level pairs alone, before any judgement."""

    space: AbstractCurveSpace
    modes: list[ChannelMode]
    share: float
    """Weight of the pairs' evidence along the ridge."""

    @property
    def likely(self) -> list[ChannelMode]:
        """Modes that affect the result."""
        least = max(map(self.weighted, self.modes)) - _NO_PART
        return [found for found in self.modes if self.weighted(found) > least]

    def weighted(self, found: ChannelMode) -> float:
        """Evidence of a mode, with the pairs at their weight."""
        return found.weighted(self.share)

    @property
    def settled(self) -> bool:
        """Whether the searches of all modes that affect the result converged."""
        return all(found.mode.settled for found in self.likely)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodSearch(AbstractCalibrator):
    """Posterior of curve and noise given any kinds of evidence.

    With level pairs of one exposure alone, the search starts from the noise level;
    Fisher scoring finds the most probable curve, noise and scene at each of several
    ratios r = u/v; curves are averaged over the ratios, weighted by their evidence.
    Other kinds determine the curve without r: one search finds the mode of the sum of
    their log-likelihoods, in all channels. Beside these, level pairs determine the
    noise. They contribute to the curve only where exposures are unknown and nothing
    else fixes the power of the curve. Deterministic.

    Parameters
    ----------
    model : AbstractModel, optional
        Family of curves; by default a free curve, with a prior learned from cameras.
    populations : PopulationWeights, optional
        How common populations of cameras are; by default by the files
        (`chartless.evidence.origins`). Evidence changes it.
    prior : CurvePrior, optional
        Prior of the log slopes, instead of that of these populations: for experiments
        that leave cameras out.
    noise_prior : NoisePrior
        Prior of the noise of one exposure, which by itself hardly constrains the ratio
        u/v.
    weight : float
        Weight of a pair of pixels in the likelihood. Below 1 it allows for what the
        model leaves out: the histogram of the scene between its nodes, digitised
        curves.
    shared_noise : bool
        Whether channels share the ratio u/v of their noise parameters. They do if they
        come from one sensor without different gains: a gain g on the light multiplies u
        by g and v by g².

    Raises
    ------
    ParameterError
        If a setting is out of range.
    """

    takes: ClassVar[tuple[type[AbstractChannelEvidence], ...]] = (
        LevelPairs,
        AbstractCurveEvidence,
    )
    uses_dark: ClassVar[bool] = True

    model: AbstractModel | None = None
    populations: PopulationWeights | None = None
    prior: CurvePrior | None = None
    noise_prior: NoisePrior = SENSORS
    weight: float = PAIR_WEIGHT
    shared_noise: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.weight <= 1:
            msg = f"weight must lie above 0 and not above 1, not {self.weight!r}"
            raise ParameterError(msg)

    @property
    @override
    def method(self) -> str:
        return "likelihood"

    @override
    def idle_settings(self, kinds: Collection[str]) -> frozenset[str]:
        if "noise" not in kinds:
            return frozenset({"noise_prior", "weight", "shared_noise"})
        return frozenset({"shared_noise"} if len(kinds) > 1 else ())

    @override
    def for_files(self, origins: Iterable[Origin]) -> "LikelihoodSearch":
        if self.populations is not None or self.prior is not None:
            return self
        return replace(self, populations=weights_of(origins))

    @override
    def _estimate_all(
        self, channels: Sequence[ChannelEvidence], progress: ChannelProgress | None
    ) -> tuple[Response, ...]:
        if not channels[0].of_curve:
            return self._of_noise(channels, progress)
        responses = self._of_curves(channels)
        if progress is not None:
            progress(1.0)
        return responses

    # Level pairs alone

    def _of_noise(
        self, channels: Sequence[ChannelEvidence], progress: ChannelProgress | None
    ) -> tuple[Response, ...]:
        walked = [
            self.ridge(each[LevelPairs], share_of(progress, place, len(channels)))
            for place, each in enumerate(channels)
        ]
        found = _with_populations(walked)
        responses = []
        for evidence, own in zip(channels, found, strict=True):
            others = [each.modes for each in found if self.shared_noise and each is not own]
            posterior = integrated(own.modes, own.space, own.share, others=others)
            estimate = CurveEstimate.of(posterior, own.space)
            judgement = judged_alone(estimate, posterior, own.space, evidence[LevelPairs])
            noise = _Noise.of(posterior.log_noise, posterior.log_noise_covariance)
            best = posterior.best.mode
            responses.append(self._response(evidence, judgement, noise, best, settled=own.settled))
        return tuple(responses)

    def ridge(self, pairs: LevelPairs, progress: ChannelProgress | None = None) -> Ridge:
        """Modes at several ratios of the noise parameters.

        Parameters
        ----------
        pairs : LevelPairs
        progress : callable, optional
            Called with the share of the work done.
        """
        channel = "Y"
        counts = self._pair_counts(pairs)
        prior, usual = self._prior(counts.n_levels), self.noise_prior.centre
        space = self._space(prior)
        start, scene = noise_level_start(counts, prior, usual)
        noise = NoiseBlock(channel, self.noise_prior, holds_ratio=True)
        term = PairTerm(counts, scene.nodes.size, noise)
        begin = {
            curve_name(channel): space.nearest(start.edges),
            noise_name(channel): at_ratio(usual.ratio, start.log_floor),
            scene_name(channel): scene.log_weights,
        }
        first = ChannelMode(maximise([term], {curve_name(channel): space}, begin), channel)
        share = ridge_share(counts, space) * belief(first, space)

        def on_mode(done: int) -> None:
            if progress is not None:
                progress(done / len(RATIOS))

        modes = ridge([term], channel, space, first.mode.values, share, on_mode=on_mode)
        if progress is not None:
            progress(1.0)
        return Ridge(space, modes, share)

    # Other evidence, with level pairs or without

    def _of_curves(self, channels: Sequence[ChannelEvidence]) -> tuple[Response, ...]:
        search = self._settled(channels)
        any_curve = None
        if self.model is not None:
            any_curve = self._free._settled(channels).last  # noqa: SLF001 - of this class
        singles = self._singles(search.parts)
        aside = with_pairs = None
        if any(len(search.parts[each.channel]) < len(each.of_curve) for each in channels):
            aside = self._free._searched(_parts_of(channels))  # noqa: SLF001 - of this class
        if channels[0].get(LevelPairs) is not None:
            with_pairs = self._searched(search.parts, self._pairs_of(channels))
        exponent_known = any(part.determines_exponent for part in channels[0].of_curve)
        responses = []
        for each in channels:
            channel = each.channel
            judgement = _judged(channel, search.parts, search.last, any_curve)
            shown = [_judged(channel, parts, single, None).estimate for parts, single in singles]
            judgement = _both(judgement, _disagreement(judgement.estimate, shown))
            if shown:
                judgement = judgement._replace(
                    accounts=_shared(judgement.accounts, channel, search)
                )
            elif len(each.parts) > 1 and exponent_known:  # the others add nothing
                sole = tuple(replace(account, share=1.0) for account in judgement.accounts)
                judgement = judgement._replace(accounts=sole)
            if aside is not None:
                judgement = _with_unused(each, search.parts[channel], judgement, aside)
            noise, settled = _Noise.at(search.last.found[channel]), search.settled(channel)
            if with_pairs is not None:
                joint = with_pairs.found[channel]
                (fit,) = (fit for fit in joint.mode.fits if isinstance(fit, PairFit))
                of_noise = judged_beside(judgement.estimate, each[LevelPairs], fit)
                judgement = _both(judgement, _idle(of_noise) if exponent_known else of_noise)
                noise = _Noise.at(joint).beside(judgement.estimate, joint)
                settled = settled and joint.mode.settled
            mode = search.first.found[channel].mode
            responses.append(self._response(each, judgement, noise, mode, settled=settled))
        return tuple(responses)

    def _singles(self, parts: Parts) -> list[tuple[Parts, Searched]]:
        """Searches of a free curve by each kind alone; none if there is only one."""
        n_kinds = len(next(iter(parts.values())))
        if n_kinds == 1:
            return []
        alone: list[Parts] = [
            {channel: [own[place]] for channel, own in parts.items()} for place in range(n_kinds)
        ]
        return [(each, self._free._searched(each)) for each in alone]  # noqa: SLF001 - own

    def _settled(self, channels: Sequence[ChannelEvidence]) -> "_Search":
        """Search the curves, after a first search if exposures are not known."""
        parts = _parts_of(channels)
        exponent_known = any(part.determines_exponent for part in channels[0].of_curve)
        if exponent_known:
            parts = {name: _determining_exponent(own) for name, own in parts.items()}
        if all(part.is_settled for own in parts.values() for part in own):
            only = self._searched(parts)
            return _Search(parts, only, only)
        noise_known = channels[0].get(LevelPairs) is not None and not exponent_known
        first = self._searched(parts, self._pairs_of(channels) if noise_known else None)
        settled = {
            channel: tuple(
                part.settled_by(first.found[channel], noise_known=noise_known) for part in own
            )
            for channel, own in parts.items()
        }
        return _Search(settled, first, self._searched(settled))

    @property
    def _free(self) -> "LikelihoodSearch":
        """Same method with a free curve."""
        return replace(self, model=None)

    def _searched(self, parts: Parts, more: MoreTerms | None = None) -> Searched:
        everything = [part for own in parts.values() for part in own]
        shoulder = any(part.shows_shoulder for part in everything)
        constrains = any(part.constrains for part in everything)
        prior = self._prior(everything[0].n_levels, constrained=constrains)
        space = self._space(prior.with_shoulder() if shoulder else prior)
        return searched(parts, space, prior, more)

    def _pairs_of(self, channels: Sequence[ChannelEvidence]) -> MoreTerms:
        """Terms of level pairs beside others, weighted as along the ridge."""

        def more(edges: Mapping[str, Floats], _: Values) -> tuple[Sequence[AbstractTerm], Values]:
            terms: list[AbstractTerm] = []
            begin: dict[str, Floats] = {}
            for each in channels:
                pairs = each[LevelPairs]
                n_pairs = max(pairs.still.table.n_pairs, 1)
                most = RIDGE_PAIRS / n_pairs * self.weight / PAIR_WEIGHT
                counts = self._pair_counts(pairs, most)
                term, own = self._pair_term(counts, edges[curve_name(each.channel)], each.channel)
                terms.append(term)
                begin.update(own)
            return terms, begin

        return more

    def _pair_counts(self, pairs: LevelPairs, most: float = 1.0) -> PairCounts:
        n_pairs = max(pairs.still.table.n_pairs, 1)
        weight = min(
            self.weight * independent_share(pairs.n_frames), most, pairs.counts_as / n_pairs
        )
        return PairCounts.of(pairs.still.table, dark=pairs.dark, weight=weight)

    def _pair_term(
        self, counts: PairCounts, edges: Floats, channel: str
    ) -> tuple[PairTerm, dict[str, Floats]]:
        """Term of level pairs with a free ratio, and its start for a known curve."""
        noise = noise_given_curve(counts, edges, self.noise_prior.centre)
        scene = with_scene(edges, noise, counts, _SCENE_STEPS).scene
        begin = {
            noise_name(channel): np.log([noise.slope, noise.floor]),
            scene_name(channel): scene.log_weights - scene.log_weights.mean(),
        }
        block = NoiseBlock(channel, self.noise_prior)
        return PairTerm(counts, scene.nodes.size, block), begin

    def _response(
        self,
        evidence: ChannelEvidence,
        judgement: Judgement,
        noise: "_Noise",
        mode: Mode,
        *,
        settled: bool,
    ) -> Response:
        estimate = judgement.estimate
        if self.model is None and any(each.is_unexplained for each in judgement.accounts):
            # What was followed may not be the curve: the band holds the typical one too.
            typical = at_levels(irradiance_at_edges(self._typical(evidence).mean)[1:-1])
            estimate = estimate.with_level_errors(typical - estimate.inverse_lut)
        comparable = all(part.compares_families for part in evidence.of_curve)
        lowest, highest = zip(*(part.observed_levels for part in evidence.parts), strict=True)
        response = Response(
            name=evidence.channel,
            curve=estimate.curve,
            noise=noise.value,
            noise_error=noise.error,
            n_levels=estimate.inverse_lut.size,
            observed_levels=(min(lowest), max(highest)),
            n_pairs=sum(part.n_pixels for part in evidence.parts),
            method=self.method,
            status=_status(evidence, settled=settled),
            log_evidence=mode.log_evidence if comparable else None,
            inverse_lut_std=estimate.std,
            shape_std=estimate.shape_std,
            white_std=estimate.white_std,
            parameter_covariance=estimate.parameter_covariance,
            accounts=judgement.accounts,
        )
        doubts = (
            (Flag.SEARCH_UNFINISHED, not settled),
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(response.response_lut) < 0))),
        )
        return response.with_flags(*judgement.flags, *(flag for flag, holds in doubts if holds))

    def _prior(self, n_levels: int, *, constrained: bool = True) -> CurvePrior:
        """Mixture of populations; without evidence, the most common one."""
        if self.prior is not None:
            return self.prior
        weights = self.populations or weights_of(())
        if not constrained:
            return population_prior(weights.most_common, n_levels)
        return weights.prior(n_levels)

    def _typical(self, evidence: ChannelEvidence) -> CurvePrior:
        """Most common population."""
        prior = self._prior(evidence.parts[0].n_levels, constrained=False)
        return max(prior.parts, key=lambda part: part[0])[1] if prior.parts else prior

    def _space(self, prior: CurvePrior) -> AbstractCurveSpace:
        if self.model is not None:
            return FamilyCurve(self.model, prior.n_levels)
        return free_curve(prior)


def _with_populations(ridges: Sequence[Ridge]) -> Sequence[Ridge]:
    """Ridges of the channels of one camera, under the populations that they favour.

    Each channel shows its population at its best mode.
    """
    space = ridges[0].space
    if not isinstance(space, FreeCurve) or not space.populations:
        return ridges
    favour = [gains(max(each.modes, key=each.weighted).mode, space) for each in ridges]
    after = with_evidence(space, np.mean(favour, axis=0))
    return [
        replace(
            each,
            space=after,
            modes=[
                ChannelMode(in_space(found.mode, space, after), found.channel)
                for found in each.likely
            ],
        )
        for each in ridges
    ]


def _status(evidence: ChannelEvidence, *, settled: bool) -> Status:
    if not any(part.constrains for part in evidence.parts):
        return Status.ASSUMED
    return Status.CONVERGED if settled else Status.LIMIT_REACHED


class _Noise(NamedTuple):
    """Noise of single frames, if any evidence determines it."""

    value: AffineNoise | None
    error: NoiseError | None

    @classmethod
    def of(cls, log_noise: Floats | None, covariance: Floats | None) -> "_Noise":
        """Noise from the mean of (ln u, ln v) and their covariance."""
        if log_noise is None or covariance is None:
            return cls(None, None)
        return cls(affine(log_noise), NoiseError.from_covariance(covariance))

    @classmethod
    def at(cls, found: ChannelMode) -> "_Noise":
        """Noise at a mode."""
        return cls.of(found.log_noise, noise_covariance(found))

    def beside(self, estimate: CurveEstimate, joint: ChannelMode) -> "_Noise":
        """Noise from level pairs in units of a curve from other evidence.

        Level pairs add nothing to the curve, and make the light at white worse: off by
        0.004 without them, by 0.03 with them (medians of four cases of
        benchmarks/files.py, PNG, an exposure repeated, exposures known).
        """
        assert self.value is not None
        light = at_levels(joint.edges)
        scale = float(estimate.inverse_lut @ light / (light @ light))
        value = AffineNoise(self.value.slope * scale, self.value.floor * scale**2)
        return self._replace(value=value)


def _determining_exponent(parts: Sequence[AbstractCurveEvidence]) -> list[AbstractCurveEvidence]:
    """Parts that distinguish f from f^γ.

    Others would do harm beside these: JPEG brackets of unknown exposures raised the
    error of the shape from two raw shots from 0.0033 to 0.0054 (benchmarks/together.py,
    eight cases, median).
    """
    return [part for part in parts if part.determines_exponent]


def _with_unused(
    evidence: ChannelEvidence,
    used: Sequence[AbstractCurveEvidence],
    judgement: Judgement,
    everything: Searched,
) -> Judgement:
    """Add results of parts that did not contribute to the curve, such as exposures."""
    channel = evidence.channel
    found = everything.found[channel]
    kinds = {part.kind for part in used}
    for part, term in zip(evidence.of_curve, everything.terms[channel], strict=True):
        if part.kind not in kinds:
            aside = part.judged(judgement.estimate, found, term)
            judgement = _both(judgement, _idle(aside._replace(estimate=judgement.estimate)))
    return judgement


def _idle(judgement: Judgement) -> Judgement:
    """Judgement of evidence that did not contribute to the curve."""
    return judgement._replace(
        accounts=tuple(replace(each, share=0.0) for each in judgement.accounts)
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Search of all channels, and the first one, which settled exposures."""

    parts: Parts
    """Evidence as the last search used it."""
    first: Searched
    last: Searched

    def settled(self, channel: str) -> bool:
        """Whether both searches converged."""
        return all(each.found[channel].mode.settled for each in (self.first, self.last))


def _parts_of(channels: Sequence[ChannelEvidence]) -> Parts:
    return {each.channel: each.of_curve for each in channels}


def _judged(channel: str, parts: Parts, result: Searched, any_curve: Searched | None) -> Judgement:
    """Judgement of a search by the kinds of evidence that determine the curve.

    Each widens the bands by what its own model leaves out. With several kinds this is
    only a part of the error of the joint result, so their variances are averaged.
    """
    found = result.found[channel]
    estimate = CurveEstimate.of(at_mode(found, result.space, skewed=True), result.space)
    judgement = Judgement(estimate, (), ())
    if any_curve is not None:
        judgement = _missed(
            estimate, at_mode(any_curve.found[channel], any_curve.space, skewed=True)
        )
    bare, widened = judgement.estimate, []
    for part, term in zip(parts[channel], result.terms[channel], strict=True):
        own = part.judged(bare, found, term)
        widened.append(own.estimate)
        judgement = _both(judgement, own)
    return judgement._replace(estimate=with_mean_bands(widened))


def _shared(accounts: Sequence[Account], channel: str, search: "_Search") -> tuple[Account, ...]:
    """Accounts of several kinds, each with its share of the curve's information."""
    result, name = search.last, curve_name(channel)
    mode = result.found[channel].mode
    terms = {
        (owner, part.kind): term
        for owner, parts in search.parts.items()
        for part, term in zip(parts, result.terms[owner], strict=True)
        if curve_name(owner) in mode.edges
    }
    by_term = shares(mode, [*terms.values()], dict.fromkeys(mode.edges, result.space))[name]
    share = dict(zip(terms, by_term.tolist(), strict=True))
    return tuple(replace(each, share=share[channel, each.kind]) for each in accounts)


def _disagreement(estimate: CurveEstimate, singles: Sequence[CurveEstimate]) -> Judgement:
    """Compare the curve from each kind of evidence with that from all.

    A kind whose shape is further away than its own band allows is flagged, and the band
    is widened to hold it: one of them is wrong, and it is not known which.
    """
    flags: tuple[Flag, ...] = ()
    for shown in singles:
        light = shown.inverse_lut
        scale = float(light @ estimate.inverse_lut / (light @ light))
        off = scale * light - estimate.inverse_lut
        if np.mean(off**2) > _FAR_APART**2 * np.mean(shown.shape_or_all**2) + _ALIKE**2:
            flags = (Flag.DISAGREEMENT,)
            estimate = estimate.with_level_errors(off)
    return Judgement(estimate, flags, ())


def _missed(estimate: CurveEstimate, any_curve: Posterior) -> Judgement:
    """Widen a family's bands by its difference from a free curve.

    Only the part beyond the deviation of the free curve counts.
    """
    light, shown, spread = estimate.inverse_lut, any_curve.inverse, any_curve.spread
    assert spread is not None
    scale = float(light @ shown / (light @ light))
    missed = _beyond(scale * light - shown, spread.shape)
    white = float(_beyond(np.log(scale), spread.log_scale))
    of_light = _beyond(light - shown, any_curve.inverse_std)
    is_wrong = float(np.sqrt(np.mean(of_light**2))) > _WRONG
    wider = estimate.with_level_errors(np.hypot(missed, white * np.append(light[:-1], 0.0)))
    return Judgement(wider, (Flag.MISFIT,) if is_wrong else (), ())


def _beyond(error: Floats | float, std: Floats | float) -> Floats:
    """Part of an error beyond a deviation, in quadrature."""
    return np.asarray(np.sqrt(np.maximum(np.square(error) - np.square(std), 0.0)))


def _both(first: Judgement, then: Judgement) -> Judgement:
    """Two judgements combined; the second was given the estimate of the first."""
    return Judgement(then.estimate, (*first.flags, *then.flags), (*first.accounts, *then.accounts))


CALIBRATORS.register("likelihood", LikelihoodSearch)
