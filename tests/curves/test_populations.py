"""Populations of cameras: mixtures of priors, their weights, and the curves they describe."""

from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless.curves.populations import (
    Population,
    PopulationWeights,
    measured_prior,
    population_prior,
)
from chartless.curves.prior import (
    CurvePrior,
    bin_edges,
    grouped_basis,
    irradiance_at_edges,
    log_slopes_of,
    mixed,
)
from chartless.curves.transfer import TRANSFER_FUNCTIONS
from chartless.errors import ParameterError, UnknownNameError
from chartless.types import Floats

EDGES = bin_edges(256)
# Not 0 to 1e-6: a weight that rounding loses beside the others is no weight.
WEIGHTS = st.one_of(st.just(0.0), st.floats(1e-6, 1e6))
ALL_WEIGHTS = st.tuples(*[WEIGHTS] * len(Population)).filter(any)
LOG_CURVES = set(TRANSFER_FUNCTIONS) - {"linear", "srgb", "rec709", "adobergb", "hlg"}


def some_prior(rng: np.random.Generator, n_levels: int) -> CurvePrior:
    root = rng.normal(size=(n_levels, n_levels))
    return CurvePrior(3 * rng.normal(size=n_levels), root @ root.T + 0.1 * np.eye(n_levels))


def second_moment(prior: CurvePrior) -> Floats:
    """E[x xᵀ]."""
    return np.asarray(prior.covariance + np.outer(prior.mean, prior.mean))


def distance(prior: CurvePrior, light_at_edges: Floats) -> float:
    """Mahalanobis distance of a curve, given by its light at `bin_edges`."""
    away = log_slopes_of(light_at_edges) - prior.mean
    return float(np.sqrt(away @ np.linalg.solve(prior.covariance, away)))


# Mixtures


