"""Noise of a sensor in units of irradiance: σ²(I) = uI + v."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from chartless.errors import ParameterError
from chartless.types import Floats

_EIGHT_BIT = 255.0

TYPICAL_8BIT = (0.03, 15.0)
"""U and V that a camera is expected to have before anything is seen: the centre of a prior."""
TYPICAL_SPREAD = 0.7
"""Deviation of ln U and of ln V about it: a factor of two either way."""
TYPICAL_RATIO = 0.5
"""u/v of these."""


@dataclass(frozen=True, slots=True)
class AffineNoise:
    r"""Signal-dependent Gaussian noise, :math:`\sigma^2(I) = u I + v` [1]_.

    Parameters
    ----------
    slope : float
        u ≥ 0, variance per irradiance: the photons' share. Unit: irradiance.
    floor : float
        v > 0, variance at black: the electronics' share. Unit: irradiance².

    Raises
    ------
    ParameterError
        If a value is out of range.

    Notes
    -----
    Papers quote both for 8 bits: U = 255 u and V = 255² v. See `from_8bit` and the
    properties `slope_8bit` and `floor_8bit`.

    References
    ----------
    .. [1] Foi et al. (2008), "Practical Poissonian-Gaussian noise modeling and fitting for
       single-image raw-data", IEEE TIP 17(10), doi:10.1109/TIP.2008.2001399.

    Examples
    --------
    >>> AffineNoise(slope=1e-4, floor=1e-5).variance([0.0, 0.5])
    array([1.e-05, 6.e-05])
    """

    slope: float
    floor: float

    def __post_init__(self) -> None:
        if not (0 <= self.slope_8bit < np.inf and 0 < self.floor_8bit < np.inf):
            msg = (
                f"noise needs a slope >= 0 and a floor > 0, not U = {self.slope_8bit:g}, "
                f"V = {self.floor_8bit:g}"
            )
            raise ParameterError(msg)

    @classmethod
    def from_8bit(cls, slope: float, floor: float) -> "AffineNoise":
        """Noise from U and V as papers quote them: σ² = U · level + V in 8-bit levels²."""
        return cls(slope / _EIGHT_BIT, floor / _EIGHT_BIT**2)

    @property
    def slope_8bit(self) -> float:
        """U = 255 u."""
        return self.slope * _EIGHT_BIT

    @property
    def floor_8bit(self) -> float:
        """V = 255² v."""
        return self.floor * _EIGHT_BIT**2

    def variance(self, irradiance: npt.ArrayLike) -> Floats:
        """Variance uI + v, shape of `irradiance` (0 black … 1 saturation)."""
        return self.slope * np.asarray(irradiance, dtype=np.float64) + self.floor

    def std(self, irradiance: npt.ArrayLike) -> Floats:
        """Standard deviation √(uI + v), shape of `irradiance`."""
        return np.sqrt(self.variance(irradiance))
