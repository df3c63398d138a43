"""Modes and what is integrated over them: quadrature, differences, sampling, a finer grid.

The camera has 32 levels, a gamma of 0.45 and noise of one to three levels; counts are what it is
expected to give. The density that is maximised is written anew here, from its description.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from chartless.curves.prior import bin_edges
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, free_curve
from chartless.evidence.noise.likelihood import (
    DARK_PIXELS,
    SCENE_STEP,
    PairCounts,
    PairModel,
    Scene,
)
from chartless.evidence.noise.stabilised import on_even_scale, warped
from chartless.inference.posterior import (
    RATIOS,
    RIDGE_PAIRS,
    Mode,
    Posterior,
    State,
    at_levels,
    belief,
    deviations_at_levels,
    integrated,
    maximise,
    predicted,
    ridge,
    ridge_share,
    std_with_dark,
)
from chartless.inference.terms import PairTerm
from chartless.models import MODELS
from chartless.noise import CAMERAS_OF_2008, TYPICAL_8BIT, TYPICAL_SPREAD, AffineNoise
from chartless.types import Floats

LEVELS, NODES = 32, 128
NOISE = AffineNoise(5e-4, 1e-3)
USUAL_RATIO = CAMERAS_OF_2008.centre.ratio
EDGES = bin_edges(LEVELS)[1:-1] ** (1 / 0.45)
SPACES = ["any", "ameegc2-exact", "gamma"]
RATIO = st.floats(np.log(RATIOS[0]), np.log(RATIOS[-1])).map(lambda log: float(np.exp(log)))


def camera(n_nodes: int = NODES) -> PairModel:
    nodes = on_even_scale(n_nodes, NOISE.ratio)
    return PairModel(EDGES, NOISE, Scene(nodes, -1.5 * nodes))


def expected_counts(n_pairs: float = 1e5, *, n_dark: float = 0, weight: float = 0.2) -> PairCounts:
    model = camera()
    return PairCounts(2 * n_pairs * model.pairs, n_dark * model.dark, weight)


def space_of(name: str) -> AbstractCurveSpace:
    return free_curve(LEVELS) if name == "any" else FamilyCurve(MODELS[name], LEVELS)


def start_of(space: AbstractCurveSpace, ratio: float = USUAL_RATIO, n_nodes: int = NODES) -> State:
    """The mean camera before an even scene: nothing of the counts."""
    scene = np.zeros(n_nodes)
    return State.at_ratio(ratio, space.mean.copy(), float(np.log(2e-3)), (scene,))


def mode_at(
    counts: PairCounts, space: AbstractCurveSpace, ratio: float, n_nodes: int = NODES
) -> Mode:
    return maximise([PairTerm(counts, n_nodes)], space, start_of(space, ratio, n_nodes))


def ridge_of(
    counts: PairCounts,
    space: AbstractCurveSpace,
    start: State,
    on_mode: Callable[[int], None] | None = None,
) -> list[Mode]:
    share = ridge_share(counts, space)
    return ridge([PairTerm(counts, NODES)], space, start, share, on_mode=on_mode)


def scene_of(state: State) -> Scene:
    (log_weights,) = state.own
    return Scene(on_even_scale(log_weights.size, state.noise.ratio), log_weights)


def unknowns(state: State) -> Floats:
    return np.concatenate([state.coordinates, state.log_noise[1:], *state.own])


def log_posterior(
    counts: PairCounts, space: AbstractCurveSpace, ratio: float, numbers: Floats
) -> float:
    """Log-likelihood and priors of coordinates, noise and scene, up to a constant."""
    size = space.mean.size
    coordinates, log_floor, log_weights = numbers[:size], numbers[size], numbers[size + 1 :]
    floor = float(np.exp(log_floor))
    scene = Scene(on_even_scale(log_weights.size, ratio), log_weights)
    model = PairModel(space.edges(coordinates), AffineNoise(ratio * floor, floor), scene)
    away = coordinates - space.mean
    typical = np.log(TYPICAL_8BIT) - np.log([255, 255**2])
    away_noise = np.array([np.log(ratio) + log_floor, log_floor]) - typical
    step = SCENE_STEP * np.sqrt(128 / log_weights.size)
    rough = np.sum(np.diff(log_weights) ** 2) / step**2 + 1e-3 * np.sum(log_weights**2)
    squares = away @ space.precision @ away + rough + np.sum((away_noise / TYPICAL_SPREAD) ** 2)
    return model.log_likelihood(counts) - 0.5 * float(squares)


@pytest.fixture(scope="module", params=SPACES)
def space(request: pytest.FixtureRequest) -> AbstractCurveSpace:
    return space_of(request.param)


@pytest.fixture(scope="module")
def counts() -> PairCounts:
    return expected_counts()


@pytest.fixture(scope="module")
def mode(space: AbstractCurveSpace, counts: PairCounts) -> Mode:
    return mode_at(counts, space, USUAL_RATIO)


@pytest.fixture(scope="module")
def modes(space: AbstractCurveSpace, counts: PairCounts, mode: Mode) -> list[Mode]:
    return ridge_of(counts, space, mode.state)


@pytest.fixture(scope="module")
def posterior(space: AbstractCurveSpace, counts: PairCounts, modes: list[Mode]) -> Posterior:
    return integrated(modes, space, ridge_share(counts, space))


# One ratio


def test_a_mode_is_where_the_posterior_no_longer_rises(
    space: AbstractCurveSpace, counts: PairCounts, mode: Mode
) -> None:
    numbers = unknowns(mode.state)
    moves = 1e-4 * np.eye(numbers.size)
    gradient = np.array(
        [
            log_posterior(counts, space, mode.ratio, numbers + move)
            - log_posterior(counts, space, mode.ratio, numbers - move)
            for move in moves
        ]
    ) / (2e-4)

    # What a Newton step would still gain, in nats.
    still = 0.5 * float(np.sum(np.linalg.solve(mode.factor, gradient) ** 2))

    assert mode.settled
    assert still < 0.05
    at_start = log_posterior(counts, space, mode.ratio, unknowns(start_of(space)))
    assert log_posterior(counts, space, mode.ratio, numbers) > at_start + 20


def test_nothing_beside_a_mode_is_more_probable(
    space: AbstractCurveSpace, counts: PairCounts, mode: Mode
) -> None:
    numbers = unknowns(mode.state)
    peak = log_posterior(counts, space, mode.ratio, numbers)
    rng = np.random.default_rng(2)
    for distance in (1.0, 3.0):
        drops = []
        for _ in range(40):
            direction = rng.normal(size=numbers.size)
            direction *= distance / np.linalg.norm(direction)
            beside = numbers + np.linalg.solve(mode.factor.T, direction)

            drops.append(peak - log_posterior(counts, space, mode.ratio, beside))

        assert min(drops) > 0
        # The information is the curvature: a deviation away, half a nat is lost.
        assert np.mean(drops) == pytest.approx(distance**2 / 2, rel=0.2)


def test_a_mode_carries_its_edges_and_noise(space: AbstractCurveSpace, mode: Mode) -> None:
    floor = np.exp(mode.state.log_noise[1])

    np.testing.assert_array_equal(mode.edges, space.edges(mode.state.coordinates))
    assert mode.noise.floor == pytest.approx(floor)
    assert mode.noise.slope == pytest.approx(USUAL_RATIO * floor)


@pytest.mark.slow
@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("ratio", [0.1, 2.0])
def test_the_evidence_is_the_integral_over_all_else(name: str, ratio: float) -> None:
    """Laplace's approximation against importance sampling; the counts are few, the scene coarse."""
    space, n_nodes = space_of(name), 12
    counts = PairCounts(2 * 3000 * camera(n_nodes).pairs, np.zeros(LEVELS), 1.0)
    mode = mode_at(counts, space, ratio, n_nodes)
    numbers, rng = unknowns(mode.state), np.random.default_rng(77)
    logs = []
    for _ in range(800):
        normal = rng.normal(size=numbers.size)
        drawn = numbers + np.linalg.solve(mode.factor.T, normal)
        proposal = -0.5 * normal @ normal + np.log(np.diag(mode.factor)).sum()
        logs.append(log_posterior(counts, space, ratio, drawn) - proposal)
    weights = np.exp(np.array(logs) - max(logs))

    integral = max(logs) + float(np.log(weights.mean())) + 0.5 * space.log_precision

    error = weights.std() / weights.mean() / np.sqrt(weights.size)
    assert error < 0.15
    # Expected information is not quite the curvature where the ratio is not the true one.
    assert mode.log_evidence == pytest.approx(integral, abs=0.4 + 3 * error)


