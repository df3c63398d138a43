"""One response curve, whatever it is made of: f, its inverse g, nothing else."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models import MODELS, checked_brightness
from chartless.types import Floats


@dataclass(frozen=True, slots=True)
class AbstractCurve(ABC):
    """A response curve f: irradiance in [0, 1] → brightness in [0, 1], increasing."""

    @abstractmethod
    def response(self, irradiance: npt.ArrayLike) -> Floats:
        """Brightness f(I); irradiance outside [0, 1] is clipped, as a sensor does."""

    @abstractmethod
    def inverse(self, brightness: npt.ArrayLike) -> Floats:
        """Irradiance g(O); raises ParameterError for a brightness outside [0, 1]."""


@final
@dataclass(frozen=True, slots=True)
class ModelCurve(AbstractCurve):
    """A member of a family: a model with its parameters.

    Parameters
    ----------
    model : str
        Name in `MODELS`.
    parameters : tuple of float

    Examples
    --------
    >>> ModelCurve("gamma", (0.5,)).inverse(0.5)
    array(0.25)
    """

    model: str
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        self.response(0.5)  # raises if the model or the parameters are no good

    @override
    def response(self, irradiance: npt.ArrayLike) -> Floats:
        return MODELS[self.model].response(irradiance, self.parameters)

    @override
    def inverse(self, brightness: npt.ArrayLike) -> Floats:
        return MODELS[self.model].inverse(brightness, self.parameters)


@final
@dataclass(frozen=True, slots=True)
class SampledCurve(AbstractCurve):
    """A measured curve: samples joined by straight lines.

    Parameters
    ----------
    irradiance, brightness : tuple of float
        Samples from (0, 0) to (1, 1), strictly increasing in irradiance, never decreasing
        in brightness.

    Raises
    ------
    ParameterError
        If the samples are no response curve.
    """

    irradiance: tuple[float, ...]
    brightness: tuple[float, ...]

    def __post_init__(self) -> None:
        x, y = np.asarray(self.irradiance), np.asarray(self.brightness)
        if x.size < 2 or x.shape != y.shape:  # noqa: PLR2004 - a line needs two points
            msg = "a curve needs two columns, irradiance and brightness, with two rows or more"
        elif not (np.all(np.diff(x) > 0) and np.all(np.diff(y) >= 0)):
            msg = "irradiance must increase strictly and brightness must not decrease"
        elif not (x[0] == 0 and x[-1] == 1 and y[0] == 0 and y[-1] == 1):
            msg = (
                f"a response curve runs from (0, 0) to (1, 1), this one from "
                f"({x[0]:g}, {y[0]:g}) to ({x[-1]:g}, {y[-1]:g}): scale it or add its ends"
            )
        else:
            return
        raise ParameterError(msg)

    @classmethod
    def from_inverse(cls, inverse_lut: npt.ArrayLike) -> "SampledCurve":
        """Curve of a look-up table of irradiance at uniform brightness, shape (L,).

        Where several levels share an irradiance the highest is kept; the ends are made
        (0, 0) and (1, 1).
        """
        lut = np.asarray(inverse_lut, dtype=np.float64)
        if np.any(np.diff(lut) < 0) or lut[0] < 0 or lut[-1] > 1:
            msg = "an inverse response must not decrease and lie in [0, 1]"
            raise ParameterError(msg)
        brightness = np.linspace(0.0, 1.0, lut.size)
        last = np.append(np.diff(lut) != 0, True)
        x, y = lut[last], brightness[last]
        inside = (x > 0) & (x < 1)
        return cls(
            (0.0, *x[inside].tolist(), 1.0),
            (0.0, *y[inside].tolist(), 1.0),
        )

    @override
    def response(self, irradiance: npt.ArrayLike) -> Floats:
        return np.asarray(np.interp(np.asarray(irradiance), self.irradiance, self.brightness))

    @override
    def inverse(self, brightness: npt.ArrayLike) -> Floats:
        # np.interp wants increasing abscissae; the first point of a flat stretch is kept.
        wanted = checked_brightness(brightness)
        x, y = np.asarray(self.irradiance), np.asarray(self.brightness)
        first = np.searchsorted(y, wanted)  # of a flat stretch the first point
        return np.asarray(np.where(y[first] == wanted, x[first], np.interp(wanted, y, x)))


@final
@dataclass(frozen=True, slots=True)
class SrgbCurve(AbstractCurve):
    """The transfer function of sRGB (IEC 61966-2-1): linear near black, then a power law."""

    @override
    def response(self, irradiance: npt.ArrayLike) -> Floats:
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        power = np.minimum(1.055 * x ** (1 / 2.4) - 0.055, 1.0)
        return np.where(x <= 0.0031308, 12.92 * x, np.where(x == 1, 1.0, power))  # noqa: PLR2004

    @override
    def inverse(self, brightness: npt.ArrayLike) -> Floats:
        y = checked_brightness(brightness)
        return np.where(y <= 0.04045, y / 12.92, ((y + 0.055) / 1.055) ** 2.4)  # noqa: PLR2004
