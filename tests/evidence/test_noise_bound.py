"""The Cramér–Rao bound, against derivatives by differences and against simulated pairs."""

import numpy as np
import pytest
from scipy.special import ndtr

from chartless.evidence.noise.bound import pair_bound
from chartless.models import MODELS, AbstractModel
from chartless.noise import AffineNoise
from chartless.types import Floats

LEVELS = 24
NOISE = AffineNoise(0.01, 0.002)
SCENE = np.random.default_rng(0).beta(1.2, 1.5, 100_000)
NODES = 128


def pairs(model: AbstractModel, numbers: Floats) -> Floats:
    """Probability of each pair of levels, written anew from the definition."""
    p = model.n_parameters
    noise = AffineNoise(*np.exp(numbers[p : p + 2]))
    weights = np.exp(numbers[p + 2 :])
    weights /= weights.sum()
    nodes = (np.arange(NODES) + 0.5) / NODES
    edges = model.inverse((np.arange(1, LEVELS) - 0.5) / (LEVELS - 1), numbers[:p])
    edges = np.concatenate([[-np.inf], edges, [np.inf]])
    below = ndtr((edges[:, np.newaxis] - nodes) / noise.std(nodes))
    shares = np.diff(below, axis=0)
    return (shares * weights) @ shares.T


@pytest.mark.parametrize(
    ("name", "parameters"), [("gamma", [0.5]), ("ameegc2-exact", [-0.6, 1.7, 0.1])]
)
def test_the_bound_is_that_of_information_by_differences(
    name: str, parameters: list[float]
) -> None:
    model, n_pairs = MODELS[name], 1e5
    weights = np.histogram(SCENE, bins=NODES, range=(0, 1))[0] + 0.5
    truth = np.concatenate(
        [parameters, np.log([NOISE.slope, NOISE.floor]), np.log(weights / weights.sum())]
    )
    steps = 1e-5 * np.eye(truth.size)
    slopes = np.array(
        [(pairs(model, truth + s) - pairs(model, truth - s)).ravel() / 2e-5 for s in steps]
    )
    information = n_pairs * (slopes / pairs(model, truth).ravel()) @ slopes.T
    n_curve = len(parameters) + 2
    rough = np.diff(np.eye(NODES), axis=0) / 0.5
    information[n_curve:, n_curve:] += rough.T @ rough + 1e-6 * np.eye(NODES)
    covariance = np.linalg.inv(information)
    grid = np.linspace(0, 1, 1024)
    gradient = model.gradient(grid, parameters)
    p = len(parameters)
    expected = np.sqrt(np.einsum("ij,jk,ik->i", gradient, covariance[:p, :p], gradient))

    bound = pair_bound(model, np.array(parameters), NOISE, SCENE, n_pairs, n_levels=LEVELS)

    np.testing.assert_allclose(bound.response, expected, rtol=2e-3, atol=1e-7)
    assert bound.log_slope == pytest.approx(np.sqrt(covariance[p, p]), rel=2e-3)
    assert bound.log_floor == pytest.approx(np.sqrt(covariance[p + 1, p + 1]), rel=2e-3)
    assert bound.rmse == pytest.approx(np.sqrt(np.mean(expected**2)), rel=2e-3)


def test_four_times_the_pairs_halve_the_bound_where_the_scene_is_not_the_limit() -> None:
    model, parameters = MODELS["gamma"], np.array([0.5])

    bounds = [
        pair_bound(model, parameters, NOISE, SCENE, n, n_levels=LEVELS).rmse for n in (1e7, 4e7)
    ]

    assert bounds[0] / bounds[1] == pytest.approx(2, rel=0.15)


def test_finer_levels_tell_more() -> None:
    model, parameters = MODELS["ameegc2-exact"], np.array([-0.6, 1.7, 0.1])

    bounds = [
        pair_bound(model, parameters, NOISE, SCENE, 1e5, n_levels=n).rmse for n in (16, 32, 256)
    ]

    assert bounds[0] > bounds[1] > bounds[2]
