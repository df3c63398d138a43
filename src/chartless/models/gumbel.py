"""A family of any order whose members all increase, without constraints."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, final

import numpy as np
from numpy.polynomial import chebyshev
from typing_extensions import override

from chartless.models._base import AbstractModel, Property, register_model
from chartless.models._exponent import ExponentModel
from chartless.models._orders import HIGHEST_ORDER
from chartless.models._polynomial import polynomial
from chartless.types import Bools, Floats

# The integrand has a term in t² ln t; as a function of √t it is smooth enough for 64 points to
# reach 1e-13 at the parameters of measured cameras. At the limit of what is admitted, the
# slope that the interpolant has must not fall below 0: at order 10 the worst parameters that a
# search finds keep 99 % of their least slope with 192 points, and none with 96.
_POWER, _POINTS = 2, 192
_LAST_TERM = 1e-17  # relative to the largest: what a series may go without
_STEEPEST = 6.0  # of |ln F'|: slopes in Gumbel coordinates from 1/400 to 400


def _nodes() -> tuple[Floats, Floats, Floats]:
    """Points t in (0, 1), t ln t there, and the map from values there to an integral.

    The map takes values φ(t) to Chebyshev coefficients, in 2 √t − 1, of ∫₀ φ dt.
    """
    angle = (np.arange(_POINTS) + 0.5) * np.pi / _POINTS
    root = (np.cos(angle) + 1) / 2
    values_to_coefficients = 2 / _POINTS * np.cos(np.outer(np.arange(_POINTS), angle))
    values_to_coefficients[0] /= 2
    integral = chebyshev.chebint(values_to_coefficients, lbnd=-1, axis=0)
    t = root**_POWER
    return t, t * np.log(t), integral * (_POWER * root ** (_POWER - 1) / 2)


_T, _T_LOG_T, _INTEGRAL = _nodes()


@final
@dataclass(frozen=True, slots=True)
class Gumbel(ExponentModel):
    r"""Monotone family of order N in Gumbel coordinates, parameters a and q₀ … q_{N−1}.

    With x = ln(−ln I), F = ln(−ln f) every increasing F(x) is a response. Here

    .. math:: \ln F'(x) = I \ln I \, q(I), \qquad q(I) = \sum_{j=0}^{N-1} q_j I^j

    whose slope is positive whatever q. As dx = dI / (I ln I) this is f = I^exp(ψ) with

    .. math:: \psi(I) = a + \int_0^I \frac{e^{t \ln t\, q(t)} - 1}{t \ln t} dt

    To first order in q it is the EEGC with ψ' = q. At both ends F' = 1: near black the curve
    is a power law, and its slope at white is finite. The integral is evaluated by Chebyshev
    interpolation; parameters are refused where F' leaves the range 1/400 … 400 that it
    resolves. See docs/design/0004-monotone-of-any-order.md.

    Examples
    --------
    >>> Gumbel(order=1).response([0.25, 1.0], [np.log(0.5), 0.0])
    array([0.5, 1. ])
    """

    family: ClassVar[str] = "gumbel"
    formula: ClassVar[str] = "I^exp(a + integral of (t^(t q(t)) - 1)/(t ln t) over 0 .. I)"
    condition: ClassVar[str] = f"with |t ln t q(t)| of {_STEEPEST:g} at most"
    order: int = 3

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property)

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("a", *(f"q{j}" for j in range(self.order)))

    @property
    @override
    def identity(self) -> Floats:
        return np.zeros(self.order + 1)

    @override
    def admits(self, parameters: Floats) -> Bools:
        with np.errstate(invalid="ignore", over="ignore"):
            steepness = np.abs(self._log_slope(parameters)).max(axis=-1)
        finite = AbstractModel.admits(self, parameters)
        return np.asarray(finite & (steepness <= _STEEPEST))

    @override
    def _psi(self, x: Floats, parameters: Floats) -> Floats:
        integrand = np.expm1(self._log_slope(parameters)) / _T_LOG_T
        if parameters.ndim == 1:  # the series of one curve is short
            terms = _INTEGRAL @ integrand
            series = chebyshev.chebtrim(terms, _LAST_TERM * np.abs(terms).max())
            return np.asarray(parameters[0] + chebyshev.chebval(2 * np.sqrt(x) - 1, series))
        psi: Floats = parameters[..., :1] + integrand @ _integral_to(x.tobytes()).T
        return psi

    @override
    def _psi_slope(self, x: Floats, parameters: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            x_log_x = x * np.log(x)
            q = polynomial(x, parameters[..., 1:]) if self.order else np.zeros_like(x)
            ratio = np.expm1(x_log_x * q) / x_log_x
        return np.where((x == 0) | (x == 1), q, ratio)

    @override
    def _psi_gradient(self, x: Floats, parameters: Floats) -> Floats:
        slope = np.exp(self._log_slope(parameters))[..., np.newaxis, :]
        integrands = slope * np.vander(_T, self.order, increasing=True).T
        # One product for all curves takes a third of the time of one for each.
        flat = integrands.reshape(-1, _POINTS) @ _integral_to(x.tobytes()).T
        by_q = flat.reshape((*integrands.shape[:-1], x.size))
        by_a = np.ones((*by_q.shape[:-2], 1, x.size))
        return np.moveaxis(np.concatenate([by_a, by_q], axis=-2), -2, -1)

    def _log_slope(self, parameters: Floats) -> Floats:
        """Ln F' at the points of integration, shape (..., K)."""
        if self.order == 0:
            return np.zeros((*parameters.shape[:-1], _POINTS))
        return polynomial(_T, parameters[..., 1:]) * _T_LOG_T


@lru_cache(maxsize=8)
def _integral_to(irradiance: bytes) -> Floats:
    """Matrix that takes φ at the points of integration to ∫₀^I φ dt, shape (N, K).

    Solvers ask again and again for the same irradiances.
    """
    x = np.frombuffer(irradiance)
    basis = chebyshev.chebvander(2 * np.sqrt(x) - 1, _POINTS)
    matrix: Floats = basis @ _INTEGRAL
    return matrix


register_model(*(Gumbel(order=order) for order in range(HIGHEST_ORDER + 1)))
