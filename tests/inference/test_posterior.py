"""What is integrated over modes: quadrature, differences, sampling, a finer grid."""

from dataclasses import replace

import numpy as np
import pytest
from gamma_camera import (
    EDGES,
    LEVELS,
    NOISE,
    expected_counts,
    mode_from,
    more_evident,
    noise_known,
    ridge_of,
    space_of,
    start_of,
)
from scipy.interpolate import PchipInterpolator

from chartless.curves.populations import measured_prior
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, free_curve
from chartless.evidence.noise.likelihood import PairCounts
from chartless.evidence.noise.term import ridge_share
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import (
    Posterior,
    at_levels,
    at_mode,
    deviations_at_levels,
    integrated,
)
from chartless.inference.ridge import predicted


def test_the_integrated_curve_increases_and_its_ends_are_known(posterior: Posterior) -> None:
    assert posterior.inverse.shape == posterior.inverse_std.shape == (LEVELS,)
    assert (posterior.inverse[0], posterior.inverse[-1]) == (0, 1)
    assert np.all(np.diff(posterior.inverse) > 0)
    assert posterior.inverse_std[0] == posterior.inverse_std[-1] == 0
    assert np.all(posterior.inverse_std[1:-1] > 0)
    assert np.linalg.eigvalsh(noise_known(posterior)[1]).min() > 0


def test_the_truth_lies_within_the_error_bars(posterior: Posterior) -> None:
    away = (posterior.inverse - at_levels(EDGES))[1:-1] / posterior.inverse_std[1:-1]

    assert np.abs(away).max() < 2.5
    mean, covariance = noise_known(posterior)
    off = mean - np.log([NOISE.slope, NOISE.floor])
    assert off @ np.linalg.solve(covariance, off) < 9


@pytest.mark.slow
def test_one_mode_alone_is_reported_with_its_own_deviations(
    space: AbstractCurveSpace, found: ChannelMode
) -> None:
    covariance = np.linalg.inv(found.mode.factor @ found.mode.factor.T)
    size = space.mean.size
    drawn = np.random.default_rng(6).multivariate_normal(
        found.coordinates, covariance[:size, :size], 1000
    )
    levels = [at_levels(space.edges(coordinates)) for coordinates in drawn]

    alone = integrated([found], space, 1.0)

    np.testing.assert_allclose(alone.inverse, at_levels(found.edges), atol=1e-12)
    np.testing.assert_allclose(alone.inverse_std, np.std(levels, axis=0), rtol=0.12)
    log_noise, noise_covariance = noise_known(alone)
    np.testing.assert_allclose(log_noise, np.log([found.noise.slope, found.noise.floor]))
    # At a given ratio ln u and ln v are wrong together.
    np.testing.assert_allclose(noise_covariance, np.full((2, 2), covariance[size, size]), rtol=1e-8)
    if isinstance(space, FamilyCurve):
        np.testing.assert_allclose(
            alone.coordinate_covariance, covariance[:size, :size], rtol=1e-6, atol=1e-12
        )
    else:
        assert alone.coordinate_covariance.shape == (0, 0)
    assert alone.best is found
    assert alone.spread is None
    same = at_mode(found, space)
    np.testing.assert_array_equal(same.inverse, alone.inverse)
    np.testing.assert_array_equal(same.inverse_std, alone.inverse_std)
    np.testing.assert_array_equal(same.best_variance, alone.best_variance)


def test_draws_about_a_mode_tell_mean_and_deviation_scale_and_shape(
    space: AbstractCurveSpace, found: ChannelMode
) -> None:
    """Of any curve; those of a family are no sums of exponentials, and none are drawn."""
    told = at_mode(found, space, skewed=True)

    by_derivatives = at_mode(found, space)
    np.testing.assert_array_equal(told.best_variance, by_derivatives.best_variance)
    if isinstance(space, FamilyCurve):
        assert told.spread is None
        np.testing.assert_array_equal(told.inverse, by_derivatives.inverse)
        np.testing.assert_array_equal(told.inverse_std, by_derivatives.inverse_std)
        return
    size = space.mean.size
    covariance = np.linalg.inv(found.mode.factor @ found.mode.factor.T)[:size, :size]
    rng = np.random.default_rng(7)
    drawn = rng.multivariate_normal(found.coordinates, covariance, 4000)
    levels = np.array([at_levels(space.edges(coordinates)) for coordinates in drawn])
    mean, std = levels.mean(axis=0), levels.std(axis=0)
    inner = slice(1, -1)
    assert np.abs((told.inverse - mean)[inner] / std[inner]).max() < 0.1
    np.testing.assert_allclose(told.inverse_std[inner], std[inner], rtol=0.12)
    # The mean of skewed light lies above the mode.
    assert np.abs((by_derivatives.inverse - mean)[inner] / std[inner]).max() > 0.1
    assert told.spread is not None
    scales = [np.vdot(mean, each) / (mean @ mean) for each in levels]
    assert told.spread.log_scale == pytest.approx(float(np.log(scales).std()), rel=0.12)
    shape = (levels / np.array(scales)[:, np.newaxis]).std(axis=0)
    np.testing.assert_allclose(told.spread.shape[inner], shape[inner], rtol=0.12)


