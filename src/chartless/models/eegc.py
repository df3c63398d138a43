"""The exponential-exponent gamma curve f(I) = I^exp(ψ(I)), ψ any polynomial."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._exponent import FreeExponentModel
from chartless.models._orders import HIGHEST_ORDER


@final
@dataclass(frozen=True, slots=True)
class Eegc(FreeExponentModel):
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
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - ({Property.MONOTONE} if self.order else set())


# The source paper compares orders 0 … 6; Eegc(order=N) serves any other.
register_model(*(Eegc(order=order) for order in range(HIGHEST_ORDER + 1)))
