"""Probabilities between exposures: against mpmath, simulation, derivatives by differences."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from chartless.evidence.bracket import likelihood as exposure_likelihood
from chartless.evidence.bracket.likelihood import (
    FIRST_PIXELS,
    STRAY,
    Comparagram,
    ExposureCounts,
    ExposureModel,
)
from chartless.noise import TYPICAL_8BIT, AffineNoise
from chartless.types import Counts, Floats

SEEDS = st.integers(0, 2**32 - 1)
IDENTITY = np.eye(2)


def gamma_edges(n_levels: int, gamma: float = 2.2) -> Floats:
    return np.asarray(((np.arange(1, n_levels) - 0.5) / (n_levels - 1)) ** gamma)


def comparagram(counts: Floats | Counts, shorter: int = 0, longer: int = 1, **more: Any) -> Any:
    ones = np.ones(len(counts))
    return Comparagram(shorter, longer, np.asarray(counts, np.float64), ones, ones, **more)


def exposure_counts(*tables: Comparagram, ratio: float = 2.0, **more: Any) -> ExposureCounts:
    n_exposures = 1 + max(max(table.shorter, table.longer) for table in tables)
    log_exposures = np.log(ratio) * np.arange(n_exposures)
    return ExposureCounts(tables, log_exposures, **more)


# The formula, written out


def row_probability(
    edges: Floats,
    noise: AffineNoise,
    *,
    scatter: float,
    ratio: float,
    level: int,
    shift: float = 0.0,
    share: float | None = None,
) -> Floats:
    """P(i | level) without stray pixels, shape (L,); share of the mean² that is noise."""
    below, above = edges[level - 1], edges[level]
    light, width = (below + above) / 2, above - below
    mean = light * (1 + shift) / ratio
    longer = noise.slope * light + noise.floor
    shorter = noise.slope * mean + noise.floor
    noisy = shorter + longer / ratio**2 if share is None else share * mean**2
    deviation = math.sqrt(noisy + width**2 / 12 / ratio**2 + (scatter * mean) ** 2)
    ends = [-math.inf, *((edge - mean) / deviation for edge in edges), math.inf]
    low, high = np.transpose(list(pairwise(ends)))
    # From the side where the share is best told from zero.
    near = np.where(low < 0, norm.cdf(high) - norm.cdf(low), norm.sf(low) - norm.sf(high))
    return np.asarray(near)


def weighted_rows(table: Comparagram) -> Floats:
    """Counts as they enter the likelihood, rows of black and white as 0."""
    rows = np.zeros_like(table.counts)
    for level in range(1, len(rows) - 1):
        n_pixels = table.counts[level].sum()
        weight = table.trust[level] * min(1.0, FIRST_PIXELS / max(n_pixels, 1e-300))
        if table.weight is not None:
            weight = table.weight[level]
        rows[level] = weight * table.counts[level]
    return rows


def stray_share(rows: Floats) -> Floats:
    return np.asarray(STRAY * (rows.sum(axis=0) + 1) / (rows.sum() + rows.shape[1]))


def probabilities(
    counts: ExposureCounts, edges: Floats, noise: AffineNoise, own: Floats
) -> list[tuple[Floats, Floats]]:
    """For each table its weighted counts and P(i | j), shapes (L, L); 1 where nothing counts."""
    relative = counts.tables[0].noise is not None
    if counts.own_noise and not relative:
        noise = AffineNoise(math.exp(own[1]), math.exp(own[2]))
    changes = own[2 if relative else 3 if counts.own_noise else 1 :]
    log_exposures = counts.log_exposures + (changes if counts.exposure_error > 0 else 0)
    told = []
    for table in counts.tables:
        rows = weighted_rows(table)
        stray, share = stray_share(rows), np.ones_like(rows)
        ratio = math.exp(log_exposures[table.longer] - log_exposures[table.shorter])
        for level in np.flatnonzero(table.counts.any(axis=1)):
            if 0 < level < len(rows) - 1:
                shift = 0.0 if table.shift is None else table.shift[level]
                share[level] = stray + (1 - STRAY) * row_probability(
                    edges,
                    noise,
                    scatter=math.exp(own[0]),
                    ratio=ratio,
                    level=int(level),
                    shift=shift,
                    share=None if table.noise is None else math.exp(own[1]) * table.noise[level],
                )
        told.append((rows, share))
    return told


# Probabilities


@pytest.mark.parametrize("ratio", [2.0, 4.0])
@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_a_simulated_camera_shows_levels_as_often_as_predicted(gamma: float, ratio: float) -> None:
    """16 levels: light even over the bin of a level, noise in both exposures, scatter between."""
    n_pixels, n_levels, scatter = 400_000, 16, 0.05
    rng = np.random.default_rng(16)
    edges, noise = gamma_edges(n_levels, gamma), AffineNoise(2e-3, 1e-3)
    counts = exposure_counts(comparagram(np.ones((16, 16))), ratio=ratio)
    ((_, share),) = probabilities(counts, edges, noise, np.array([math.log(scatter)]))
    without_stray = (share - stray_share(weighted_rows(counts.tables[0]))) / (1 - STRAY)
    for level in (5, 10, 14):
        below, above = edges[level - 1], edges[level]
        shown = (below + above) / 2
        light = rng.uniform(below, above, n_pixels)
        light += noise.std(shown) * rng.standard_normal(n_pixels)
        passed = light / ratio + scatter * shown / ratio * rng.standard_normal(n_pixels)
        seen = passed + noise.std(passed.clip(0)) * rng.standard_normal(n_pixels)

        share_seen = np.bincount(np.searchsorted(edges, seen), minlength=n_levels) / n_pixels

        # Total variation: 10 % more variance make 0.02, light even over a bin, not normal, 0.005.
        assert 0.5 * np.abs(share_seen - without_stray[level]).sum() < 0.008


def seen_by_the_model(model: ExposureModel, table: Comparagram) -> Floats:
    """P(i | j) of a model, shape (J, L), with what is beyond reach."""
    (rows,) = model._rows
    share = np.tile(stray_share(weighted_rows(table)), (len(rows._upper), 1))
    for place, edge in enumerate(rows._edge):
        near = np.append(edge, edge[-1] + 1)
        share[place, near] = rows._shares[place]
    return share


def test_windows_of_eight_levels_are_those_of_the_formula() -> None:
    """NumPy 2.4's np.negative takes rows of 8 numbers for numbers side by side."""
    for n_levels in range(8, 24):
        table = comparagram(np.ones((n_levels, n_levels)))
        counts, noise = exposure_counts(table), AffineNoise(3e-3, 9e-4)
        edges, own = gamma_edges(n_levels), np.log([0.02])
        ((_, expected),) = probabilities(counts, edges, noise, own)

        share = seen_by_the_model(ExposureModel(counts, edges, noise, own), table)

        np.testing.assert_allclose(share, expected[1:-1], atol=4e-6)


