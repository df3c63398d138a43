"""Coordinates of curves: derivatives against differences, and the way back from edges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless.curves import named_curve
from chartless.curves.populations import measured_prior
from chartless.curves.prior import bin_edges
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve, free_curve
from chartless.errors import ParameterError
from chartless.models import MODELS
from chartless.types import Floats

LEVELS = 32
# Family and how well differences tell the derivative: EMoR's basis is a table, with kinks.
FAMILIES = {"ameegc2-exact": 1e-6, "emor4": 3e-3, "gamma": 1e-6, "gumbel2": 1e-6, "eegc2": 1e-6}
SEEDS = st.integers(0, 2**32 - 1)
SHIFTS = [-0.1, -0.01, 0.0, 0.01, 0.1]


def camera(space: AbstractCurveSpace, seed: int) -> Floats:
    """Coordinates of some camera, not a rare one."""
    normal = np.random.default_rng(seed).normal(0, 0.7, space.mean.size)
    return np.asarray(space.mean + np.linalg.solve(np.linalg.cholesky(space.precision).T, normal))


def jacobian(space: AbstractCurveSpace, coordinates: Floats, step: float = 1e-5) -> Floats:
    """Central differences of the edges, shape (L − 1, P)."""
    moves = step * np.eye(coordinates.size)
    changes = [space.edges(coordinates + move) - space.edges(coordinates - move) for move in moves]
    return np.array(changes).T / (2 * step)


def check_pull(space: AbstractCurveSpace, coordinates: Floats, tolerance: float) -> None:
    rng = np.random.default_rng(5)
    one, several = rng.normal(size=LEVELS - 1), rng.normal(size=(LEVELS - 1, 3))
    derivatives = jacobian(space, coordinates)

    pull = space.pull(coordinates)

    for rows in (one, several, np.eye(LEVELS - 1)):
        expected = derivatives.T @ rows
        scale = np.abs(expected).max()
        np.testing.assert_allclose(pull(rows), expected, rtol=0, atol=tolerance * scale)


# Any curve


@given(seed=SEEDS)
def test_pull_of_any_curve_is_that_of_differences(seed: int) -> None:
    space = free_curve(measured_prior(LEVELS))

    check_pull(space, camera(space, seed), 1e-7)


@given(seed=SEEDS, constant=st.floats(-3, 3))
def test_any_curve_comes_back_from_its_edges(seed: int, constant: float) -> None:
    space = free_curve(measured_prior(LEVELS))
    coordinates = camera(space, seed)
    edges = space.edges(coordinates + constant)

    back = space.nearest(edges)

    assert edges.shape == (LEVELS - 1,)
    assert np.all(np.diff(edges) > 0)
    np.testing.assert_allclose(space.edges(back), edges, atol=1e-12)
    # Of the coordinates of one curve, which differ by a constant, the most probable.
    np.testing.assert_allclose(np.diff(back), np.diff(coordinates), atol=1e-9)
    surprises = [
        (back + c - space.mean) @ space.precision @ (back + c - space.mean) for c in SHIFTS
    ]
    assert int(np.argmin(surprises)) == SHIFTS.index(0.0)


def test_a_plateau_becomes_a_steep_stretch() -> None:
    """Log slopes are limited, so the way back is exact only up to e^−5 of a level."""
    space = FreeCurve(measured_prior(LEVELS))
    edges = np.concatenate([np.linspace(0.1, 0.4, 15), np.full(3, 0.4), np.linspace(0.4, 0.95, 13)])

    back = space.nearest(edges)

    assert np.all(np.diff(space.edges(back)) > 0)
    np.testing.assert_allclose(space.edges(back), edges, atol=4 * np.exp(-5) / LEVELS)


def test_the_precision_inverts_the_covariance_of_the_prior() -> None:
    prior = measured_prior(LEVELS)

    space = FreeCurve(prior)

    np.testing.assert_allclose(space.precision @ prior.covariance, np.eye(LEVELS), atol=1e-8)
    np.testing.assert_array_equal(space.mean, prior.mean)


# Families


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", range(4))
def test_pull_of_a_family_is_that_of_differences(name: str, seed: int) -> None:
    space = FamilyCurve(MODELS[name], LEVELS)

    check_pull(space, camera(space, seed), FAMILIES[name])


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", [0, 1])
def test_edges_of_a_family_are_where_its_curve_passes_between_levels(name: str, seed: int) -> None:
    model = MODELS[name]
    space = FamilyCurve(model, LEVELS)
    coordinates = camera(space, seed)

    edges = space.edges(coordinates)

    brightness = model.response(edges, space.parameters(coordinates))
    np.testing.assert_allclose(brightness, (np.arange(1, LEVELS) - 0.5) / (LEVELS - 1), atol=1e-9)


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("away", [0.8, -0.8])
def test_a_member_of_a_family_comes_back_from_its_edges(name: str, away: float) -> None:
    space = FamilyCurve(MODELS[name], LEVELS)
    coordinates = away * np.resize([1.0, -1.0], space.mean.size)
    edges = space.edges(coordinates)

    back = space.nearest(edges)

    # The weak pull towards the mean camera leaves a trace.
    np.testing.assert_allclose(space.edges(back), edges, atol=3e-4)
    np.testing.assert_allclose(back, coordinates, atol=0.05)


@pytest.mark.parametrize("name", ["ameegc2-exact", "emor4", "gamma", "eegc2"])
def test_nothing_beside_the_nearest_member_is_nearer(name: str) -> None:
    space = FamilyCurve(MODELS[name], LEVELS)
    wanted = named_curve("srgb").inverse(bin_edges(LEVELS)[1:-1])

    def distance(coordinates: Floats) -> float:
        return float(np.sum((space.edges(coordinates) - wanted) ** 2))

    found = space.nearest(wanted)

    rng = np.random.default_rng(3)
    for step in (0.3, 0.03):
        for _ in range(10):
            assert distance(found) < distance(found + rng.normal(0, step, found.size)) + 1e-6
    assert distance(found) < distance(space.mean) / 3


@pytest.mark.parametrize("name", FAMILIES)
def test_the_prior_of_a_family_is_standard_normal(name: str) -> None:
    space = FamilyCurve(MODELS[name], LEVELS)

    np.testing.assert_array_equal(space.mean, np.zeros(MODELS[name].n_parameters))
    np.testing.assert_array_equal(space.precision, np.eye(MODELS[name].n_parameters))


@pytest.mark.parametrize("name", ["gamma", "ameegc2-exact", "emor4"])
def test_the_covariance_of_parameters_is_that_of_draws(name: str) -> None:
    space = FamilyCurve(MODELS[name], 16)
    root = np.random.default_rng(3).normal(size=(space.mean.size, space.mean.size))
    draws = np.random.default_rng(4).normal(size=(20_000, space.mean.size)) @ root.T
    drawn = np.cov(np.array([space.parameters(draw) for draw in draws]).T, ddof=0)

    covariance = space.parameter_covariance(np.atleast_2d(np.cov(draws.T, ddof=0)))

    np.testing.assert_allclose(covariance, np.atleast_2d(drawn), rtol=1e-9, atol=1e-14)


def test_edges_never_decrease_where_a_member_does() -> None:
    """EMoR has members that fall in places; the likelihood has no use for negative bins."""
    model = MODELS["emor4"]
    space = FamilyCurve(model, 256)
    coordinates = np.array([-1.5, 1.5, 2.5, -2.5, 2.5])
    curve = model.response(np.linspace(0, 1, 1024), space.parameters(coordinates))

    edges = space.edges(coordinates)

    assert np.diff(curve).min() < -1e-4
    assert np.all(np.diff(edges) >= 0)
    assert np.all((edges >= 0) & (edges <= 1))
    assert np.all(np.isfinite(space.pull(coordinates)(np.eye(255))))


def test_coordinates_of_no_member_are_refused() -> None:
    with pytest.raises(ParameterError):
        FamilyCurve(MODELS["gumbel2"], LEVELS).edges(np.array([0.0, 500.0, 500.0]))
