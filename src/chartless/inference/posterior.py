"""What level pairs tell: the most probable curve at each ratio of the noise parameters, and all.

With r = u/v held, the problem is nearly quadratic and Fisher scoring solves it in a few steps.
Across r the likelihood is long and curved: `ridge` walks along it, from one ratio to the next, and
gives each the Laplace approximation of its evidence; `integrated` adds up what they say.

Two weights keep the model from being believed more than it deserves; docs/design/0006 has the
figures. Pairs count as a fifth (`PAIR_WEIGHT`). The evidence along the ridge counts as that of no
more than `RIDGE_PAIRS` pairs: what tells ratios apart is how sharply the histogram of the scene
rises and falls, and scenes are not as the model takes them, however many pixels there are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, cholesky, solve_triangular

from chartless._numeric.pchip import pchip
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve, in_coordinates
from chartless.errors import ParameterError
from chartless.evidence.noise.likelihood import DARK_PIXELS, PairCounts
from chartless.evidence.noise.stabilised import log_extent, warped
from chartless.inference.terms import AbstractFit, AbstractTerm, PairFit
from chartless.noise import CAMERAS_OF_2008, AffineNoise, NoisePrior
from chartless.types import Bools, Floats

PAIR_WEIGHT = 0.2
"""Of a pair of pixels in the likelihood."""
RIDGE_PAIRS = 10_000
"""Weighted pairs that tell ratios apart, at most."""
RATIOS = (
    *(0.005, 0.013, 0.032, 0.08, 0.2, 0.5, 1.25, 3.1, 7.8, 20.0, 50.0),
    *(125.0, 310.0, 780.0, 2000.0, 5000.0),
)
"""Ratios r = u/v at which modes are sought."""
_MOST_STEPS, _MOST_TRIALS = 40, 12
_SETTLED = 0.1  # gain in nats
_LONGEST = 3.0  # step of any coordinate
_ROUNDING = 1e-9
_DROP = 3.0  # nats
_REFINEMENTS = 10
_WIDEST = 2.5  # distance of modes at the peak in deviations of the evidence
_DRAWS = 256  # pairs of curves from the posterior
_FINE = 40  # ratios from one mode to the next at which they are interpolated


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A state of knowledge."""

    coordinates: Floats
    """Of the curve, in its space, shape (P,)."""
    log_noise: Floats
    """(ln u, ln v)."""
    own: tuple[Floats, ...]
    """Unknowns of each term."""

    @classmethod
    def at_ratio(
        cls, ratio: float, coordinates: Floats, log_floor: float, own: tuple[Floats, ...]
    ) -> "State":
        """State with u = r v."""
        return cls(coordinates, np.array([np.log(ratio) + log_floor, log_floor]), own)

    @property
    def noise(self) -> AffineNoise:
        """U and v."""
        slope, floor = np.exp(self.log_noise)
        return AffineNoise(float(slope), float(floor))


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """The most probable state, at a ratio or at all."""

    state: State
    edges: Floats
    """Shape (L − 1,)."""
    fits: tuple[AbstractFit, ...]
    """The terms at this state."""
    mix: Floats
    """How (ln u, ln v) follow from the unknowns of the noise: one if r was held, or both."""
    log_evidence: float
    """ln of the probability of the counts at this ratio, by Laplace, up to a constant."""
    known: float
    """The part of it that is never weighted down: prior of the noise, and what is firm."""
    factor: Floats
    """Lower triangle R with R Rᵀ the information on coordinates, noise and own unknowns."""
    steps: int
    settled: bool
    """Whether the search came to its end."""

    @property
    def noise(self) -> AffineNoise:
        """Noise at the mode."""
        return self.state.noise

    @property
    def ratio(self) -> float:
        """R = u/v."""
        return self.noise.ratio


