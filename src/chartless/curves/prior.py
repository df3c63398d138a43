"""Priors of response curves: Gaussian distributions of the log slope of g in each level.

A curve is a number w for each of the L levels: the log slope of the inverse response g in
the bin of the level. The exponentials, summed and divided by their total, give the
irradiance between the levels: increasing by construction, through both ends, and no curve
is excluded. A Gaussian process keeps it from following every fluctuation of the counts:
mean and covariance of w over measured cameras, with additional roughness, so that other
cameras are not excluded.

A prior may also be a mixture of several (`mixed`). `chartless.curves.populations` has the
priors of populations of cameras.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from chartless.types import Floats, JsonObject

N_BINS = 256
"""Levels at which the prior is kept; at other numbers it is interpolated."""
# Roughness that smooth measured curves lack: Matérn 3/2 of this share of their deviation and
# this length in brightness; and white, per level. docs/design/0006 has what other values do.
_ROUGHNESS, _LENGTH, _WHITE = 0.02, 8 / 255, 0.003
# What DoRF does not know of digital cameras: how hard their shoulders are. Matérn 3/2 of this
# deviation at white and this length in ln of the distance from white, as shoulders are powers of
# it; it falls off by e within so much brightness. scripts/fit_shoulder.py has what was fitted.
_SHOULDER, _SHOULDER_LENGTH, _SHOULDER_REACH = 0.7, 0.75, 32 / 255
# Share of DoRF's deviations in the prior of digital cameras, for curves unlike the few
# that were measured: with it, the band of shape holds 99 % of the patches of cameras left
# out (benchmarks/one_picture.py).
_OTHER_CAMERAS = 0.25
_LEAST_SCALE = 1e-9  # of principal components, relative to the first
_STEEPEST = 5.0
"""Digitised curves have plateaus; their log slope is cut here."""


def bin_edges(n_levels: int) -> Floats:
    """Brightness at the lower end, between and at the upper end of the levels, shape (L + 1,)."""
    inner = (np.arange(1, n_levels) - 0.5) / (n_levels - 1)
    return np.concatenate([[0.0], inner, [1.0]])


def irradiance_at_edges(log_slopes: Floats) -> Floats:
    """G at `bin_edges`, shape (L + 1,), from 0 to 1, increasing.

    Parameters
    ----------
    log_slopes : ndarray, shape (L,)
        Up to a constant.
    """
    widths = np.diff(bin_edges(log_slopes.size)) * np.exp(log_slopes - log_slopes.max())
    edges = np.concatenate([[0.0], np.cumsum(widths)])
    return np.asarray(edges / edges[-1])


def log_slopes_of(irradiance: Floats) -> Floats:
    """Log slopes, shape (L,), of a curve given by g at `bin_edges`, shape (L + 1,)."""
    brightness = bin_edges(irradiance.size - 1)
    slopes = np.diff(irradiance) / np.diff(brightness)
    return np.log(np.clip(slopes, np.exp(-_STEEPEST), np.exp(_STEEPEST)))


def log_slopes_of_response(irradiance: Floats, brightness: Floats) -> Floats:
    """Log slopes at `N_BINS` levels, shape (256,), of a response measured at N points.

    Parameters
    ----------
    irradiance : ndarray, shape (N,)
        Increasing from 0 to 1.
    brightness : ndarray, shape (N,)
        From 0 to 1, never decreasing.
    """
    trifle = 1e-9 * np.arange(irradiance.size)  # plateaus have a first and a last point
    return log_slopes_of(np.interp(bin_edges(N_BINS), brightness + trifle, irradiance))


@dataclass(frozen=True, eq=False)
class CurvePrior:
    """Gaussian distribution of log slopes."""

    mean: Floats
    """Shape (L,)."""
    covariance: Floats
    """Shape (L, L)."""
    parts: tuple[tuple[float, "CurvePrior"], ...] = ()
    """Weights and distributions of a mixture that has this mean and covariance; empty if
    the distribution is a Gaussian itself."""

    @property
    def n_levels(self) -> int:
        """L."""
        return self.mean.size

    @cached_property
    def precision(self) -> Floats:
        """Inverse of the covariance, shape (L, L)."""
        return np.asarray(np.linalg.inv(self.covariance), np.float64)

    def with_shoulder(self) -> "CurvePrior":
        """Return the same prior with shoulders of any hardness next to white.

        For exposures, which show all levels but the last. To noise, which shows less, the term
        would only be one more thing that is not known.
        """
        return _with_shoulder(self)


@lru_cache(maxsize=16)
def _with_shoulder(prior: CurvePrior) -> CurvePrior:
    hard = shoulder_covariance(prior.n_levels)
    parts = tuple(
        (weight, CurvePrior(part.mean, part.covariance + hard)) for weight, part in prior.parts
    )
    return CurvePrior(prior.mean, prior.covariance + hard, parts)


def mixed(
    parts: Sequence[tuple[float, CurvePrior]], *, centre: CurvePrior | None = None
) -> CurvePrior:
    """Mixture of priors, with its mean and covariance.

    Parameters
    ----------
    parts : sequence of (float, CurvePrior)
        Weights, which need not add up to 1, and priors of one number of levels.
    centre : CurvePrior, optional
        Prior whose mean is to be kept; the covariance is then about that mean.
    """
    weights = np.array([weight for weight, _ in parts], dtype=np.float64)
    weights /= weights.sum()
    means = np.array([part.mean for _, part in parts])
    mean = weights @ means if centre is None else centre.mean
    apart = means - mean
    covariance = (apart.T * weights) @ apart
    for weight, (_, part) in zip(weights, parts, strict=True):
        covariance += weight * part.covariance
    priors = [part for _, part in parts]
    return CurvePrior(mean, covariance, tuple(zip(weights.tolist(), priors, strict=True)))


@dataclass(frozen=True, slots=True, eq=False)
class LogSlopeBasis:
    """Mean and principal components of the log slopes of cameras, at `N_BINS` levels."""

    mean: Floats
    """Shape (256,)."""
    components: Floats
    """Each times its deviation, shape (K, 256)."""

    def save(self, name: str, provenance: JsonObject) -> Path:
        """Write the data of the package that belong to a population; return the file."""
        path = Path(__file__).with_name(f"{name}.npz")
        np.savez_compressed(
            path,
            allow_pickle=False,
            mean=self.mean.astype(np.float32),
            components=self.components.astype(np.float32),
            provenance=np.array(json.dumps(provenance)),
        )
        return path

    def prior(self, n_levels: int = N_BINS) -> CurvePrior:
        """Prior for pictures of so many levels."""
        centres = _centres(n_levels)
        known = _centres(N_BINS)
        mean, *components = (
            np.interp(centres, known, row) for row in (self.mean, *self.components)
        )
        loadings = np.array(components)
        covariance = loadings.T @ loadings
        deviation = np.sqrt(np.diag(covariance))
        distance = np.sqrt(3) * np.abs(centres[:, np.newaxis] - centres) / _LENGTH
        matern = (1 + distance) * np.exp(-distance)
        relative = deviation / np.sqrt(np.mean(deviation**2))
        covariance += _ROUGHNESS**2 * np.outer(relative, relative) * matern
        covariance += _WHITE**2 * np.eye(n_levels)
        return CurvePrior(mean, covariance)


def log_slope_basis(irradiance: Floats, curves: Floats, n_components: int = 60) -> LogSlopeBasis:
    """Mean and leading principal components of the log slopes of measured responses.

    Parameters
    ----------
    irradiance : ndarray, shape (N,)
        Increasing from 0 to 1.
    curves : ndarray, shape (B, N)
        Brightness, from 0 to 1, never decreasing. Give each camera once.
    n_components : int
        At most this many.
    """
    rows = np.array([log_slopes_of_response(irradiance, curve) for curve in curves])
    mean = rows.mean(axis=0)
    _, deviations, components = np.linalg.svd(rows - mean, full_matrices=False)
    kept = slice(min(n_components, len(rows) - 1))
    scale = deviations[kept, np.newaxis] / np.sqrt(len(rows))
    return LogSlopeBasis(mean, scale * components[kept])


def digital_basis(cameras: Sequence[Floats], film: LogSlopeBasis) -> LogSlopeBasis:
    """Typical curve of digital cameras and its components, from a few measured cameras.

    Parameters
    ----------
    cameras : sequence of ndarray, shape (C, 256)
        Log slopes of the C channels of each camera. Each camera counts once.
    film : LogSlopeBasis
        Basis of a larger database, whose deviations count by a quarter.

    Returns
    -------
    LogSlopeBasis
        The mean is the interquartile mean over cameras at each level, which a single odd
        camera does not move.
    """
    typical = np.array([channels.mean(axis=0) for channels in cameras])
    quarter = len(cameras) // 4
    mean = np.sort(typical, axis=0)[quarter : len(cameras) - quarter].mean(axis=0)
    deviations = [
        (channels - mean) / np.sqrt((len(cameras) - 1) * len(channels)) for channels in cameras
    ]
    rows = np.concatenate([*deviations, _OTHER_CAMERAS * film.components])
    _, scale, components = np.linalg.svd(rows, full_matrices=False)
    kept = slice(len(film.components))
    return LogSlopeBasis(mean, scale[kept, np.newaxis] * components[kept])


def grouped_basis(groups: Sequence[Sequence[Floats]], more: Floats) -> LogSlopeBasis:
    """Mean and principal components of log slopes in groups, each group counted once.

    Parameters
    ----------
    groups : sequence of sequences of ndarray, shape (256,)
    more : ndarray, shape (K, 256)
        Components, times their deviations, for curves unlike those.
    """
    mean = np.mean([np.mean(rows, axis=0) for rows in groups], axis=0)
    deviations = [(np.array(rows) - mean) / np.sqrt(len(groups) * len(rows)) for rows in groups]
    rows = np.concatenate([*deviations, more])
    _, scale, components = np.linalg.svd(rows, full_matrices=False)
    kept = scale > _LEAST_SCALE * scale[0]
    return LogSlopeBasis(mean, scale[kept, np.newaxis] * components[kept])


def shoulder_covariance(
    n_levels: int,
    *,
    deviation: float = _SHOULDER,
    length: float = _SHOULDER_LENGTH,
    reach: float = _SHOULDER_REACH,
) -> Floats:
    """Covariance of log slopes by shoulders of any hardness, shape (L, L).

    Parameters
    ----------
    n_levels : int
    deviation : float
        At white.
    length : float
        In ln of the distance from white: log slopes of powers of that distance are linear in it.
    reach : float
        Brightness below white within which the term falls off by e.
    """
    below = 1 - _centres(n_levels)
    apart = np.sqrt(3) * np.abs(np.subtract.outer(np.log(below), np.log(below))) / length
    fading = deviation * np.exp(-below / reach)
    return np.asarray((1 + apart) * np.exp(-apart) * np.outer(fading, fading))


def _centres(n_levels: int) -> Floats:
    edges = bin_edges(n_levels)
    return np.asarray((edges[1:] + edges[:-1]) / 2)
