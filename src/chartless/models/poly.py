"""Polynomials through black, the family of Mitsunaga and Nayar."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._linear import LinearModel
from chartless.models._orders import HIGHEST_ORDER
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class Poly(LinearModel):
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

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"c{j}" for j in range(1, self.order + 2))

    @property
    @override
    def identity(self) -> Floats:
        return np.asarray(np.eye(self.order + 1)[0])

    @property
    @override
    def lower(self) -> "Poly | None":
        return Poly(order=self.order - 1) if self.order else None

    @override
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        return np.zeros_like(x), x[:, np.newaxis] ** np.arange(1, self.order + 2)

    @override
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        powers = np.arange(1, self.order + 2)
        return np.zeros_like(x), powers * x[:, np.newaxis] ** (powers - 1)


register_model(*(Poly(order=order) for order in range(HIGHEST_ORDER + 1)))