@given(
    weights=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=5),
    n_levels=st.integers(2, 8),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_mixture_has_the_moments_of_its_parts(
    weights: list[float], n_levels: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    priors = [some_prior(rng, n_levels) for _ in weights]
    total = sum(weights)

    found = mixed(list(zip(weights, priors, strict=True)))

    mean = sum(w * each.mean for w, each in zip(weights, priors, strict=True)) / total
    moments = sum(w * second_moment(each) for w, each in zip(weights, priors, strict=True)) / total
    np.testing.assert_allclose(found.mean, mean, atol=1e-10)
    np.testing.assert_allclose(second_moment(found), moments, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.covariance, found.covariance.T, atol=1e-12)
    assert [part for _, part in found.parts] == priors
    assert [w for w, _ in found.parts] == pytest.approx([w / total for w in weights])


@given(weights=ALL_WEIGHTS, factor=st.floats(1e-3, 1e3))
def test_only_ratios_of_weights_count(weights: tuple[float, ...], factor: float) -> None:
    once = PopulationWeights(*weights).prior(16)
    scaled = PopulationWeights(*(factor * each for each in weights)).prior(16)

    np.testing.assert_allclose(scaled.mean, once.mean, atol=1e-12)
    np.testing.assert_allclose(scaled.covariance, once.covariance, atol=1e-12)
    assert [w for w, _ in scaled.parts] == pytest.approx([w for w, _ in once.parts])


def test_a_mixture_of_one_is_that_one() -> None:
    prior = some_prior(np.random.default_rng(1), 5)

    found = mixed([(0.2, prior)])

    np.testing.assert_allclose(found.mean, prior.mean, atol=1e-12)
    np.testing.assert_allclose(found.covariance, prior.covariance, atol=1e-12)


def test_draws_from_the_parts_have_the_moments_of_the_mixture() -> None:
    rng = np.random.default_rng(5)
    parts = [(1.0, some_prior(rng, 3)), (3.0, some_prior(rng, 3))]
    drawn = np.concatenate(
        [rng.multivariate_normal(p.mean, p.covariance, int(50_000 * w)) for w, p in parts]
    )

    found = mixed(parts)

    deviation = np.sqrt(np.diag(found.covariance))
    assert np.abs((drawn.mean(axis=0) - found.mean) / deviation).max() < 0.02
    unit = np.outer(deviation, deviation)
    np.testing.assert_allclose(np.cov(drawn.T) / unit, found.covariance / unit, atol=0.02)


def test_a_mixture_with_shoulder_is_the_mixture_of_its_parts_with_shoulder() -> None:
    bare = PopulationWeights(digital=3, dorf=1, log=0.5).prior(64)

    found = bare.with_shoulder()

    expected = mixed([(weight, part.with_shoulder()) for weight, part in bare.parts])
    np.testing.assert_allclose(found.mean, expected.mean, atol=1e-12)
    np.testing.assert_allclose(found.covariance, expected.covariance, atol=1e-10)
    for (weight, part), (its_weight, its_part) in zip(found.parts, expected.parts, strict=True):
        assert weight == its_weight
        np.testing.assert_array_equal(part.mean, its_part.mean)
        np.testing.assert_array_equal(part.covariance, its_part.covariance)
    assert bare.with_shoulder() is found


# Weights


@given(
    weights=st.tuples(*[WEIGHTS] * len(Population)),
    place=st.integers(0, len(Population) - 1),
    wrong=st.one_of(
        st.floats(max_value=0, exclude_max=True, allow_nan=False), st.just(np.nan), st.just(np.inf)
    ),
)
def test_weights_that_are_no_weights_are_refused(
    weights: tuple[float, ...], place: int, wrong: float
) -> None:
    spoiled = [*weights]
    spoiled[place] = wrong

    with pytest.raises(ParameterError, match=r"^weights of populations are 0 or above"):
        PopulationWeights(*spoiled)


def test_some_population_is_needed() -> None:
    with pytest.raises(ParameterError, match="one of them above 0"):
        PopulationWeights()


@given(weights=ALL_WEIGHTS)
def test_weights_come_back_from_their_text(weights: tuple[float, ...]) -> None:
    text = ", ".join(
        f"{each.value}:{weight!r}" for each, weight in zip(Population, weights, strict=True)
    )

    assert PopulationWeights.parsed(text) == PopulationWeights(*weights)


@pytest.mark.parametrize(
    ("text", "weights"),
    [
        ("dorf", PopulationWeights(dorf=1)),
        ("digital:3,dorf", PopulationWeights(digital=3, dorf=1)),
        (" gamma:0.5 , log:1e-2 ", PopulationWeights(gamma=0.5, log=0.01)),
        ("digital:0,log:2", PopulationWeights(log=2)),
    ],
)
def test_names_have_a_weight_of_one_unless_told(text: str, weights: PopulationWeights) -> None:
    assert PopulationWeights.parsed(text) == weights


@pytest.mark.parametrize("text", ["film", "", "dorf,", "dorf:1,film:2", "DORF"])
def test_an_unknown_population_is_refused_by_name(text: str) -> None:
    with pytest.raises(UnknownNameError, match="population") as caught:
        PopulationWeights.parsed(text)

    assert all(each.value in str(caught.value) for each in Population)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("dorf:much", "^the weight of a population is a number, not 'much'$"),
        ("dorf:1:2", "^the weight of a population is a number, not '1:2'$"),
        ("dorf:-1", "^weights of populations are 0 or above"),
        ("dorf:nan", "^weights of populations are 0 or above"),
        ("dorf:0", "one of them above 0"),
        ("dorf:1,log:2,dorf:3", "^population 'dorf' is given twice$"),
    ],
)
def test_a_text_without_meaning_is_refused(text: str, why: str) -> None:
    with pytest.raises(ParameterError, match=why):
        PopulationWeights.parsed(text)


@given(weights=ALL_WEIGHTS)
def test_the_most_common_population_has_the_largest_weight(weights: tuple[float, ...]) -> None:
    found = PopulationWeights(*weights)

    assert getattr(found, found.most_common.value) == max(weights)


def test_of_equally_common_populations_the_first_counts() -> None:
    assert PopulationWeights(dorf=2, gamma=2).most_common is Population.DORF


def test_each_population_has_a_weight_of_its_name() -> None:
    for place, each in enumerate(Population):
        assert astuple(PopulationWeights(**{each.value: 2.0}))[place] == 2.0


# Priors


def test_a_prior_is_made_once() -> None:
    weights = PopulationWeights(digital=2, gamma=1)

    assert weights.prior(32) is PopulationWeights(digital=2, gamma=1).prior(32)
    assert weights.prior(32) is not weights.prior(33)
    assert population_prior(Population.LOG, 32) is population_prior(Population.LOG, 32)


