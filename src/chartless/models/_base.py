"""What every family of response curves promises, and the registry of families."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from enum import Enum
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from chartless._numeric.invert import invert_on_grid
from chartless._registry import Registry
from chartless.errors import ParameterError
from chartless.types import Bools, Floats

_GRID = np.linspace(0.0, 1.0, 1025)
UNIFORM_IRRADIANCE = np.linspace(0.0, 1.0, 1024)
"""Where curves are judged and compared, as finely as DoRF samples them."""
_LEAST_FALL = 1e-9
_TOLERANCE = 5e-13  # in brightness: half of what `AbstractModel.inverse` promises


class Property(Enum):
    """What makes a family a good model of responses; the value is a sentence about it.

    The first three make every member a valid response, the others are of the family.
    Grossberg and Nayar, *Modeling the space of camera response functions* (2004), section 2,
    and the paper on EEGC, which adds bounded and analytical.
    """

    ENDS = "f(0) = 0 and f(1) = 1, whatever the parameters"
    MONOTONE = "never decreases, whatever the parameters; nor does g where that is described"
    BOUNDED = "stays in [0, 1], whatever the parameters"
    SMOOTH = "f' is continuous on (0, 1)"
    EXTENSIBLE = "each order contains the orders below it"
    ANALYTICAL = "a formula with parameters free within limits: no measured curves, no constraints"
    COMPACT = "three parameters reach 0.005 RMSE on the median of 201 measured cameras"


def checked_brightness(brightness: npt.ArrayLike) -> Floats:
    """Brightness as float64; raises ParameterError unless all of it lies in [0, 1]."""
    values = np.asarray(brightness, dtype=np.float64)
    if not np.all((values >= 0) & (values <= 1)):
        msg = "brightness must lie in [0, 1]"
        raise ParameterError(msg)
    return values


def _range(name: str, least: float, greatest: float) -> str:
    """Name of a parameter and the limits that it has."""
    if np.isinf(greatest):
        return name if np.isinf(least) else f"{name} > {least:g}"
    return f"{least:g} < {name} < {greatest:g}"


@dataclass(frozen=True, slots=True)
class AbstractModel(ABC):
    """A family of response curves f: irradiance in [0, 1] → brightness.

    A model is the family, not one curve of it: parameters are an argument of every
    method. To pair a model with parameters use `chartless.curves.ModelCurve`.

    Public methods check their arguments and broadcast; a family writes the hooks
    `_response`, `_derivative` and `_gradient` for flat arrays inside (0, 1) or at its ends.
    `_response` and `_gradient` take many sets of parameters at once, of shape (..., P).
    """

    family: ClassVar[str]
    """Name without the order, such as ``"eegc"``."""
    formula: ClassVar[str]
    """f(I) in plain characters, for tables."""
    constrained: ClassVar[bool] = False
    """Whether `inequalities` limit the parameters beyond `bounds`."""
    condition: ClassVar[str] = ""
    """What `admits` asks beyond `bounds`, to follow the names of the parameters in a sentence."""
    order: int
    """An order-N family has N + 1 free parameters."""

    def __post_init__(self) -> None:
        if self.order < 0:
            msg = f"{self.family} has the orders 0, 1, 2 …, not {self.order}"
            raise ParameterError(msg)

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
    def properties(self) -> frozenset[Property]:
        """Which of the seven properties of a good model hold; tests prove each claim."""

    @property
    def always_monotone(self) -> bool:
        """True when no parameters whatever make the curve decrease."""
        return Property.MONOTONE in self.properties

    @property
    @abstractmethod
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in their order."""

    @property
    @abstractmethod
    def identity(self) -> Floats:
        """Parameters of the linear camera, f(I) = I, or of the member nearest to it.

        Where searches start. Shape (P,).
        """

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Least and greatest value of each parameter, each of shape (P,); both excluded."""
        unlimited = np.full(self.n_parameters, np.inf)
        return -unlimited, unlimited

    @property
    def penalty(self) -> Floats | None:
        """Matrix M, shape (R, P): fits minimise Σ (f(I) − O)² + |M p|²; None without."""
        return None

    @property
    def lower(self) -> Self | None:
        """The same family at the order below, if it is extensible; `promoted` leads back up."""
        extends = self.order > 0 and Property.EXTENSIBLE in self.properties
        return replace(self, order=self.order - 1) if extends else None

    def promoted(self, parameters: Floats) -> Floats:
        """Parameters of this order, (..., P), for the curves of `lower`, (..., P − 1)."""
        zero = np.zeros((*parameters.shape[:-1], 1))
        return np.concatenate([parameters, zero], axis=-1)

    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:  # noqa: ARG002 - a hook
        """Parameters from which a fit to samples should start.

        Parameters
        ----------
        irradiance : ndarray, shape (N,)
        brightness : ndarray, shape (B, N)
            B curves.

        Returns
        -------
        ndarray, shape (B, K, P)
            K starts for each curve.
        """
        return np.tile(self.identity, (len(brightness), 1, 1))

    def inequalities(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Side constraints C p ≤ d of the family.

        Parameters
        ----------
        parameters : ndarray, shape (P,)
            Where the solver is: a family constrained at every irradiance may answer with
            the places that matter there.

        Returns
        -------
        (ndarray, ndarray) of shapes (M, P) and (M,)
            M is 0 unless the family is `constrained`.
        """
        return np.empty((0, parameters.size)), np.empty(0)

    def repaired(self, parameters: Floats) -> Floats:
        """Parameters nearby that `admits` takes, (..., P), where a solver's rounding went over."""
        return parameters

    def admits(self, parameters: Floats) -> Bools:
        """Whether parameters, of shape (..., P), are finite and within `bounds`: shape (...)."""
        least, greatest = self.bounds
        return np.asarray(np.all((parameters > least) & (parameters < greatest), axis=-1))

    def response(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Brightness f(I).

        Parameters
        ----------
        irradiance : array_like of float, shape (...)
            0 black … 1 saturation. Values outside are clipped, as a sensor does.
        parameters : array_like of float, shape (P,) or (..., P)
            Parameters of one curve, or of several.

        Returns
        -------
        ndarray of float64, shape of the curves + shape of the irradiance
            0 … 1 if the family is bounded (see `properties`).

        Raises
        ------
        ParameterError
            If the number of parameters is wrong, or one is not finite or out of bounds.
        """
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        values = self._checked(parameters)
        return self._response(x.ravel(), values).reshape((*values.shape[:-1], *x.shape))

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
            is smaller than the smallest float64, 0. A brightness that the curve does not
            reach gives the nearer end.

        Raises
        ------
        ParameterError
            As for `response`, and if a brightness lies outside [0, 1].
        """
        y = checked_brightness(brightness)
        flat = y.ravel()
        irradiance = self._inverse(flat, self._checked(parameters, single=True))
        return np.where(flat == 0, 0.0, np.where(flat == 1, 1.0, irradiance)).reshape(y.shape)

    def derivative(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Slope f'(I) of one curve; may be 0 or infinite at I = 0. Arguments as for `inverse`."""
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        return self._derivative(x.ravel(), self._checked(parameters, single=True)).reshape(x.shape)

    def gradient(self, irradiance: npt.ArrayLike, parameters: npt.ArrayLike) -> Floats:
        """Derivatives of f(I) in the parameters, shape (..., P). Arguments as for `response`."""
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        values = self._checked(parameters)
        flat = self._gradient(x.ravel(), values)
        return flat.reshape(*values.shape[:-1], *x.shape, self.n_parameters)

    def increases(self, parameters: npt.ArrayLike) -> bool:
        """Whether a curve never decreases by more than 1e-9 between 1024 uniform irradiances.

        For a family that describes g, whether g does not, at its own points. Arguments as
        for `inverse`.
        """
        steps = np.diff(self._defining_values(self._checked(parameters, single=True)))
        return bool(np.all(steps >= -_LEAST_FALL))

    def evaluate(self, irradiance: Floats, parameters: Floats) -> tuple[Floats, Floats]:
        """Response and gradient at once, for solvers, which know what they ask.

        Parameters
        ----------
        irradiance : ndarray, shape (N,), 0 … 1
        parameters : ndarray, shape (..., P)
            Not checked.

        Returns
        -------
        (ndarray, ndarray) of shapes (..., N) and (..., N, P)
        """
        return self._response(irradiance, parameters), self._gradient(irradiance, parameters)

    def _checked(self, parameters: npt.ArrayLike, *, single: bool = False) -> Floats:
        values = np.asarray(parameters, dtype=np.float64)
        right = values.ndim == 1 or (values.ndim > 1 and not single)
        if not (right and values.shape[-1] == self.n_parameters and np.all(self.admits(values))):
            raise ParameterError(self._refusal(values))
        return values

    def _refusal(self, parameters: Floats) -> str:
        """Sentence about parameters that `admits` refuses or that are too few or too many."""
        names = self.parameter_names
        shown = 8  # a table has hundreds
        ranges = list(map(_range, names[:shown], *self.bounds))
        if parameters.ndim > 1 and parameters.shape[-1] == self.n_parameters:
            sets = parameters.reshape(-1, self.n_parameters)
            refused = sets[~self.admits(sets)]
            given = [f"{value:g}" for value in refused[0]] if refused.size else ["sets of them"]
        else:
            given = [f"{value:g}" for value in parameters.ravel()[: self.n_parameters + 1]]
        plural = "s" if self.n_parameters > 1 else ""
        return (
            f"{self.name} takes {self.n_parameters} finite parameter{plural} "
            f"({', '.join(ranges)}{', …' if len(names) > shown else ''})"
            f"{' ' if self.condition else ''}{self.condition}, not "
            f"{', '.join(given[:shown]) or 'none'}{', …' if len(given) > shown else ''}"
        )

    @abstractmethod
    def _response(self, x: Floats, parameters: Floats) -> Floats: ...

    @abstractmethod
    def _derivative(self, x: Floats, parameters: Floats) -> Floats: ...

    @abstractmethod
    def _gradient(self, x: Floats, parameters: Floats) -> Floats: ...

    def _defining_values(self, parameters: Floats) -> Floats:
        return self._response(UNIFORM_IRRADIANCE, parameters)

    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        def response(x: Floats) -> tuple[Floats, Floats]:
            return self._response(x, parameters), self._derivative(x, parameters)

        return invert_on_grid(response, y, _GRID, tolerance=_TOLERANCE)


MODELS: Registry[AbstractModel] = Registry("model")
"""Every family at every order a user may name."""


def register_model(*models: AbstractModel) -> None:
    """Make models known to the command line and to calibration files."""
    for model in models:
        MODELS.register(model.name, model)
