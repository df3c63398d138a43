"""Polynomials through black and white."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._linear import PowersModel
from chartless.models._orders import HIGHEST_ORDER
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class ConPoly(PowersModel):
    r"""Polynomial of order N: :math:`f = I^{N+2} + \sum_{j=1}^{N+1} c_j (I^j - I^{N+2})`.

    The polynomials of `Poly` with one degree more and f(1) = 1.

    Examples
    --------
    >>> ConPoly(order=0).response([0.5, 1.0], [1.5])
    array([0.625, 1.   ])
    """

    family: ClassVar[str] = "conpoly"
    formula: ClassVar[str] = "I^K + c1 (I - I^K) + ... + cM (I^M - I^K), M = N + 1, K = N + 2"
    order: int = 2

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.SMOOTH, Property.EXTENSIBLE, Property.ANALYTICAL})

    @override
    def promoted(self, parameters: Floats) -> Floats:
        # The highest power of the order below, whose coefficient is 1 − Σ c, becomes free.
        last = 1 - parameters.sum(axis=-1, keepdims=True)
        return np.concatenate([parameters, last], axis=-1)

    @override
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        highest = x ** (self.order + 2)
        return highest, self.powers(x) - highest[:, np.newaxis]

    @override
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        highest = (self.order + 2) * x ** (self.order + 1)
        return highest, self.power_slopes(x) - highest[:, np.newaxis]


register_model(*(ConPoly(order=order) for order in range(HIGHEST_ORDER + 1)))
