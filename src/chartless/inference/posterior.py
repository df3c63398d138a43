"""Posterior mean and deviations of a curve, averaged over the noise ratio.

Modes along a ridge, and the points between them, are weighted by their evidence.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from chartless._numeric.pchip import pchip
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.search import Mode
from chartless.inference.stabilised import warped
from chartless.types import Floats

_DRAWS = 256  # pairs of curves from the posterior
_FINE = 40  # interpolated ratios from one mode to the next


class ScaleSpread(NamedTuple):
    """Deviation of g divided into scale and shape."""

    log_scale: float
    """Deviation of the log of the factor that brings a curve closest to the mean."""
    shape: Floats
    """Deviation of g at the levels after this scaling, shape (L,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior of one channel, the ratio of the noise parameters integrated out."""

    inverse: Floats
    """Mean of g at the levels, shape (L,)."""
    inverse_std: Floats
    """Deviation of g at the levels, shape (L,)."""
    log_noise: Floats | None
    """Mean of (ln u, ln v); None if no term reads them."""
    log_noise_covariance: Floats | None
    """Covariance of (ln u, ln v), shape (2, 2)."""
    coordinate_covariance: Floats
    """Covariance of a family's coordinates, shape (P, P); (0, 0) for a free curve,
    which has one for each level."""
    best: ChannelMode
    """Mode of highest evidence along the ridge."""
    best_variance: Floats
    """Variance of g at the levels, given the ratio of the best mode, shape (L,)."""
    spread: ScaleSpread | None
    """Spread of curves drawn from the posterior; None if none were drawn."""


def at_mode(found: ChannelMode, space: AbstractCurveSpace, *, skewed: bool = False) -> Posterior:
    """Posterior about a single mode.

    Parameters
    ----------
    found : ChannelMode
    space : AbstractCurveSpace
    skewed : bool
        Whether mean and deviation come from draws, see `drawn_curves`.
    """
    variance = _variances(found, space)
    curve, best_variance, drawn = at_levels(found.edges), variance, None
    if skewed and isinstance(space, FreeCurve):
        drawn = drawn_curves(found, space)
        curve, variance = drawn.mean(axis=0), drawn.var(axis=0)
    inverse = _increasing(curve)
    return Posterior(
        inverse=inverse,
        inverse_std=np.sqrt(variance + (curve - inverse) ** 2),
        log_noise=found.log_noise,
        log_noise_covariance=noise_covariance(found),
        coordinate_covariance=_coordinate_covariance(found, space),
        best=found,
        best_variance=best_variance,
        spread=None if drawn is None else scale_spread(drawn),
    )


def integrated(
    modes: Sequence[ChannelMode],
    space: AbstractCurveSpace,
    share: float,
    *,
    others: Sequence[Sequence[ChannelMode]] = (),
) -> Posterior:
    """Posterior over modes along the ridge, weighted by their evidence.

    Parameters
    ----------
    modes : sequence of ChannelMode
        Modes in order of their ratios.
    space : AbstractCurveSpace
    share : float
        Weight of the pairs' evidence.
    others : sequence of sequences of ChannelMode, optional
        Modes of other channels with the same noise ratio, whose pairs constrain it too.
    """
    if len(modes) == 1:
        return at_mode(modes[0], space)
    log_ratios = np.log([mode.ratio for mode in modes])
    evidence = np.array([mode.weighted(share) for mode in modes])
    top = int(evidence.argmax())
    within = [_variances(mode, space) for mode in modes]
    n_coordinates = space.mean.size if isinstance(space, FamilyCurve) else 0
    pieces = [np.linspace(*ends, _FINE, endpoint=False) for ends in pairwise(log_ratios)]
    fine = np.concatenate([*pieces, log_ratios[-1:]])
    evidence = pchip(log_ratios, evidence, fine)
    for each in others:
        evidence += _ratio_likelihood(each, share, fine)
    share_of_mode = np.stack([np.interp(fine, log_ratios, one) for one in np.eye(len(modes))])
    # Between modes the warp of each neighbour is nearly right: interpolate the two.
    curves = np.zeros((fine.size, modes[top].edges.size + 1))
    for mode, parts in zip(modes, share_of_mode, strict=True):
        for place in np.flatnonzero(parts):
            edges = warped(mode.edges, mode.ratio, float(np.exp(fine[place])))
            curves[place] += parts[place] * at_levels(edges)
    of_modes = (
        [mode.log_floor for mode in modes],
        within,
        [noise_covariance(mode) for mode in modes],
        [mode.coordinates[:n_coordinates] for mode in modes],
        [_coordinate_covariance(mode, space) for mode in modes],
    )
    log_floors, curve_variances, noise_covariances, coordinates, covariances = (
        np.tensordot(share_of_mode, np.array(values), axes=(0, 0)) for values in of_modes
    )
    weights = np.exp(evidence - evidence.max()) * np.gradient(fine)
    weights /= weights.sum()
    mean = _increasing(weights @ curves)
    variance = weights @ (curve_variances + (curves - mean) ** 2)
    log_noise = np.stack([log_floors + fine, log_floors], axis=1)
    return Posterior(
        inverse=mean,
        inverse_std=np.sqrt(variance),
        log_noise=weights @ log_noise,
        log_noise_covariance=_spread(log_noise, weights)
        + np.tensordot(weights, noise_covariances, axes=1),
        coordinate_covariance=_spread(coordinates, weights)
        + np.tensordot(weights, covariances, axes=1),
        best=modes[top],
        best_variance=within[top],
        spread=None,
    )


def _increasing(curve: Floats) -> Floats:
    """Mean of curves, made monotone again after rounding."""
    mean = np.maximum.accumulate(curve)
    return np.asarray(mean / mean[-1])


def drawn_curves(found: ChannelMode, space: FreeCurve) -> Floats:
    """Draws of g at the levels about a mode.

    Light is a sum of exponentials, so it is skewed where few pixels show the levels:
    its mean lies above the mode, and a deviation from derivatives is too small.

    Returns
    -------
    ndarray, shape (N, L)
        Draws in pairs on either side of the mode.
    """
    generator = np.random.default_rng(0)
    factor = found.mode.factor
    draws = generator.standard_normal((len(factor), _DRAWS))
    away = solve_triangular(factor, draws, lower=True, trans="T", check_finite=False)
    steps = away[found.curve_place].T
    curves = [space.edges(found.coordinates + way * step) for step in steps for way in (1, -1)]
    return np.array([at_levels(edges) for edges in curves])


def scale_spread(curves: Floats) -> ScaleSpread:
    """Divide the spread of curves, shape (N, L), into scale and shape."""
    mean = curves.mean(axis=0)
    scale = curves @ mean / (mean @ mean)
    shape = (curves / scale[:, np.newaxis]).std(axis=0)
    return ScaleSpread(float(np.log(scale).std()), shape)


def _spread(values: Floats, weights: Floats) -> Floats:
    """Covariance of rows with weights that sum to 1, shape (P, P)."""
    away = values - weights @ values
    return np.asarray((away * weights[:, np.newaxis]).T @ away)


def _ratio_likelihood(modes: Sequence[ChannelMode], share: float, log_ratios: Floats) -> Floats:
    """Log-likelihood of the ratio from a channel's pairs, constant beyond its modes.

    Priors are left out: curves of one camera are alike, and each would count its own
    again.
    """
    if len(modes) == 1:
        return np.zeros(log_ratios.size)
    known = np.log([found.ratio for found in modes])
    log_likelihood = np.array(
        [share * sum(fit.log_likelihood() - fit.firm for fit in found.mode.fits) for found in modes]
    )
    within = np.clip(log_ratios, known[0], known[-1])
    return np.asarray(pchip(known, log_likelihood - log_likelihood.max(), within))


def at_levels(edges: Floats) -> Floats:
    """Irradiance at the levels: halfway between their edges, 0 and 1 at the ends."""
    return np.concatenate([[0.0], (edges[1:] + edges[:-1]) / 2, [1.0]])


def deviations_at_levels(
    pull: Callable[[Floats], Floats], covariance: Floats, n_levels: int
) -> Floats:
    """Deviation of g at the levels, shape (L,), from the covariance of coordinates."""
    changes = pull(_level_rows(n_levels - 1))
    variances = np.einsum("il,ij,jl->l", changes, covariance, changes, optimize=True)
    return np.concatenate([[0.0], np.sqrt(variances), [0.0]])


def _level_rows(n_inner: int) -> Floats:
    """Matrix from the edges to the inner levels, shape (L − 1, L − 2)."""
    return np.asarray(0.5 * (np.eye(n_inner)[:, 1:] + np.eye(n_inner)[:, :-1]))


def noise_covariance(found: ChannelMode) -> Floats | None:
    """Covariance of (ln u, ln v) at a mode, shape (2, 2); None if no term reads it."""
    if found.noise_place is None:
        return None
    mix = found.noise_mix
    return np.asarray(mix.T @ covariance_of(found.mode, found.noise_place) @ mix)


def _variances(found: ChannelMode, space: AbstractCurveSpace) -> Floats:
    """Variance of g at the levels, shape (L,)."""
    changes = np.zeros((len(found.mode.factor), found.edges.size - 1))
    changes[found.curve_place] = space.pull(found.coordinates)(_level_rows(found.edges.size))
    roots = _roots(found.mode, changes)
    return np.concatenate([[0.0], np.einsum("ij,ij->j", roots, roots), [0.0]])


def _coordinate_covariance(found: ChannelMode, space: AbstractCurveSpace) -> Floats:
    """Covariance of the coordinates of a family; empty for a free curve."""
    place = found.curve_place
    n_coordinates = space.mean.size if isinstance(space, FamilyCurve) else 0
    return covariance_of(found.mode, slice(place.start, place.start + n_coordinates))


def covariance_of(mode: Mode, which: slice) -> Floats:
    """Covariance of some unknowns of a mode, in the order of its factor."""
    changes = np.eye(len(mode.factor))[:, which]
    if changes.shape[1] == 0:  # LAPACK may refuse
        return np.empty((0, 0))
    roots = _roots(mode, changes)
    return np.asarray(roots.T @ roots)


def _roots(mode: Mode, changes: Floats) -> Floats:
    """Root R of the covariance Rᵀ R of linear functions of the unknowns of a mode."""
    return np.asarray(solve_triangular(mode.factor, changes, lower=True, check_finite=False))