def maximise(
    terms: Sequence[AbstractTerm],
    space: AbstractCurveSpace,
    start: State,
    *,
    noise_prior: NoisePrior = CAMERAS_OF_2008,
    hold_ratio: bool = True,
    tolerance: float = _SETTLED,
) -> Mode:
    """Most probable state, by Fisher scoring.

    Parameters
    ----------
    terms : sequence of AbstractTerm
        Whose log-likelihoods are added.
    space : AbstractCurveSpace
    start : State
    noise_prior : NoisePrior
    hold_ratio : bool
        Whether u/v stays what it is at the start. Level pairs of one exposure hardly tell it.
    tolerance : float
        Gain of a step, in nats, below which the search is over.
    """
    # At fixed r, ln u and ln v move together.
    mix = np.ones((1, 2)) if hold_ratio else np.eye(2)
    prior = _Prior(space, terms, noise_prior, mix)
    held = np.concatenate(
        [np.zeros(space.mean.size + len(mix), dtype=bool), *(term.own_held for term in terms)]
    )
    state = start
    fits = _fits(terms, space, state)
    value = _value(fits) + prior.log_density(state)
    damping, settled, wary = 1e-4, False, False
    for steps in range(1, _MOST_STEPS + 1):  # noqa: B007 - used after the loop
        gradient, information = _expanded(fits, space, state, mix)
        # What follows the curve are logarithms of what acts. Where it is pulled down, exponentials
        # bend the likelihood by as much as they pull, and expected information knows nothing of it.
        bent = np.maximum(-gradient, 0.0)
        bent[: state.coordinates.size] = 0.0
        gradient += prior.gradient(state)
        information += prior.precision
        whole = information
        gradient, information = _without(held, gradient, whole)
        diagonal = np.diag(information).copy()
        for _ in range(_MOST_TRIALS):
            damped = information.copy()
            damped[np.diag_indices_from(damped)] += damping * diagonal + wary * bent
            step = cho_solve(cho_factor(damped, lower=True, check_finite=False), gradient)
            scale = min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-9))
            trial = _moved(terms, state, scale * step, mix)
            try:
                trial_fits = _fits(terms, space, trial)
            except ParameterError:  # no member of the family
                trial_value = -np.inf
            else:
                trial_value = _value(trial_fits) + prior.log_density(trial)
            if trial_value >= value - _ROUNDING:
                break
            damping, wary = max(8 * damping, 1e-6), True
        else:  # nothing near is better, or rounding hides it
            settled = float(gradient @ step) < tolerance
            break
        settled = trial_value - value < tolerance and scale == 1.0
        state, fits, value = trial, trial_fits, trial_value
        if settled:  # the information has hardly changed since
            break
        damping = max(damping / 8, 1e-9)
    if held.any():
        information = _cut(whole, held, prior.precision)
    factor = cholesky(information, lower=True, check_finite=False)
    return Mode(
        state=state,
        edges=space.edges(state.coordinates),
        fits=fits,
        mix=mix,
        log_evidence=value + 0.5 * space.log_precision - float(np.log(np.diag(factor)).sum()),
        known=prior.log_density_of_noise(state) + sum(fit.firm for fit in fits),
        factor=factor,
        steps=steps,
        settled=settled,
    )


def _without(held: Bools, gradient: Floats, information: Floats) -> tuple[Floats, Floats]:
    """Gradient and information by which what is held does not move, and nothing moves with it."""
    if not held.any():
        return gradient, information
    free = ~held
    return np.where(free, gradient, 0.0), np.where(
        np.logical_and.outer(free, free), information, np.diag(np.diag(information))
    )