@given(seed=SEEDS, n_levels=st.integers(4, 40), floor=st.floats(1e-6, 1e-2))
def test_probabilities_of_a_level_add_up_to_one(seed: int, n_levels: int, floor: float) -> None:
    rng = np.random.default_rng(seed)
    table = comparagram(rng.integers(0, 5, (n_levels, n_levels)) + 1)
    counts = exposure_counts(table, ratio=float(rng.uniform(1.1, 8)))
    edges = np.cumsum(rng.dirichlet(np.ones(n_levels)))[:-1]

    model = ExposureModel(counts, edges, AffineNoise(1e-3, floor), counts.own_mean)

    share = seen_by_the_model(model, table)
    assert share.shape == (n_levels - 2, n_levels)
    assert np.all(share > 0)
    np.testing.assert_allclose(share.sum(axis=1), 1, atol=1e-12)


def test_probabilities_agree_with_mpmath() -> None:
    table = comparagram(np.random.default_rng(3).integers(1, 9, (12, 12)))
    counts, edges, own = exposure_counts(table, ratio=3.0), gamma_edges(12), np.log([0.1])
    expected = np.zeros((10, 12))
    with mpmath.workdps(30):
        ends = [*map(mpmath.mpf, edges.tolist())]
        u, v, kappa, ratio = map(mpmath.mpf, ("0.005", "0.0004", "0.1", "3"))
        for level in range(1, 11):
            light, width = (ends[level - 1] + ends[level]) / 2, ends[level] - ends[level - 1]
            mean = light / ratio
            variance = u * mean + v + (u * light + v + width**2 / 12) / ratio**2
            deviation = mpmath.sqrt(variance + (kappa * mean) ** 2)
            below = [0, *(mpmath.ncdf((end - mean) / deviation) for end in ends), 1]
            expected[level - 1] = [float(b - a) for a, b in pairwise(below)]
    expected = (1 - STRAY) * expected + stray_share(weighted_rows(table))

    share = seen_by_the_model(ExposureModel(counts, edges, AffineNoise(5e-3, 4e-4), own), table)

    # What lies beyond reach is left to the level at its end: 3 · 10⁻⁶ on either side.
    np.testing.assert_allclose(share, expected, atol=4e-6)


