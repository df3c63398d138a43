"""Variance-stabilised scale of irradiance, and the warp that keeps the noise level."""

import numpy as np

from chartless.types import Floats


def warped(irradiance: Floats, ratio: float, other: float) -> Floats:
    """Irradiance at another ratio with the same stabilised scale T = ∫ dI/σ, 0 … 1.

    Curves that differ by this warp alone have the same noise level at every brightness:
    I → ((1 + a′ (√(1 + rI) − 1)/a)² − 1)/r′ with a = √(1 + r) − 1.
    """
    scale = np.expm1(0.5 * np.log1p(other)) / np.expm1(0.5 * np.log1p(ratio))
    root = 1 + scale * np.expm1(0.5 * np.log1p(ratio * irradiance))
    return np.asarray((root**2 - 1) / other)


def on_even_scale(n_places: int, ratio: float) -> Floats:
    """Irradiance 0 … 1, evenly spaced on the stabilised scale, shape (n_places,).

    `warped` gives the same places at any other ratio.
    """
    places, root = np.linspace(0, 1, n_places), np.sqrt(1 + ratio)
    return np.asarray(places * (2 + (root - 1) * places) / (root + 1))


def log_extent(ratio: float) -> float:
    """Logarithm of T over the whole range, at v = 1."""
    return float(np.log(2 / (np.sqrt(1 + ratio) + 1)))