def _cut(information: Floats, held: Bools, prior: Floats) -> Floats:
    r"""Precision where what is held keeps its prior and the rest follows it.

    If t is held with the precision Λ and the rest is c, the counts tell c given t alone: its
    covariance becomes :math:`H_{cc}^{-1} + H_{cc}^{-1} H_{ct} Λ^{-1} H_{tc} H_{cc}^{-1}`, as if
    the information on t were :math:`Λ + H_{tc} H_{cc}^{-1} H_{ct}` ("cutting feedback": Plummer
    2015, doi:10.1007/s11222-014-9503-z).
    """
    free = ~held
    with_held = information[np.ix_(free, held)]
    solved = cho_solve(cho_factor(information[np.ix_(free, free)], lower=True), with_held)
    precision = information.copy()
    precision[np.ix_(held, held)] = prior[np.ix_(held, held)] + with_held.T @ solved
    return precision


class _Prior:
    """Of coordinates, noise and the own unknowns of the terms."""

    def __init__(
        self,
        space: AbstractCurveSpace,
        terms: Sequence[AbstractTerm],
        noise: NoisePrior,
        mix: Floats,
    ) -> None:
        self._log_noise, self._noise_precision = noise.mean, noise.precision
        self._mix = mix
        self._centres = [space.mean, *(term.own_mean for term in terms)]
        self._precisions = [space.precision, *(term.own_precision for term in terms)]
        curve, *rest = self._precisions
        self.precision = block_diag(curve, mix @ noise.precision @ mix.T, *rest)

    def log_density(self, state: State) -> float:
        squares = sum(float(away @ pull) for away, pull in self._away(state))
        return self.log_density_of_noise(state) - 0.5 * squares

    def log_density_of_noise(self, state: State) -> float:
        away = state.log_noise - self._log_noise
        return -0.5 * float(away @ self._noise_precision @ away)

    def gradient(self, state: State) -> Floats:
        noise = self._mix @ self._noise_precision @ (state.log_noise - self._log_noise)
        (_, curve), *rest = self._away(state)
        return -np.concatenate([curve, noise, *(pull for _, pull in rest)])

    def _away(self, state: State) -> list[tuple[Floats, Floats]]:
        """How far curve and own unknowns are from their means, and that times the precision."""
        parts = zip((state.coordinates, *state.own), self._centres, self._precisions, strict=True)
        away = [(value - centre, precision) for value, centre, precision in parts]
        return [(each, precision @ each) for each, precision in away]


def _fits(
    terms: Sequence[AbstractTerm], space: AbstractCurveSpace, state: State
) -> tuple[AbstractFit, ...]:
    edges = space.edges(state.coordinates)
    return tuple(
        term.fit(edges, state.noise, own) for term, own in zip(terms, state.own, strict=True)
    )


def _value(fits: Sequence[AbstractFit]) -> float:
    return sum(fit.log_likelihood() for fit in fits)


def _moved(terms: Sequence[AbstractTerm], state: State, step: Floats, mix: Floats) -> State:
    sizes = [state.coordinates.size, len(mix), *(own.size for own in state.own)]
    curve, noise, *rest = np.split(step, np.cumsum(sizes)[:-1])
    return State(
        state.coordinates + curve,
        state.log_noise + noise @ mix,
        tuple(
            term.normalised(own + change)
            for term, own, change in zip(terms, state.own, rest, strict=True)
        ),
    )


def _expanded(
    fits: Sequence[AbstractFit], space: AbstractCurveSpace, state: State, mix: Floats
) -> tuple[Floats, Floats]:
    """Gradient and information in (coordinates, noise, own unknowns)."""
    expansions = [fit.expand(mix) for fit in fits]
    pull = space.pull(state.coordinates)
    n_shared = expansions[0].gradient.size - state.own[0].size
    n_inner = n_shared - len(mix)
    size = n_shared + sum(own.size for own in state.own)
    gradient, information = np.zeros(size), np.zeros((size, size))
    first = n_shared
    for expansion, own in zip(expansions, state.own, strict=True):
        shared, its_own = slice(n_shared), slice(first, first + own.size)
        places = list(zip((shared, its_own), (shared, slice(n_shared, None)), strict=True))
        for row, its_row in places:
            gradient[row] += expansion.gradient[its_row]
            for column, its_column in places:
                information[row, column] += expansion.information[its_row, its_column]
        first += own.size
    gradient = np.concatenate([pull(gradient[:n_inner]), gradient[n_inner:]])
    return gradient, in_coordinates(information, n_inner, pull)


