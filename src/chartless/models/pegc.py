"""Polynomial exponent gamma curve f(I) = I^E(I), E any polynomial."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless._numeric.invert import invert_on_grid
from chartless.models._base import AbstractModel, Property, register_model
from chartless.models._orders import HIGHEST_ORDER
from chartless.models._polynomial import polynomial, slope_coefficients
from chartless.types import Floats

_MOST_LOG = 600.0  # exp of it is finite, in products with parameters as well
# ln I from 0 to 1 in float64, as fine near I = 1 as near 0.
_LOG_TABLE = -np.exp(np.linspace(np.log(750.0), np.log(1e-17), 1024))


@final
@dataclass(frozen=True, slots=True)
class Pegc(AbstractModel):
    r"""PEGC of order N: :math:`f(I) = I^{E(I)}`, :math:`E = \sum_{j=0}^N \alpha_j I^j`, α₀ > 0.

    Ng, Chang and Tsui, *Using geometry invariants for camera response function estimation*
    (CVPR 2007), eq. 14. Where the exponent turns negative the curve rises above 1.

    Examples
    --------
    >>> Pegc(order=1).response([0.25], [0.5, 0.0])
    array([0.5])
    """

    family: ClassVar[str] = "pegc"
    formula: ClassVar[str] = "I^(a0 + a1 I + ... + aN I^N)"
    order: int = 2

    @property
    @override
    def properties(self) -> frozenset[Property]:
        always = frozenset(Property) - {Property.COMPACT}  # 0.0062 with three parameters
        return always - ({Property.MONOTONE, Property.BOUNDED} if self.order else set())

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"a{j}" for j in range(self.order + 1))

    @property
    @override
    def identity(self) -> Floats:
        return np.asarray(np.eye(self.order + 1)[0])

    @property
    @override
    def bounds(self) -> tuple[Floats, Floats]:
        least = np.full(self.order + 1, -np.inf)
        least[0] = 0.0
        return least, np.full(self.order + 1, np.inf)

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            log_response = polynomial(x, parameters) * np.log(x)
        return np.where(x == 0, 0.0, np.exp(log_response.clip(max=_MOST_LOG)))

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        exponent = polynomial(x, parameters)
        slope = polynomial(x, slope_coefficients(parameters))
        with np.errstate(divide="ignore", invalid="ignore"):
            log = np.log(x)
            ratio = np.exp(((exponent - 1) * log).clip(max=_MOST_LOG))
            inside = ratio * (exponent + slope * x * log)
        first = parameters[0]
        return np.where(x == 0, np.inf if first < 1 else 0.0 if first > 1 else 1.0, inside)

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            common = np.where(x == 0, 0.0, self._response(x, parameters) * np.log(x))
        powers: Floats = np.vander(x, self.order + 1, increasing=True)
        return common[..., np.newaxis] * powers

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        def log_response(log: Floats) -> tuple[Floats, Floats]:
            x = np.exp(log)
            exponent = polynomial(x, parameters)
            slope = polynomial(x, slope_coefficients(parameters))
            return exponent * log, exponent + slope * x * log

        inside = (y > 0) & (y < 1)
        irradiance = y.copy()
        irradiance[inside] = np.exp(
            invert_on_grid(log_response, np.log(y[inside]), _LOG_TABLE, tolerance=5e-13)
        )
        return irradiance


register_model(*(Pegc(order=order) for order in range(HIGHEST_ORDER + 1)))
