r"""Likelihood that two noisy irradiances come from the same light, in closed form.

With noise of variance σ²(t) = ut + v around a true irradiance t, all values of t equally
likely, the similarity of two measured irradiances is

.. math:: S(I_1, I_2) = \int N(I_1; t, ut + v) \, N(I_2; t, ut + v) \, dt

(Takamatsu & Matsushita, CVPR 2008, who integrate numerically). Substituting y = ut + v and
completing the square leaves an incomplete Bessel integral. Written with the variances at
the two points, :math:`B_i = u I_i + v`, and :math:`\rho = \sqrt{(B_1^2 + B_2^2)/2}`,

.. math:: S = \frac{1}{2\pi u} \exp\left(-\frac{(I_1 - I_2)^2}{2\rho + B_1 + B_2}\right)
              \int e^{-2 z \sinh^2(\theta/2)} \, d\theta ,
          \qquad \theta = \ln(y/\rho), \; z = 2\rho/u^2 .

Over all light with a positive variance the integral is 2 e^z K₀(z); over t ∈ [0, 1] it
runs from ln(v/ρ) to ln((u + v)/ρ). z is 10³ … 10⁵ for cameras, so an asymptotic series
in 1/z with elementary functions is exact to double precision. Large numbers are never
subtracted, and at u = 0 the formulas reduce to N(I₁ − I₂; 0, 2v).

Three functions compute this quantity: `similarity` (all light), `bounded_similarity`
(t ∈ [0, 1], used by the objectives) and `quadrature_similarity`, the direct integral
used to check the other two.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial.legendre import leggauss
from scipy.special import k0e, ndtr

from chartless.errors import ParameterError
from chartless.noise import AffineNoise
from chartless.types import Floats

# Asymptotic series of √(2z/π) e^z K₀(z) in 1/z: DLMF 10.40.2 with ν = 0.
_BESSEL_SERIES = (1.0, -1 / 8, 9 / 128, -75 / 1024, 3675 / 32768)
# From this z on, five terms leave less than the last bit.
_SERIES_Z = 2e3
# From this z on, three terms of the bounded series are good to 1e-7 (the fourth is
# 75/1024 z^-3 times a moment below 1); measured in tests/methods/test_similarity.py.
_BOUNDED_SERIES_Z = 100.0
# The incomplete integral ends where its integrand is below exp(-W²/2) = 4e-18.
_WINDOW = 9.0
_BESSEL_NODES = 48
# ∫₀^∞ 1 − Φ(√2 x)² erf(√2 x) dx: loss of the integral of S² at each end of [0, 1], in
# units of the noise deviation there. Quadrature to 15 digits in
# tests/methods/test_similarity.py.
_END_DEFICIT = 0.660130006162497


class Variances(NamedTuple):
    """Quantities common to all forms of the similarity, of the broadcast shape."""

    rho: Floats
    """ρ = √((B₁² + B₂²)/2), the effective variance."""
    spread: Floats
    """2ρ + B₁ + B₂; S falls off as exp(−(I₁ − I₂)²/spread)."""


def pair_variances(variance_1: Floats, variance_2: Floats) -> Variances:
    """`Variances` of two irradiances whose noise has these variances."""
    rho = variance_1 * variance_1
    rho += variance_2 * variance_2
    rho *= 0.5
    np.sqrt(rho, out=rho)
    spread = 2.0 * rho
    spread += variance_1
    spread += variance_2
    return Variances(rho, spread)


def similarity(first: npt.ArrayLike, second: npt.ArrayLike, noise: AffineNoise) -> Floats:
    """Similarity S(I₁, I₂) over all light whose noise variance is positive.

    Parameters
    ----------
    first, second : array_like of float
        Irradiances I₁ and I₂ above −v/u, where the noise has a variance; broadcast against
        each other.
    noise : AffineNoise

    Returns
    -------
    ndarray of float64
        S in units of 1/irradiance; relative error below 1e-12.
    """
    x, y, shape = _flat(first, second)
    rho, spread = pair_variances(noise.variance(x), noise.variance(y))
    inverse_z = noise.slope**2 / (2.0 * rho)
    series = np.polynomial.polynomial.polyval(inverse_z, _BESSEL_SERIES)
    small = inverse_z * _SERIES_Z > 1
    if small.any():
        z = 1.0 / np.where(small, inverse_z, 1.0)
        series = np.where(small, np.sqrt(2.0 * z / np.pi) * k0e(z), series)
    value = series * np.exp(-((x - y) ** 2) / spread) / np.sqrt(4.0 * np.pi * rho)
    return value.reshape(shape)


def bounded_similarity(first: npt.ArrayLike, second: npt.ArrayLike, noise: AffineNoise) -> Floats:
    """Similarity S(I₁, I₂) when the true irradiance lies in [0, 1].

    Parameters
    ----------
    first, second : array_like of float, 0 … 1
        Irradiances I₁ and I₂, broadcast against each other.
    noise : AffineNoise

    Returns
    -------
    ndarray of float64
        S in units of 1/irradiance; relative error below 1e-6 on the whole square, and
        below 1e-9 where z = 2ρ/u² > 500.
    """
    x, y, shape = _flat(first, second)
    rho, spread = pair_variances(noise.variance(x), noise.variance(y))
    inverse_z = noise.slope**2 / (2.0 * rho)
    mass = _whole_mass(inverse_z)
    # Further than this from an end, the end has no effect: black_end(x, x) = −x √(2/v).
    near_black = np.minimum(x, y) < _WINDOW * np.sqrt(noise.floor / 2)
    near_white = np.maximum(x, y) > 1 - _WINDOW * np.sqrt((noise.slope + noise.floor) / 2)
    for near, end, sign in ((near_black, black_end, 1.0), (near_white, white_end, -1.0)):
        w = end(x[near], y[near], rho[near], noise)
        mass[near] -= _mass_below(sign * w, inverse_z[near])
    short = inverse_z * _BOUNDED_SERIES_Z > 1
    if short.any():
        x_short, y_short, rho_short = x[short], y[short], rho[short]
        mass[short] = _incomplete_bessel(
            black_end(x_short, y_short, rho_short, noise),
            white_end(x_short, y_short, rho_short, noise),
            inverse_z[short],
        )
    value = mass * np.exp(-((x - y) ** 2) / spread) / np.sqrt(4.0 * np.pi * rho)
    return value.reshape(shape)


def black_end(x: Floats, y: Floats, rho: Floats, noise: AffineNoise) -> Floats:
    """Value at t = 0 of the variable w = 2√z sinh(θ/2), in which S has unit width.

    The integrand over w is exp(−w²/2) (1 + w²/4z)^(−1/2), so to leading order the share of
    S that comes from t > 0 is Φ(−black_end). At most 0 for x and y in [0, 1].
    """
    u, v = noise.slope, noise.floor
    # v² − ρ² with the squares factored, without cancellation.
    end: Floats = -(x * (u * x + 2 * v) + y * (u * y + 2 * v)) / (np.sqrt(2 * v) * (v + rho))
    return end


def white_end(x: Floats, y: Floats, rho: Floats, noise: AffineNoise) -> Floats:
    """Value of w at t = 1, see `black_end`; at least 0 for x and y in [0, 1]."""
    u, white = noise.slope, noise.slope + noise.floor
    x, y = 1 - x, 1 - y
    to_white = x * (2 * white - u * x) + y * (2 * white - u * y)
    end: Floats = to_white / (np.sqrt(2 * white) * (white + rho))
    return end


def _mass_below(w: Floats, inverse_z: Floats) -> Floats:
    """Integral of φ(w) (1 + w²/4z)^(−1/2) up to w, to second order in 1/z.

    m₀ − m₂/8z + 3 m₄/128z² with m_k the moments of the normal density φ cut at w.
    """
    density = w * np.exp(-0.5 * w * w) / np.sqrt(2 * np.pi)
    m0 = ndtr(w)
    m2 = m0 - density
    m4 = 3 * m2 - w * w * density
    mass: Floats = m0 - inverse_z * (m2 / 8 - inverse_z * (3 * m4 / 128))
    return mass


def _whole_mass(inverse_z: Floats) -> Floats:
    """Value of `_mass_below` at w = ∞."""
    return 1 - inverse_z * (1 / 8 - inverse_z * (9 / 128))


def _incomplete_bessel(low: Floats, high: Floats, inverse_z: Floats) -> Floats:
    """Integral of φ(w) (1 + w²/4z)^(−1/2) from low to high, for any z, by quadrature over θ."""
    nodes, weights = _legendre(_BESSEL_NODES)
    scale = 0.5 * np.sqrt(inverse_z)  # w/(2√z) = sinh(θ/2)
    start = 2 * np.arcsinh(scale * np.maximum(low, -_WINDOW))
    stop = 2 * np.arcsinh(scale * np.minimum(high, _WINDOW))
    half = 0.5 * (stop - start)
    theta = (start + half)[..., np.newaxis] + half[..., np.newaxis] * nodes
    integrand = np.exp(-2 * np.sinh(0.5 * theta) ** 2 / inverse_z[..., np.newaxis])
    mass: Floats = half * (integrand @ weights) / np.sqrt(2 * np.pi * inverse_z)
    return mass


def quadrature_similarity(
    first: npt.ArrayLike, second: npt.ArrayLike, noise: AffineNoise, *, nodes: int = 256
) -> Floats:
    """Similarity S(I₁, I₂) over t ∈ [0, 1] by direct quadrature: the reference.

    Gauss–Legendre in √(ut + v), where the width of the integrand is constant. It takes
    `nodes` exponentials per pair of irradiances, like any implementation of the paper.

    Parameters
    ----------
    first, second : array_like of float, 0 … 1
        Irradiances I₁ and I₂, broadcast against each other.
    noise : AffineNoise
    nodes : int
        Quadrature nodes. 256 are exact to 1e-11 down to a noise of 4 levels in 256; less
        noise needs more nodes in proportion.

    Returns
    -------
    ndarray of float64
    """
    x, y, shape = _flat(first, second)
    total = np.zeros_like(x)
    for t, weight in zip(*light_nodes(noise, nodes), strict=True):
        variance = noise.slope * t + noise.floor
        total += (
            weight
            * np.exp(-0.5 * ((x - t) ** 2 + (y - t) ** 2) / variance)
            / (2 * np.pi * variance)
        )
    return total.reshape(shape)


@cache
def _legendre(nodes: int) -> tuple[Floats, Floats]:
    points, weights = leggauss(nodes)  # an eigenvalue problem: slower than all the rest
    return points, weights


def light_nodes(noise: AffineNoise, nodes: int) -> tuple[Floats, Floats]:
    """Nodes t ∈ [0, 1] and weights of a quadrature over light, each of shape (nodes,).

    Gauss–Legendre in √(ut + v), so that the nodes are equally dense in noise deviations.
    """
    root_0, root_1 = np.sqrt(noise.floor), np.sqrt(noise.slope + noise.floor)
    points, weights = _legendre(nodes)
    share = 0.5 * (points + 1)
    # t = (root² − v)/u with root = root_0 + share (root_1 − root_0), without dividing by u.
    span = root_0 + root_1
    t = share * (2 * root_0 + share * (root_1 - root_0)) / span
    slope = 2 * (root_0 + share * (root_1 - root_0)) / span
    return t, 0.5 * weights * slope


def self_similarity(noise: AffineNoise) -> float:
    r"""Z² = ∬ S² dI₁ dI₂ over the unit square, S with light in [0, 1]; unit 1.

    .. math:: Z^2 \approx \frac{1}{2\sqrt{2\pi}}
              \left( \frac{2}{u}(\sqrt{u + v} - \sqrt{v}) - 2 c \right)

    The first term takes S for a Gaussian of the local noise; c = 0.6601 corrects for the
    two ends. Without c the result is 1 … 3 % too large at the noise of cameras; with it the
    relative error is below 2.5e-4 for z = 2v/u² > 500 and noise below a tenth of the range,
    and 2 % at the extreme U = 1, V = 0.05.

    Raises
    ------
    ParameterError
        If the noise is as large as the range of light, where the formula is invalid.
    """
    u, v = noise.slope, noise.floor
    deviations = 2.0 / (np.sqrt(u + v) + np.sqrt(v))  # ∫ dI/σ(I)
    if deviations <= 2 * _END_DEFICIT:
        msg = f"noise of U = {noise.slope_8bit:g}, V = {noise.floor_8bit:g} hides all light"
        raise ParameterError(msg)
    return float((deviations - 2 * _END_DEFICIT) / (2 * np.sqrt(2 * np.pi)))


def _flat(first: npt.ArrayLike, second: npt.ArrayLike) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Both arrays, broadcast and flattened, and the shape of the result."""
    x, y = np.broadcast_arrays(np.asarray(first, np.float64), np.asarray(second, np.float64))
    return x.ravel(), y.ravel(), x.shape