def test_without_counts_the_prior_is_all_there_is() -> None:
    space = free_curve(LEVELS)
    nothing = PairCounts(np.zeros((LEVELS, LEVELS)), np.zeros(LEVELS), 0.2)

    mode = mode_at(nothing, space, 2.0)

    np.testing.assert_allclose(mode.state.coordinates, space.mean, atol=0.01)
    np.testing.assert_allclose(scene_of(mode.state).weights, 1 / NODES, rtol=0.01)
    # u and v have the same say in v: it lies half way between what each of them wants.
    floor_8bit = np.sqrt(15 * 0.03 * 255 / 2)
    assert mode.noise.floor_8bit == pytest.approx(floor_8bit, rel=0.01)
    covariance = np.linalg.inv(mode.factor @ mode.factor.T)
    assert covariance[LEVELS, LEVELS] == pytest.approx(TYPICAL_SPREAD**2 / 2)
    curve = np.linalg.inv(space.precision)
    np.testing.assert_allclose(covariance[:LEVELS, :LEVELS], curve, atol=1e-6)


def test_the_known_part_of_the_evidence_is_prior_and_dark_frames() -> None:
    space = space_of("ameegc2-exact")
    counts = expected_counts(n_dark=1000)

    mode = mode_at(counts, space, 0.5)

    # In units of the typical deviation, a factor of two either way.
    away = np.log([mode.noise.slope_8bit / 0.03, mode.noise.floor_8bit / 15]) / TYPICAL_SPREAD
    dark = PairModel(mode.edges, mode.noise, scene_of(mode.state)).dark
    assert mode.known == pytest.approx(-0.5 * away @ away + counts.dark @ np.log(dark))


