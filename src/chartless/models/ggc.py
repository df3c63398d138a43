"""Generalised gamma curves: a power law, alone or with an offset and a gain."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models._base import AbstractModel, Property, register_model
from chartless.types import Floats

_POWER, _AFFINE = 0, 2


@final
@dataclass(frozen=True, slots=True)
class Ggc(AbstractModel):
    r"""Generalised gamma curve of order 0, f = I^(1/γ), or 2, f = α + β I^γ with β, γ > 0.

    The affine form (Mann and Picard, *Being "undigital" with digital cameras*, 1994) passes
    through the ends only if α = 0 and β = 1. There is no order between them: the family
    does not extend.

    Examples
    --------
    >>> Ggc(order=0).response([0.25], [2.0])
    array([0.5])
    >>> Ggc(order=2).response([0.25], [0.1, 0.8, 0.5])
    array([0.5])
    """

    family: ClassVar[str] = "ggc"
    formula: ClassVar[str] = "I^(1/g); order 2: a + b I^g"
    order: int = _AFFINE

    def __post_init__(self) -> None:
        if self.order not in (_POWER, _AFFINE):
            msg = f"GGC has the orders 0 and 2, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def properties(self) -> frozenset[Property]:
        always = frozenset({Property.MONOTONE, Property.SMOOTH, Property.ANALYTICAL})
        return always if self.order else always | {Property.ENDS, Property.BOUNDED}

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("alpha", "beta", "gamma") if self.order else ("gamma",)

    @property
    @override
    def identity(self) -> Floats:
        return np.array([0.0, 1.0, 1.0]) if self.order else np.ones(1)

    @property
    @override
    def bounds(self) -> tuple[Floats, Floats]:
        least = np.array([-np.inf, 0.0, 0.0]) if self.order else np.zeros(1)
        return least, np.full(self.n_parameters, np.inf)

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        offset, gain, power = self._parts(parameters)
        response: Floats = offset + gain * x**power
        return response

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        _, gain, power = self._parts(parameters)
        with np.errstate(divide="ignore", over="ignore"):
            slope: Floats = gain * (power * x ** (power - 1))
        return slope

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        _, gain, power = self._parts(parameters)
        value = x**power
        with np.errstate(divide="ignore", invalid="ignore"):
            by_power = np.where(x > 0, gain * value * np.log(x), 0.0)
        if not self.order:
            by_gamma: Floats = -by_power * power * power  # d(1/γ)/dγ = −1/γ², which may overflow
            return by_gamma[..., np.newaxis]
        return np.stack([np.ones_like(value), value, by_power], axis=-1)

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        offset, gain, power = self._parts(parameters)
        with np.errstate(over="ignore"):
            irradiance: Floats = ((y - offset) / gain).clip(0, 1) ** (1 / power)
        return irradiance

    def _parts(self, parameters: Floats) -> tuple[Floats, Floats, Floats]:
        """Offset, gain and power, each of shape (..., 1)."""
        if self.order:
            offset, gain, power = np.moveaxis(parameters[..., np.newaxis], -2, 0)
            return offset, gain, power
        one = np.ones_like(parameters)
        return 0 * one, one, 1 / parameters


register_model(Ggc(order=_POWER), Ggc(order=_AFFINE))
