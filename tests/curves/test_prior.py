"""Log slopes: increasing curves whatever the numbers, and a prior like the cameras it is from."""

import runpy
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from chartless.curves.populations import (
    Population,
    measured_prior,
    population_basis,
    population_prior,
)
from chartless.curves.prior import (
    CurvePrior,
    LogSlopeBasis,
    bin_edges,
    digital_basis,
    irradiance_at_edges,
    log_slope_basis,
    log_slopes_of,
)
from chartless.datasets import load_dorf
from chartless.types import Floats

LOG_SLOPES = hnp.arrays(
    np.float64, st.integers(2, 300), elements=st.floats(-2, 2, allow_subnormal=False)
)


@pytest.fixture(scope="module")
def measured(data_path: Path) -> tuple[Floats, Floats]:
    """Irradiance, and brightness of each distinct measured curve."""
    dorf = load_dorf(data_path / "dorf")
    return dorf.irradiance, dorf.curves[list(dorf.distinct)]


def inverses(measured: tuple[Floats, Floats], brightness: Floats) -> Floats:
    """G of each measured curve, in the middle of its plateaus, shape (B, N)."""
    irradiance, curves = measured
    rows = []
    for curve in curves:
        levels, first = np.unique(curve, return_index=True)
        last = np.append(first[1:], curve.size) - 1
        rows.append(np.interp(brightness, levels, (irradiance[first] + irradiance[last]) / 2))
    return np.array(rows)


# Curves


@pytest.mark.parametrize("n_levels", [2, 16, 256])
def test_levels_reach_half_way_to_their_neighbours(n_levels: int) -> None:
    edges = bin_edges(n_levels)

    levels = np.arange(n_levels) / (n_levels - 1)
    assert edges.shape == (n_levels + 1,)
    assert (edges[0], edges[-1]) == (0, 1)
    np.testing.assert_allclose(edges[1:-1], (levels[1:] + levels[:-1]) / 2, atol=1e-15)


@given(
    log_slopes=hnp.arrays(np.float64, st.integers(2, 300), elements=st.floats(-15, 15)),
    constant=st.floats(-1000, 1000),
)
def test_any_log_slopes_make_an_increasing_curve(log_slopes: Floats, constant: float) -> None:
    edges = irradiance_at_edges(log_slopes)

    assert edges.shape == (log_slopes.size + 1,)
    assert (edges[0], edges[-1]) == (0, 1)
    # A bin may be too narrow to be seen beside the others: 1e-13 of them and less.
    assert np.all(np.diff(edges) >= 0)
    if np.ptp(log_slopes) < 20:
        assert np.all(np.diff(edges) > 0)
    np.testing.assert_allclose(irradiance_at_edges(log_slopes + constant), edges, atol=1e-11)


@given(log_slopes=LOG_SLOPES)
def test_log_slopes_come_back_from_their_curve(log_slopes: Floats) -> None:
    back = log_slopes_of(irradiance_at_edges(log_slopes))

    # Up to the constant that makes the curve end at (1, 1).
    difference = back - log_slopes
    np.testing.assert_allclose(difference, difference[0], atol=1e-9)
    assert np.exp(back) @ np.diff(bin_edges(log_slopes.size)) == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.2])
def test_log_slopes_of_a_power_are_those_of_its_differences(exponent: float) -> None:
    levels = np.arange(64) / 63
    edges = np.concatenate([[0], (levels[1:] + levels[:-1]) / 2, [1]])
    expected = np.log((edges[1:] ** exponent - edges[:-1] ** exponent) / np.diff(edges))

    found = log_slopes_of(edges**exponent)

    np.testing.assert_allclose(found, np.maximum(expected, -5), atol=1e-9)
    np.testing.assert_allclose(irradiance_at_edges(expected), edges**exponent, atol=1e-12)


def test_plateaus_and_jumps_have_finite_log_slopes() -> None:
    irradiance = np.array([0, 0, 0.999, 1, 1.0])

    found = log_slopes_of(irradiance)

    np.testing.assert_allclose(found[[0, -1]], -5)
    assert found.max() == pytest.approx(np.log(0.999 * 3))


# The prior