def predicted(space: AbstractCurveSpace, mode: Mode, ratio: float) -> State:
    """State at another ratio with the same noise level at every brightness."""
    before = mode.ratio
    edges = warped(mode.edges, before, ratio)
    log_floor = float(mode.state.log_noise[1]) + 2 * (log_extent(ratio) - log_extent(before))
    return State.at_ratio(ratio, space.nearest(edges), log_floor, mode.state.own)


def ridge(
    terms: Sequence[AbstractTerm],
    space: AbstractCurveSpace,
    start: State,
    share: float,
    *,
    noise_prior: NoisePrior = CAMERAS_OF_2008,
    on_mode: Callable[[int], None] | None = None,
) -> list[Mode]:
    """Modes at `RATIOS`, each found from its neighbour, from the start outward both ways.

    A way ends where the evidence, weighted as it will be, has fallen so far that what lies
    beyond adds nothing.

    Parameters
    ----------
    terms : sequence of AbstractTerm
    space : AbstractCurveSpace
    start : State
        At a usual ratio, which takes the place of the nearest of `RATIOS`.
    share : float
        Weight of the pairs' evidence along the ridge, see `ridge_share`.
    noise_prior : NoisePrior
    on_mode : callable, optional
        Called with the number of modes found, at most that of `RATIOS`.
    """
    first = int(np.abs(np.log(np.divide(RATIOS, start.noise.ratio))).argmin())
    places = {first: maximise(terms, space, start, noise_prior=noise_prior)}
    best = weighted(places[first], share)
    for way in (1, -1):
        place = first
        while 0 <= place + way < len(RATIOS) and weighted(places[place], share) > best - _DROP:
            ratio = RATIOS[place + way]
            begin = predicted(space, places[place], ratio)
            place += way
            places[place] = maximise(terms, space, begin, noise_prior=noise_prior)
            best = max(best, weighted(places[place], share))
            if on_mode is not None:
                on_mode(len(places))
    modes = [places[place] for place in sorted(places)]
    return _refined(terms, space, modes, share, noise_prior)


def _refined(
    terms: Sequence[AbstractTerm],
    space: AbstractCurveSpace,
    modes: list[Mode],
    share: float,
    noise_prior: NoisePrior,
) -> list[Mode]:
    """Add modes where the evidence is narrower than their distance, as with dark frames."""
    for _ in range(_REFINEMENTS):
        x = np.log([mode.ratio for mode in modes])
        y = np.array([weighted(mode, share) for mode in modes])
        best = int(y.argmax())
        if not 0 < best < len(modes) - 1:
            break
        left, right = x[best] - x[best - 1], x[best + 1] - x[best]
        # The parabola through the best and its neighbours.
        fall_left, fall_right = (y[best] - y[best - 1]) / left, (y[best] - y[best + 1]) / right
        curvature = 2 * (fall_left + fall_right) / (left + right)
        deviation = 1 / np.sqrt(max(curvature, 1e-12))
        if max(left, right) < _WIDEST * deviation:
            break
        peak = x[best] + (fall_left * right - fall_right * left) / (fall_left + fall_right) / 2
        if abs(peak - x[best]) < deviation / 2:  # the peak is known: bring its sides nearer
            peak = x[best] + (deviation if right > left else -deviation)
        ratio = float(np.exp(peak))
        near = modes[int(np.abs(x - peak).argmin())]
        begin = predicted(space, near, ratio)
        found = maximise(terms, space, begin, noise_prior=noise_prior)
        modes = sorted([*modes, found], key=lambda mode: mode.ratio)
    return modes


