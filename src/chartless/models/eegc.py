"""The exponential-exponent gamma curve f(I) = I^exp(ψ(I)), ψ any polynomial."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import register_model
from chartless.models._exponent import ExponentModel
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class Eegc(ExponentModel):
    r"""EEGC of order N: :math:`f(I) = I^{\exp\psi(I)}`, :math:`\psi = \sum_{j=0}^N \alpha_j I^j`.

    Extensible (order N contains order N − 1), always bounded and through both ends,
    not always increasing: for that see `Ameegc` and `AmeegcExact`.

    Examples
    --------
    >>> Eegc(order=2).response([0.25], [-0.8, 0.5, 0.1]).round(6)
    array([0.491513])
    """

    family: ClassVar[str] = "eegc"
    formula: ClassVar[str] = "I^exp(a0 + a1 I + ... + aN I^N)"
    order: int = 2

    @property
    @override
    def always_monotone(self) -> bool:
        return self.order == 0

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"a{j}" for j in range(self.order + 1))

    @property
    @override
    def identity(self) -> Floats:
        return np.zeros(self.order + 1)

    @override
    def coefficients(self, parameters: Floats) -> Floats:
        return parameters

    @override
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        return np.eye(parameters.size)


# Orders 0 … 6 are those the source paper compares; Eegc(order=N) serves any other.
register_model(*(Eegc(order=order) for order in range(7)))