# The warp


@given(irradiance=st.floats(0, 1), ratio=RATIO, other=RATIO)
def test_the_warp_keeps_the_stabilised_scale(irradiance: float, ratio: float, other: float) -> None:
    def extent(end: float, ratio: float) -> float:
        """T = ∫ dI/σ from 0 to `end`, at v = 1."""
        return float(quad(lambda x: 1 / np.sqrt(1 + ratio * x), 0, end, epsabs=1e-13)[0])

    moved = float(warped(np.array(irradiance), ratio, other))

    assert 0 <= moved <= 1 + 1e-12
    share = extent(irradiance, ratio) / extent(1, ratio)
    assert extent(moved, other) / extent(1, other) == pytest.approx(share, abs=1e-10)


@given(ratio=RATIO, other=RATIO, third=RATIO)
def test_warps_keep_the_ends_compose_and_invert(ratio: float, other: float, third: float) -> None:
    grid = np.linspace(0, 1, 101)

    moved = warped(grid, ratio, other)

    assert moved[0] == 0
    assert moved[-1] == pytest.approx(1, abs=1e-12)
    assert np.all(np.diff(moved) > 0)
    np.testing.assert_allclose(warped(moved, other, third), warped(grid, ratio, third), atol=1e-11)
    np.testing.assert_allclose(warped(moved, other, ratio), grid, atol=1e-11)
    np.testing.assert_allclose(warped(grid, ratio, ratio), grid, atol=1e-12)


@given(RATIO, RATIO)
def test_even_places_of_one_ratio_are_those_of_another_warped(ratio: float, other: float) -> None:
    places = on_even_scale(33, ratio)

    assert (places[0], places[-1]) == (0.0, 1.0)
    np.testing.assert_allclose(warped(places, ratio, other), on_even_scale(33, other), atol=1e-12)


def test_even_places_without_photons_are_even() -> None:
    np.testing.assert_allclose(on_even_scale(5, 0.0), [0, 0.25, 0.5, 0.75, 1])


