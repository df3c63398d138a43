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
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from chartless._pchip import pchip
from chartless.curve_space import AbstractCurveSpace, in_coordinates
from chartless.errors import ParameterError
from chartless.likelihood import Expansion, PairCounts, PairModel, Scene, scene_precision
from chartless.noise import TYPICAL_8BIT, TYPICAL_RATIO, TYPICAL_SPREAD, AffineNoise
from chartless.types import Floats

PAIR_WEIGHT = 0.2
"""Of a pair of pixels in the likelihood."""
RIDGE_PAIRS = 30_000
"""Weighted pairs that tell ratios apart, at most."""
RATIOS = (0.005, 0.013, 0.032, 0.08, 0.2, 0.5, 1.25, 3.1, 7.8, 20.0, 50.0)
"""Ratios r = u/v at which modes are sought."""
_MOST_STEPS, _MOST_TRIALS = 40, 12
_SETTLED = 0.1  # gain in nats
_LONGEST = 3.0  # step of any coordinate
_ROUNDING = 1e-9
_DROP = 1.5  # nats
_REFINEMENTS = 10
_WIDEST = 2.5  # distance of modes at the peak in deviations of the evidence
_FINE = 40  # ratios from one mode to the next at which they are interpolated


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A state of knowledge at a given ratio r."""

    coordinates: Floats
    """Of the curve, in its space, shape (P,)."""
    log_floor: float
    """ln v."""
    scene: Scene

    def noise(self, ratio: float) -> AffineNoise:
        """Noise with u = r v."""
        floor = float(np.exp(self.log_floor))
        return AffineNoise(ratio * floor, floor)


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """The most probable state at a ratio."""

    ratio: float
    """u/v, for irradiance from 0 to 1."""
    state: State
    edges: Floats
    """Shape (L − 1,)."""
    log_evidence: float
    """ln of the probability of the counts at this ratio, by Laplace, up to a constant."""
    known: float
    """The part of it that is prior of the noise and dark frames: never weighted down."""
    factor: Floats
    """Lower triangle R with R Rᵀ the information on coordinates, ln v and ln p."""
    steps: int
    settled: bool
    """Whether the search came to its end."""

    @property
    def noise(self) -> AffineNoise:
        """Noise at the mode."""
        return self.state.noise(self.ratio)


def maximise(counts: PairCounts, space: AbstractCurveSpace, ratio: float, start: State) -> Mode:
    """Most probable state at a ratio of the noise parameters, by Fisher scoring."""
    prior = _Prior(space, ratio, start.scene.nodes.size)
    state = start
    model = _model(space, state, ratio)
    value = model.log_likelihood(counts) + prior.log_density(state)
    damping, settled = 1e-4, False
    for steps in range(1, _MOST_STEPS + 1):  # noqa: B007 - used after the loop
        # At fixed r, ln u and ln v move together: the variance itself is the direction.
        expansion = model.expand(counts, model.deviation[np.newaxis] ** 2)
        gradient, information = _in_coordinates(space, state, expansion)
        gradient += prior.gradient(state)
        information += prior.precision
        diagonal = np.diag(information).copy()
        for _ in range(_MOST_TRIALS):
            damped = information.copy()
            damped[np.diag_indices_from(damped)] += damping * diagonal
            step = cho_solve(cho_factor(damped, lower=True, check_finite=False), gradient)
            scale = min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-9))
            trial = _moved(state, scale * step)
            try:
                trial_model = _model(space, trial, ratio)
            except ParameterError:  # no member of the family
                trial_value = -np.inf
            else:
                trial_value = trial_model.log_likelihood(counts) + prior.log_density(trial)
            if trial_value >= value - _ROUNDING:
                break
            damping = max(8 * damping, 1e-6)
        else:  # nothing near is better, or rounding hides it
            settled = float(gradient @ step) < _SETTLED
            break
        settled = trial_value - value < _SETTLED and scale == 1.0
        state, model, value = trial, trial_model, trial_value
        if settled:  # the information has hardly changed since
            break
        damping = max(damping / 8, 1e-9)
    factor = cholesky(information, lower=True, check_finite=False)
    dark = float(counts.dark @ np.log(model.dark)) if counts.dark.any() else 0.0
    return Mode(
        ratio=ratio,
        state=state,
        edges=space.edges(state.coordinates),
        log_evidence=value + 0.5 * space.log_precision - float(np.log(np.diag(factor)).sum()),
        known=prior.log_density_of_noise(state) + dark,
        factor=factor,
        steps=steps,
        settled=settled,
    )


class _Prior:
    """Of coordinates, ln v and ln p at one ratio."""

    def __init__(self, space: AbstractCurveSpace, ratio: float, n_nodes: int) -> None:
        centre = AffineNoise.from_8bit(*TYPICAL_8BIT)
        self._log_slope = np.log(centre.slope) - np.log(ratio)  # of ln v, from that of ln u
        self._log_floor = np.log(centre.floor)
        self._space = space
        self._scene = scene_precision(n_nodes)
        size = space.mean.size
        self.precision = np.zeros((size + 1 + n_nodes, size + 1 + n_nodes))
        self.precision[:size, :size] = space.precision
        self.precision[size, size] = 2 / TYPICAL_SPREAD**2
        self.precision[size + 1 :, size + 1 :] = self._scene

    def log_density(self, state: State) -> float:
        away = state.coordinates - self._space.mean
        log_weights = state.scene.log_weights
        squares = away @ self._space.precision @ away + log_weights @ self._scene @ log_weights
        return self.log_density_of_noise(state) - 0.5 * float(squares)

    def log_density_of_noise(self, state: State) -> float:
        squares = (state.log_floor - self._log_slope) ** 2 + (
            state.log_floor - self._log_floor
        ) ** 2
        return -0.5 * float(squares) / TYPICAL_SPREAD**2

    def gradient(self, state: State) -> Floats:
        away = state.coordinates - self._space.mean
        noise = 2 * state.log_floor - self._log_slope - self._log_floor
        return np.concatenate(
            [
                -self._space.precision @ away,
                [-noise / TYPICAL_SPREAD**2],
                -self._scene @ state.scene.log_weights,
            ]
        )


def _model(space: AbstractCurveSpace, state: State, ratio: float) -> PairModel:
    return PairModel(space.edges(state.coordinates), state.noise(ratio), state.scene)


def _moved(state: State, step: Floats) -> State:
    size = state.coordinates.size
    log_weights = state.scene.log_weights + step[size + 1 :]
    return State(
        state.coordinates + step[:size],
        state.log_floor + float(step[size]),
        Scene(state.scene.nodes, log_weights - log_weights.mean()),
    )


def _in_coordinates(
    space: AbstractCurveSpace, state: State, expansion: Expansion
) -> tuple[Floats, Floats]:
    """Gradient and information in (coordinates, ln v, ln p)."""
    pull = space.pull(state.coordinates)
    n_inner = expansion.gradient.size - 1 - state.scene.nodes.size
    own, rest = expansion.gradient[:n_inner], expansion.gradient[n_inner:]
    gradient = np.concatenate([pull(own), rest])
    return gradient, in_coordinates(expansion.information, n_inner, pull)


def warped(irradiance: Floats, ratio: float, other: float) -> Floats:
    """Irradiance at another ratio that keeps the stabilised scale T = ∫ dI/σ, from 0 to 1.

    Curves that differ by this warp alone have the same noise level at every brightness:
    I → ((1 + a′ (√(1 + rI) − 1)/a)² − 1)/r′ with a = √(1 + r) − 1.
    """
    scale = np.expm1(0.5 * np.log1p(other)) / np.expm1(0.5 * np.log1p(ratio))
    root = 1 + scale * np.expm1(0.5 * np.log1p(ratio * irradiance))
    return np.asarray((root**2 - 1) / other)


def _log_extent(ratio: float) -> float:
    """Logarithm of T over the whole range, at v = 1."""
    return float(np.log(2 * np.expm1(0.5 * np.log1p(ratio)) / ratio))


def predicted(space: AbstractCurveSpace, mode: Mode, ratio: float) -> State:
    """State at another ratio with the same noise level at every brightness."""
    state, nodes = mode.state, mode.state.scene.nodes
    edges = warped(mode.edges, mode.ratio, ratio)
    log_floor = state.log_floor + 2 * (_log_extent(ratio) - _log_extent(mode.ratio))
    moved = warped(nodes, mode.ratio, ratio)
    log_weights = state.scene.log_weights - np.log(np.gradient(moved, nodes))
    return State(
        space.nearest(edges),
        log_floor,
        Scene(nodes, np.interp(nodes, moved, log_weights - log_weights.mean())),
    )


def ridge(
    counts: PairCounts,
    space: AbstractCurveSpace,
    start: State,
    *,
    on_mode: Callable[[int], None] | None = None,
) -> list[Mode]:
    """Modes at `RATIOS`, each found from its neighbour, from `TYPICAL_RATIO` outward both ways.

    A way ends where the evidence, weighted as it will be, has fallen so far that what lies
    beyond adds nothing.

    Parameters
    ----------
    counts : PairCounts
    space : AbstractCurveSpace
    start : State
        At `TYPICAL_RATIO`.
    on_mode : callable, optional
        Called with the number of modes found, at most that of `RATIOS`.
    """
    share = ridge_share(counts, space)
    places = {RATIOS.index(TYPICAL_RATIO): maximise(counts, space, TYPICAL_RATIO, start)}
    first = next(iter(places))
    best = _weighted(places[first], share)
    for way in (1, -1):
        place = first
        while 0 <= place + way < len(RATIOS) and _weighted(places[place], share) > best - _DROP:
            ratio = RATIOS[place + way]
            begin = predicted(space, places[place], ratio)
            place += way
            places[place] = maximise(counts, space, ratio, begin)
            best = max(best, _weighted(places[place], share))
            if on_mode is not None:
                on_mode(len(places))
    return _refined(counts, space, [places[place] for place in sorted(places)], share)


def _refined(
    counts: PairCounts, space: AbstractCurveSpace, modes: list[Mode], share: float
) -> list[Mode]:
    """Add modes where the evidence is narrower than their distance, as with dark frames."""
    for _ in range(_REFINEMENTS):
        x = np.log([mode.ratio for mode in modes])
        y = np.array([_weighted(mode, share) for mode in modes])
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
        found = maximise(counts, space, ratio, predicted(space, near, ratio))
        modes = sorted([*modes, found], key=lambda mode: mode.ratio)
    return modes


def ridge_share(counts: PairCounts, space: AbstractCurveSpace) -> float:
    """Weight of the pairs' evidence along the ridge, 0 … 1."""
    if not space.tells_ratio:
        return 0.0
    return min(1.0, RIDGE_PAIRS / max(counts.weight * counts.n_pairs, 1.0))


