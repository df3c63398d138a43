"""What every family of response curves promises, and the registry of families."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from chartless._registry import Registry
from chartless.errors import ParameterError
from chartless.types import Floats


def checked_brightness(brightness: npt.ArrayLike) -> Floats:
    """Brightness as float64; raises ParameterError unless all of it lies in [0, 1]."""
    values = np.asarray(brightness, dtype=np.float64)
    if not np.all((values >= 0) & (values <= 1)):
        msg = "brightness must lie in [0, 1]"
        raise ParameterError(msg)
    return values


@dataclass(frozen=True, slots=True)
class AbstractModel(ABC):
    """A family of response curves f: irradiance in [0, 1] → brightness in [0, 1].

    A model is the family, not one curve of it: parameters are an argument of every
    method. To pair a model with parameters use `chartless.curves.ModelCurve`.

    Public methods check their arguments and broadcast; a family writes the hooks
    `_response`, `_inverse`, `_derivative` and `_gradient` for flat arrays strictly
    inside (0, 1) or at its ends.
    """

    family: ClassVar[str]
    """Name without the order, such as ``"eegc"``."""
    formula: ClassVar[str]
    """f(I) in plain characters, for tables."""
    order: int
    """An order-N family has N + 1 free parameters."""

    @property
    def name(self) -> str:
        """What a user types: the family with its order, such as ``"eegc2"``."""
        return f"{self.family}{self.order}"

    @property
    def n_parameters(self) -> int:
        """Number of free parameters."""
        return len(self.parameter_names)

    @property
    @abstractmethod
    def always_monotone(self) -> bool:
        """True when no parameters whatever make the curve decrease."""

    @property
    @abstractmethod
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""

    @property
    @abstractmethod
    def identity(self) -> Floats:
        """Parameters of the linear camera, f(I) = I; where searches start. Shape (P,)."""

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Least and greatest value of each parameter, each of shape (P,); both excluded."""
        unlimited = np.full(self.n_parameters, np.inf)
        return -unlimited, unlimited

    def admits(self, parameters: Floats) -> bool:
        """Whether these parameters, of shape (P,), are finite and within `bounds`."""
        least, greatest = self.bounds
        return bool(np.all((parameters > least) & (parameters < greatest)))

    def response(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Brightness f(I).

        Parameters
        ----------
        irradiance : array_like of float, shape (...)
            0 black … 1 saturation. Values outside are clipped, as a sensor does.
        parameters : array_like of float, shape (P,)

        Returns
        -------
        ndarray of float64, shape (...), 0 … 1

        Raises
        ------
        ParameterError
            If the number of parameters is wrong, or one is not finite or out of bounds.
        """
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        return self._response(x.ravel(), self._checked(parameters)).reshape(x.shape)

    def inverse(self, brightness: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Irradiance g(O) with f(g(O)) = O to 1e-12 in brightness.

        Where the slope of f exceeds 10⁴, the spacing of float64 near I = 1 limits that.

        Parameters
        ----------
        brightness : array_like of float, shape (...), 0 … 1
        parameters : array_like of float, shape (P,)

        Returns
        -------
        ndarray of float64, shape (...), 0 … 1
            Exactly 0 at 0 and 1 at 1. Where the curve of a family that is not always
            monotone takes a brightness more than once, one of the places. Where g(O)
            is smaller than the smallest float64, 0.

        Raises
        ------
        ParameterError
            As for `response`, and if a brightness lies outside [0, 1].
        """
        y = checked_brightness(brightness)
        return self._inverse(y.ravel(), self._checked(parameters)).reshape(y.shape)

    def derivative(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Slope f'(I); may be 0 or infinite at I = 0. Arguments as for `response`."""
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        return self._derivative(x.ravel(), self._checked(parameters)).reshape(x.shape)

    def gradient(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Derivatives of f(I) in the parameters, shape (..., P). Arguments as for `response`."""
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        flat = self._gradient(x.ravel(), self._checked(parameters))
        return flat.reshape(*x.shape, self.n_parameters)

    def _checked(self, parameters: npt.ArrayLike) -> Floats:
        values = np.asarray(parameters, dtype=np.float64)
        if values.shape != (self.n_parameters,) or not self.admits(values):
            ranges = (
                name if np.isinf(least) else f"{name} > {least:g}"
                for name, least in zip(self.parameter_names, self.bounds[0], strict=True)
            )
            given = ", ".join(f"{value:g}" for value in values.ravel()) or "none"
            plural = "s" if self.n_parameters > 1 else ""
            msg = (
                f"{self.name} takes {self.n_parameters} finite parameter{plural} "
                f"({', '.join(ranges)}), not {given}"
            )
            raise ParameterError(msg)
        return values

    @abstractmethod
    def _response(self, x: Floats, parameters: Floats) -> Floats: ...

    @abstractmethod
    def _inverse(self, y: Floats, parameters: Floats) -> Floats: ...

    @abstractmethod
    def _derivative(self, x: Floats, parameters: Floats) -> Floats: ...

    @abstractmethod
    def _gradient(self, x: Floats, parameters: Floats) -> Floats: ...


MODELS: Registry[AbstractModel] = Registry("model")
"""Every family at every order a user may name."""


def register_model(*models: AbstractModel) -> None:
    """Make models known to the command line and to calibration files."""
    for model in models:
        MODELS.register(model.name, model)
