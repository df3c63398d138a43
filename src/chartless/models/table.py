"""A free table of ln g over the levels, kept smooth: the family of Debevec and Malik."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models._base import Property, register_model
from chartless.models._inverse_nodes import InverseNodesModel
from chartless.types import Bools, Floats

_LEAST_STEP = 1e-9  # of ln g from one level to the next, in the solver
_MOST_LOG = 700.0


@final
@dataclass(frozen=True, slots=True)
class Table(InverseNodesModel):
    r"""ln g at each level between black and white, with a smoothness weight.

    Debevec and Malik, *Recovering high dynamic range radiance maps from photographs*
    (SIGGRAPH 1997), eq. 3: fits minimise the squared error in brightness plus
    :math:`\lambda \sum_z (\Delta^2 \ln g(z))^2`. Here g(0) = 0 and g(1) = 1, and the table
    must increase; between two levels g is a straight line.

    Parameters
    ----------
    order : int
        Two fewer than the table has levels, less one: a free number for each inner level.
    smoothness : float
        λ, the weight of the squared second differences.
    """

    family: ClassVar[str] = "table"
    constrained: ClassVar[bool] = True
    condition: ClassVar[str] = "that never decrease and end at 0 or below"
    formula: ClassVar[str] = "inverse of exp(t(level)), a free number for each level"
    order: int = 253
    smoothness: float = 1e-5

    def __post_init__(self) -> None:
        if self.order < 1:
            msg = f"a table has two inner levels or more, not {self.order + 1}"
            raise ParameterError(msg)
        if not self.smoothness > 0:
            msg = f"smoothness must be above 0, not {self.smoothness:g}"
            raise ParameterError(msg)

    @property
    @override
    def name(self) -> str:
        return self.family

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.MONOTONE, Property.BOUNDED})

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"t{level}" for level in range(1, self.order + 2))

    @property
    @override
    def identity(self) -> Floats:
        return np.log(np.arange(1, self.order + 2) / (self.order + 2))

    @property
    @override
    def penalty(self) -> Floats:
        # ln g is 0 at white and −∞ at black, which no second difference reaches.
        rows = np.diff(np.eye(self.order + 2), n=2, axis=0)[:, :-1]
        return np.asarray(np.sqrt(self.smoothness) * rows)

    @override
    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:
        level = np.linspace(0, 1, self.order + 3)[1:-1]
        starts = np.empty((len(brightness), 1, self.order + 1))
        for start, curve in zip(starts, brightness, strict=True):
            measured = np.interp(level, np.maximum.accumulate(curve), irradiance)
            log = np.log(measured.clip(1e-6, 1))
            falling = np.arange(self.order, -1, -1)
            # Strictly increasing and below ln 1, as the constraint asks.
            start[0] = log - 1e-6 * (falling + 1)
        return starts

    @override
    def repaired(self, parameters: Floats) -> Floats:
        return np.maximum.accumulate(np.minimum(parameters, 0.0), axis=-1)

    @override
    def admits(self, parameters: Floats) -> Bools:
        white = np.zeros((*parameters.shape[:-1], 1))
        with np.errstate(invalid="ignore"):
            steps = np.diff(np.concatenate([parameters, white], axis=-1))
        # NaN compares false, −∞ has an infinite step
        return np.asarray(np.all((steps >= 0) & (steps < np.inf), axis=-1))

    @override
    def inequalities(self, parameters: Floats) -> tuple[Floats, Floats]:
        size = self.order + 1
        rows = np.eye(size) - np.eye(size, k=1)
        return rows, np.full(size, -_LEAST_STEP)

    @override
    def _nodes(self, parameters: Floats) -> Floats:
        return np.concatenate([[0.0], np.exp(parameters.clip(-_MOST_LOG, 0)), [1.0]])

    @override
    def _node_gradient(self, parameters: Floats) -> Floats:
        gradient = np.zeros((self.order + 3, self.order + 1))
        inner = np.arange(self.order + 1)
        gradient[inner + 1, inner] = np.exp(parameters.clip(-_MOST_LOG, 0))
        return gradient


register_model(Table())
