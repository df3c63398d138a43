"""The toe-shoulder-gamma response of PPISP, which radiance fields are trained with."""

from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models._base import AbstractModel, Property, register_model
from chartless.types import Bools, Floats

_LEAST = np.array([0.3, 0.3, 0.1])  # of toe, shoulder and gamma
_ORDER = 3
_ROUNDING = 8 * np.finfo(np.float64).eps  # of an exponent that is meant to be 1
_STARTS = 3
# Where fits may start: what measured cameras have, and half and twice as much.
_TOES, _SHOULDERS = (0.4, 0.8, 1.5, 3.0, 6.0), (0.4, 0.8, 1.3, 2.5, 5.0)
_GAMMAS, _CENTERS = (0.15, 0.3, 0.5, 0.8, 1.3, 3.0), (-4.0, -2.5, -1.5, -0.5, 1.0, 3.0)


class _Shape(NamedTuple):
    """Numbers of the formula, each of shape (..., 1)."""

    toe: Floats
    shoulder: Floats
    gamma: Floats
    centre: Floats
    log_centre: Floats
    log_beyond: Floats
    """ln(1 − c)."""
    a: Floats
    b: Floats
    log_a: Floats
    log_b: Floats


@final
@dataclass(frozen=True, slots=True)
class Ppisp(AbstractModel):
    r"""Two power laws that meet at c, raised to a power: toe, shoulder, gamma and center.

    .. math::
        u(I) = \begin{cases}
            a \, (I/c)^t & I \le c \\
            1 - b \left(\frac{1 - I}{1 - c}\right)^s & I > c
        \end{cases}
        \qquad f = u^\gamma

    The parameters are the raw numbers that PPISP trains: t = 0.3 + softplus(toe), s = 0.3 +
    softplus(shoulder), γ = 0.1 + softplus(gamma), c = 1/(1 + e^−center). Deutsch et al.,
    *PPISP: Physically-plausible compensation and control of photometric variations in radiance
    field reconstruction* (2026), arXiv:2601.18336; the constants are those of its program
    (github.com/nv-tlabs/ppisp).

    Notes
    -----
    Values meet at c if a + b = 1 and slopes if a t / c = b s / (1 − c), which leaves

    .. math:: a = \frac{s c}{t + c (s - t)}, \qquad b = \frac{t (1 - c)}{t + c (s - t)}

    with the denominator that PPISP writes as ``lerp(toe, shoulder, center)``. The second
    derivative jumps at c. The slope at white is 0 for s > 1 and infinite for s < 1.

    Examples
    --------
    >>> model = Ppisp()
    >>> model.response([0.0, 0.18, 1.0], model.identity).round(12)
    array([0.  , 0.18, 1.  ])
    """

    family: ClassVar[str] = "ppisp"
    formula: ClassVar[str] = "(a (I/c)^t up to c, 1 - b ((1 - I)/(1 - c))^s beyond)^g"
    order: int = _ORDER

    def __post_init__(self) -> None:
        if self.order != _ORDER:
            msg = f"ppisp has the order {_ORDER} only, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def name(self) -> str:
        return self.family

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(Property) - {Property.EXTENSIBLE, Property.COMPACT}

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return ("toe", "shoulder", "gamma", "center")

    @property
    @override
    def identity(self) -> Floats:
        return _raw(np.ones(3), np.array(0.0))

    @override
    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:
        # Members alike have exponents unlike, and local minima lie between them: the nearest of
        # a grid with each gamma, and of these the best.
        candidates = _candidates()
        responses = self._response(irradiance, candidates.reshape(-1, self.n_parameters))
        cost = np.sum(responses**2, axis=1) - 2 * brightness @ responses.T
        cost = cost.reshape(len(brightness), *candidates.shape[:2])
        nearest = cost.argmin(axis=2)
        best = np.argsort(cost.min(axis=2), axis=1)[:, :_STARTS]
        starts: Floats = candidates[best, np.take_along_axis(nearest, best, axis=1)]
        return starts

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        shape = _shape(parameters)
        response = np.exp(shape.gamma * _log_u(x, shape)[0])
        response[..., x == 0] = 0.0
        return response

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        return self.evaluate(x, parameters)[1]

    @override
    def evaluate(self, irradiance: Floats, parameters: Floats) -> tuple[Floats, Floats]:
        shape = _shape(parameters)
        log_u, log_v = _log_u(irradiance, shape)
        response = np.exp(shape.gamma * log_u)
        below = _is_below(irradiance, shape)
        t, s, b = shape.toe, shape.shoulder, shape.b
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            log_x, log_rest = np.log(irradiance), np.log1p(-irradiance)
            ratio = -np.exp(log_v - log_u)  # d ln u / d ln v
            by_toe = np.where(below, log_x - shape.log_centre - b / t, ratio * shape.a / t)
            by_shoulder = np.where(
                below, b / s, ratio * (log_rest - shape.log_beyond - shape.a / s)
            )
            by_centre = np.where(
                below, b - t * np.exp(shape.log_beyond), ratio * (s * shape.centre - shape.a)
            )
            columns = [shape.gamma * each for each in (by_toe, by_shoulder)]
            columns += [log_u, shape.gamma * by_centre]
            gradient = response[..., np.newaxis] * np.stack(columns, axis=-1)
        inner = np.concatenate([_logistic(parameters[..., :3]), np.ones_like(shape.toe)], axis=-1)
        gradient *= inner[..., np.newaxis, :]
        for end in (0, 1):
            response[..., irradiance == end] = end
            gradient[..., irradiance == end, :] = 0.0
        return response, gradient

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        shape = _shape(parameters)
        log_u, log_v = _log_u(x, shape)
        t, s, gamma = shape.toe, shape.shoulder, shape.gamma
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            log_x, log_rest = np.log(x), np.log1p(-x)
            # In logarithms f/I stays finite where f and I both vanish.
            lower = gamma * t * np.exp(gamma * log_u - log_x)
            upper = gamma * s * np.exp((gamma - 1) * log_u + log_v - log_rest)
            slope = np.where(_is_below(x, shape), lower, upper)
            black = gamma * (shape.log_a - t * shape.log_centre)
            white = np.log(gamma * s) + shape.log_b - s * shape.log_beyond
            slope[x == 0] = _power_at_zero(gamma * t, black)
            slope[x == 1] = _power_at_zero(s, white)
        return slope

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        shape = _shape(parameters)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore"):
            log_u = np.log(y) / shape.gamma
            lower = np.exp(shape.log_centre + (log_u - shape.log_a) / shape.toe)
            log_w = (np.log(-np.expm1(log_u)) - shape.log_b) / shape.shoulder
            # 1 − (1 − c) w and c + (1 − c) (1 − w): the one with more digits.
            gained = (np.exp(log_u) - shape.a) / shape.b
            near = shape.centre - np.exp(shape.log_beyond) * np.expm1(
                np.log1p(-gained) / shape.shoulder
            )
            upper = np.where(gained < 0.5, near, -np.expm1(shape.log_beyond + log_w))  # noqa: PLR2004
        return np.where(log_u <= shape.log_a, lower, upper).clip(0.0, 1.0)


