"""Monotone EEGCs of any order, by constraints."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._exponent import FreeExponentModel
from chartless.models._orders import HIGHEST_ORDER
from chartless.models._polynomial import polynomial, slope_coefficients
from chartless.types import Bools, Floats

# The paper asks for 255 places or more; peaks between them are found by Newton steps.
_PLACES = np.arange(1, 512) / 512
# Large coefficients put peaks before the first place and after the last.
_BEYOND = 0.5 ** np.arange(50, 9, -1)
_SEARCHED = np.concatenate([_BEYOND, _PLACES, 1 - _BEYOND[::-1]])
_MARGIN = 1e-9  # of the slope of ψ: keeps rounding away from a decreasing curve
_NEWTON_STEPS = 6


def _barrier(x: Floats) -> tuple[Floats, Floats, Floats]:
    """Return h = −1/(I ln I) and its first two derivatives."""
    log = np.log(x)
    curvature = -(2 * log**2 + 3 * log + 2) / (x * log) ** 3
    return -1 / (x * log), (log + 1) / (x * log) ** 2, curvature


_BARRIER = _barrier(_SEARCHED)[0]


@final
@dataclass(frozen=True, slots=True)
class Meegc(FreeExponentModel):
    r"""MEEGC of order N: :math:`f = I^{\exp\psi(I)}`, ψ a polynomial with ψ' ≤ h.

    :math:`h(I) = -1/(I \ln I)`; the curve increases exactly where ψ' ≤ h. The paper writes
    linear inequalities on a grid; between its points a curve may still decrease a little, so
    the places where ψ' − h is greatest are added to them. Orders 0 and 1 are `Ameegc` of
    these orders, order 2 is `AmeegcExact`, both free of constraints.

    Examples
    --------
    >>> Meegc(order=2).admits(np.array([0.0, -6.0, 9.0])).item()
    False
    """

    family: ClassVar[str] = "meegc"
    constrained: ClassVar[bool] = True
    condition: ClassVar[str] = "of a curve that never decreases"
    formula: ClassVar[str] = "I^exp(a0 + a1 I + ... + aN I^N) with f' > 0"
    order: int = 3

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - {Property.ANALYTICAL}

    @override
    def admits(self, parameters: Floats) -> Bools:
        flat = parameters.reshape(-1, self.order + 1)
        admitted = [bool(np.all(np.isfinite(one)) and self._excess(one) <= 0) for one in flat]
        return np.reshape(admitted, parameters.shape[:-1])

    @override
    def inequalities(self, parameters: Floats) -> tuple[Floats, Floats]:
        places = np.concatenate([_PLACES, self._peaks(parameters)])
        powers = np.arange(self.order + 1)
        rows = powers * places[:, np.newaxis] ** np.maximum(powers - 1, 0)
        return rows, _barrier(places)[0] - _MARGIN

    @override
    def repaired(self, parameters: Floats) -> Floats:
        # To lower α₁ is to lower the whole of ψ'.
        flat = parameters.reshape(-1, self.order + 1).copy()
        if self.order:
            for one in flat:
                excess = self._excess(one)
                rounding = _MARGIN * max(1.0, float(np.abs(one).max()))
                one[1] -= excess + rounding if excess > 0 else 0.0
        return flat.reshape(parameters.shape)

    def _excess(self, alpha: Floats) -> float:
        """Greatest ψ' − h on (0, 1); the curve increases where it is not above 0."""
        if self.order == 0:
            return -np.e  # ψ' = 0, and h is e at least
        slope = slope_coefficients(alpha)
        places = np.concatenate([_PLACES, self._peaks(alpha)])
        return float(np.max(polynomial(places, slope) - _barrier(places)[0]))

    def _peaks(self, alpha: Floats) -> Floats:
        """Where ψ' − h has a maximum, to the last bits."""
        first = slope_coefficients(alpha)
        second = slope_coefficients(first)
        third = slope_coefficients(second)
        excess = polynomial(_SEARCHED, first) - _BARRIER
        highest = (excess[1:-1] >= excess[:-2]) & (excess[1:-1] >= excess[2:])
        x = _SEARCHED[1:-1][highest]
        low, high = _SEARCHED[:-2][highest], _SEARCHED[2:][highest]
        for _ in range(_NEWTON_STEPS):
            _, slope, curvature = _barrier(x)
            bend = np.minimum(polynomial(x, third) - curvature, -1e-12)
            x = (x - (polynomial(x, second) - slope) / bend).clip(low, high)
        return x


register_model(*(Meegc(order=order) for order in range(HIGHEST_ORDER + 1)))