def _weighted(mode: Mode, share: float) -> float:
    return share * (mode.log_evidence - mode.known) + mode.known


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
    best: Mode
    """Of the modes along the ridge that of highest evidence."""


def integrated(
    modes: list[Mode],
    space: AbstractCurveSpace,
    share: float,
    *,
    others: Sequence[list[Mode]] = (),
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
    """
    log_ratios = np.log([mode.ratio for mode in modes])
    evidence = np.array([_weighted(mode, share) for mode in modes])
    best = modes[int(evidence.argmax())]
    curves = np.array([at_levels(mode.edges) for mode in modes])
    log_floors = np.array([mode.state.log_floor for mode in modes])
    within = [_variances(mode, space) for mode in modes]
    curve_variances = np.array([variance for variance, _ in within])
    floor_variances = np.array([variance for _, variance in within])
    if len(modes) > 1:
        pieces = [np.linspace(*ends, _FINE, endpoint=False) for ends in pairwise(log_ratios)]
        fine = np.concatenate([*pieces, log_ratios[-1:]])
        evidence = pchip(log_ratios, evidence, fine)
        for each in others:
            evidence += _told_of_ratio(each, share, fine)
        share_of_mode = np.array([np.interp(fine, log_ratios, one) for one in np.eye(len(modes))])
        # Between modes the warp of each neighbour is nearly right: take of both by distance.
        curves = np.zeros((fine.size, best.edges.size + 1))
        for mode, parts in zip(modes, share_of_mode, strict=True):
            for place in np.flatnonzero(parts):
                edges = warped(mode.edges, mode.ratio, float(np.exp(fine[place])))
                curves[place] += parts[place] * at_levels(edges)
        log_floors, curve_variances, floor_variances = (
            share_of_mode.T @ values for values in (log_floors, curve_variances, floor_variances)
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
    centre = weights @ log_noise
    away = log_noise - centre
    covariance = (away * weights[:, np.newaxis]).T @ away + weights @ floor_variances
    return Posterior(mean, np.sqrt(variance), centre, covariance, best)


def _told_of_ratio(modes: list[Mode], share: float, log_ratios: Floats) -> Floats:
    """What the pairs of a channel tell of the ratio, without the prior; flat beyond its modes."""
    known = np.log([mode.ratio for mode in modes])
    told = np.array([share * (mode.log_evidence - mode.known) for mode in modes])
    if len(modes) == 1:
        return np.zeros(log_ratios.size)
    within = np.clip(log_ratios, known[0], known[-1])
    return np.asarray(pchip(known, told - told.max(), within))


def at_levels(edges: Floats) -> Floats:
    """Irradiance at the levels themselves: halfway between their edges, 0 and 1 at the ends."""
    return np.concatenate([[0.0], (edges[1:] + edges[:-1]) / 2, [1.0]])


def deviations_at_levels(pull: Callable[[Floats], Floats], covariance: Floats) -> Floats:
    """Deviation of g at the levels, shape (L,), from the covariance of log slopes."""
    changes = pull(_level_rows(len(covariance) - 1))
    variances = np.einsum("il,ij,jl->l", changes, covariance, changes, optimize=True)
    return np.concatenate([[0.0], np.sqrt(variances), [0.0]])


def _level_rows(n_inner: int) -> Floats:
    """How the inner levels follow from the edges, shape (L − 1, L − 2)."""
    return np.asarray(0.5 * (np.eye(n_inner)[:, 1:] + np.eye(n_inner)[:, :-1]))


def _variances(mode: Mode, space: AbstractCurveSpace) -> tuple[Floats, float]:
    """Variance of g at the levels, shape (L,), and of ln v, at the ratio of the mode."""
    n_inner, size = mode.edges.size, mode.state.coordinates.size
    changes = np.zeros((len(mode.factor), n_inner))
    changes[:size, 1:] = space.pull(mode.state.coordinates)(_level_rows(n_inner))
    changes[size, 0] = 1.0
    roots = solve_triangular(mode.factor, changes, lower=True, check_finite=False)
    variances = np.einsum("ij,ij->j", roots, roots)
    return np.concatenate([[0.0], variances[1:], [0.0]]), float(variances[0])