@cache
def _candidates() -> Floats:
    """Raw parameters of a grid of members, shape (gammas, others, 4)."""
    axes = np.meshgrid(_GAMMAS, _TOES, _SHOULDERS, _CENTERS, indexing="ij")
    gamma, toe, shoulder, center = (each.reshape(len(_GAMMAS), -1) for each in axes)
    return _raw(np.stack([toe, shoulder, gamma], axis=-1), center)


def _shape(parameters: Floats) -> _Shape:
    raw = parameters[..., np.newaxis, :]
    toe, shoulder, gamma = np.moveaxis(np.logaddexp(0.0, raw[..., :3]) + _LEAST, -1, 0)
    center = raw[..., 3]
    log_centre, log_beyond = -np.logaddexp(0.0, -center), -np.logaddexp(0.0, center)
    log_a = -np.logaddexp(0.0, np.log(toe / shoulder) - center)
    log_b = -np.logaddexp(0.0, np.log(shoulder / toe) + center)
    return _Shape(
        toe, shoulder, gamma, np.exp(log_centre), log_centre, log_beyond,
        np.exp(log_a), np.exp(log_b), log_a, log_b,
    )  # fmt: skip


def _is_below(x: Floats, shape: _Shape) -> Bools:
    """Whether the lower power law holds, (..., N); the upper one has f(1) = 1 if c rounds to 1."""
    return (x <= shape.centre) & (x < 1)


def _log_u(x: Floats, shape: _Shape) -> tuple[Floats, Floats]:
    """Ln u and, beyond the centre, ln(1 − u); each of shape (..., N)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        below = shape.log_a + shape.toe * (np.log(x) - shape.log_centre)
        log_v = shape.log_b + shape.shoulder * (np.log1p(-x) - shape.log_beyond)
        v = np.exp(log_v)
        # Near the centre 1 − v has few digits if a is small; a and what u gains have all.
        share = (x - shape.centre) / np.exp(shape.log_beyond)
        gain = -shape.b * np.expm1(shape.shoulder * np.log1p(-share))
        beyond = np.where(v < 0.5, np.log1p(-v), np.log(shape.a + gain))  # noqa: PLR2004
    return np.where(_is_below(x, shape), below, beyond), log_v


def _power_at_zero(exponent: Floats, log_factor: Floats) -> float:
    """Slope of factor · z^exponent at z = 0; the factor that of the slope if the exponent is 1."""
    excess = float(exponent[0]) - 1
    if abs(excess) <= _ROUNDING:
        return float(np.exp(log_factor[0]))
    return 0.0 if excess > 0 else np.inf


def _logistic(x: Floats) -> Floats:
    return np.exp(-np.logaddexp(0.0, -x))


def _raw(exponents: Floats, center: Floats) -> Floats:
    """Parameters, (..., 4), for t, s and γ, (..., 3), and the raw center, (...)."""
    softplus = exponents - _LEAST
    raw = softplus + np.log(-np.expm1(-softplus))
    return np.concatenate([raw, center[..., np.newaxis]], axis=-1)


register_model(Ppisp())