@pytest.mark.parametrize("population", Population)
def test_one_population_alone_is_no_mixture(population: Population) -> None:
    prior = PopulationWeights(**{population.value: 0.3}).prior(32)

    assert prior is population_prior(population, 32)
    assert prior.parts == ()


def test_populations_without_weight_are_no_parts() -> None:
    found = PopulationWeights(dorf=1, log=3).prior(32)

    assert found.parts == (
        (0.25, measured_prior(32)),
        (0.75, population_prior(Population.LOG, 32)),
    )


@pytest.mark.parametrize("n_levels", [2, 16, 256, 1024])
@pytest.mark.parametrize("population", Population)
def test_a_population_is_a_distribution(population: Population, n_levels: int) -> None:
    prior = population_prior(population, n_levels)

    assert prior.n_levels == n_levels
    assert np.all(np.isfinite(prior.mean))
    np.testing.assert_allclose(prior.covariance, prior.covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(prior.covariance).min() > 0.9 * 0.003**2  # the white part


def test_each_group_of_log_slopes_counts_once() -> None:
    rng = np.random.default_rng(8)
    groups = [rng.normal(size=(n, 256)) for n in (1, 4, 2)]
    more = rng.normal(size=(3, 256))

    basis = grouped_basis(groups, more)

    rows = np.concatenate(groups)
    shares = np.concatenate([np.full(len(each), 1 / (3 * len(each))) for each in groups])
    mean = shares @ rows
    expected = np.cov(rows.T, aweights=shares, bias=True) + more.T @ more
    np.testing.assert_allclose(basis.mean, mean, atol=1e-12)
    np.testing.assert_allclose(basis.components.T @ basis.components, expected, atol=1e-9)
    # Seven rows about their mean span six directions, and more spans three.
    assert len(basis.components) == 9


def srgb_light(brightness: Floats) -> Floats:
    power = ((brightness + 0.055) / 1.055) ** 2.4
    return np.where(brightness <= 0.04045, brightness / 12.92, power)


def rec709_light(brightness: Floats) -> Floats:
    power = ((brightness + 0.099) / 1.099) ** (1 / 0.45)
    return np.where(brightness < 0.081, brightness / 4.5, power)


# A curve that is 1/N of a distribution cannot lie further than √N deviations from its mean.
@pytest.mark.parametrize("light", [EDGES, srgb_light(EDGES), rec709_light(EDGES)])
def test_plain_transfer_functions_lie_in_their_prior(light: Floats) -> None:
    assert distance(population_prior(Population.GAMMA), light) < np.sqrt(4)


@pytest.mark.parametrize("exponent", [0.4, 0.45, 0.5, 0.55])
def test_powers_lie_in_the_prior_of_plain_transfer_functions(exponent: float) -> None:
    assert distance(population_prior(Population.GAMMA), EDGES ** (1 / exponent)) < np.sqrt(16)


@pytest.mark.parametrize("name", sorted(LOG_CURVES))
def test_log_curves_lie_in_their_prior(name: str) -> None:
    light = TRANSFER_FUNCTIONS[name].curve.inverse(EDGES).clip(0, 1)
    light = (light - light[0]) / np.ptp(light)

    assert distance(population_prior(Population.LOG), light) < np.sqrt(len(LOG_CURVES))
    # Nothing else describes it as well.
    others = set(Population) - {Population.LOG}
    assert min(distance(population_prior(each), light) for each in others) > 6


def test_the_mean_of_plain_transfer_functions_is_that_of_their_log_slopes() -> None:
    powers = [log_slopes_of(EDGES ** (1 / each)) for each in (0.4, 0.45, 0.5, 0.55)]
    plain = [log_slopes_of(each) for each in (EDGES, srgb_light(EDGES), rec709_light(EDGES))]

    mean = population_prior(Population.GAMMA).mean

    np.testing.assert_allclose(mean, np.mean([*plain, np.mean(powers, axis=0)], axis=0), atol=2e-3)


def test_log_curves_lift_shadows_more_than_any_other_population() -> None:
    light = {each: irradiance_at_edges(population_prior(each).mean) for each in Population}

    # Half of full brightness needs less light.
    assert all(np.all(np.diff(each) > 0) for each in light.values())
    assert light[Population.LOG][128] < 0.5 * min(
        each[128] for population, each in light.items() if population is not Population.LOG
    )