@pytest.mark.parametrize("ratio", [0.05, 5.0])
def test_the_state_predicted_at_another_ratio_shows_the_same_noise(ratio: float) -> None:
    space, counts = free_curve(LEVELS), expected_counts()
    mode = mode_at(counts, space, USUAL_RATIO)

    state = predicted(space, mode, ratio)

    def seen(edges: Floats, noise: AffineNoise) -> Floats:
        """Deviation in levels where a level lies."""
        return noise.std((edges[1:] + edges[:-1]) / 2) / np.diff(edges)

    edges = space.edges(state.coordinates)
    here = seen(mode.edges, mode.noise)
    np.testing.assert_allclose(seen(edges, state.noise), here, rtol=0.01)
    before = PairModel(mode.edges, mode.noise, scene_of(mode.state))
    after = PairModel(edges, state.noise, scene_of(state))
    # As many pixels at each level as before, and nearly the same pairs.
    assert np.abs(after.pairs - before.pairs).sum() < 0.02
    np.testing.assert_allclose(after.pairs.sum(axis=1), before.pairs.sum(axis=1), atol=4e-3)


# The ridge


def test_modes_follow_each_other_along_the_ridge(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[Mode]
) -> None:
    ratios = [mode.ratio for mode in modes]

    assert all(a < b for a, b in pairwise(ratios))
    assert any(ratio == pytest.approx(USUAL_RATIO) for ratio in ratios)
    assert len(modes) >= 3
    assert all(np.isfinite([mode.log_evidence, mode.known]).all() for mode in modes)
    assert all(mode.settled for mode in modes)
    # The walk went past the best both ways.
    share = ridge_share(counts, space)
    heard = [share * (mode.log_evidence - mode.known) + mode.known for mode in modes]
    assert 0 < int(np.argmax(heard)) < len(modes) - 1


def test_modes_of_the_ridge_do_not_depend_on_the_way_to_them(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[Mode]
) -> None:
    for mode in modes:
        direct = mode_at(counts, space, mode.ratio)

        assert direct.log_evidence == pytest.approx(mode.log_evidence, abs=0.1)
        np.testing.assert_allclose(direct.edges, mode.edges, atol=2e-3)


def test_the_number_of_modes_is_told() -> None:
    told: list[int] = []
    space = space_of("gamma")

    ridge_of(expected_counts(), space, start_of(space), on_mode=told.append)

    assert told == list(range(2, len(told) + 2))
    assert told[-1] <= len(RATIOS)


def test_a_narrow_ridge_gets_modes_where_its_evidence_is() -> None:
    space = space_of("gamma")

    modes = ridge_of(expected_counts(n_dark=2e6), space, start_of(space))

    # The evidence for the true ratio, 0.5, is narrower than the steps of `RATIOS`.
    logs = np.array([mode.log_evidence for mode in modes])
    likely = [mode.ratio for mode in modes if mode.log_evidence > logs.max() - 2]
    assert len(likely) >= 2
    assert any(min(abs(np.log(RATIOS) - np.log(ratio))) > 0.01 for ratio in likely)
    assert likely == pytest.approx([NOISE.slope / NOISE.floor] * len(likely), rel=0.2)


@pytest.mark.parametrize(
    ("n_pairs", "weight", "share"),
    [(RIDGE_PAIRS, 1.0, 1.0), (0, 0.2, 1.0), (4 * RIDGE_PAIRS, 0.5, 0.5), (1e9, 1.0, 1e-5)],
)
def test_many_pairs_tell_ratios_apart_no_better_than_some(
    n_pairs: float, weight: float, share: float
) -> None:
    counts = expected_counts(n_pairs, weight=weight)

    assert ridge_share(counts, free_curve(LEVELS)) == pytest.approx(share, rel=1e-6)
    assert ridge_share(counts, space_of("gamma")) == 0  # a family is not heard about it


# Integrated


def test_the_integrated_curve_increases_and_its_ends_are_known(posterior: Posterior) -> None:
    assert posterior.inverse.shape == posterior.inverse_std.shape == (LEVELS,)
    assert (posterior.inverse[0], posterior.inverse[-1]) == (0, 1)
    assert np.all(np.diff(posterior.inverse) > 0)
    assert posterior.inverse_std[0] == posterior.inverse_std[-1] == 0
    assert np.all(posterior.inverse_std[1:-1] > 0)
    assert np.linalg.eigvalsh(posterior.log_noise_covariance).min() > 0


def test_the_truth_lies_within_the_error_bars(posterior: Posterior) -> None:
    away = (posterior.inverse - at_levels(EDGES))[1:-1] / posterior.inverse_std[1:-1]

    assert np.abs(away).max() < 2.5
    noise = posterior.log_noise - np.log([NOISE.slope, NOISE.floor])
    assert noise @ np.linalg.solve(posterior.log_noise_covariance, noise) < 9


