"""Image similarity against direct integrals over light, and what makes it an objective."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr
from scipy.stats import norm

from chartless.curves import named_curve
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.methods.ism.objectives import (
    OBJECTIVES,
    BinnedPairs,
    SampledPairs,
    expected_table,
    half_levels,
    image_similarity,
    sampled_image_similarity,
)
from chartless.methods.ism.similarity import light_nodes, quadrature_similarity
from chartless.models import MODELS
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames

LINEAR = "ameegc2-exact:0,1.6487212707001282,-0.5413248546129181"
CAMERA = "ameegc2-exact:-0.8,1.8,-0.11"  # near the mean of measured cameras
NOISE = AffineNoise.from_8bit(0.03, 15)


def inverse_of(curve: str, n_levels: int = 256) -> np.ndarray:
    return named_curve(curve).inverse(half_levels(n_levels))


def shares_by_quadrature(inverse: np.ndarray, noise: AffineNoise, nodes: int = 600) -> np.ndarray:
    """∫ N(g_i; t, σ²) P(second frame shows level j | t) dt over light t in [0, 1], (L, L)."""
    t, weights = light_nodes(noise, nodes)
    deviation = noise.std(t)
    edges = np.concatenate([[-np.inf], inverse[1::2], [np.inf]])
    first = norm.pdf(inverse[::2, np.newaxis], t, deviation)
    second = np.diff(ndtr((edges[:, np.newaxis] - t) / deviation), axis=0)
    return (first * weights) @ second.T


def conditional(counts: np.ndarray) -> np.ndarray:
    """Share of each level among the partners of a level that is not clipped."""
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    shares[[0, -1]] = 0
    return shares


def cosine(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sum(a * b) / np.sqrt(np.sum(a**2) * np.sum(b**2)))


@pytest.fixture(scope="module")
def simulated() -> np.ndarray:
    """Symmetric counts of two frames of a scene with all light alike."""
    scene = np.random.default_rng(8).uniform(0, 1, (600, 800))
    first, second = simulate_frames(scene, named_curve(CAMERA), NOISE, seed=1)
    return Cooccurrence.of_pair(first, second).symmetric


def test_half_levels_alternate_levels_and_edges():
    halves = half_levels(256)

    assert halves.shape == (511,)
    np.testing.assert_allclose(halves[::2] * 255, np.arange(256), atol=1e-12)
    np.testing.assert_allclose(halves[1::2] * 255, np.arange(255) + 0.5, atol=1e-12)


@pytest.mark.parametrize(
    ("curve", "noise", "tolerance"),
    [
        # Errors in shares of a row; noise of 2 levels and more in the picture.
        (LINEAR, (0.03, 15), 2e-4),  # measured 7.9e-5
        (LINEAR, (0.01, 9), 3e-4),  # 1.7e-4
        (LINEAR, (0.06, 25), 1e-4),  # 3.7e-5
        (LINEAR, (0.06, 4), 6e-4),  # 4.8e-4
        (LINEAR, (0.01, 100), 1e-4),  # 4.9e-6
        # The camera squeezes white, where the noise falls below a level.
        (CAMERA, (0.03, 15), 3e-3),  # 1.2e-3
        (CAMERA, (0.01, 9), 3e-3),  # 2.6e-3
        (CAMERA, (0.5, 25), 3e-3),
    ],
)
def test_expected_shares_agree_with_direct_quadrature(
    curve: str, noise: tuple[float, float], tolerance: float
):
    inverse, model = inverse_of(curve), AffineNoise.from_8bit(*noise)
    reference = shares_by_quadrature(inverse, model)

    table = expected_table(inverse, model)

    error = np.abs(table - reference) / reference.sum(axis=1, keepdims=True)
    assert error[1:-1, 1:-1].max() < tolerance


@pytest.mark.parametrize(
    ("noise", "tolerance"),
    [
        ((0, 4), 5e-8),  # without slope only the normal distribution is left
        ((0, 9), 1e-9),
        ((0.001, 25), 1e-8),
        ((0.03, 15), 1e-6),
        ((0.06, 4), 5e-6),
        ((0.01, 1), 1e-5),
        ((0.001, 0.5), 1e-5),
    ],
    ids=str,
)
def test_expected_shares_are_nearly_exact_far_from_the_ends(
    noise: tuple[float, float], tolerance: float
):
    inverse, model = inverse_of(LINEAR), AffineNoise.from_8bit(*noise)
    reference = shares_by_quadrature(inverse, model, nodes=800)

    table = expected_table(inverse, model)

    np.testing.assert_allclose(table[80:176, 1:-1], reference[80:176, 1:-1], rtol=0, atol=tolerance)


@pytest.mark.parametrize("noise", [(0.03, 15), (0.01, 9), (0.06, 25)], ids=str)
@pytest.mark.parametrize("curve", [LINEAR, CAMERA], ids=["linear", "camera"])
@pytest.mark.parametrize("clipped", [0, 255], ids=["black", "white"])
def test_expected_shares_of_clipped_levels_agree_with_direct_quadrature(
    curve: str, noise: tuple[float, float], clipped: int
):
    inverse, model = inverse_of(curve), AffineNoise.from_8bit(*noise)
    reference = shares_by_quadrature(inverse, model)

    table = expected_table(inverse, model)

    error = np.abs(table - reference) / reference.sum(axis=1, keepdims=True)
    assert error[1:-1, clipped].max() < 0.045  # measured 0.041: see _CLIPPED_REACH


def test_rows_far_from_the_ends_sum_to_one():
    total = expected_table(inverse_of(LINEAR), NOISE)[60:190].sum(axis=1)

    np.testing.assert_allclose(total, 1, atol=1e-4)


def test_image_similarity_is_one_where_the_counts_are_as_expected():
    inverse = inverse_of(CAMERA)
    expected = expected_table(inverse, NOISE)
    expected[:100] = expected[200:] = 0  # rows shortened by the ends of light
    pairs = BinnedPairs.from_counts(np.rint(1e12 * expected).astype(np.int64))

    assert image_similarity(pairs, inverse, NOISE) == pytest.approx(1, abs=1e-9)
    twice = AffineNoise(2 * NOISE.slope, 2 * NOISE.floor)
    assert image_similarity(pairs, inverse, twice) < 0.98


def test_image_similarity_is_a_cosine_over_the_cells_with_counts():
    rng = np.random.default_rng(5)
    inverse = inverse_of(CAMERA, 64)
    noise = AffineNoise.from_8bit(0.3, 100)
    counts = rng.integers(1, 50, (64, 64)) * (rng.uniform(size=(64, 64)) < 0.3)
    counts[7] = 0
    counts[20] = [5] + 62 * [0] + [9]
    pairs = BinnedPairs.from_counts(counts)

    expected = np.where(conditional(counts) > 0, expected_table(inverse, noise), 0)

    value = image_similarity(pairs, inverse, noise)
    assert value == pytest.approx(cosine(conditional(counts), expected), rel=1e-12)


def test_only_cells_with_counts_are_evaluated(simulated: np.ndarray):
    pairs = BinnedPairs.from_counts(simulated)

    assert pairs.rows.size < 1.2 * np.count_nonzero(simulated) + 512
    np.testing.assert_allclose(pairs.shares @ pairs.shares, 1)
    shares = conditional(simulated)
    kept = shares >= 0.02 * shares.max(axis=1, keepdims=True)
    assert np.count_nonzero(pairs.shares) == np.count_nonzero(kept & (shares > 0))


@pytest.mark.parametrize("name", OBJECTIVES)
def test_partners_of_clipped_levels_say_nothing(name: str, simulated: np.ndarray):
    inverse, objective = inverse_of(CAMERA), OBJECTIVES[name]
    flooded = simulated.copy()
    flooded[0, 0] += 10**7  # a black border
    flooded[-1, -1] += 10**7

    value, unflooded = (
        objective.evaluate(objective.prepare(counts), inverse, NOISE)
        for counts in (flooded, simulated)
    )

    assert value == pytest.approx(unflooded, rel=1e-12)


@pytest.mark.parametrize("name", OBJECTIVES)
def test_objectives_do_not_depend_on_how_many_pixels_were_counted(name: str, simulated: np.ndarray):
    inverse, objective = inverse_of(CAMERA), OBJECTIVES[name]

    once = objective.evaluate(objective.prepare(simulated), inverse, NOISE)
    often = objective.evaluate(objective.prepare(7 * simulated), inverse, NOISE)

    assert often == pytest.approx(once, rel=1e-12)


@given(
    seed=st.integers(0, 2**32 - 1),
    offset=st.lists(st.floats(-2, 2), min_size=3, max_size=3),
    log_u=st.floats(np.log(1e-3 / 255), np.log(10 / 255)),
    log_v=st.floats(np.log(1e-2 / 255**2), np.log(1e4 / 255**2)),
)
@settings(max_examples=60)
def test_image_similarity_lies_between_zero_and_one(
    seed: int, offset: list[float], log_u: float, log_v: float
):
    rng = np.random.default_rng(seed)
    counts = rng.poisson(rng.choice([0.05, 1, 30]), (32, 32))
    model = MODELS["ameegc2-exact"]
    inverse = model.inverse(half_levels(32), model.identity + offset)
    noise = AffineNoise(float(np.exp(log_u)), float(np.exp(log_v)))

    value = image_similarity(BinnedPairs.from_counts(counts + counts.T), inverse, noise)

    assert -1e-12 <= value <= 1 + 1e-12


def test_an_empty_table_is_similar_to_nothing():
    empty = np.zeros((32, 32), dtype=np.int64)
    inverse = inverse_of(CAMERA, 32)

    assert image_similarity(BinnedPairs.from_counts(empty), inverse, NOISE) == 0
    assert sampled_image_similarity(SampledPairs.from_counts(empty), inverse, NOISE) == 0


@pytest.mark.parametrize("name", OBJECTIVES)
@pytest.mark.parametrize("shift", [-0.3, 0.3])
@pytest.mark.parametrize("parameter", [0, 1, 2])
def test_objectives_are_larger_at_the_true_curve_than_beside_it(
    name: str, parameter: int, shift: float, simulated: np.ndarray
):
    objective = OBJECTIVES[name]
    pairs = objective.prepare(simulated)
    truth = named_curve(CAMERA)
    moved = list(truth.parameters)
    moved[parameter] += shift * (1, 2, 3)[parameter]
    beside = replace(truth, parameters=tuple(moved))

    at_truth, elsewhere = (
        objective.evaluate(pairs, curve.inverse(half_levels(256)), NOISE)
        for curve in (truth, beside)
    )

    assert at_truth > elsewhere


@pytest.mark.parametrize("factor", [(0.2, 0.2), (3, 3), (10, 1), (1, 3), (1, 0.2)], ids=str)
def test_image_similarity_is_larger_at_the_true_noise_than_beside_it(
    factor: tuple[float, float], simulated: np.ndarray
):
    pairs = BinnedPairs.from_counts(simulated)
    inverse = inverse_of(CAMERA)
    beside = AffineNoise(factor[0] * NOISE.slope, factor[1] * NOISE.floor)

    assert image_similarity(pairs, inverse, NOISE) > image_similarity(pairs, inverse, beside)


def test_image_similarity_of_simulated_frames_is_near_one_at_the_truth(simulated: np.ndarray):
    pairs = BinnedPairs.from_counts(simulated)

    assert image_similarity(pairs, inverse_of(CAMERA), NOISE) > 0.9


@pytest.mark.slow
def test_sampled_image_similarity_is_the_double_sum_of_the_paper():
    n_levels = 24
    rng = np.random.default_rng(24)
    counts = rng.poisson(40 * np.exp(-0.5 * np.subtract.outer(*2 * [np.arange(n_levels)]) ** 2))
    counts = counts + counts.T
    inverse, noise = inverse_of(CAMERA, n_levels), AffineNoise.from_8bit(0.06, 60)
    levels, edges = inverse[::2], np.concatenate([[0], inverse[1::2], [1]])

    total = 0.0
    for i in range(1, n_levels - 1):
        for j in range(n_levels):
            share = counts[i, j] / counts[i].sum()
            slope = (edges[j + 1] - edges[j]) * (n_levels - 1)
            same_light = quadrature_similarity(levels[i], levels[j], noise).item()
            total += share * slope * same_light / (n_levels - 1) ** 2
    t, weights = light_nodes(noise, 256)
    squared = quadrature_similarity(t[:, np.newaxis], t, noise) ** 2
    expected = total / np.sqrt(weights @ squared @ weights)

    value = sampled_image_similarity(SampledPairs.from_counts(counts), inverse, noise)

    assert value == pytest.approx(expected, rel=1e-4)


def test_sampled_form_grows_without_bound_when_the_noise_vanishes(simulated: np.ndarray):
    pairs = SampledPairs.from_counts(simulated)
    inverse = inverse_of(CAMERA)
    deviations = np.array([0.05, 0.0125, 0.003125]) / 255

    values = [sampled_image_similarity(pairs, inverse, AffineNoise(0.0, s**2)) for s in deviations]

    # σ^(−1/2): twice as large at a quarter of the noise
    np.testing.assert_allclose(np.divide(values[1:], values[:-1]), 2, rtol=1e-2)
    assert values[0] > sampled_image_similarity(pairs, inverse, NOISE)


def test_bin_form_has_no_hole_where_the_noise_vanishes(simulated: np.ndarray):
    pairs = BinnedPairs.from_counts(simulated)
    inverse = inverse_of(CAMERA)
    deviations = np.array([0.05, 0.0125, 0.003125]) / 255

    values = [image_similarity(pairs, inverse, AffineNoise(0.0, s**2)) for s in deviations]

    assert max(values) < 0.7 * image_similarity(pairs, inverse, NOISE)
    assert np.ptp(values) < 0.05
