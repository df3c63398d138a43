"""The power law f(I) = I^γ: the family of order 0."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models._base import Property, register_model
from chartless.models._exponent import PolynomialExponentModel
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class Gamma(PolynomialExponentModel):
    """f(I) = I^γ with γ > 0; a display gamma of 2.2 is met by γ = 1/2.2.

    Examples
    --------
    >>> Gamma().response([0.0, 0.25, 1.0], [0.5])
    array([0. , 0.5, 1. ])
    """

    family: ClassVar[str] = "gamma"
    formula: ClassVar[str] = "I^g"
    order: int = 0

    def __post_init__(self) -> None:
        if self.order != 0:
            msg = f"gamma has the order 0 only, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def name(self) -> str:
        return self.family

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - {Property.EXTENSIBLE, Property.COMPACT}

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("gamma",)

    @property
    @override
    def identity(self) -> Floats:
        return np.ones(1)

    @property
    @override
    def bounds(self) -> tuple[Floats, Floats]:
        return np.zeros(1), np.full(1, np.inf)

    @override
    def coefficients(self, parameters: Floats) -> Floats:
        return np.log(parameters)

    @override
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        return 1.0 / parameters[..., np.newaxis]


register_model(Gamma())
