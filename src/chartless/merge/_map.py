"""The radiance of a scene, its errors, and where all exposures are clipped."""

from dataclasses import dataclass

import numpy as np

from chartless.types import Bools, Floats32

_RANGE = (0.1, 99.9)  # percentiles
_SAMPLE = 1 << 21  # radiances that percentiles are taken of


@dataclass(frozen=True, slots=True, eq=False)
class RadianceMap:
    """Radiance of a scene, up to a factor that is one for each channel."""

    values: Floats32
    """Irradiance over exposure, 0 and up, all finite, shape (height, width, channels). Unit:
    saturation irradiance over the unit of the exposures."""
    std: Floats32
    """Deviation of `values` by noise, quantisation and the calibration, same shape; infinite where
    all exposures are saturated."""
    saturated: Bools
    """Pixels of which a channel is saturated in all exposures, shape (height, width). Its value is
    the largest lower bound there is, white of the shortest exposure."""
    black: Bools
    """Pixels of which a channel is at level 0 in all exposures, shape (height, width). Its value is
    half the upper bound: the middle of what level 0 of the longest exposure covers."""
    orientation: int = 1
    """EXIF orientation of the shortest exposure."""
    remarks: tuple[str, ...] = ()
    """What the user should know about the frames."""

    @property
    def dynamic_range_stops(self) -> float | None:
        """log₂ of the 99.9th over the 0.1st percentile of what is neither saturated nor black.

        None if there is nothing.
        """
        measured = self.values[~(self.saturated | self.black)]
        measured = measured[measured > 0]
        if not measured.size:
            return None
        low, high = np.percentile(measured[:: 1 + measured.size // _SAMPLE], _RANGE)
        return float(np.log2(high / low))
