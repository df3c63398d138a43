"""Estimates from level pairs besides the curve."""

from dataclasses import dataclass

import numpy as np

from chartless.types import Floats


@dataclass(frozen=True, slots=True)
class NoiseError:
    """How sure the noise parameters are."""

    log_slope: float
    """Deviation of ln u, so about the relative error of u."""
    log_floor: float
    """Deviation of ln v."""
    correlation: float
    """Correlation of ln u and ln v."""

    @classmethod
    def from_covariance(cls, covariance: Floats) -> "NoiseError":
        """Errors of a covariance of (ln u, ln v), shape (2, 2)."""
        slope, floor = np.sqrt(np.diag(covariance))
        return cls(float(slope), float(floor), float(covariance[0, 1] / (slope * floor)))
