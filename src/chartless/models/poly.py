"""Polynomials through black, the family of Mitsunaga and Nayar."""

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
class Poly(PowersModel):
    r"""Polynomial of order N: :math:`f(I) = \sum_{j=1}^{N+1} c_j I^j`.

    Mitsunaga and Nayar, *Radiometric self calibration* (CVPR 1999), eq. 3, there for the
    inverse response. Passes through black only; `ConPoly` passes through white as well.

    Examples
    --------
    >>> Poly(order=1).response([0.5], [1.5, -0.5])
    array([0.625])
    """

    family: ClassVar[str] = "poly"
    formula: ClassVar[str] = "c1 I + c2 I^2 + ... + cM I^M, M = N + 1"
    order: int = 2

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.SMOOTH, Property.EXTENSIBLE, Property.ANALYTICAL})

    @override
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        return np.zeros_like(x), self.powers(x)

    @override
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        return np.zeros_like(x), self.power_slopes(x)


register_model(*(Poly(order=order) for order in range(HIGHEST_ORDER + 1)))