def test_one_mode_alone_is_reported_with_its_own_deviations(
    space: AbstractCurveSpace, mode: Mode
) -> None:
    covariance = np.linalg.inv(mode.factor @ mode.factor.T)
    size = space.mean.size
    drawn = np.random.default_rng(6).multivariate_normal(
        mode.state.coordinates, covariance[:size, :size], 1000
    )
    levels = [at_levels(space.edges(coordinates)) for coordinates in drawn]

    alone = integrated([mode], space, 1.0)

    np.testing.assert_allclose(alone.inverse, at_levels(mode.edges), atol=1e-12)
    np.testing.assert_allclose(alone.inverse_std, np.std(levels, axis=0), rtol=0.12)
    np.testing.assert_allclose(alone.log_noise, np.log([mode.noise.slope, mode.noise.floor]))
    # At a given ratio ln u and ln v are wrong together.
    np.testing.assert_allclose(alone.log_noise_covariance, covariance[size, size], rtol=1e-8)
    if isinstance(space, FamilyCurve):
        np.testing.assert_allclose(
            alone.coordinate_covariance, covariance[:size, :size], rtol=1e-6, atol=1e-12
        )
    else:
        assert alone.coordinate_covariance.shape == (0, 0)
    assert alone.best is mode


def test_deviations_of_levels_are_those_of_draws() -> None:
    space = free_curve(LEVELS)
    rng = np.random.default_rng(12)
    root = rng.normal(0, 0.01, (LEVELS, LEVELS))
    drawn = space.mean + rng.normal(size=(4000, LEVELS)) @ root.T
    levels = [at_levels(space.edges(coordinates)) for coordinates in drawn]

    deviations = deviations_at_levels(space.pull(space.mean), root @ root.T, LEVELS)

    assert deviations[0] == deviations[-1] == 0
    np.testing.assert_allclose(np.std(levels, axis=0), deviations, rtol=0.06, atol=1e-12)


@pytest.mark.slow
def test_the_integral_is_that_of_a_finer_grid(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[Mode], posterior: Posterior
) -> None:
    """Sums over 24 modes with no interpolation, no warp between them and no end of the ridge."""
    log_ratios = np.linspace(np.log(0.003), np.log(50), 24)
    fine: list[Mode] = []
    near = modes[0]
    for ratio in np.exp(log_ratios):
        terms = [PairTerm(counts, NODES)]
        near = maximise(terms, space, predicted(space, near, float(ratio)))
        fine.append(near)
    share = ridge_share(counts, space)
    logs = np.array([share * (mode.log_evidence - mode.known) + mode.known for mode in fine])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    alone = [integrated([mode], space, 1.0) for mode in fine]
    curves = np.array([each.inverse for each in alone])
    mean = weights @ curves
    variance = weights @ (np.array([e.inverse_std for e in alone]) ** 2 + (curves - mean) ** 2)
    noise = np.array([each.log_noise for each in alone])
    centre = weights @ noise
    covariance = ((noise - centre).T * weights) @ (noise - centre)
    covariance += np.tensordot(weights, [each.log_noise_covariance for each in alone], 1)

    assert weights[[0, -1]].max() < 1e-3
    deviation = np.sqrt(variance)[1:-1]
    # The ends of the ridge, where little is left, are cut: error bars are up to a quarter less.
    assert np.abs((posterior.inverse - mean)[1:-1] / deviation).max() < 0.15
    ratio = posterior.inverse_std[1:-1] / deviation
    assert ratio.min() > 0.7
    assert ratio.max() < 1.1
    assert np.abs((posterior.log_noise - centre) / np.sqrt(np.diag(covariance))).max() < 0.15
    spread = np.sqrt(np.diag(posterior.log_noise_covariance) / np.diag(covariance))
    assert spread.min() > 0.6
    assert spread.max() < 1.1


@pytest.mark.parametrize("place", [0, -2])
def test_one_mode_more_between_two_changes_little(
    space: AbstractCurveSpace,
    counts: PairCounts,
    modes: list[Mode],
    posterior: Posterior,
    place: int,
) -> None:
    """Modes stand for the ratios about them, however many there are."""
    ratio = float(np.sqrt(modes[place].ratio * modes[place + 1].ratio))
    terms = [PairTerm(counts, NODES)]
    found = maximise(terms, space, predicted(space, modes[place], ratio))
    more = sorted([*modes, found], key=lambda mode: mode.ratio)

    found = integrated(more, space, ridge_share(counts, space))

    np.testing.assert_allclose(found.log_noise, posterior.log_noise, atol=0.02)
    np.testing.assert_allclose(found.inverse_std, posterior.inverse_std, rtol=0.03)