# The log-likelihood


def a_bracket(
    n_levels: int = 12, seed: int = 5, *, relative: bool = False, **more: Any
) -> ExposureCounts:
    """Three exposures, each compared with each, as no camera shows them."""
    rng = np.random.default_rng(seed)
    tables, noise = [], rng.uniform(1e-3, 1e-1, n_levels) if relative else None
    for shorter, longer in ((0, 1), (1, 2), (0, 2)):
        counts = rng.uniform(0, 4, (n_levels, n_levels))
        counts[rng.integers(1, n_levels - 1)] = 0
        table = replace(comparagram(counts, shorter, longer), trust=rng.uniform(0.1, 1, n_levels))
        if longer - shorter == 2:
            weight = rng.uniform(0, 1, n_levels)
            shift = rng.uniform(-0.1, 0.1, n_levels)
            table = replace(table, weight=weight, shift=shift)
        tables.append(replace(table, noise=noise))
    return exposure_counts(*tables, ratio=2.5, **more)


def an_own(counts: ExposureCounts, seed: int = 8) -> Floats:
    rng = np.random.default_rng(seed)
    own = rng.uniform(-0.05, 0.05, counts.own_mean.size)
    own[0] = math.log(0.06)
    if counts.own_noise and not counts.has_relative_noise:
        own[1:3] = np.log([4e-3, 6e-4])
    return np.asarray(own)


VARIANTS = [
    pytest.param(
        {"own_noise": own_noise, "relative": relative, "exposure_error": error},
        id=f"{own_noise}, {relative}, {error}",
    )
    for own_noise, relative in ((False, False), (True, False), (True, True))
    for error in (0.0, 0.02)
]


@pytest.mark.parametrize("variant", VARIANTS)
def test_log_likelihood_is_the_sum_over_cells(variant: dict[str, Any]) -> None:
    counts = a_bracket(**variant)
    edges, noise, own = gamma_edges(12), AffineNoise(3e-3, 9e-4), an_own(counts)
    expected = 0.0
    for rows, share in probabilities(counts, edges, noise, own):
        for level in range(1, 11):
            for seen in range(12):
                expected += rows[level, seen] * math.log(share[level, seen])

    value = ExposureModel(counts, edges, noise, own).log_likelihood()

    assert value == pytest.approx(expected, rel=1e-5)
    assert expected < -100


def test_what_is_black_or_white_in_the_longer_exposure_is_no_condition() -> None:
    counts = a_bracket()
    edges, noise, own = gamma_edges(12), AffineNoise(3e-3, 9e-4), an_own(counts)
    more = []
    for table in counts.tables:
        changed = table.counts.copy()
        changed[[0, -1]] += 50
        more.append(replace(table, counts=changed))

    value = ExposureModel(replace(counts, tables=tuple(more)), edges, noise, own).log_likelihood()

    assert value == ExposureModel(counts, edges, noise, own).log_likelihood()


def test_white_and_black_of_the_shorter_exposure_are_evidence() -> None:
    """What is saturated in both would need a curve that is steeper than this at white."""
    edges, noise = gamma_edges(16), AffineNoise(1e-4, 1e-5)
    table = np.zeros((16, 16))
    table[8, 15] = 5.0
    counts = exposure_counts(comparagram(table))

    model = ExposureModel(counts, edges, noise, np.array([math.log(0.02)]))

    ((rows, _),) = probabilities(counts, edges, noise, np.array([math.log(0.02)]))
    assert model.log_likelihood() == pytest.approx(5 * math.log(stray_share(rows)[15]), rel=1e-9)


