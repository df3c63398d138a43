"""The similarity integral in closed form against adaptive quadrature in 30 digits.

The dense check over the whole band uses Gauss–Legendre panels in float64, which are
themselves checked against mpmath here.
"""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import erf, ndtr
from scipy.stats import norm
from slow_cases import slow_but

from chartless.methods.ism.similarity import (
    _END_DEFICIT,
    black_end,
    bounded_similarity,
    light_nodes,
    pair_variances,
    quadrature_similarity,
    self_similarity,
    similarity,
    white_end,
)
from chartless.noise import AffineNoise

# U and V, 8-bit units: cameras, and the corners of the range that must work.
NOISES = [
    (0.03, 15),
    (0.06, 9),
    (0.01, 25),
    (0.3, 4),
    (1e-3, 0.05),
    (1e-3, 100),
    (1, 100),
    (1, 0.05),
]
CAMERAS = [(0.01, 9), (0.03, 15), (0.06, 25), (0.06, 1)]


def integral(first: float, second: float, noise: AffineNoise, *, bounded: bool) -> float:
    """∫ N(I₁; t, ut + v) N(I₂; t, ut + v) dt by mpmath, over the variance y = ut + v."""
    with mp.workdps(30):
        u, v = mp.mpf(noise.slope), mp.mpf(noise.floor)
        x1, x2 = mp.mpf(first), mp.mpf(second)
        centre = (u * (x1 + x2) / 2 + v) or v
        width = u * mp.sqrt(centre / 2)

        def density(y: mp.mpf) -> mp.mpf:
            t = (y - v) / u
            return mp.exp(-((x1 - t) ** 2 + (x2 - t) ** 2) / (2 * y)) / (2 * mp.pi * y * u)

        low, high = (v, u + v) if bounded else (mp.mpf(0), mp.inf)
        # The integrand ends like exp(-y/u²) above and exp(-const/y) below.
        splits = [centre + k * width for k in (-12, -8, -5, -3, -1, 0, 1, 3, 5, 8, 12, 20, 40)]
        splits += [centre * mp.mpf(10) ** -k for k in (1, 2, 3)]
        splits += [centre + k * u * u for k in (5, 20, 80, 200)]
        inside = sorted(y for y in splits if low < y < high)
        return float(mp.quad(density, [low, *inside, high]))


def panels(x: np.ndarray, y: np.ndarray, noise: AffineNoise) -> np.ndarray:
    """Integrate the same over t in [0, 1] for many pairs at once, 60 panels of 40 nodes each."""
    u, v = noise.slope, noise.floor
    points, weights = np.polynomial.legendre.leggauss(40)
    x, y = x[:, np.newaxis], y[:, np.newaxis]
    centre = np.hypot(u * x + v, u * y + v) / np.sqrt(2)
    reach = np.arccosh(1 + 60 * u**2 / (2 * centre))
    edges = (centre * np.exp(reach * np.linspace(-1, 1, 61))).clip(v, u + v)
    total = np.zeros(len(x))
    for low, high in zip(edges.T, edges.T[1:], strict=False):
        half = 0.5 * (high - low)[:, np.newaxis]
        variance = low[:, np.newaxis] + half * (1 + points)
        t = (variance - v) / u
        density = np.exp(-((x - t) ** 2 + (y - t) ** 2) / (2 * variance)) / (2 * np.pi * variance)
        total += (density * half) @ weights
    return total / u


