"""Estimates from a bracket besides the curve."""

from dataclasses import dataclass, replace

import numpy as np

from chartless.curves import AbstractCurve
from chartless.types import Floats

_DARKEST = 1e-12  # of irradiance, for its logarithm


@dataclass(frozen=True, slots=True)
class SeenTransfer:
    """Which level of an exposure follows which of a longer one, for plots."""

    ratio: float
    """Of the exposures, as estimated."""
    upper: tuple[float, ...]
    """Levels of the longer exposure."""
    lower: tuple[float, ...]
    """Median level of the same pixels in the shorter one."""

    def apart(self, curve: AbstractCurve, n_levels: int) -> Floats:
        """Ln of the light of both by the curve, less that of the ratio; shape of `upper`."""
        longer, shorter = (
            np.log(np.maximum(curve.inverse(np.array(levels) / (n_levels - 1)), _DARKEST))
            for levels in (self.upper, self.lower)
        )
        return np.asarray(longer - shorter - np.log(self.ratio))


@dataclass(frozen=True, slots=True)
class ExposureEstimate:
    """Exposures and scatter, estimated from a bracket."""

    relative: tuple[float, ...]
    """Exposures in the order of the inputs, the least being 1."""
    exponent_error: float
    """Deviation of ln γ if the curve is known up to f^γ; 0 if the exposures are exact. A curve and
    its powers explain a bracket alike, with exposures that are powers of each other."""
    scatter: float
    """Relative deviation of irradiance between exposures that noise does not explain."""
    transfers: tuple[SeenTransfer, ...] = ()

    def scaled(self, factor: float) -> "ExposureEstimate":
        """Return the same for levels so many times as high."""
        transfers = tuple(
            SeenTransfer(
                each.ratio,
                tuple(factor * level for level in each.upper),
                tuple(factor * level for level in each.lower),
            )
            for each in self.transfers
        )
        return replace(self, transfers=transfers)
