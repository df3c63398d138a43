"""Cramér–Rao bound for the response from level pairs.

It uses the information of the exact likelihood, see
`chartless.evidence.noise.likelihood`, at the true values.
"""

from typing import NamedTuple

import numpy as np

from chartless.curves.prior import CurvePrior, bin_edges
from chartless.curves.space import FreeCurve, in_coordinates
from chartless.evidence.noise.likelihood import (
    SCENE_NODES,
    SPACING,
    PairModel,
    Scene,
    scene_precision,
)
from chartless.inference.posterior import deviations_at_levels
from chartless.models import UNIFORM_IRRADIANCE, AbstractModel
from chartless.noise import TYPICAL_SPREAD, AffineNoise
from chartless.types import Floats


class Bound(NamedTuple):
    """Least deviations of unbiased estimates."""

    response: Floats
    """Deviation of f at 1024 uniform irradiances, shape (1024,)."""
    log_slope: float
    """Deviation of ln u."""
    log_floor: float
    """Deviation of ln v."""

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
    """Cramér–Rao bound for the response, with noise and scene also unknown.

    Parameters
    ----------
    model : AbstractModel
        Family that the truth belongs to.
    parameters : ndarray, shape (P,)
        Parameters of the true response.
    noise : AffineNoise
    scene : ndarray of float, any shape, 0 … 1
        True irradiance; only its histogram matters. The estimator is assumed to know
        that logarithms of neighbouring weights differ by about 0.5, and nothing else
        about it.
    n_pairs : float
        Independent pixel pairs.
    n_levels : int
        Number of levels L.

    Returns
    -------
    Bound
    """
    inner = model.inverse(bin_edges(n_levels)[1:-1], parameters)
    slope = model.derivative(inner, parameters)
    jacobian = -model.gradient(inner, parameters) / slope[:, np.newaxis]
    pairs = PairModel(inner, noise, _histogram(scene, noise))
    information = n_pairs * in_coordinates(
        pairs.information(), inner.size, lambda rows: np.asarray(jacobian.T @ rows)
    )
    n_curve = parameters.size + 2
    information[n_curve:, n_curve:] += scene_precision(pairs.weights.size)
    covariance = np.linalg.inv(information)[:n_curve, :n_curve]
    n_parameters = parameters.size
    gradient = model.gradient(UNIFORM_IRRADIANCE, parameters)
    of_response = covariance[:n_parameters, :n_parameters]
    variance = np.einsum("ij,jk,ik->i", gradient, of_response, gradient)
    log_slope, log_floor = np.sqrt(np.diag(covariance)[n_parameters:])
    return Bound(np.sqrt(variance.clip(min=0)), float(log_slope), float(log_floor))


def free_bound(
    edges: Floats, noise: AffineNoise, scene: Floats, n_pairs: float, prior: CurvePrior
) -> float:
    """Least root mean square error of f over irradiance for an estimate of any curve.

    The Bayesian form (van Trees 1968, Detection, Estimation, and Modulation Theory, section 2.4):
    curve and noise have the priors that the noise experiment gives them.

    Parameters
    ----------
    edges : ndarray, shape (L − 1,)
        True irradiance between the levels.
    noise : AffineNoise
    scene : ndarray of float, any shape, 0 … 1
        True irradiance; only its histogram matters.
    n_pairs : float
        Independent pixel pairs.
    prior : CurvePrior
        Prior at the true curve; its mean does not matter.
    """
    space = FreeCurve(prior)
    pairs = PairModel(edges, noise, _histogram(scene, noise))
    pull = space.pull(space.nearest(edges))
    information = n_pairs * in_coordinates(pairs.information(), edges.size, pull)
    n_curve = prior.n_levels
    information[:n_curve, :n_curve] += space.precision
    information[[n_curve, n_curve + 1], [n_curve, n_curve + 1]] += TYPICAL_SPREAD**-2
    information[n_curve + 2 :, n_curve + 2 :] += scene_precision(pairs.weights.size)
    covariance = np.asarray(np.linalg.inv(information)[:n_curve, :n_curve], np.float64)
    deviations = deviations_at_levels(pull, covariance, edges.size + 1)
    # ∫ (σ_g f′)² dI over irradiance, level by level
    whole = np.concatenate([[0.0], edges, [1.0]])
    rise = np.diff(bin_edges(n_curve)) ** 2 / np.diff(whole)
    return float(np.sqrt(np.sum(deviations**2 * rise)))


def _histogram(scene: Floats, noise: AffineNoise) -> Scene:
    """Histogram of true irradiance at even nodes, fine enough for the noise at black."""
    n_nodes = max(SCENE_NODES, int(np.ceil(1 / (SPACING * np.sqrt(noise.floor)))))
    counts = np.histogram(scene, bins=n_nodes, range=(0.0, 1.0))[0] + 0.5
    return Scene((np.arange(n_nodes) + 0.5) / n_nodes, np.log(counts))
