"""Curve from the noise level alone, by generalised least squares, in milliseconds.

The deviation of the noise observed at brightness O is σ_O = σ(I)/g′(O), so ln g′ is ½
ln(uI + v) − ln σ_O: linear in the log slopes w of g, up to ½ ln(1 + rI), for which a
few rounds suffice. The ratio r = u/v is kept at its assumed value: all ratios explain
the noise level equally well.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from chartless.curves.prior import CurvePrior, bin_edges, irradiance_at_edges
from chartless.evidence.noise.cooccurrence import difference_moments
from chartless.evidence.noise.likelihood import PairCounts, PairModel, Scene, with_scene
from chartless.noise import AffineNoise
from chartless.types import Bools, Floats, Indices

_ROUNDS = 4
_FEWEST = 50  # pairs at a level
_CLIPPED = 1.0  # deviations from the ends within which levels are clipped
_LEAST_VARIANCE = 0.02  # levels²; rounding alone gives 1/12
_MISFIT = 0.15  # deviation of ln σ from the model beyond chance
_ROUNDING = 0.15  # the same, in levels, by remaining rounding
_FLOOR_SPREAD = 2.0  # prior deviation of ½ ln v
_FURTHEST = 3.0  # of ½ ln v from its prior
_SCENE_STEPS = 3  # of expectation maximisation
_LEAST_LEVELS = 8  # needed to separate slope and floor of the noise
_LEAST_PART = 1e-3  # share of the noise: slope and floor have logarithms
_MANY = 1e6  # pairs assumed in the table of a model


class NoiseLevelFit(NamedTuple):
    """Curve and noise fitted to a noise level function."""

    log_slopes: Floats
    """Most probable log slopes, shape (L,)."""
    log_floor: float
    """ln v."""
    prior: CurvePrior
    used: Indices
    """Levels whose noise was used, shape (U,)."""
    gain: tuple[Floats, bool]
    """Cholesky factor of the covariance of what was seen at these levels, and "lower"."""

    @property
    def edges(self) -> Floats:
        """Irradiance between the levels, shape (L − 1,)."""
        return irradiance_at_edges(self.log_slopes)[1:-1]

    def noise(self, ratio: float) -> AffineNoise:
        """Noise with u = r v."""
        floor = float(np.exp(self.log_floor))
        return AffineNoise(ratio * floor, floor)

    @property
    def covariance(self) -> Floats:
        """Covariance of the log slopes, shape (L, L)."""
        known = self.prior.covariance[:, self.used]
        return np.asarray(self.prior.covariance - known @ cho_solve(self.gain, known.T))


def noise_levels(pairs: Floats) -> tuple[Floats, Floats]:
    """Noise variance about each level in levels², less rounding, and pairs used.

    Parameters
    ----------
    pairs : ndarray, shape (L, L)
        Symmetric counts of level pairs.

    Returns
    -------
    (ndarray, ndarray) of shapes (L,)
    """
    by_sum, _, squares = difference_moments(pairs)
    # Symmetric counts hold each pair twice. Odd sums lie halfway between two levels: half of them
    # for each.
    counts, moments = (
        each[::2] + 0.5 * (np.append(each[1::2], 0) + np.append(0, each[1::2]))
        for each in (by_sum / 2, squares / 2)
    )
    return moments / np.maximum(counts, 1) / 2 - 1 / 12, counts


def fit_noise_levels(
    seen: tuple[Floats, Floats],
    prior: CurvePrior,
    usual: AffineNoise,
    *,
    seen_share: Floats | float = 1.0,
) -> NoiseLevelFit:
    """Fit curve and floor at the ratio of usual noise.

    Parameters
    ----------
    seen : (ndarray, ndarray) of shapes (L,)
        Variance and number of pairs about each level, by `noise_levels`.
    prior : CurvePrior
    usual : AffineNoise
        Its ratio u/v is kept, its floor is a first guess.
    seen_share : ndarray of shape (L,) or float
        Share of the variance at each level that `noise_levels` measures: it differs
        from 1 by the histogram of the scene and the bend of the curve.

    Returns
    -------
    NoiseLevelFit
    """
    n_levels = prior.n_levels
    log_floor = float(np.log(usual.floor))
    variance, counts = seen
    deviation = np.sqrt(np.maximum(variance / seen_share, _LEAST_VARIANCE))
    (used,) = np.nonzero((counts > _FEWEST) & _unclipped(deviation))
    observed = -np.log(deviation[used] / (n_levels - 1))
    uncertain = _MISFIT**2 + 1 / counts[used] + (_ROUNDING / np.maximum(deviation[used], 0.1)) ** 2
    # y = w − ½ ln v + ½ ln(1 + rI) + error: condition the Gaussian process on y.
    covariance = prior.covariance[np.ix_(used, used)] + _FLOOR_SPREAD**2
    covariance[np.diag_indices_from(covariance)] += uncertain
    gain = cho_factor(covariance, lower=True)
    slopes = prior.mean
    half_floor = 0.5 * log_floor
    for _ in range(_ROUNDS):
        edges = irradiance_at_edges(slopes)
        middle = 0.5 * (edges[1:] + edges[:-1])[used]
        expected = prior.mean[used] - 0.5 * log_floor
        away = cho_solve(gain, observed + 0.5 * np.log1p(usual.ratio * middle) - expected)
        slopes = prior.mean + prior.covariance[:, used] @ away
        half_floor = 0.5 * log_floor - _FLOOR_SPREAD**2 * float(away.sum())
    # Slopes that do not sum to one imply another floor.
    scale = float(np.log(np.diff(bin_edges(n_levels)) @ np.exp(slopes)))
    half_floor = np.clip(
        half_floor - scale, 0.5 * log_floor - _FURTHEST, 0.5 * log_floor + _FURTHEST
    )
    return NoiseLevelFit(slopes - scale, 2 * float(half_floor), prior, used, gain)


def noise_level_start(
    counts: PairCounts, prior: CurvePrior, usual: AffineNoise
) -> tuple[NoiseLevelFit, Scene]:
    """Fit curve and floor at the ratio of usual noise, and the matching scene.

    The noise level is fitted twice: the first fit gives the share of the variance that
    differences of pairs show, given the histogram of the scene; the second corrects for
    it.
    """
    seen = noise_levels(counts.pairs)
    first = fit_noise_levels(seen, prior, usual)
    model = with_scene(first.edges, first.noise(usual.ratio), counts, _SCENE_STEPS)
    fit = fit_noise_levels(seen, prior, usual, seen_share=_seen_share(model))
    log_weights = model.scene.log_weights
    return fit, Scene(model.scene.nodes, log_weights - log_weights.mean())


def noise_given_curve(counts: PairCounts, edges: Floats, usual: AffineNoise) -> AffineNoise:
    """Noise from the differences of pairs where the curve is known.

    It is fitted by least squares of relative differences; `usual` if levels are too
    few.
    """
    variance, n_pairs = noise_levels(counts.pairs)
    deviation = np.sqrt(np.maximum(variance, _LEAST_VARIANCE))
    width = np.diff(np.concatenate([[0.0], edges, [1.0]]))
    light = np.concatenate([[0.0], (edges[1:] + edges[:-1]) / 2, [1.0]])
    (used,) = np.nonzero((n_pairs > _FEWEST) & _unclipped(deviation))
    if used.size < _LEAST_LEVELS:
        return usual
    seen = (deviation * width)[used] ** 2
    by_slope, by_floor = light[used] / seen, 1 / seen
    n = n_pairs[used]
    normal = np.array([[n @ by_slope**2, n @ (by_slope * by_floor)], [0.0, n @ by_floor**2]])
    normal[1, 0] = normal[0, 1]
    shown = np.array([n @ by_slope, n @ by_floor])
    slope, floor = np.linalg.solve(normal, shown)
    if slope < 0:
        slope, floor = 0.0, shown[1] / normal[1, 1]
    elif floor < 0:
        slope, floor = shown[0] / normal[0, 0], 0.0
    least = _LEAST_PART * float(np.median(seen))
    return AffineNoise(max(float(slope), least), max(float(floor), least))


def _unclipped(deviation: Floats) -> Bools:
    """Whether the noise at each level is not clipped at black or white."""
    last = deviation.size - 1
    level = np.arange(deviation.size)
    return (level - _CLIPPED * deviation >= _CLIPPED) & (
        level + _CLIPPED * deviation <= last - _CLIPPED
    )


def _seen_share(model: PairModel) -> Floats:
    """Share of a model's noise variance that `noise_levels` measures, shape (L,)."""
    edges = np.concatenate([[0.0], model.edges, [1.0]])
    n_levels = edges.size - 1
    seen, _ = noise_levels(2 * _MANY * model.pairs)
    slope = np.diff(edges) / np.diff(bin_edges(n_levels))
    deviation = model.noise.std(0.5 * (edges[1:] + edges[:-1])) / slope * (n_levels - 1)
    return np.asarray(np.maximum(seen, _LEAST_VARIANCE) / deviation**2)
