"""Polynomials through black and white."""

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
class ConPoly(LinearModel):
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
    def lower(self) -> "ConPoly | None":
        return ConPoly(order=self.order - 1) if self.order else None

    @override
    def promoted(self, parameters: Floats) -> Floats:
        # The highest power of the order below, whose coefficient is 1 − Σ c, becomes free.
        last = 1 - parameters.sum(axis=-1, keepdims=True)
        return np.concatenate([parameters, last], axis=-1)

    @override
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        highest = x ** (self.order + 2)
        powers = x[:, np.newaxis] ** np.arange(1, self.order + 2)
        return highest, powers - highest[:, np.newaxis]

    @override
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        highest = (self.order + 2) * x ** (self.order + 1)
        powers = np.arange(1, self.order + 2)
        return highest, powers * x[:, np.newaxis] ** (powers - 1) - highest[:, np.newaxis]


register_model(*(ConPoly(order=order) for order in range(HIGHEST_ORDER + 1)))