def band(noise: AffineNoise, size: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Pairs up to six deviations of their difference apart, many near the ends and on them."""
    rng = np.random.default_rng(1964)
    uniform = rng.uniform(0, 1, (3, size))
    x = np.concatenate([uniform[0], uniform[1] ** 6, 1 - uniform[2] ** 6])
    y = x + rng.uniform(-6, 6, x.size) * np.sqrt(2) * noise.std(x)
    black, white = 6 * np.sqrt(2) * noise.std(np.array([0.0, 1.0]))
    x = np.concatenate([x, [0, 0, 1, 1]])
    y = np.concatenate([y, [0, black, 1, 1 - white]])
    return x, y.clip(0, 1)


def pairs_to_check(noise: AffineNoise) -> list[tuple[float, float]]:
    middle, black, white = noise.std([0.5, 0.0, 1.0]) * np.sqrt(2)
    return [
        (0.5, 0.5),
        (0.5, float(np.clip(0.5 + 4 * middle, 0, 1))),
        (0.0, 0.0),
        (0.0, float(min(3 * black, 1))),
        (1.0, 1.0),
        (1.0, float(max(1 - 6 * white, 0))),
    ]


@pytest.mark.parametrize("noise", slow_but(NOISES, (1, 100)), ids=str)
def test_similarity_is_the_integral_over_all_light(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)

    for first, second in pairs_to_check(model):
        expected = integral(first, second, model, bounded=False)
        assert similarity(first, second, model) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("noise", slow_but(NOISES, (0.001, 0.05)), ids=str)
def test_bounded_similarity_is_the_integral_over_light_from_black_to_white(
    noise: tuple[float, float],
):
    model = AffineNoise.from_8bit(*noise)

    for first, second in pairs_to_check(model):
        expected = integral(first, second, model, bounded=True)
        assert bounded_similarity(first, second, model) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("noise", slow_but([(0.03, 15), (0.3, 4), (1, 0.05)], (0.03, 15)), ids=str)
def test_panels_agree_with_mpmath(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)
    x, y = np.transpose(pairs_to_check(model))

    expected = [integral(*pair, model, bounded=True) for pair in zip(x, y, strict=True)]

    np.testing.assert_allclose(panels(x, y, model), expected, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("slope", [1e-3, 0.01, 0.06, 0.2, 0.5, 1])
@pytest.mark.parametrize("floor", [0.05, 0.25, 4, 25, 100])
def test_bounded_similarity_is_good_to_1e_6_wherever_there_are_counts(slope: float, floor: float):
    noise = AffineNoise.from_8bit(slope, floor)
    x, y = band(noise)
    z = np.hypot(noise.variance(x), noise.variance(y)) * np.sqrt(2) / noise.slope**2

    error = np.abs(bounded_similarity(x, y, noise) / panels(x, y, noise) - 1)

    assert error.max() < 1e-7  # measured 7.2e-8, just above z = 100
    assert error.max(initial=0, where=z > 500) < 1e-9  # measured 5.8e-10
    assert error.max(initial=0, where=z < 100) < 1e-12  # quadrature takes over


@pytest.mark.parametrize("noise", [(0.5, 4), (1, 0.05), (10, 0.01), (3, 0.05)], ids=str)
def test_bounded_similarity_is_good_on_the_whole_square(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(0, 1, 24)]))

    error = np.abs(bounded_similarity(x, y, model) / panels(x, y, model) - 1)

    assert error.max() < 1e-6


@pytest.mark.parametrize("function", [similarity, bounded_similarity])
def test_similarity_does_not_depend_on_the_order_of_the_frames(function):
    noise = AffineNoise.from_8bit(0.2, 1)
    x, y = band(noise)

    np.testing.assert_allclose(function(x, y, noise), function(y, x, noise), rtol=1e-14)


@pytest.mark.parametrize("slope", [0.0, 1e-12])
def test_without_slope_similarity_is_the_normal_density_of_the_difference(slope: float):
    noise = AffineNoise(slope, 4e-4)
    first, second = np.full(41, 0.5), np.linspace(0.4, 0.6, 41)

    expected = norm.pdf(first - second, scale=np.sqrt(2 * noise.floor))

    np.testing.assert_allclose(similarity(first, second, noise), expected, rtol=1e-7)
    np.testing.assert_allclose(bounded_similarity(first, second, noise), expected, rtol=1e-7)
    np.testing.assert_allclose(quadrature_similarity(first, second, noise), expected, rtol=1e-7)


def test_without_slope_the_ends_cut_a_normal_density():
    deviation = 0.02
    noise = AffineNoise(0.0, deviation**2)
    second = np.linspace(0, 0.1, 11)

    share_of_light = ndtr(second / 2 / (deviation / np.sqrt(2)))  # above black
    expected = norm.pdf(second, scale=np.sqrt(2) * deviation) * share_of_light

    np.testing.assert_allclose(bounded_similarity(0.0, second, noise), expected, rtol=1e-13)


@pytest.mark.parametrize("noise", [(0.0, 16), (0.03, 16), (1, 16), (0.06, 25)], ids=str)
def test_quadrature_with_256_nodes_is_exact_from_four_levels_of_noise(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)
    x, y = band(model, size=100)

    value = quadrature_similarity(x, y, model)

    dense = quadrature_similarity(x, y, model, nodes=400)
    np.testing.assert_allclose(value, dense, rtol=1e-11)
    if model.slope:
        np.testing.assert_allclose(value, panels(x, y, model), rtol=1e-11)


@pytest.mark.parametrize("noise", [(0.03, 15), (0.06, 9), (0.3, 4), (1, 25)], ids=str)
def test_closed_form_agrees_with_quadrature(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)
    x, y = band(model, size=50)

    value = bounded_similarity(x, y, model)

    np.testing.assert_allclose(value, quadrature_similarity(x, y, model, nodes=400), rtol=1e-6)


@pytest.mark.parametrize("function", [similarity, bounded_similarity, quadrature_similarity])
def test_similarity_broadcasts(function):
    noise = AffineNoise.from_8bit(0.5, 1)  # z on both sides of the switch to quadrature
    levels = np.linspace(0, 1, 7)

    table = function(levels[:, np.newaxis], levels, noise)

    assert table.shape == (7, 7)
    assert table[2, 3] == pytest.approx(function(levels[2], levels[3], noise).item(), rel=1e-14)


@given(
    x=st.floats(0, 1),
    y=st.floats(0, 1),
    slope=st.floats(0, 0.1),
    floor=st.floats(1e-9, 0.1),
)
def test_the_ends_of_light_lie_on_their_sides(x: float, y: float, slope: float, floor: float):
    assume(slope == 0 or slope > 1e-100)
    noise = AffineNoise(slope, floor)
    first, second = np.array([x]), np.array([y])
    rho = pair_variances(noise.variance(first), noise.variance(second)).rho

    assert black_end(first, second, rho, noise) <= 0 <= white_end(first, second, rho, noise)


@pytest.mark.parametrize("nodes", [16, 64])
@pytest.mark.parametrize("noise", [AffineNoise(0.0, 1e-3), AffineNoise(1e-3, 1e-6)], ids=str)
def test_light_nodes_are_a_quadrature_of_the_unit_interval(noise: AffineNoise, nodes: int):
    t, weights = light_nodes(noise, nodes)

    assert np.all((t > 0) & (t < 1))
    assert np.all(np.diff(t) > 0)
    moments = [weights @ t**k for k in range(5)]
    assert moments == pytest.approx([1 / (k + 1) for k in range(5)], rel=1e-12)


def self_similarity_by_quadrature(noise: AffineNoise, nodes: int) -> float:
    t, weights = light_nodes(noise, nodes)
    table = bounded_similarity(t[:, np.newaxis], t, noise)
    return float(weights @ table**2 @ weights)


@pytest.mark.parametrize(
    ("noise", "nodes", "tolerance"),
    [
        # Cameras, with z = 2v/u² from 550 to 2e6; then large slopes, z from 500 to 800.
        *((noise, 450, 1e-4) for noise in CAMERAS),
        ((0.1, 9), 240, 1e-4),
        ((0.01, 100), 200, 1e-4),
        ((0.15, 9), 240, 2.5e-4),
        ((0.3, 25), 240, 2.5e-4),
        ((0.5, 100), 240, 2.5e-4),
        ((1, 25), 240, 2e-2),
        ((1, 0.05), 240, 2e-2),
    ],
    ids=str,
)
def test_self_similarity_is_the_double_integral(
    noise: tuple[float, float], nodes: int, tolerance: float
):
    model = AffineNoise.from_8bit(*noise)

    expected = self_similarity_by_quadrature(model, nodes)

    assert self_similarity(model) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("noise", [(0.01, 9), (0.03, 15), (0.06, 25)], ids=str)
def test_without_the_ends_self_similarity_would_be_percents_too_large(noise: tuple[float, float]):
    model = AffineNoise.from_8bit(*noise)
    whole_line = quad(lambda i: 1 / model.std(i), 0, 1)[0] / (2 * np.sqrt(2 * np.pi))

    assert 0.01 < whole_line / self_similarity(model) - 1 < 0.04


def test_the_deficit_of_an_end_is_its_integral():
    expected, _ = quad(
        lambda x: 1 - ndtr(np.sqrt(2) * x) ** 2 * erf(np.sqrt(2) * x), 0, np.inf, epsabs=1e-12
    )

    assert pytest.approx(expected, rel=1e-13) == _END_DEFICIT
