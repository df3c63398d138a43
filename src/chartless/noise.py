"""Noise of a sensor in units of irradiance: σ²(I) = uI + v."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from chartless.errors import ParameterError
from chartless.types import Floats

_EIGHT_BIT = 255.0

TYPICAL_8BIT = (0.03, 15.0)
"""U and V about which Takamatsu and Matsushita (2008) draw their cameras."""
TYPICAL_SPREAD = 0.7
"""Standard deviation of ln U and of ln V: a factor of two either way."""


@dataclass(frozen=True, slots=True)
class AffineNoise:
    r"""Signal-dependent Gaussian noise, :math:`\sigma^2(I) = u I + v` [1]_.

    Parameters
    ----------
    slope : float
        u ≥ 0, variance per irradiance, due to photons. Unit: irradiance.
    floor : float
        v > 0, variance at black, due to the electronics. Unit: irradiance².

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

    @classmethod
    def of_sensor(cls, electrons: float, read: float) -> "AffineNoise":
        """Noise from the capacity and the read noise that data sheets give.

        Parameters
        ----------
        electrons : float
            Electrons at white: the saturation capacity at unit gain, fewer at higher
            gain.
        read : float
            Standard deviation in the dark, in electrons.

        Raises
        ------
        ParameterError
            If either is not above 0.
        """
        if not (0 < electrons < np.inf and 0 < read < np.inf):
            msg = f"a sensor has electrons and a read noise above 0, not {electrons} and {read}"
            raise ParameterError(msg)
        return cls(1 / electrons, (read / electrons) ** 2)

    @property
    def ratio(self) -> float:
        """Ratio r = u/v: the variance at white is 1 + r times that at black."""
        return self.slope / self.floor

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


@dataclass(frozen=True, slots=True)
class NoiseError:
    """Uncertainty of the noise parameters."""

    log_slope: float
    """Standard deviation of ln u, about the relative error of u."""
    log_floor: float
    """Standard deviation of ln v."""
    correlation: float
    """Correlation of ln u and ln v."""

    @classmethod
    def from_covariance(cls, covariance: Floats) -> "NoiseError":
        """Errors from the covariance of (ln u, ln v), shape (2, 2)."""
        slope, floor = np.sqrt(np.diag(covariance))
        return cls(float(slope), float(floor), float(covariance[0, 1] / (slope * floor)))


@dataclass(frozen=True, slots=True)
class NoisePrior:
    """Prior of the noise before any picture is seen: (ln u, ln v) is normal.

    Parameters
    ----------
    centre : AffineNoise
        Median of u and of v.
    spread : (float, float)
        Standard deviations of ln u and ln v, above 0.
    correlation : float
        Correlation of ln u and ln v, between -1 and 1.

    Raises
    ------
    ParameterError
        If a value is out of range.
    """

    centre: AffineNoise
    spread: tuple[float, float]
    correlation: float = 0.0

    def __post_init__(self) -> None:
        if not (
            all(0 < each < np.inf for each in self.spread)
            and abs(self.correlation) < 1
            and self.centre.slope > 0
        ):
            msg = (
                "a noise prior needs a centre with a slope above 0, spreads above 0 and a "
                f"correlation between -1 and 1, not {self}"
            )
            raise ParameterError(msg)

    @classmethod
    def of_ratio(
        cls, slope: float, slope_spread: float, ratio: float, ratio_spread: float
    ) -> "NoisePrior":
        """Prior with independent u and r = u/v, from medians and spreads.

        Spreads are standard deviations of ln u and ln r.

        Raises
        ------
        ParameterError
            If a number is not above 0.
        """
        numbers = slope, slope_spread, ratio, ratio_spread
        if not all(0 < each < np.inf for each in numbers):
            msg = f"medians and spreads of a noise prior lie above 0, not {numbers}"
            raise ParameterError(msg)
        spread = float(np.hypot(slope_spread, ratio_spread))
        centre = AffineNoise(slope, slope / ratio)
        return cls(centre, (slope_spread, spread), slope_spread / spread)

    @classmethod
    def of_sensor(cls, electrons: float, read: float, *, factor: float = 2.0) -> "NoisePrior":
        """Prior centred on the noise of a known sensor.

        Parameters
        ----------
        electrons, read
            As for `AffineNoise.of_sensor`.
        factor : float
            Factor by which u and u/v may be larger or smaller (one standard deviation),
            above 1: gain and tone curve change both.
        """
        if not 1 < factor < np.inf:
            msg = f"the factor of a noise prior lies above 1, not {factor!r}"
            raise ParameterError(msg)
        centre, spread = AffineNoise.of_sensor(electrons, read), float(np.log(factor))
        return cls.of_ratio(centre.slope, spread, centre.ratio, spread)

    @property
    def mean(self) -> Floats:
        """Mean of (ln u, ln v)."""
        return np.log([self.centre.slope, self.centre.floor])

    @property
    def covariance(self) -> Floats:
        """Covariance of (ln u, ln v), shape (2, 2)."""
        both = self.correlation * self.spread[0] * self.spread[1]
        return np.array([[self.spread[0] ** 2, both], [both, self.spread[1] ** 2]])

    @property
    def precision(self) -> Floats:
        """Inverse of the covariance, shape (2, 2)."""
        return np.asarray(np.linalg.inv(self.covariance))

    @property
    def ratio_spread(self) -> float:
        """Standard deviation of ln r."""
        difference = np.array([1.0, -1.0])
        return float(np.sqrt(difference @ self.covariance @ difference))


CAMERAS_OF_2008 = NoisePrior(AffineNoise.from_8bit(*TYPICAL_8BIT), (TYPICAL_SPREAD, TYPICAL_SPREAD))
"""Prior of the noise experiment: noise hardly grows with light (r = 0.5)."""
SENSORS = NoisePrior.of_ratio(slope=1e-4, slope_spread=2.0, ratio=50.0, ratio_spread=2.0)
"""Prior of real sensors: photon noise dominates where there is light."""