def test_deviations_of_levels_are_those_of_draws() -> None:
    space = free_curve(measured_prior(LEVELS))
    rng = np.random.default_rng(12)
    root = rng.normal(0, 0.01, (LEVELS, LEVELS))
    drawn = space.mean + rng.normal(size=(4000, LEVELS)) @ root.T
    levels = [at_levels(space.edges(coordinates)) for coordinates in drawn]

    deviations = deviations_at_levels(space.pull(space.mean), root @ root.T, LEVELS)

    assert deviations[0] == deviations[-1] == 0
    np.testing.assert_allclose(np.std(levels, axis=0), deviations, rtol=0.06, atol=1e-12)


@pytest.mark.slow
def test_the_integral_is_that_of_a_finer_grid(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[ChannelMode], posterior: Posterior
) -> None:
    """Sums over 24 modes with no interpolation, no warp between them and no end of the ridge."""
    log_ratios = np.linspace(np.log(0.003), np.log(50), 24)
    fine: list[ChannelMode] = []
    near = modes[0]
    for ratio in np.exp(log_ratios):
        near = mode_from(counts, space, predicted(space, near, float(ratio)))
        fine.append(near)
    share = ridge_share(counts, space)
    logs = np.array([share * (one.mode.log_evidence - one.known) + one.known for one in fine])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    alone = [integrated([one], space, 1.0) for one in fine]
    curves = np.array([each.inverse for each in alone])
    mean = weights @ curves
    variance = weights @ (np.array([e.inverse_std for e in alone]) ** 2 + (curves - mean) ** 2)
    noise = np.array([noise_known(each)[0] for each in alone])
    centre = weights @ noise
    covariance = ((noise - centre).T * weights) @ (noise - centre)
    covariance += np.tensordot(weights, [noise_known(each)[1] for each in alone], 1)

    assert weights[[0, -1]].max() < 1e-3
    deviation = np.sqrt(variance)[1:-1]
    # The ends of the ridge, where little is left, are cut: error bars are up to a quarter less.
    assert np.abs((posterior.inverse - mean)[1:-1] / deviation).max() < 0.15
    ratio = posterior.inverse_std[1:-1] / deviation
    assert ratio.min() > 0.7
    assert ratio.max() < 1.1
    log_noise, noise_covariance = noise_known(posterior)
    assert np.abs((log_noise - centre) / np.sqrt(np.diag(covariance))).max() < 0.15
    spread = np.sqrt(np.diag(noise_covariance) / np.diag(covariance))
    assert spread.min() > 0.6
    assert spread.max() < 1.1


@pytest.mark.parametrize("place", [0, -2])
def test_one_mode_more_between_two_changes_little(
    space: AbstractCurveSpace,
    counts: PairCounts,
    modes: list[ChannelMode],
    posterior: Posterior,
    place: int,
) -> None:
    """Modes stand for the ratios about them, however many there are."""
    ratio = float(np.sqrt(modes[place].ratio * modes[place + 1].ratio))
    between = mode_from(counts, space, predicted(space, modes[place], ratio))
    more = sorted([*modes, between], key=lambda each: each.ratio)

    found = integrated(more, space, ridge_share(counts, space))

    np.testing.assert_allclose(noise_known(found)[0], noise_known(posterior)[0], atol=0.02)
    np.testing.assert_allclose(found.inverse_std, posterior.inverse_std, rtol=0.03)


def test_modes_count_by_their_evidence(space: AbstractCurveSpace, modes: list[ChannelMode]) -> None:
    first = modes[0]
    certain = [more_evident(first, 1e4), *modes[1:]]

    found = integrated(certain, space, 1.0)

    assert found.best is certain[0]
    np.testing.assert_allclose(found.inverse, at_levels(first.edges), atol=1e-3)
    log_slope, log_floor = noise_known(found)[0]
    ratio = float(np.exp(log_slope - log_floor))
    assert ratio == pytest.approx(first.ratio, rel=0.01)


