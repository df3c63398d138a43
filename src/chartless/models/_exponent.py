"""Shared by all families f = I^exp(ψ(I)) with a polynomial ψ: everything but the parameters.

In Gumbel coordinates x = ln(−ln I), F = ln(−ln f) these curves are F = x + ψ(I): the
ends of [0, 1] go to ±∞, a gamma curve becomes a shift, and slopes that are 0 or ∞ in I
become tame. The inverse is solved there.
"""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from chartless._invert import invert_increasing
from chartless.models._base import AbstractModel
from chartless.types import Floats

# Beyond these x, exp(-exp(x)) is 1 or 0 in float64.
_GUMBEL_LOW, _GUMBEL_HIGH = -38.0, 6.62
_MOST_PSI = 600.0  # exp of it squared is still finite in products with f
_GUMBEL_TABLE = np.linspace(_GUMBEL_LOW, _GUMBEL_HIGH, 512)
# |d brightness| <= |dF| / e, so this is 1e-12 in brightness with a factor to spare.
_GUMBEL_TOLERANCE = 5e-13


@dataclass(frozen=True, slots=True)
class ExponentModel(AbstractModel):
    """f(I) = I^exp(ψ(I)), ψ(I) = Σ_j α_j I^j; a leaf says how α follows from its parameters.

    Always bounded, always through (0, 0) and (1, 1); increasing where
    ψ'(I) ≤ −1/(I ln I).
    """

    @abstractmethod
    def coefficients(self, parameters: Floats) -> Floats:
        """Coefficients α of ψ, lowest power first, shape (N + 1,)."""

    @abstractmethod
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        """Derivatives of α in the parameters, shape (N + 1, P)."""

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        return _ends(x, np.exp(_log_response(x, self.coefficients(parameters))), 0.0, 1.0)

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        alpha = self.coefficients(parameters)

        def gumbel(x: Floats) -> tuple[Floats, Floats]:
            minus_log = np.exp(x)
            irradiance = np.exp(-minus_log)
            psi, slope = _polynomial(irradiance, alpha)
            return x + psi, 1.0 - irradiance * minus_log * slope

        inside = (y > 0) & (y < 1)
        target = np.log(-np.log(y[inside]))
        # ψ − α₀ lies between the sum of the negative and of the positive other coefficients.
        low = (target - alpha[0] - alpha[1:].clip(min=0).sum()).clip(_GUMBEL_LOW, _GUMBEL_HIGH)
        high = (target - alpha[0] - alpha[1:].clip(max=0).sum()).clip(_GUMBEL_LOW, _GUMBEL_HIGH)
        # A curve that decreases somewhere is inverted through its running maximum.
        table = np.maximum.accumulate(gumbel(_GUMBEL_TABLE)[0])
        start = np.interp(target, table, _GUMBEL_TABLE).clip(low, high)
        x = invert_increasing(gumbel, target, low, high, start, tolerance=_GUMBEL_TOLERANCE)
        irradiance = y.copy()
        irradiance[inside] = np.exp(-np.exp(x))
        return irradiance

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        alpha = self.coefficients(parameters)
        psi, psi_slope = _polynomial(x, alpha)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            exponent = np.exp(psi.clip(-_MOST_PSI, _MOST_PSI))
            # f/I = I^(exponent − 1) stays finite where f and I both vanish.
            ratio = np.exp((exponent - 1.0) * np.log(x))
            slope = ratio * exponent * (1.0 + psi_slope * x * np.log(x))
        at_zero = np.inf if alpha[0] < 0 else 0.0 if alpha[0] > 0 else 1.0
        return _ends(x, slope, at_zero, float(np.exp(np.clip(alpha.sum(), -_MOST_PSI, _MOST_PSI))))

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        alpha = self.coefficients(parameters)
        log_response = _log_response(x, alpha)
        with np.errstate(invalid="ignore"):
            common = _ends(x, np.exp(log_response) * log_response, 0.0, 0.0)
        powers = np.vander(x, alpha.size, increasing=True)
        return common[:, np.newaxis] * (powers @ self.coefficient_jacobian(parameters))


def _log_response(x: Floats, alpha: Floats) -> Floats:
    """Return ln f = exp(ψ) ln I; what it says at the ends is not to be used."""
    psi, _ = _polynomial(x, alpha)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        log_response: Floats = np.exp(psi.clip(-_MOST_PSI, _MOST_PSI)) * np.log(x)
    return log_response


def _polynomial(x: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Value and slope of Σ_j c_j x^j by Horner's rule; NumPy's own takes ten times as long."""
    value, slope = np.full_like(x, coefficients[-1]), np.zeros_like(x)
    for step, coefficient in enumerate(coefficients[-2::-1]):
        slope = slope * x + value if step else value
        value = value * x + coefficient
    return value, slope


def _ends(x: Floats, inside: Floats, at_zero: float, at_one: float) -> Floats:
    return np.where(x == 0, at_zero, np.where(x == 1, at_one, inside))
