"""Monotone EEGCs of low order in the form of the source paper.

An EEGC increases exactly where ψ'(I) ≤ h(I) = −1/(I ln I), and h has its minimum e at
I = 1/e. The paper therefore writes ψ so that ψ' ≤ e at chosen points.
"""

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
class Ameegc(PolynomialExponentModel):
    r"""AMEEGC of order 0, 1 or 2, as published.

    With parameters a, b, c (the first N + 1 of them at order N)

    .. math:: \psi(I) = a + (e - b^2) I + (b^2 - c^2/2) I^2

    where order 1 stops after the term in I and order 0 after a. Orders 0 and 1 are
    exactly the monotone EEGCs of their order. Order 2 holds the slope of ψ to at most e
    at I = 0 (α₁ ≤ e) and bounds α₁ + α₂ ≤ e: an approximation. It holds curves that
    decrease, such as a = 0, b = 3, c = 0 between I = 0.51 and 0.89, and misses monotone ones with
    α₁ > e; `AmeegcExact` does neither.
    """

    family: ClassVar[str] = "ameegc"
    formula: ClassVar[str] = "I^exp(a + (e - b^2) I + (b^2 - c^2/2) I^2)"
    order: int = 2

    def __post_init__(self) -> None:
        if self.order not in (0, 1, 2):
            msg = f"AMEEGC has the orders 0, 1 and 2, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - ({Property.MONOTONE} if self.order > 1 else set())

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("a", "b", "c")[: self.order + 1]

    @property
    @override
    def identity(self) -> Floats:
        return np.array([0.0, np.sqrt(np.e), np.sqrt(2 * np.e)])[: self.order + 1]

    @override
    def promoted(self, parameters: Floats) -> Floats:
        last = (
            np.sqrt(2) * parameters[..., 1]
            if self.order > 1
            else np.full_like(parameters[..., 0], np.sqrt(np.e))
        )
        return np.concatenate([parameters, last[..., np.newaxis]], axis=-1)

    @override
    def coefficients(self, parameters: Floats) -> Floats:
        alpha = parameters.copy()
        if self.order >= 1:
            alpha[..., 1] = np.e - parameters[..., 1] ** 2
        if self.order == 2:  # noqa: PLR2004 - the order in the paper's own numbering
            alpha[..., 2] = parameters[..., 1] ** 2 - parameters[..., 2] ** 2 / 2
        return alpha

    @override
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        jacobian = np.zeros((*parameters.shape, self.order + 1))
        jacobian[..., 0, 0] = 1.0
        if self.order >= 1:
            jacobian[..., 1, 1] = -2 * parameters[..., 1]
        if self.order == 2:  # noqa: PLR2004 - as above
            jacobian[..., 2, 1] = 2 * parameters[..., 1]
            jacobian[..., 2, 2] = -parameters[..., 2]
        return jacobian


register_model(*(Ameegc(order=order) for order in range(3)))