@pytest.mark.parametrize("reach", [6.0, 100.0])
def test_what_is_beyond_reach_makes_no_difference(
    reach: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond 4.5 deviations lie 7 · 10⁻⁶ of the pixels, a stray level has 4 · 10⁻⁵ and more."""
    rng = np.random.default_rng(4)
    edges, noise = gamma_edges(256), AffineNoise.from_8bit(0.03, 16)
    table = rng.uniform(0, 1, (256, 256)) * (rng.uniform(size=(256, 256)) < 0.05)
    counts = exposure_counts(comparagram(table))
    own = np.array([math.log(0.02)])
    near = ExposureModel(counts, edges, noise, own)
    assert near._rows[0]._edge.shape[1] < 150

    monkeypatch.setattr(exposure_likelihood, "_REACH", reach)
    all_of_it = ExposureModel(counts, edges, noise, own)

    n_pixels = weighted_rows(counts.tables[0]).sum()
    difference = all_of_it.log_likelihood() - near.log_likelihood()
    assert abs(difference) < n_pixels * 7e-6 / (STRAY / 512)
    assert difference == pytest.approx(0, abs=1e-4 * abs(near.log_likelihood()))
    one, other = (model.expand(IDENTITY).gradient for model in (near, all_of_it))
    np.testing.assert_allclose(one, other, atol=2e-3 * np.abs(other).max())


# Derivatives


def unknowns(counts: ExposureCounts) -> Floats:
    """(edges, ln u, ln v, own) of a small camera."""
    return np.concatenate([gamma_edges(12), np.log([3e-3, 9e-4]), an_own(counts)])


def model_of(counts: ExposureCounts, numbers: Floats) -> ExposureModel:
    edges, log_noise, own = np.split(numbers, [11, 13])
    slope, floor = np.exp(log_noise)
    return ExposureModel(counts, edges, AffineNoise(float(slope), float(floor)), own)


def differences(value: Callable[[Floats], Any], numbers: Floats, step: float = 1e-6) -> Floats:
    """Central differences, by each unknown: first axis."""
    return np.array(
        [
            (value(numbers + move) - value(numbers - move)) / (2 * step)
            for move in step * np.eye(numbers.size)
        ]
    )


@pytest.fixture(params=VARIANTS)
def everywhere(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ExposureCounts:
    """A bracket whose windows hold all levels, so that no edge moves in or out."""
    monkeypatch.setattr(exposure_likelihood, "_REACH", 1e3)
    return a_bracket(**request.param)


def test_gradient_is_that_of_differences(everywhere: ExposureCounts) -> None:
    numbers = unknowns(everywhere)
    by_differences = differences(lambda x: model_of(everywhere, x).log_likelihood(), numbers)

    expansion = model_of(everywhere, numbers).expand(IDENTITY)

    assert expansion.value == model_of(everywhere, numbers).log_likelihood()
    scale = np.abs(by_differences).max()
    np.testing.assert_allclose(expansion.gradient, by_differences, rtol=1e-5, atol=1e-6 * scale)
    # Every unknown is told something, but for the noise of another kind of evidence.
    heard = np.abs(expansion.gradient) > 1e-6 * scale
    assert np.flatnonzero(~heard).tolist() == ([11, 12] if everywhere.own_noise else [])


@pytest.mark.slow
def test_information_is_that_of_all_levels_one_by_one(everywhere: ExposureCounts) -> None:
    numbers = unknowns(everywhere)

    def share_of(x: Floats) -> Floats:
        edges, log_noise, own = np.split(x, [11, 13])
        slope, floor = np.exp(log_noise)
        told = probabilities(everywhere, edges, AffineNoise(float(slope), float(floor)), own)
        return np.array([share for _, share in told])

    changes = differences(share_of, numbers)
    told = zip(everywhere.tables, share_of(numbers), changes.swapaxes(0, 1), strict=True)
    expected = np.zeros((numbers.size,) * 2)
    for table, share, change in told:
        n_pixels = weighted_rows(table).sum(axis=1)
        expected += np.einsum("j,aji,bji->ab", n_pixels, change / share, change)

    information = model_of(everywhere, numbers).expand(IDENTITY).information

    unit = np.sqrt(np.diag(expected) + 1e-6 * np.diag(expected).max())
    unit = np.outer(unit, unit)
    np.testing.assert_allclose(information / unit, expected / unit, atol=1e-5)
    np.testing.assert_allclose(information, information.T, atol=1e-10 * unit.max())


@pytest.mark.slow
def test_information_is_the_covariance_of_gradients() -> None:
    """Fisher's identity, over counts drawn from the model; the stray share stays what it was."""
    rng = np.random.default_rng(44)
    edges, noise, own = gamma_edges(6), AffineNoise(2e-2, 4e-3), np.array([math.log(0.1)])
    counts = exposure_counts(comparagram(np.full((6, 6), 1e5), weight=np.ones(6)))
    model = ExposureModel(counts, edges, noise, own)
    (rows,) = model._rows
    share = rows._shares.copy()
    assert share.shape == (4, 6)
    gradients, n_pixels = [], 400
    for _ in range(3000):
        rows._counts = np.stack([rng.multinomial(n_pixels, each) for each in share]) * 1.0
        rows._n = rows._counts.sum(axis=1)
        gradients.append(model.expand(IDENTITY).gradient)

    information = model.expand(IDENTITY).information

    unit = np.sqrt(np.outer(np.diag(information), np.diag(information)))
    np.testing.assert_allclose(np.cov(np.array(gradients).T) / unit, information / unit, atol=0.12)
    mean = np.mean(gradients, axis=0) / np.sqrt(np.diag(information) / 3000)
    assert np.abs(mean).max() < 4


@pytest.mark.parametrize("own_noise", [False, True])
def test_noise_may_change_in_any_direction(own_noise: bool) -> None:
    """By the chain rule, from ln u and ln v apart to three unknowns of the noise, or one."""
    counts = a_bracket(own_noise=own_noise, exposure_error=0.1)
    model = model_of(counts, unknowns(counts))
    plain = model.expand(IDENTITY)
    for mixture in (np.random.default_rng(1).normal(size=(3, 2)), np.ones((1, 2))):
        size = len(mixture)
        mix = np.zeros((plain.gradient.size - 2 + size, plain.gradient.size))
        mix[:11, :11] = np.eye(11)
        mix[11 : 11 + size, 11:13] = mixture
        mix[11 + size :, 13:] = np.eye(counts.own_mean.size)

        mixed = model.expand(mixture)

        scale = np.abs(plain.gradient).max()
        np.testing.assert_allclose(mixed.gradient, mix @ plain.gradient, atol=1e-9 * scale)
        expected = mix @ plain.information @ mix.T
        np.testing.assert_allclose(mixed.information, expected, atol=1e-9 * expected.max())


def test_a_factor_on_all_exposures_is_told_by_nothing() -> None:
    counts = a_bracket(exposure_error=0.1)

    expansion = model_of(counts, unknowns(counts)).expand(IDENTITY)

    every = np.r_[np.zeros(14), np.ones(3)]
    scale = np.abs(expansion.gradient).max()
    assert every @ expansion.gradient == pytest.approx(0, abs=1e-10 * scale)
    largest = np.abs(expansion.information).max()
    assert np.abs(expansion.information @ every).max() < 1e-10 * largest


# What a first estimate tells


def test_a_gaussian_scene_draws_the_light_towards_its_middle() -> None:
    """Closed form: of y = x + n, both normal, E[x | y] = μ + (y − μ) τ²/(τ² + σ²)."""
    n_levels, middle, spread, deviation = 256, 0.5, 0.1, 0.015
    edges, noise = gamma_edges(n_levels, 1.0), AffineNoise(0.0, deviation**2)
    light = (edges[1:] + edges[:-1]) / 2
    seen = np.exp(-0.5 * (light - middle) ** 2 / (spread**2 + deviation**2))
    histogram = 1e6 * np.r_[0.0, seen, 0.0]
    counts = exposure_counts(comparagram(np.ones((n_levels, n_levels))))
    counts = replace(counts, tables=(replace(counts.tables[0], histogram=histogram),))
    inner = slice(60, 200)
    given_level = middle + (light - middle) * spread**2 / (spread**2 + deviation**2)
    expected = (given_level / light - 1)[inner]

    informed = ExposureModel(counts, edges, noise, counts.own_mean).informed()

    (table,) = informed.tables
    assert table.shift is not None
    # The histogram is smoothed over half the noise: 1 % less.
    np.testing.assert_allclose(table.shift[1:-1][inner], expected, rtol=0.02, atol=2e-5)
    assert expected[0] > 5e-3
    assert (table.shift[0], table.shift[-1]) == (0, 0)
    assert np.abs(table.shift).max() <= 0.5


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_before_an_even_scene_only_the_growth_of_noise_shifts_light(gamma: float) -> None:
    """Beside black and white as in the middle: E[x | y] = y + u where σ² = u x + v."""
    edges, noise = gamma_edges(256, gamma), AffineNoise.from_8bit(0.03, 4)
    light = (edges[1:] + edges[:-1]) / 2
    histogram = np.r_[2e5, 1e6 * np.diff(edges), 3e5]
    counts = exposure_counts(comparagram(np.ones((256, 256))))
    counts = replace(counts, tables=(replace(counts.tables[0], histogram=histogram),))

    (table,) = ExposureModel(counts, edges, noise, counts.own_mean).informed().tables

    assert table.shift is not None
    expected = np.minimum(noise.slope / light, 0.5)
    np.testing.assert_allclose(table.shift[1:-1], expected, rtol=1e-9)


def test_the_mean_light_of_a_level_is_that_of_simulation() -> None:
    """A steep scene and strong noise that grows with the light, without saturation."""
    rng, noise = np.random.default_rng(21), AffineNoise(4e-3, 2e-4)
    light = rng.exponential(0.12, 4_000_000)
    light = light[light < 0.9]
    seen = light + noise.std(light) * rng.standard_normal(light.size)
    edges = gamma_edges(256, 1.0)
    level = np.searchsorted(edges, seen)
    histogram = np.bincount(level, minlength=256) * 1.0
    mean = np.bincount(level, light, 256) / np.maximum(histogram, 1)
    counts = exposure_counts(comparagram(np.ones((256, 256))))
    counts = replace(counts, tables=(replace(counts.tables[0], histogram=histogram),))

    (table,) = ExposureModel(counts, edges, noise, counts.own_mean).informed().tables

    assert table.shift is not None
    inner = np.arange(40, 160)
    expected = mean[inner] / (inner / 255) - 1
    assert -0.06 < expected.min() < expected.max() < -0.01
    difference = table.shift[inner] - expected
    assert np.abs(difference).max() < 0.01  # chance
    assert abs(difference.mean()) < 1e-3


def test_shift_is_of_the_longer_exposure() -> None:
    """Of a scene that is even in one exposure and uneven in the other."""
    n_levels = 64
    steep = np.exp(np.linspace(0, 6, n_levels))
    tables = [comparagram(np.ones((64, 64)), *pair) for pair in ((0, 1), (1, 2), (0, 2))]
    counts = exposure_counts(*tables)
    histograms = np.stack([np.ones(64), np.ones(64), steep])
    model = ExposureModel(
        replace(
            counts,
            tables=tuple(replace(each, histogram=histograms[each.longer]) for each in tables),
        ),
        gamma_edges(64, 1.0),
        AffineNoise(0.0, 1e-4),
        counts.own_mean,
    )

    first, second, third = (table.shift for table in model.informed().tables)

    inner = slice(10, 54)
    assert np.abs(first[inner]).max() < 1e-3
    # σ²/g · d ln h/dI, the density being e^(6I).
    light = np.arange(64)[inner] / 63
    np.testing.assert_allclose(second[inner], 1e-4 / light * 6, rtol=0.03)
    np.testing.assert_array_equal(second, third)


def test_an_informed_model_expects_the_light_where_it_is_shifted_to() -> None:
    counts = a_bracket()
    edges, noise, own = gamma_edges(12), AffineNoise(3e-3, 9e-4), an_own(counts)
    informed = ExposureModel(counts, edges, noise, own).informed()
    expected = sum(
        float(np.sum(rows * np.log(share)))
        for rows, share in probabilities(informed, edges, noise, own)
    )

    value = ExposureModel(informed, edges, noise, own).log_likelihood()

    assert value == pytest.approx(expected, rel=1e-5)


def test_an_informed_model_keeps_the_noise_of_its_own() -> None:
    """Its spread stays what it was, and its own unknowns become those that go with it."""
    counts = replace(a_bracket(own_noise=True, exposure_error=0.1))
    edges, noise, own = gamma_edges(12), AffineNoise(3e-3, 9e-4), an_own(counts)
    before = ExposureModel(counts, edges, noise, own)

    informed = before.informed()
    its_own = np.concatenate([own[:1], [0.0], own[counts.first_change :]])

    assert informed.has_relative_noise
    assert informed.own_mean[1] == 0.0  # where the factor begins
    assert informed.own_mean.size == its_own.size
    shiftless = tuple(
        replace(new, weight=old.weight, shift=old.shift)
        for new, old in zip(informed.tables, counts.tables, strict=True)
    )
    after = ExposureModel(replace(informed, tables=shiftless), edges, noise, its_own)
    assert after.log_likelihood() == pytest.approx(before.log_likelihood(), rel=1e-9)


def test_noise_of_its_own_tells_no_power_of_the_curve() -> None:
    """f^γ with exposures to that power explains a bracket alike, so far as levels are narrow."""
    n_levels = 256
    table = comparagram(np.ones((n_levels, n_levels)), noise=np.full(n_levels, 1e-3))
    counts = exposure_counts(table, ratio=4.0, own_noise=True, exposure_error=0.5)
    base, noise = gamma_edges(n_levels, 2.2), AffineNoise(3e-3, 9e-4)
    own = np.array([math.log(0.03), 0.0, 0.0, 0.0])
    ((_, expected),) = probabilities(counts, base, noise, own)
    expected[[0, -1]] = 0
    counts = replace(counts, tables=(replace(table, counts=1e3 * expected),))
    values = []
    for power in (1.0, 1.02):
        turned = own.copy()
        turned[:2] += np.log(power) * np.array([1, 2])
        turned[2:] = (power - 1) * counts.log_exposures
        values.append(ExposureModel(counts, base**power, noise, turned).log_likelihood())
    off = ExposureModel(counts, base**1.02, noise, own).log_likelihood()

    assert values[0] - values[1] < 1e-3 * (values[0] - off)


def weights(n_pixels: float, scatter: float, trust: float = 1.0) -> Floats:
    table = comparagram(np.full((32, 32), n_pixels / 32))
    counts = exposure_counts(replace(table, trust=np.full(32, trust)))
    model = ExposureModel(
        counts, gamma_edges(32), AffineNoise.from_8bit(0.03, 16), np.array([math.log(scatter)])
    )
    (informed,) = model.informed().tables
    assert informed.weight is not None
    return informed.weight


def test_weights_of_rows() -> None:
    plain = weights(100, 0.02)

    assert (plain[0], plain[-1]) == (0, 0)
    assert np.all((plain[1:-1] > 0) & (plain[1:-1] <= 1))
    # The scatter is relative, so it counts most where there is light.
    assert plain[30] < plain[15] < plain[2]
    np.testing.assert_allclose(weights(100, 1e-9)[1:-1], 1)
    np.testing.assert_allclose(weights(100, 0.02, trust=0.1), 0.1 * plain)
    assert np.all(weights(100, 0.1)[1:-1] < plain[1:-1])
    many, more = weights(1e6, 0.02), weights(1e7, 0.02)
    assert np.all(many[1:-1] < plain[1:-1])
    # More pixels never count less in all, and however many there are, they end at a limit.
    assert np.all(1e7 * more >= 1e6 * many)
    np.testing.assert_allclose((1e7 * more)[20:31], (1e6 * many)[20:31], rtol=0.01)


def test_rows_of_lossy_files_count_less_where_the_scene_shifts_them() -> None:
    """Five times the shift is what pixels share, twenty times where the shorter one is given."""
    counts = np.tile(1e6 * np.exp(-np.arange(32) / 8.0), (32, 1)).T
    noise, own = AffineNoise.from_8bit(0.5, 4), np.array([math.log(1e-6)])
    edges = gamma_edges(32)

    def informed(shorter: int, longer: int, margin: int) -> Comparagram:
        table = replace(comparagram(counts, shorter, longer, margin=margin), histogram=counts[:, 0])
        (found,) = ExposureModel(exposure_counts(table), edges, noise, own).informed().tables
        return found

    level, step = 20, math.log(2.0)
    for shorter, longer, times in ((0, 1, 5.0), (1, 0, 20.0)):
        lossy = informed(shorter, longer, margin=2)
        assert lossy.shift is not None
        assert lossy.weight is not None
        assert abs(lossy.shift[level]) > 0.003
        ratio = math.exp(step if longer else -step)
        light = (edges[level] + edges[level - 1]) / 2
        mean = light / ratio
        variance = noise.slope * (mean + light / ratio**2) + noise.floor * (1 + 1 / ratio**2)
        variance += (edges[level] - edges[level - 1]) ** 2 / 12 / ratio**2
        shared = (times * lossy.shift[level] * mean) ** 2 / variance
        n_pixels = counts[level].sum()
        assert lossy.weight[level] == pytest.approx(1 / (1 + n_pixels * shared), rel=1e-4)
        lossless = informed(shorter, longer, margin=0)
        assert lossless.weight is not None
        assert lossless.weight[level] == pytest.approx(1.0, rel=1e-3)


def test_the_limit_of_many_pixels_is_that_of_what_they_share() -> None:
    """0.3 of the scatter's variance is common to a row: its mean is no surer than that."""
    scatter, noise = 0.05, AffineNoise.from_8bit(0.03, 16)
    edges, level, n_pixels = gamma_edges(32), 20, 1e9
    below, above = edges[level - 1], edges[level]
    mean = (below + above) / 4
    of_noise = noise.variance(mean) + (noise.variance(2 * mean) + (above - below) ** 2 / 12) / 4
    variance = of_noise + (scatter * mean) ** 2

    weight = weights(n_pixels, scatter)[level]

    assert weight * n_pixels == pytest.approx(variance / (0.3 * (scatter * mean) ** 2), rel=1e-6)


# What a bracket says of itself


def test_prior_of_the_own_unknowns() -> None:
    noise = AffineNoise.from_8bit(*TYPICAL_8BIT)
    log_noise = [math.log(noise.slope), math.log(noise.floor)]
    counts = a_bracket()
    scatter = [math.log(0.02)]

    assert counts.own_mean.tolist() == scatter
    assert a_bracket(own_noise=True).own_mean.tolist() == pytest.approx(scatter + log_noise)
    all_of_it = a_bracket(own_noise=True, exposure_error=0.1)
    assert all_of_it.own_mean.tolist() == pytest.approx([*scatter, *log_noise, 0, 0, 0])
    deviations = 1 / np.sqrt(np.diag(all_of_it.own_precision))
    np.testing.assert_allclose(deviations, [1, 0.7, 0.7, 0.1, 0.1, 0.1])
    informed = a_bracket(own_noise=True, relative=True, exposure_error=0.1)
    assert informed.own_mean.tolist() == pytest.approx([*scatter, 0, 0, 0, 0])
    deviations = 1 / np.sqrt(np.diag(informed.own_precision))
    np.testing.assert_allclose(deviations, [1, 0.7, 0.1, 0.1, 0.1])
    exact = 1 / np.sqrt(np.diag(a_bracket(exposure_error=0.1).own_precision))
    np.testing.assert_allclose(exact, [1, 0.1, 0.1, 0.1])


@pytest.mark.parametrize(
    ("cells", "observed"),
    [
        ([(3, 1), (9, 4)], (1, 9)),
        ([(15, 7)], (7, 7)),
        ([(15, 0)], (0, 15)),
        ([(2, 0), (15, 14)], (2, 14)),
    ],
)
def test_observed_levels_are_neither_black_nor_white(
    cells: list[tuple[int, int]], observed: tuple[int, int]
) -> None:
    table = np.zeros((16, 16))
    for cell in cells:
        table[cell] = 1.4

    counts = exposure_counts(comparagram(table))

    assert counts.observed_levels == observed
    assert counts.n_pixels == round(1.4 * len(cells))


@settings(max_examples=15)
@given(seed=SEEDS)
def test_the_most_probable_ratio_of_expected_counts_is_the_true_one(seed: int) -> None:
    """Counts as the model expects them pull nowhere."""
    rng = np.random.default_rng(seed)
    edges = np.cumsum(rng.dirichlet(np.full(10, 3.0)))[:-1]
    noise, own = AffineNoise(5e-3, 2e-3), np.array([math.log(0.05), 0.03, -0.02])
    table = comparagram(np.full((10, 10), 10.0), weight=np.ones(10))
    counts = exposure_counts(table, exposure_error=0.1)
    ((_, share),) = probabilities(counts, edges, noise, own)
    for _ in range(5):  # the stray share follows the counts
        counts = replace(counts, tables=(replace(table, counts=100 * share),))
        ((_, share),) = probabilities(counts, edges, noise, own)

    gradient = ExposureModel(counts, edges, noise, own).expand(IDENTITY).gradient

    information = ExposureModel(counts, edges, noise, own).expand(IDENTITY).information
    unit = np.sqrt(np.diag(information) + 1e-9)
    assert np.abs(gradient / unit).max() < 1e-2