def test_modes_count_by_their_evidence(space: AbstractCurveSpace, modes: list[Mode]) -> None:
    first = modes[0]
    certain = [replace(first, log_evidence=first.log_evidence + 1e4), *modes[1:]]

    found = integrated(certain, space, 1.0)

    assert found.best is certain[0]
    np.testing.assert_allclose(found.inverse, at_levels(first.edges), atol=1e-3)
    ratio = float(np.exp(found.log_noise[0] - found.log_noise[1]))
    assert ratio == pytest.approx(first.ratio, rel=0.01)


def test_without_a_share_the_evidence_of_pairs_does_not_matter(
    space: AbstractCurveSpace, modes: list[Mode]
) -> None:
    rng = np.random.default_rng(0)
    others = [replace(mode, log_evidence=mode.log_evidence + rng.normal(0, 50)) for mode in modes]

    found, same = (integrated(each, space, 0.0) for each in (modes, others))
    shared, other = (integrated(each, space, 0.1) for each in (modes, others))

    np.testing.assert_array_equal(found.inverse, same.inverse)
    np.testing.assert_array_equal(found.inverse_std, same.inverse_std)
    np.testing.assert_array_equal(found.log_noise_covariance, same.log_noise_covariance)
    assert found.best.ratio == same.best.ratio
    assert np.abs(shared.inverse - other.inverse).max() > 1e-5


@pytest.mark.parametrize(("deviations", "believed"), [(0.0, 1.0), (1.0, 1.0), (4.0, 1 / 16)])
def test_curves_that_the_prior_does_not_know_are_believed_less(
    deviations: float, believed: float, counts: PairCounts
) -> None:
    """So many deviations away in each direction."""
    space = free_curve(LEVELS)
    mode = mode_at(counts, space, USUAL_RATIO)
    root = np.linalg.cholesky(np.linalg.inv(space.precision))
    coordinates = space.mean + root @ np.full(space.mean.size, deviations)
    there = replace(mode, state=replace(mode.state, coordinates=coordinates))

    assert belief(there, space) == pytest.approx(believed)


def test_other_channels_count_by_what_their_pairs_tell_of_the_ratio(
    space: AbstractCurveSpace, modes: list[Mode]
) -> None:
    """Added to the own evidence, without priors, which would be counted twice."""
    flat = [replace(mode, fits=modes[0].fits) for mode in modes]
    told = np.array([mode.fits[0].log_likelihood() - mode.fits[0].firm for mode in modes])
    doubled = [
        replace(mode, log_evidence=mode.log_evidence + 2 * each)
        for mode, each in zip(modes, told - told.max(), strict=True)
    ]

    alone = integrated(modes, space, 0.3)
    beside_flat = integrated(modes, space, 0.3, others=[flat, modes[:1]])
    beside_two = integrated(modes, space, 0.3, others=[modes, modes])

    np.testing.assert_allclose(beside_flat.inverse, alone.inverse, atol=1e-12)
    np.testing.assert_allclose(beside_flat.inverse_std, alone.inverse_std, atol=1e-12)
    expected = integrated(doubled, space, 0.3)
    np.testing.assert_allclose(beside_two.log_noise, expected.log_noise, atol=0.05)
    np.testing.assert_allclose(beside_two.inverse, expected.inverse, atol=1e-3)
    assert np.abs(beside_two.log_noise - alone.log_noise).max() > 1e-3


def test_dark_frames_settle_the_floor_and_the_curve_follows() -> None:
    space = space_of("gamma")
    results = []
    for n_dark in (0, 1e5):
        counts = expected_counts(n_dark=n_dark)
        modes = ridge_of(counts, space, start_of(space))
        results.append(integrated(modes, space, ridge_share(counts, space)))

    without, with_dark = results

    deviations = [float(np.sqrt(each.log_noise_covariance[1, 1])) for each in results]
    assert deviations[1] < 0.7 * deviations[0]
    assert with_dark.inverse_std.max() < without.inverse_std.max() / 2
    assert with_dark.log_noise[1] == pytest.approx(np.log(NOISE.floor), abs=2 * deviations[1])
    errors = [np.abs(each.inverse - at_levels(EDGES)).max() for each in results]
    assert errors[1] < errors[0]


