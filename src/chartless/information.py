"""How well can the response be known from level pairs at all? The Cramér–Rao bound.

A pixel of true irradiance Ĩ shows level i with probability A[i, Ĩ] = Φ((e_{i+1} − Ĩ)/σ) −
Φ((e_i − Ĩ)/σ), e_i = g((i − ½)/(L − 1)) the irradiance at the lower edge of the level, e_0 = −∞ and
e_L = ∞: rounding and clipping are part of it. With a scene of weights p at nodes Ĩ_k, two
frames show the pair (i, j) with probability Q = A diag(p) Aᵀ.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from chartless.models import UNIFORM_IRRADIANCE, AbstractModel
from chartless.noise import AffineNoise
from chartless.objectives import half_levels
from chartless.types import Floats

# Nodes of the scene lie no further apart than this part of the least noise, √v.
_SPACING = 0.67
# Logarithms of neighbouring weights differ by this much in scenes, at 128 nodes.
_SCENE_STEP, _SCENE_NODES = 0.5, 128
_LEAST_SHARE = 1e-12
_ROWS = 32  # of the table that are at work at once


class Bound(NamedTuple):
    """Least deviations of unbiased estimates."""

    response: Floats
    """Of f at 1024 uniform irradiances, shape (1024,)."""
    log_slope: float
    """Of ln u."""
    log_floor: float
    """Of ln v."""

    @property
    def rmse(self) -> float:
        """Root mean square of the deviations of f."""
        return float(np.sqrt(np.mean(self.response**2)))


def pair_bound(
    model: AbstractModel,
    parameters: Floats,
    noise: AffineNoise,
    scene: Floats,
    n_pairs: float,
    *,
    n_levels: int = 256,
) -> Bound:
    """Cramér–Rao bound for the response, with noise and scene unknown too.

    Parameters
    ----------
    model : AbstractModel
        Family that the truth belongs to.
    parameters : ndarray, shape (P,)
        Of the true response.
    noise : AffineNoise
    scene : ndarray of float, any shape, 0 … 1
        True irradiance; its histogram counts. The estimator is taken to know that logarithms
        of neighbouring weights differ by about 0.5, and nothing else about it.
    n_pairs : float
        Independent pixel pairs.
    n_levels : int
        L.

    Returns
    -------
    Bound
    """
    n_nodes = max(_SCENE_NODES, int(np.ceil(1 / (_SPACING * np.sqrt(noise.floor)))))
    nodes = (np.arange(n_nodes) + 0.5) / n_nodes
    weights = np.histogram(scene, bins=n_nodes, range=(0.0, 1.0))[0] + 0.5
    weights = weights / weights.sum()
    shares, slopes = _shares(model, parameters, noise, nodes, n_levels)
    weighted = shares * weights
    pairs = np.maximum(weighted @ shares.T, _LEAST_SHARE)

    of_curve = np.array([slope @ weighted.T for slope in slopes])
    of_curve += of_curve.transpose(0, 2, 1)
    n_curve = len(slopes)
    information = np.zeros((n_curve + n_nodes, n_curve + n_nodes))
    for first in range(0, n_levels, _ROWS):
        rows = slice(first, first + _ROWS)
        (near,) = np.nonzero(pairs[rows].max(axis=0) > _LEAST_SHARE)  # a band of the table
        columns = slice(near[0], near[-1] + 1)
        seen = pairs[rows, columns].ravel()
        by_curve = of_curve[:, rows, columns].reshape(n_curve, -1)
        by_scene = np.einsum("ik,jk->kij", weighted[rows], shares[columns]).reshape(n_nodes, -1)
        by_scene -= weights[:, np.newaxis] * seen  # the weights add up to 1
        changes = np.vstack([by_curve, by_scene])
        information += n_pairs * (changes / seen) @ changes.T

    steps = np.diff(np.eye(n_nodes), axis=0) / (_SCENE_STEP * np.sqrt(_SCENE_NODES / n_nodes))
    information[n_curve:, n_curve:] += steps.T @ steps
    information[n_curve:, n_curve:] += 1e-6 * np.eye(n_nodes)  # their common factor is no matter
    covariance = np.linalg.inv(information)[:n_curve, :n_curve]
    n_parameters = parameters.size
    gradient = model.gradient(UNIFORM_IRRADIANCE, parameters)
    of_response = covariance[:n_parameters, :n_parameters]
    variance = np.einsum("ij,jk,ik->i", gradient, of_response, gradient)
    log_slope, log_floor = np.sqrt(np.diag(covariance)[n_parameters:])
    return Bound(np.sqrt(variance.clip(min=0)), float(log_slope), float(log_floor))


def _shares(
    model: AbstractModel, parameters: Floats, noise: AffineNoise, nodes: Floats, n_levels: int
) -> tuple[Floats, list[Floats]]:
    """A, shape (L, K), and its derivatives in the curve's parameters, ln u and ln v."""
    deviation = noise.std(nodes)
    inner = model.inverse(half_levels(n_levels)[1::2], parameters)
    rise = model.derivative(inner, parameters)
    by_parameter = -model.gradient(inner, parameters) / rise[:, np.newaxis]
    distance = (inner[:, np.newaxis] - nodes) / deviation
    below = np.vstack([np.zeros(nodes.size), ndtr(distance), np.ones(nodes.size)])
    density = np.exp(-(distance**2) / 2) / np.sqrt(2 * np.pi)

    def share_of(change: Floats) -> Floats:
        ends = np.zeros((1, nodes.size))
        return np.diff(np.vstack([ends, change, ends]), axis=0)

    by_edge = density / deviation
    changes = [share_of(by_edge * column[:, np.newaxis]) for column in by_parameter.T]
    changes += [
        share_of(-density * distance * part / (2 * deviation**2))
        for part in (noise.slope * nodes, np.full_like(nodes, noise.floor))
    ]
    return np.diff(below, axis=0), changes
