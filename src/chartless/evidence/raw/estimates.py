"""Estimates from raw files besides the curve."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RawEstimate:
    """Matrix, gains and scatter, estimated from raw files."""

    matrix: tuple[float, float, float]
    """Weights of the raw file's red, green and blue in the channel, of sum 1."""
    gains: tuple[float, ...]
    """By which the camera brightened each shot, the first being 1."""
    corner_gain: float
    """By which it brightened the corners against the middle, to make up for the lens."""
    scatter: float
    """Relative deviation of the light of greys from what the curve makes of their levels."""