def test_without_a_share_the_evidence_of_pairs_does_not_matter(
    space: AbstractCurveSpace, modes: list[ChannelMode]
) -> None:
    rng = np.random.default_rng(0)
    others = [more_evident(each, rng.normal(0, 50)) for each in modes]

    found, same = (integrated(each, space, 0.0) for each in (modes, others))
    shared, other = (integrated(each, space, 0.1) for each in (modes, others))

    np.testing.assert_array_equal(found.inverse, same.inverse)
    np.testing.assert_array_equal(found.inverse_std, same.inverse_std)
    np.testing.assert_array_equal(noise_known(found)[1], noise_known(same)[1])
    assert found.best.ratio == same.best.ratio
    assert np.abs(shared.inverse - other.inverse).max() > 1e-5


def test_other_channels_count_by_what_their_pairs_tell_of_the_ratio(
    space: AbstractCurveSpace, modes: list[ChannelMode]
) -> None:
    """Added to the own evidence, without priors, which would be counted twice."""
    first = modes[0].mode.fits
    flat = [replace(each, mode=replace(each.mode, fits=first)) for each in modes]
    fits = [fit for each in modes for fit in each.mode.fits]
    told = np.array([fit.log_likelihood() - fit.firm for fit in fits])
    doubled = [
        more_evident(each, 2 * nats) for each, nats in zip(modes, told - told.max(), strict=True)
    ]

    alone = integrated(modes, space, 0.3)
    beside_flat = integrated(modes, space, 0.3, others=[flat, modes[:1]])
    beside_two = integrated(modes, space, 0.3, others=[modes, modes])

    np.testing.assert_allclose(beside_flat.inverse, alone.inverse, atol=1e-12)
    np.testing.assert_allclose(beside_flat.inverse_std, alone.inverse_std, atol=1e-12)
    expected = integrated(doubled, space, 0.3)
    two, alone_noise = noise_known(beside_two)[0], noise_known(alone)[0]
    np.testing.assert_allclose(two, noise_known(expected)[0], atol=0.05)
    np.testing.assert_allclose(beside_two.inverse, expected.inverse, atol=1e-3)
    assert np.abs(two - alone_noise).max() > 1e-3


def test_dark_frames_settle_the_floor_and_the_curve_follows() -> None:
    space = space_of("gamma")
    results = []
    for n_dark in (0, 1e5):
        counts = expected_counts(n_dark=n_dark)
        modes = ridge_of(counts, space, start_of(space))
        results.append(integrated(modes, space, ridge_share(counts, space)))

    without, with_dark = results

    deviations = [float(np.sqrt(noise_known(each)[1][1, 1])) for each in results]
    assert deviations[1] < 0.7 * deviations[0]
    assert with_dark.inverse_std.max() < without.inverse_std.max() / 2
    assert noise_known(with_dark)[0][1] == pytest.approx(np.log(NOISE.floor), abs=2 * deviations[1])
    errors = [np.abs(each.inverse - at_levels(EDGES)).max() for each in results]
    assert errors[1] < errors[0]


def test_the_covariance_of_coordinates_has_what_the_ratio_adds() -> None:
    """Along the ridge, by evidence, with a finer sum; within and between."""
    space = space_of("gamma")
    counts = expected_counts()
    modes = ridge_of(counts, space, start_of(space))
    logs = np.log([each.ratio for each in modes])
    fine = np.linspace(logs[0], logs[-1], 4000)
    # A family hears of the ratio from the prior alone.
    known = PchipInterpolator(logs, [each.known for each in modes])(fine)
    weights = np.exp(known - known.max()) / np.exp(known - known.max()).sum()
    places = np.interp(fine, logs, [each.coordinates[0] for each in modes])
    inside = [np.linalg.inv(each.mode.factor @ each.mode.factor.T)[0, 0] for each in modes]
    between = weights @ (places - weights @ places) ** 2

    found = integrated(modes, space, 0.0).coordinate_covariance

    assert found.shape == (1, 1)
    assert between > 3 * max(inside)  # the ratio is most of it
    assert found[0, 0] == pytest.approx(between + weights @ np.interp(fine, logs, inside), rel=0.03)


@pytest.mark.slow
def test_two_runs_are_equal_to_the_last_bit(space: AbstractCurveSpace) -> None:
    counts = expected_counts(n_dark=1000)

    once, again = (
        integrated(ridge_of(counts, space, start_of(space)), space, 0.5) for _ in range(2)
    )

    np.testing.assert_array_equal(once.inverse, again.inverse)
    np.testing.assert_array_equal(once.inverse_std, again.inverse_std)
    for part, same in zip(noise_known(once), noise_known(again), strict=True):
        np.testing.assert_array_equal(part, same)
    assert once.best.mode.log_evidence == again.best.mode.log_evidence
