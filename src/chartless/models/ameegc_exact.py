"""All monotone second-order EEGCs, and no others, without constraints on the parameters."""

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
class AmeegcExact(PolynomialExponentModel):
    r"""Exact monotone EEGC of order 2, with parameters a, s and c.

    An EEGC increases exactly where :math:`\psi' \le h`, :math:`h(I) = -1/(I \ln I)`. On
    (0, 1) h is convex and its slope runs over all reals, so the line
    :math:`\psi'(I) = \alpha_1 + 2\alpha_2 I` keeps below h exactly when it keeps below the
    tangent of equal slope. With the point of tangency t = 1/(1 + e^−c) and L = ln t

    .. math::
        \alpha_0 = a, \qquad
        \alpha_1 = h(t) - t h'(t) - s^2 = -\frac{2L + 1}{t L^2} - s^2, \qquad
        \alpha_2 = \frac{h'(t)}{2} = \frac{L + 1}{2 t^2 L^2}

    is one-to-one for s ≥ 0. At t = 1/e it is the first-order form α₁ = e − s².

    Examples
    --------
    >>> model = AmeegcExact()
    >>> model.response([0.0, 0.18, 1.0], model.identity).round(12)
    array([0.  , 0.18, 1.  ])
    """

    family: ClassVar[str] = "ameegc-exact"
    formula: ClassVar[str] = "I^exp(a + (h(t) - t h'(t) - s^2) I + h'(t)/2 I^2)"
    order: int = 2

    def __post_init__(self) -> None:
        if self.order != 2:  # noqa: PLR2004 - it is the order in the name
            msg = f"exact AMEEGC has the order 2 only, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def name(self) -> str:
        return "ameegc2-exact"

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - {Property.EXTENSIBLE}

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("a", "s", "c")

    @property
    @override
    def identity(self) -> Floats:
        return np.array([0.0, np.sqrt(np.e), -np.log(np.e - 1)])  # t = 1/e

    @property
    @override
    def bounds(self) -> tuple[Floats, Floats]:
        # Beyond |c| = 100 the tangent touches at 0 or 1 to the last bit of float64.
        greatest = np.array([np.inf, np.inf, 100.0])
        return -greatest, greatest

    @override
    def coefficients(self, parameters: Floats) -> Floats:
        a, s, c = np.moveaxis(parameters, -1, 0)
        log_t = -np.logaddexp(0.0, -c)
        t = np.exp(log_t)
        slope = -(2 * log_t + 1) / (t * log_t**2) - s**2
        return np.stack([a, slope, (log_t + 1) / (2 * t**2 * log_t**2)], axis=-1)

    @override
    def coefficient_jacobian(self, parameters: Floats) -> Floats:
        _, s, c = np.moveaxis(parameters, -1, 0)
        log_t = -np.logaddexp(0.0, -c)
        t = np.exp(log_t)
        curvature = -(2 * log_t**2 + 3 * log_t + 2) / (t * log_t) ** 3  # h''(t) > 0
        dt = t * np.exp(-np.logaddexp(0.0, c))  # dt/dc = t (1 − t)
        jacobian = np.zeros((*parameters.shape, 3))
        jacobian[..., 0, 0] = 1.0
        jacobian[..., 1, 1] = -2 * s
        jacobian[..., 1, 2] = -t * curvature * dt
        jacobian[..., 2, 2] = curvature * dt / 2
        return jacobian


register_model(AmeegcExact())
