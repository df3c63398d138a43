"""Shared by all families f = I^exp(ψ(I)): everything but ψ.

In Gumbel coordinates x = ln(−ln I), F = ln(−ln f) these curves are F = x + ψ(I): the
ends of [0, 1] go to ±∞, a gamma curve becomes a shift, and slopes that are 0 or ∞ in I
become tame. The inverse is solved there.
"""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from chartless._numeric.invert import invert_on_grid
from chartless.models._base import AbstractModel
from chartless.models._polynomial import polynomial, slope_coefficients
from chartless.types import Floats

# Beyond these x, exp(-exp(x)) is 1 or 0 in float64.
_GUMBEL_TABLE = np.linspace(-38.0, 6.62, 512)
_MOST_PSI = 600.0  # exp of it squared is still finite in products with f
# |d brightness| <= |dF| / e, so this is 1e-12 in brightness with a factor to spare.
_GUMBEL_TOLERANCE = 5e-13


@dataclass(frozen=True, slots=True)
class ExponentModel(AbstractModel):
    """f(I) = I^exp(ψ(I)); a leaf writes ψ, its slope, and its derivatives in the parameters.

    Always bounded, always through (0, 0) and (1, 1); increasing where
    ψ'(I) ≤ −1/(I ln I).
    """

    @abstractmethod
    def _psi(self, x: Floats, parameters: Floats) -> Floats:
        """Return ψ(I), shape (..., N), for parameters of shape (..., P)."""

    @abstractmethod
    def _psi_slope(self, x: Floats, parameters: Floats) -> Floats:
        """Return ψ'(I), shape (N,), for parameters of shape (P,)."""

    @abstractmethod
    def _psi_gradient(self, x: Floats, parameters: Floats) -> Floats:
        """Derivatives of ψ(I) in the parameters, shape (..., N, P)."""

    @override
    def evaluate(self, irradiance: Floats, parameters: Floats) -> tuple[Floats, Floats]:
        log_response = self._log_response(irradiance, parameters)
        response = _ends(irradiance, np.exp(log_response), 0.0, 1.0)
        with np.errstate(invalid="ignore"):
            log_response *= response
        common = _ends(irradiance, log_response, 0.0, 0.0)
        gradient: Floats = common[..., np.newaxis] * self._psi_gradient(irradiance, parameters)
        return response, gradient

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        return _ends(x, np.exp(self._log_response(x, parameters)), 0.0, 1.0)

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        return self.evaluate(x, parameters)[1]

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        def gumbel(x: Floats) -> tuple[Floats, Floats]:
            minus_log = np.exp(x)
            irradiance = np.exp(-minus_log)
            slope = 1.0 - irradiance * minus_log * self._psi_slope(irradiance, parameters)
            return x + self._psi(irradiance, parameters), slope

        inside = (y > 0) & (y < 1)
        target = np.log(-np.log(y[inside]))
        x = invert_on_grid(gumbel, target, _GUMBEL_TABLE, tolerance=_GUMBEL_TOLERANCE)
        irradiance = y.copy()
        irradiance[inside] = np.exp(-np.exp(x))
        return irradiance

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        psi = self._psi(x, parameters).clip(-_MOST_PSI, _MOST_PSI)
        at_black, at_white = self._psi(np.array([0.0, 1.0]), parameters)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            exponent = np.exp(psi)
            # f/I = I^(exponent − 1) stays finite where f and I both vanish.
            ratio = np.exp((exponent - 1.0) * np.log(x))
            slope = ratio * exponent * (1.0 + self._psi_slope(x, parameters) * x * np.log(x))
        at_zero = np.inf if at_black < 0 else 0.0 if at_black > 0 else 1.0
        return _ends(x, slope, at_zero, float(np.exp(at_white.clip(-_MOST_PSI, _MOST_PSI))))

    def _log_response(self, x: Floats, parameters: Floats) -> Floats:
        """Return ln f = exp(ψ) ln I; what it says at the ends is not to be used."""
        psi = self._psi(x, parameters)
        log_response = psi.clip(-_MOST_PSI, _MOST_PSI)
        np.exp(log_response, out=log_response)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            log_response *= np.log(x)
        return log_response


@dataclass(frozen=True, slots=True)
class PolynomialExponentModel(ExponentModel):
    """ψ(I) = Σ_j α_j I^j; a leaf says how α follows from its parameters."""

    @abstractmethod
    def coefficients(self, parameters: Floats) -> Floats:
        """Coefficients α of ψ, lowest power first, (..., N + 1), for parameters (..., P)."""

    @abstractmethod
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        """Derivatives of α in the parameters, shape (..., N + 1, P)."""

    @override
    def _psi(self, x: Floats, parameters: Floats) -> Floats:
        return polynomial(x, self.coefficients(parameters))

    @override
    def _psi_slope(self, x: Floats, parameters: Floats) -> Floats:
        alpha = self.coefficients(parameters)
        return polynomial(x, slope_coefficients(alpha))

    @override
    def _psi_gradient(self, x: Floats, parameters: Floats) -> Floats:
        jacobian = self.coefficient_jacobian(parameters)
        powers = np.vander(x, jacobian.shape[-2], increasing=True)
        by_parameter = np.swapaxes(jacobian, -1, -2) @ powers.T  # long rows: twice as fast
        gradient: Floats = np.swapaxes(by_parameter, -1, -2)
        return gradient


@dataclass(frozen=True, slots=True)
class FreeExponentModel(PolynomialExponentModel):
    """The parameters are the coefficients of ψ themselves."""

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
        return np.broadcast_to(np.eye(self.order + 1), (*parameters.shape, self.order + 1))


def _ends(x: Floats, inside: Floats, at_zero: float, at_one: float) -> Floats:
    """Set both ends of an array (..., N), in place."""
    inside[..., x == 0] = at_zero
    inside[..., x == 1] = at_one
    return inside
