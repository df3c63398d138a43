"""The exact likelihood against mpmath, enumeration, derivatives by differences and simulation."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.likelihood import PairCounts, PairModel, Scene
from chartless.noise import AffineNoise
from chartless.types import Counts, Floats

SEEDS = st.integers(0, 2**32 - 1)


def model_of(numbers: Floats, nodes: Floats) -> PairModel:
    """Model of the unknowns (edges, ln u, ln v, log-weights), as `expand` orders them."""
    n_inner = numbers.size - 2 - nodes.size
    slope, floor = np.exp(numbers[n_inner : n_inner + 2])
    noise = AffineNoise(float(slope), float(floor))
    return PairModel(numbers[:n_inner], noise, Scene(nodes, numbers[n_inner + 2 :]))


@st.composite
def problems(draw: st.DrawFn) -> tuple[Floats, Floats]:
    """Unknowns and nodes of a small camera; the nodes lie no further apart than the noise."""
    rng = np.random.default_rng(draw(SEEDS))
    n_levels, n_nodes = draw(st.integers(2, 8)), draw(st.integers(2, 12))
    gaps = rng.uniform(0.2, 1, n_levels)
    edges = np.cumsum(gaps / gaps.sum())[:-1]
    slope = draw(st.floats(1e-4, 0.3))
    floor = (draw(st.floats(0.7, 2)) / (n_nodes - 1)) ** 2
    numbers = np.concatenate([edges, np.log([slope, floor]), rng.normal(0, 1.5, n_nodes)])
    return numbers, np.linspace(0, 1, n_nodes)


def uneven_counts(model: PairModel, rng: np.random.Generator) -> PairCounts:
    """Counts near what a model expects, with dark frames; the model is not the best for them."""
    around = rng.uniform(0.5, 1.5, model.pairs.shape)
    pairs = rng.poisson(1e4 * model.pairs * around)
    dark = rng.poisson(500 * model.dark * rng.uniform(0.5, 1.5, model.dark.size))
    return PairCounts((pairs + pairs.T).astype(np.float64), dark.astype(np.float64), 0.3)


def smooth_camera(n_levels: int, noise: AffineNoise, n_nodes: int = 64) -> PairModel:
    """Gamma of 1/2.2 before a scene of more dark than light."""
    nodes = np.linspace(0, 1, n_nodes)
    edges = ((np.arange(1, n_levels) - 0.5) / (n_levels - 1)) ** 2.2
    return PairModel(edges, noise, Scene(nodes, -2 * nodes))


# Probabilities


def test_shares_and_pairs_agree_with_mpmath() -> None:
    edges, nodes, log_weights = [0.1, 0.35, 0.8], [0.0, 0.5, 1.0], [0.3, -1.0, 0.5]
    slope, floor = 0.02, 0.01
    with mpmath.workdps(30):
        ends = [-mpmath.inf, *map(mpmath.mpf, edges), mpmath.inf]
        shares = [
            [
                mpmath.ncdf((ends[i + 1] - t) / mpmath.sqrt(slope * t + floor))
                - mpmath.ncdf((ends[i] - t) / mpmath.sqrt(slope * t + floor))
                for t in map(mpmath.mpf, nodes)
            ]
            for i in range(4)
        ]
        weights = [mpmath.exp(w) for w in log_weights]
        pairs = [
            [
                sum(w * a * b for w, a, b in zip(weights, one, other, strict=True)) / sum(weights)
                for other in shares
            ]
            for one in shares
        ]

    model = PairModel(
        np.array(edges), AffineNoise(slope, floor), Scene(np.array(nodes), np.array(log_weights))
    )

    np.testing.assert_allclose(model.shares, np.array(shares, float), rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(model.pairs, np.array(pairs, float), rtol=1e-10, atol=3e-14)
    np.testing.assert_allclose(model.dark, model.shares[:, 0], rtol=1e-10, atol=3e-14)


@given(problem=problems())
def test_probabilities_are_probabilities(problem: tuple[Floats, Floats]) -> None:
    model = model_of(*problem)

    assert model.shares.min() >= 0
    np.testing.assert_allclose(model.shares.sum(axis=0), 1, atol=1e-12)
    assert model.pairs.min() > 0
    assert model.pairs.sum() == pytest.approx(1, abs=1e-11)
    np.testing.assert_allclose(model.pairs, model.pairs.T, rtol=1e-12)
    # One frame alone shows what the nodes show, whatever the other.
    single = model.shares @ model.weights
    np.testing.assert_allclose(model.pairs.sum(axis=1), single, atol=1e-12)
    # A dark frame is a scene of irradiance 0, the first node.
    np.testing.assert_allclose(model.dark, model.shares[:, 0], atol=1e-12)


@given(
    slope=st.floats(1e-4, 0.3),
    floor=st.floats(3e-4, 0.1),
    lowest=st.floats(0, 0.4),
    highest=st.floats(0.6, 1),
)
def test_the_first_and_last_level_collect_all_that_is_clipped(
    slope: float, floor: float, lowest: float, highest: float
) -> None:
    scene = Scene(np.array([0.0, 1.0]), np.zeros(2))

    model = PairModel(np.array([lowest, highest]), AffineNoise(slope, floor), scene)

    black = 0.5 + 0.5 * math.erf(lowest / math.sqrt(2 * floor))
    white = 0.5 + 0.5 * math.erf((1 - highest) / math.sqrt(2 * (slope + floor)))
    assert model.shares[0, 0] == pytest.approx(black, abs=1e-14)
    assert model.dark[0] == pytest.approx(black, abs=1e-13)
    assert model.shares[-1, -1] == pytest.approx(white, abs=1e-14)


def test_simulated_pairs_are_as_frequent_as_predicted() -> None:
    """A camera of 16 levels and a gamma of 1/2.2 looks at a scene of 24 irradiances."""
    n_pairs, top = 3_000_000, 15
    rng = np.random.default_rng(16)
    nodes = np.linspace(0, 1, 24)
    log_weights = rng.normal(size=24)
    noise = AffineNoise(0.02, 0.004)
    weights = np.exp(log_weights)
    light = nodes[rng.choice(24, n_pairs, p=weights / weights.sum())]

    def picture() -> Counts:
        seen = light + np.sqrt(0.02 * light + 0.004) * rng.standard_normal(n_pairs)
        return np.rint(top * np.clip(seen, 0, 1) ** (1 / 2.2)).astype(np.int64)

    seen = np.bincount((top + 1) * picture() + picture(), minlength=(top + 1) ** 2)
    edges = ((np.arange(top) + 0.5) / top) ** 2.2

    def surprise(noise: AffineNoise) -> tuple[float, float]:
        """Excess of chi-squared in its deviations, and the largest single deviation."""
        expected = n_pairs * PairModel(edges, noise, Scene(nodes, log_weights)).pairs.ravel()
        large = expected > 10
        pulls = (seen[large] - expected[large]) / np.sqrt(expected[large])
        assert large.sum() > 150
        return float((pulls @ pulls - pulls.size) / np.sqrt(2 * pulls.size)), np.abs(pulls).max()

    excess, largest = surprise(noise)
    assert abs(excess) < 4
    assert largest < 5
    # The comparison is sharp: it tells 3 % more of either noise.
    assert surprise(replace(noise, floor=1.03 * noise.floor))[0] > 6
    assert surprise(replace(noise, slope=1.03 * noise.slope))[0] > 6


# The log-likelihood


@pytest.mark.parametrize("with_dark", [False, True], ids=["lit", "dark"])
def test_log_likelihood_is_the_sum_over_pixels(with_dark: bool) -> None:
    rng = np.random.default_rng(5)
    model = smooth_camera(16, AffineNoise(0.02, 0.004))
    table = Cooccurrence(rng.integers(0, 5, (16, 16)))  # the order of frames does not matter
    dark = rng.integers(0, 9, 16) if with_dark else None
    expected = 0.0
    for first in range(16):
        for second in range(16):
            times = int(table.counts[first, second])
            expected += 0.25 * times * float(np.log(model.pairs[first, second]))
    if dark is not None:
        # Dark frames are what they are: the weight is of pairs.
        expected += sum(int(n) * float(np.log(p)) for n, p in zip(dark, model.dark, strict=True))

    counts = PairCounts.of(table, dark=dark, weight=0.25)

    assert model.log_likelihood(counts) == pytest.approx(expected, rel=1e-12)
    assert counts.n_pairs == table.n_pairs
    assert counts.n_levels == 16


def differences(
    value: Callable[[PairModel], Any], numbers: Floats, nodes: Floats, step: float = 1e-5
) -> Floats:
    """Central differences of a number or an array of the model, by each unknown: first axis."""
    return np.array(
        [
            (value(model_of(numbers + move, nodes)) - value(model_of(numbers - move, nodes)))
            / (2 * step)
            for move in step * np.eye(numbers.size)
        ]
    )


@given(problem=problems(), seed=SEEDS, with_dark=st.booleans())
@settings(max_examples=60)
def test_gradient_is_that_of_differences(
    problem: tuple[Floats, Floats], seed: int, with_dark: bool
) -> None:
    model = model_of(*problem)
    counts = uneven_counts(model, np.random.default_rng(seed))
    if not with_dark:
        counts = replace(counts, dark=np.zeros_like(counts.dark))
    by_differences = differences(lambda each: each.log_likelihood(counts), *problem)

    expansion = model.expand(counts)

    assert expansion.value == model.log_likelihood(counts)
    scale = np.abs(by_differences).max()
    np.testing.assert_allclose(expansion.gradient, by_differences, rtol=1e-5, atol=1e-6 * scale)


@given(problem=problems(), seed=SEEDS, with_dark=st.booleans())
@settings(max_examples=60)
def test_information_is_that_of_all_pairs_one_by_one(
    problem: tuple[Floats, Floats], seed: int, with_dark: bool
) -> None:
    model = model_of(*problem)
    counts = uneven_counts(model, np.random.default_rng(seed))
    by_pairs = differences(lambda each: each.pairs.ravel(), *problem)
    expected = counts.weight * counts.n_pairs * (by_pairs / model.pairs.ravel()) @ by_pairs.T
    if with_dark:
        by_dark = differences(lambda each: each.dark, *problem)
        expected += counts.dark.sum() * (by_dark / model.dark) @ by_dark.T
    else:
        counts = replace(counts, dark=np.zeros_like(counts.dark))

    information = model.expand(counts).information

    # Each entry in units of how well the two unknowns are known.
    known = np.sqrt(np.diag(expected))
    known = np.maximum(known, 1e-3 * known.max())
    unit = np.outer(known, known)
    np.testing.assert_allclose(information / unit, expected / unit, atol=1e-4)
    np.testing.assert_allclose(information, information.T, rtol=1e-10, atol=1e-10 * unit.max())


@given(problem=problems(), seed=SEEDS, with_dark=st.booleans())
def test_noise_may_change_in_any_direction(
    problem: tuple[Floats, Floats], seed: int, with_dark: bool
) -> None:
    """By the chain rule: directions are mixed from ln u and ln v, and everything mixes alike."""
    rng = np.random.default_rng(seed)
    model = model_of(*problem)
    counts = uneven_counts(model, rng)
    if not with_dark:
        counts = replace(counts, dark=np.zeros_like(counts.dark))
    n_inner, n_nodes = model.edges.size, model.scene.nodes.size
    noise, nodes = model.noise, model.scene.nodes
    own = np.array([noise.slope * nodes, np.full(n_nodes, noise.floor)])
    mixture = rng.normal(size=(3, 2))
    mix = np.zeros((n_inner + 3 + n_nodes, n_inner + 2 + n_nodes))
    mix[:n_inner, :n_inner], mix[n_inner + 3 :, n_inner + 2 :] = np.eye(n_inner), np.eye(n_nodes)
    mix[n_inner : n_inner + 3, n_inner : n_inner + 2] = mixture
    plain = model.expand(counts)

    mixed = model.expand(counts, mixture @ own)

    scale = np.abs(plain.gradient).max()
    np.testing.assert_allclose(mixed.gradient, mix @ plain.gradient, atol=1e-9 * scale)
    expected = mix @ plain.information @ mix.T
    np.testing.assert_allclose(mixed.information, expected, atol=1e-9 * np.abs(expected).max())
    assert mixed.value == plain.value


def test_information_of_counts_is_that_of_one_pair_as_often() -> None:
    model = smooth_camera(16, AffineNoise(0.02, 0.004))
    counts = PairCounts(2 * 5000 * model.pairs, np.zeros(16), 0.3)

    of_one = model.information()

    assert counts.n_pairs == pytest.approx(5000)
    np.testing.assert_allclose(model.expand(counts).information, 0.3 * 5000 * of_one, rtol=1e-9)


@pytest.mark.slow
def test_information_is_the_covariance_of_gradients() -> None:
    """Fisher's identity: a check of gradient and information that uses neither's formula."""
    rng = np.random.default_rng(44)
    model = smooth_camera(6, AffineNoise(0.05, 0.01), n_nodes=5)
    gradients = []
    for _ in range(2500):
        table = rng.multinomial(1000, (model.pairs / model.pairs.sum()).ravel()).reshape(6, 6)
        dark = rng.multinomial(300, model.dark / model.dark.sum())
        counts = PairCounts.of(Cooccurrence(table), dark=dark)
        gradients.append(model.expand(counts).gradient)

    information = model.expand(counts).information

    unit = np.sqrt(np.outer(np.diag(information), np.diag(information)))
    np.testing.assert_allclose(np.cov(np.array(gradients).T) / unit, information / unit, atol=0.12)
    # The mean gradient vanishes within four standard errors.
    mean = np.mean(gradients, axis=0) / np.sqrt(np.diag(information) / 2500)
    assert np.abs(mean).max() < 4


# Goodness of fit


@pytest.mark.parametrize("n_pairs", [300, 30_000, 3_000_000])
def test_deviance_is_one_of_counts_drawn_from_the_model(n_pairs: int) -> None:
    """Also where nearly all cells expect less than one count."""
    rng = np.random.default_rng(n_pairs)
    model = smooth_camera(64, AffineNoise.from_8bit(0.5, 100))
    probability = (model.pairs / model.pairs.sum()).ravel()
    draws = (Cooccurrence(rng.multinomial(n_pairs, probability).reshape(64, 64)) for _ in range(20))

    deviances = [model.relative_deviance(PairCounts.of(table)) for table in draws]

    # Four deviations of the mean; multinomial counts miss at most one of the Poisson cells.
    assert np.mean(deviances) == pytest.approx(1, abs=4 * np.std(deviances) / np.sqrt(20) + 3e-3)
    assert np.std(deviances) < 0.2


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_deviance_rises_when_the_noise_is_ten_percent_off(factor: float) -> None:
    model = smooth_camera(64, AffineNoise.from_8bit(0.5, 100))
    table = np.random.default_rng(9).poisson(3e6 * model.pairs)
    counts = PairCounts.of(Cooccurrence(table), weight=0.2)

    off = AffineNoise(factor * model.noise.slope, factor * model.noise.floor)

    assert model.relative_deviance(counts) == pytest.approx(1, abs=0.1)
    assert PairModel(model.edges, off, model.scene).relative_deviance(counts) > 3


# The scene


@given(problem=problems(), seed=SEEDS)
def test_an_improved_scene_is_never_less_likely(problem: tuple[Floats, Floats], seed: int) -> None:
    """The property of expectation maximisation, up to the floor that keeps weights above 0."""
    model = model_of(*problem)
    table = Cooccurrence(np.random.default_rng(seed).integers(0, 200, model.pairs.shape))
    counts = PairCounts.of(table)
    of_the_floor = 1e-7 * model.weights.size * counts.n_pairs
    for _ in range(4):
        better = PairModel(model.edges, model.noise, model.improved_scene(counts))

        gain = better.log_likelihood(counts) - model.log_likelihood(counts)

        assert gain > -2 * of_the_floor
        model = better


@given(problem=problems())
def test_the_true_scene_is_not_improved(problem: tuple[Floats, Floats]) -> None:
    model = model_of(*problem)
    expected = PairCounts(2e5 * model.pairs, np.zeros(model.dark.size))

    improved = model.improved_scene(expected)

    np.testing.assert_allclose(improved.weights, model.weights, atol=1e-5)


def test_improving_a_scene_finds_the_true_histogram() -> None:
    truth = smooth_camera(64, AffineNoise.from_8bit(0.5, 100), n_nodes=16)
    expected = PairCounts(2e5 * truth.pairs, np.zeros(64))
    model = PairModel(truth.edges, truth.noise, Scene(truth.scene.nodes, np.zeros(16)))
    away = np.abs(model.weights - truth.weights).max()

    for _ in range(50):
        model = PairModel(truth.edges, truth.noise, model.improved_scene(expected))

    assert np.abs(model.weights - truth.weights).max() < away / 20