@pytest.mark.parametrize("n_levels", [16, 64, 256, 1024])
def test_the_packaged_prior_is_a_distribution(n_levels: int) -> None:
    prior = measured_prior(n_levels)

    assert prior.n_levels == n_levels
    assert prior.mean.shape == (n_levels,)
    np.testing.assert_array_equal(prior.covariance, prior.covariance.T)
    eigenvalues = np.linalg.eigvalsh(prior.covariance)
    assert eigenvalues.min() > 0.9 * 0.003**2  # the white part
    # As stiff as curves are: a few directions hold nearly all of the variance.
    assert eigenvalues[-6:].sum() > 0.9 * eigenvalues.sum()


def test_the_mean_curve_is_like_that_of_measured_cameras(measured: tuple[Floats, Floats]) -> None:
    edges = bin_edges(256)
    inverse = inverses(measured, edges)

    mean = irradiance_at_edges(measured_prior(256).mean)

    np.testing.assert_allclose(mean, np.median(inverse, axis=0), atol=0.02)
    np.testing.assert_allclose(mean, inverse.mean(axis=0), atol=0.03)


@pytest.mark.parametrize("n_levels", [64, 256])
def test_curves_drawn_from_the_prior_spread_as_measured_cameras_do(
    n_levels: int, measured: tuple[Floats, Floats]
) -> None:
    prior = measured_prior(n_levels)
    cameras = inverses(measured, bin_edges(n_levels))
    rng = np.random.default_rng(190)

    drawn = np.array(
        [
            irradiance_at_edges(w)
            for w in rng.multivariate_normal(prior.mean, prior.covariance, 3000)
        ]
    )

    np.testing.assert_allclose(drawn.mean(axis=0), cameras.mean(axis=0), atol=0.02)
    middle = slice(n_levels // 8, -n_levels // 8)
    spread = drawn.std(axis=0)[middle] / cameras.std(axis=0)[middle]
    np.testing.assert_allclose(spread, 1, atol=0.2)


def covariance_at(prior: CurvePrior, brightness: Floats) -> Floats:
    """Covariance of the log slopes at some brightnesses."""
    edges = bin_edges(prior.n_levels)
    centres = (edges[1:] + edges[:-1]) / 2
    rows = np.array([np.interp(brightness, centres, row) for row in prior.covariance])
    return np.array([np.interp(brightness, centres, column) for column in rows.T])


@pytest.mark.parametrize(("n_levels", "tolerance"), [(64, 0.06), (128, 0.06), (1024, 0.003)])
def test_priors_at_other_numbers_of_levels_describe_the_same_curves(
    n_levels: int, tolerance: float
) -> None:
    brightness = np.linspace(0.02, 0.98, 97)
    fine, other = measured_prior(256), measured_prior(n_levels)
    covariance = covariance_at(fine, brightness)

    np.testing.assert_allclose(
        np.interp(brightness, bin_edges(n_levels), irradiance_at_edges(other.mean)),
        np.interp(brightness, bin_edges(256), irradiance_at_edges(fine.mean)),
        atol=2e-3,
    )
    unit = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    np.testing.assert_allclose(
        covariance_at(other, brightness) / unit, covariance / unit, atol=tolerance
    )


# Where it comes from


def test_two_cameras_span_a_basis_of_one_component() -> None:
    irradiance = np.linspace(0, 1, 4001)
    edges = bin_edges(256)
    slopes = [np.log(np.diff(edges**gamma) / np.diff(edges)) for gamma in (1.3, 0.8)]

    basis = log_slope_basis(irradiance, np.array([irradiance ** (1 / 1.3), irradiance**1.25]))

    assert basis.components.shape == (1, 256)
    np.testing.assert_allclose(basis.mean, np.mean(slopes, axis=0), atol=0.02)
    # Components are deviations: mean ± component are the cameras.
    first, second = basis.mean + basis.components[0], basis.mean - basis.components[0]
    if np.abs(first - slopes[0]).max() > np.abs(second - slopes[0]).max():
        first, second = second, first
    np.testing.assert_allclose(first, slopes[0], atol=0.02)
    np.testing.assert_allclose(second, slopes[1], atol=0.02)


def test_components_hold_the_covariance_of_the_cameras(measured: tuple[Floats, Floats]) -> None:
    irradiance, curves = measured
    basis = log_slope_basis(irradiance, curves, len(curves))

    trifle = 1e-9 * np.arange(irradiance.size)
    rows = np.array(
        [
            np.diff(np.interp(bin_edges(256), curve + trifle, irradiance)) / np.diff(bin_edges(256))
            for curve in curves
        ]
    )
    rows = np.log(rows.clip(np.exp(-5), np.exp(5)))

    assert len(basis.components) == len(curves) - 1
    np.testing.assert_allclose(basis.mean, rows.mean(axis=0), atol=1e-12)
    covariance = np.cov(rows.T, bias=True)
    np.testing.assert_allclose(basis.components.T @ basis.components, covariance, atol=1e-10)


def test_the_packaged_numbers_are_those_of_the_measured_curves(
    measured: tuple[Floats, Floats],
) -> None:
    with resources.files("chartless.curves").joinpath("dorf.npz").open("rb") as file:
        arrays = np.load(file, allow_pickle=False)
        mean, components = arrays["mean"], arrays["components"].astype(np.float64)

    basis = log_slope_basis(*measured)

    np.testing.assert_allclose(basis.mean, mean, rtol=1e-6, atol=1e-6)
    # The sign of a component is nobody's choice: compare what they make together.
    np.testing.assert_allclose(
        basis.components.T @ basis.components, components.T @ components, rtol=0, atol=3e-6
    )
    prior, packaged = basis.prior(64), measured_prior(64)
    np.testing.assert_allclose(prior.mean, packaged.mean, atol=1e-6)
    np.testing.assert_allclose(prior.covariance, packaged.covariance, atol=1e-5)


# Digital cameras


def test_an_odd_camera_does_not_move_the_typical_curve() -> None:
    rng = np.random.default_rng(2)
    cameras = [0.1 * rng.standard_normal((3, 256)) for _ in range(8)]
    film = LogSlopeBasis(np.zeros(256), 0.2 * rng.standard_normal((5, 256)))
    usual = digital_basis(cameras, film).mean
    odd = digital_basis([*cameras[:7], cameras[7] + 50], film).mean

    means = np.array([rows.mean(axis=0) for rows in cameras])
    np.testing.assert_allclose(usual, np.sort(means, axis=0)[2:6].mean(axis=0), atol=1e-12)
    assert np.abs(odd - usual).max() < np.ptp(means[:7], axis=0).max()


def test_the_prior_of_digital_cameras_spans_cameras_and_a_quarter_of_film() -> None:
    rng = np.random.default_rng(3)
    cameras = [rng.standard_normal((n, 256)) for n in (3, 1, 3, 3)]
    components = np.zeros((20, 256))  # as many are kept: those of film and ten of cameras
    components[:10] = rng.standard_normal((10, 256))
    film = LogSlopeBasis(np.zeros(256), components)
    basis = digital_basis(cameras, film)

    deviations = [rows - basis.mean for rows in cameras]
    between = sum(each.T @ each / len(each) for each in deviations) / 3
    expected = between + 0.25**2 * film.components.T @ film.components
    np.testing.assert_allclose(basis.components.T @ basis.components, expected, atol=1e-9)


def test_the_typical_digital_camera_lifts_shadows_more_than_film() -> None:
    digital, film = (
        irradiance_at_edges(population_prior(each).mean)
        for each in (Population.DIGITAL, Population.DORF)
    )

    # Half of full brightness needs less light.
    assert digital[128] < 0.7 * film[128]
    assert np.all(np.diff(digital) > 0)


@pytest.mark.slow
def test_the_packaged_numbers_are_those_of_the_script(data_path: Path) -> None:
    """Nine brackets are calibrated anew: what the script does, on the data it names."""
    if not (data_path / "middlebury").is_dir() or not (data_path / "modern_curves").is_dir():
        pytest.skip(f"no folders middlebury and modern_curves in {data_path}")
    script = runpy.run_path(str(Path(__file__).parents[2] / "scripts" / "fit_digital.py"))
    cameras = {**script["of_brackets"](data_path), **script["of_others"](data_path)}

    basis = digital_basis(list(cameras.values()), population_basis(Population.DORF))

    stored = population_basis(Population.DIGITAL)
    np.testing.assert_allclose(basis.mean, stored.mean, atol=1e-4)
    np.testing.assert_allclose(
        basis.components.T @ basis.components, stored.components.T @ stored.components, atol=1e-3
    )