def ridge_share(counts: PairCounts, space: AbstractCurveSpace) -> float:
    """Weight of the pairs' evidence along the ridge, 0 … 1."""
    if not space.tells_ratio:
        return 0.0
    return min(1.0, RIDGE_PAIRS / max(counts.weight * counts.n_pairs, 1.0))


def weighted(mode: Mode, share: float) -> float:
    """Evidence of a mode, that of the pairs at their weight along the ridge, see `ridge_share`."""
    return share * (mode.log_evidence - mode.known) + mode.known


def belief(mode: Mode, space: AbstractCurveSpace) -> float:
    """How much of the evidence to believe, 0 … 1, as far as the prior knows such curves.

    A prior whose scale were unknown would tell curves apart by P/(2q) of what it says, where P is
    the number of coordinates and q half the squared distance of the curve from its mean, about
    P/2 for curves that it knows.
    """
    away = mode.state.coordinates - space.mean
    surprise = 0.5 * float(away @ space.precision @ away)
    return min(1.0, 0.5 * away.size / max(surprise, 1e-9))


class ScaleSpread(NamedTuple):
    """How the deviation of g divides into that of its scale and that of its shape."""

    log_scale: float
    """Deviation of ln of the factor that brings a curve closest to the mean."""
    shape: Floats
    """Deviation of g at the levels when each curve is brought closest, shape (L,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """What counts tell, the ratio of the noise parameters integrated out."""

    inverse: Floats
    """Mean of g at the levels, shape (L,)."""
    inverse_std: Floats
    """Deviation of g at the levels, shape (L,)."""
    log_noise: Floats
    """Mean of (ln u, ln v)."""
    log_noise_covariance: Floats
    """Shape (2, 2)."""
    coordinate_covariance: Floats
    """Of the coordinates of a family, shape (P, P); (0, 0) for any curve, which has one
    for each level."""
    best: Mode
    """Of the modes along the ridge that of highest evidence."""
    mode_weights: Floats
    """How much of the posterior each mode stands for, of sum 1."""
    best_variance: Floats
    """Variance of g at the levels if the ratio is that of the best mode, shape (L,)."""
    spread: ScaleSpread | None
    """Of curves drawn from it; None if none were."""


def integrated(
    modes: list[Mode],
    space: AbstractCurveSpace,
    share: float,
    *,
    others: Sequence[list[Mode]] = (),
    skewed: bool = False,
) -> Posterior:
    """Posterior mean and deviations over modes along the ridge, each by its evidence.

    Parameters
    ----------
    modes : list of Mode
    space : AbstractCurveSpace
    share : float
        Weight of the pairs' evidence, see `ridge_share`.
    others : sequence of lists of Mode, optional
        Of other channels with the same ratio of the noise parameters: their pairs tell it too.
    skewed : bool
        Whether curves are drawn, see `drawn_curves`: they tell scale from shape and, if there is a
        single mode, mean and deviation.
    """
    log_ratios = np.log([mode.ratio for mode in modes])
    evidence = np.array([weighted(mode, share) for mode in modes])
    top = int(evidence.argmax())
    best = modes[top]
    curves = np.array([at_levels(mode.edges) for mode in modes])
    log_floors = np.array([mode.state.log_noise[1] for mode in modes])
    within = [_variances(mode, space) for mode in modes]
    curve_variances = np.array([variance for variance, _ in within])
    noise_covariances = np.array([covariance for _, covariance in within])
    n_coordinates = space.mean.size if isinstance(space, FamilyCurve) else 0
    coordinates = np.array([mode.state.coordinates[:n_coordinates] for mode in modes])
    covariances = np.array([covariance_of(mode, slice(n_coordinates)) for mode in modes])
    share_of_mode = np.eye(len(modes))
    drawn = None
    if skewed and len(modes) == 1 and isinstance(space, FreeCurve):
        drawn = drawn_curves(modes, np.ones(1), space)
        curves[0], curve_variances[0] = drawn.mean(axis=0), drawn.var(axis=0)
    if len(modes) > 1:
        pieces = [np.linspace(*ends, _FINE, endpoint=False) for ends in pairwise(log_ratios)]
        fine = np.concatenate([*pieces, log_ratios[-1:]])
        evidence = pchip(log_ratios, evidence, fine)
        for each in others:
            evidence += _told_of_ratio(each, share, fine)
        share_of_mode = np.stack([np.interp(fine, log_ratios, one) for one in share_of_mode])
        # Between modes the warp of each neighbour is nearly right: take of both by distance.
        curves = np.zeros((fine.size, best.edges.size + 1))
        for mode, parts in zip(modes, share_of_mode, strict=True):
            for place in np.flatnonzero(parts):
                edges = warped(mode.edges, mode.ratio, float(np.exp(fine[place])))
                curves[place] += parts[place] * at_levels(edges)
        known = (log_floors, curve_variances, noise_covariances, coordinates, covariances)
        log_floors, curve_variances, noise_covariances, coordinates, covariances = (
            np.tensordot(share_of_mode, values, axes=(0, 0)) for values in known
        )
        log_ratios = fine
    weights = np.exp(evidence - evidence.max())
    if len(modes) > 1:
        weights *= np.gradient(log_ratios)
    weights /= weights.sum()
    mean = np.maximum.accumulate(weights @ curves)
    mean /= mean[-1]  # rounding
    variance = weights @ (curve_variances + (curves - mean) ** 2)
    log_noise = np.stack([log_floors + log_ratios, log_floors], axis=1)
    mode_weights = share_of_mode @ weights
    if skewed and len(modes) > 1 and isinstance(space, FreeCurve):
        drawn = drawn_curves(modes, mode_weights, space)
    return Posterior(
        mean,
        np.sqrt(variance),
        weights @ log_noise,
        _spread(log_noise, weights) + np.tensordot(weights, noise_covariances, axes=1),
        _spread(coordinates, weights) + np.tensordot(weights, covariances, axes=1),
        best,
        mode_weights,
        within[top][0],
        None if drawn is None else scale_spread(drawn),
    )


def drawn_curves(modes: list[Mode], weights: Floats, space: FreeCurve) -> Floats:
    """Draws of g at the levels from the posterior, each mode as often as its weight asks for.

    Light is the sum of exponentials, so where levels are hardly seen it is skewed: its mean lies
    above the mode, and a deviation by derivatives is too small.

    Parameters
    ----------
    modes : list of Mode
    weights : ndarray, shape of `modes`
        Of sum 1.
    space : FreeCurve

    Returns
    -------
    ndarray, shape (N, L)
        Draws in pairs on either side of a mode.
    """
    generator = np.random.default_rng(0)
    curves = []
    for mode, weight in zip(modes, weights, strict=True):
        size = mode.state.coordinates.size
        draws = generator.standard_normal((len(mode.factor), round(_DRAWS * weight)))
        away = solve_triangular(mode.factor, draws, lower=True, trans="T", check_finite=False)
        for step in away[:size].T:
            curves += [space.edges(mode.state.coordinates + way * step) for way in (1, -1)]
    return np.array([at_levels(edges) for edges in curves])


def scale_spread(curves: Floats) -> ScaleSpread:
    """Divide the spread of curves, shape (N, L), into scale and shape."""
    mean = curves.mean(axis=0)
    scale = curves @ mean / (mean @ mean)
    shape = (curves / scale[:, np.newaxis]).std(axis=0)
    return ScaleSpread(float(np.log(scale).std()), shape)


def _spread(values: Floats, weights: Floats) -> Floats:
    """Covariance of rows of weights that sum to 1, shape (P, P)."""
    away = values - weights @ values
    return np.asarray((away * weights[:, np.newaxis]).T @ away)


def std_with_dark(posterior: Posterior, space: AbstractCurveSpace) -> Floats:
    """Deviation of g at the levels that would be left after two frames with the lens covered.

    Each has `DARK_PIXELS` pixels or more. What they are expected to tell narrows the curve at the
    best mode; what is unknown of the ratio stays, as they do not tell it.

    Returns
    -------
    ndarray, shape (L,)
    """
    best = posterior.best
    (model,) = (fit.model for fit in best.fits if isinstance(fit, PairFit))
    of_edges = model.dark_information(DARK_PIXELS, best.mix[:, 1] * best.noise.floor)
    told = in_coordinates(of_edges, best.edges.size, space.pull(best.state.coordinates))
    information = best.factor @ best.factor.T
    information[: len(told), : len(told)] += told
    surer = replace(best, factor=cholesky(information, lower=True, check_finite=False))
    after, _ = _variances(surer, space)
    return np.sqrt(after + np.maximum(posterior.inverse_std**2 - posterior.best_variance, 0.0))


def _told_of_ratio(modes: list[Mode], share: float, log_ratios: Floats) -> Floats:
    """What the pairs of a channel tell of the ratio, flat beyond its modes.

    Without the priors: curves of one camera are alike, and each would count theirs anew.
    """
    known = np.log([mode.ratio for mode in modes])
    told = np.array(
        [share * sum(fit.log_likelihood() - fit.firm for fit in mode.fits) for mode in modes]
    )
    if len(modes) == 1:
        return np.zeros(log_ratios.size)
    within = np.clip(log_ratios, known[0], known[-1])
    return np.asarray(pchip(known, told - told.max(), within))


def at_levels(edges: Floats) -> Floats:
    """Irradiance at the levels themselves: halfway between their edges, 0 and 1 at the ends."""
    return np.concatenate([[0.0], (edges[1:] + edges[:-1]) / 2, [1.0]])


def deviations_at_levels(
    pull: Callable[[Floats], Floats], covariance: Floats, n_levels: int
) -> Floats:
    """Deviation of g at the levels, shape (L,), from the covariance of coordinates."""
    changes = pull(_level_rows(n_levels - 1))
    variances = np.einsum("il,ij,jl->l", changes, covariance, changes, optimize=True)
    return np.concatenate([[0.0], np.sqrt(variances), [0.0]])


def _level_rows(n_inner: int) -> Floats:
    """How the inner levels follow from the edges, shape (L − 1, L − 2)."""
    return np.asarray(0.5 * (np.eye(n_inner)[:, 1:] + np.eye(n_inner)[:, :-1]))


def _variances(mode: Mode, space: AbstractCurveSpace) -> tuple[Floats, Floats]:
    """Variance of g at the levels, shape (L,), and covariance of (ln u, ln v), of a mode."""
    n_inner, size = mode.edges.size, mode.state.coordinates.size
    n_noise = len(mode.mix)
    changes = np.zeros((len(mode.factor), n_inner - 1 + n_noise))
    changes[:size, n_noise:] = space.pull(mode.state.coordinates)(_level_rows(n_inner))
    changes[size : size + n_noise, :n_noise] = np.eye(n_noise)
    roots = _roots(mode, changes)
    variances = np.einsum("ij,ij->j", roots, roots)[n_noise:]
    noise = roots[:, :n_noise].T @ roots[:, :n_noise]
    return np.concatenate([[0.0], variances, [0.0]]), mode.mix.T @ noise @ mode.mix


def covariance_of(mode: Mode, which: slice) -> Floats:
    """Covariance of some unknowns of a mode, in the order of its factor."""
    changes = np.eye(len(mode.factor))[:, which]
    if changes.shape[1] == 0:  # LAPACK may refuse
        return np.empty((0, 0))
    roots = _roots(mode, changes)
    return np.asarray(roots.T @ roots)


def _roots(mode: Mode, changes: Floats) -> Floats:
    """Square root of the covariance, of what changes so with the unknowns of a mode."""
    return np.asarray(solve_triangular(mode.factor, changes, lower=True, check_finite=False))