def dark_shown(space: AbstractCurveSpace, mode: Mode, numbers: Floats) -> Floats:
    """Probability of each level under a covered lens, from coordinates and ln v."""
    noise = AffineNoise(1.0, float(np.exp(numbers[-1])))
    return PairModel(space.edges(numbers[:-1]), noise, scene_of(mode.state)).dark


def slopes(function: Callable[[Floats], Floats], at: Floats) -> Floats:
    """Derivatives by central differences, one column for each number."""
    steps = 1e-4 * np.eye(at.size)
    return np.stack([(function(at + step) - function(at - step)) / 2e-4 for step in steps], axis=1)


def test_what_dark_frames_would_leave_is_what_their_information_leaves(
    space: AbstractCurveSpace, mode: Mode
) -> None:
    """Σ n (∂A)²/A of the levels added to what is known, all by differences and inverses."""
    size = space.mean.size
    at = unknowns(mode.state)[: size + 1]
    information = mode.factor @ mode.factor.T
    changes = slopes(lambda numbers: dark_shown(space, mode, numbers), at)
    shown = dark_shown(space, mode, at)
    information[: size + 1, : size + 1] += DARK_PIXELS * changes.T @ (changes.T / shown).T
    of_levels = slopes(lambda numbers: at_levels(space.edges(numbers)), at[:size])
    left = of_levels @ np.linalg.inv(information)[:size, :size] @ of_levels.T

    std = std_with_dark(integrated([mode], space, 1.0), space)

    np.testing.assert_allclose(std, np.sqrt(np.diag(left)), rtol=2e-3, atol=1e-9)


def test_dark_frames_would_narrow_the_band_at_each_ratio_and_not_between(
    space: AbstractCurveSpace, posterior: Posterior
) -> None:
    best = integrated([posterior.best], space, 1.0)

    with_dark, best_with_dark = (std_with_dark(each, space) for each in (posterior, best))

    assert np.all(with_dark <= posterior.inverse_std + 1e-12)
    between = np.maximum(posterior.inverse_std**2 - best.inverse_std**2, 0)
    np.testing.assert_allclose(with_dark**2, best_with_dark**2 + between, rtol=1e-9, atol=1e-15)


def test_the_covariance_of_coordinates_has_what_the_ratio_adds() -> None:
    """Along the ridge, by evidence, with a finer sum; within and between."""
    space = space_of("gamma")
    counts = expected_counts()
    modes = ridge_of(counts, space, start_of(space))
    logs = np.log([mode.ratio for mode in modes])
    fine = np.linspace(logs[0], logs[-1], 4000)
    # A family hears of the ratio from the prior alone.
    known = PchipInterpolator(logs, [mode.known for mode in modes])(fine)
    weights = np.exp(known - known.max()) / np.exp(known - known.max()).sum()
    places = np.interp(fine, logs, [mode.state.coordinates[0] for mode in modes])
    inside = [np.linalg.inv(mode.factor @ mode.factor.T)[0, 0] for mode in modes]
    between = weights @ (places - weights @ places) ** 2

    found = integrated(modes, space, 0.0).coordinate_covariance

    assert found.shape == (1, 1)
    assert between > 3 * max(inside)  # the ratio is most of it
    assert found[0, 0] == pytest.approx(between + weights @ np.interp(fine, logs, inside), rel=0.03)


def test_two_runs_are_equal_to_the_last_bit(space: AbstractCurveSpace) -> None:
    counts = expected_counts(n_dark=1000)

    once, again = (
        integrated(ridge_of(counts, space, start_of(space)), space, 0.5) for _ in range(2)
    )

    np.testing.assert_array_equal(once.inverse, again.inverse)
    np.testing.assert_array_equal(once.inverse_std, again.inverse_std)
    np.testing.assert_array_equal(once.log_noise, again.log_noise)
    np.testing.assert_array_equal(once.log_noise_covariance, again.log_noise_covariance)
    assert once.best.log_evidence == again.best.log_evidence
