"""Term of the posterior for measured points."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from typing_extensions import override

from chartless.evidence.points.likelihood import PointModel
from chartless.inference.block import Block, Values, curve_name
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.types import Floats

USUAL_SCATTER, SCATTER_SPREAD = 0.01, 1.0
"""Prior median of σ, and deviation of ln σ: charts have reflectances good to 1 %."""
_ANY_SCALE, _EXACT_SCALE = 5.0, 1e-4  # deviation of ln k
_MOST_LOOKS, _SETTLED = 5, 0.02  # change of ln of a slope between looks


def points_name(channel: str) -> str:
    """Name of the block of factor and scatter of points in a channel."""
    return f"points/{channel}"


@final
@dataclass(frozen=True, slots=True, eq=False)
class PointTerm(AbstractTerm):
    """Light of points in one channel, given their brightness."""

    model: PointModel
    channel: str
    absolute: bool
    """Whether the factor k is 1."""
    slope: Floats | None = None
    """g' at the points, from the last look; None before the first."""
    looks: int = 0

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return (curve_name(self.channel),)

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        deviations = np.array([_EXACT_SCALE if self.absolute else _ANY_SCALE, SCATTER_SPREAD])
        mean = np.array([0.0, np.log(USUAL_SCATTER)])
        return (Block(points_name(self.channel), mean, np.diag(deviations**-2.0)),)

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "PointFit":
        assert self.slope is not None
        own = values[points_name(self.channel)]
        return PointFit(self.model, edges[curve_name(self.channel)], own, self.slope)

    @override
    def first_look(self, edges: Mapping[str, Floats], values: Values) -> "PointTerm":
        return replace(self, slope=self.model.slope(edges[curve_name(self.channel)]))

    @override
    def informed(self, edges: Mapping[str, Floats], values: Values) -> "PointTerm":
        slope = self.model.slope(edges[curve_name(self.channel)])
        changed = self.slope is None or np.abs(np.log(slope / self.slope)).max() > _SETTLED
        if not changed or self.looks >= _MOST_LOOKS:
            return self
        return replace(self, slope=slope, looks=self.looks + 1)


@final
@dataclass(frozen=True, eq=False)
class PointFit(AbstractFit):
    """Model of the points at one state of the unknowns."""

    model: PointModel
    edges: Floats
    own: Floats
    slope: Floats

    @cached_property
    def _expansion(self) -> Expansion:
        return self.model.expand(self.edges, self.own, self.slope)

    @override
    def log_likelihood(self) -> float:
        return self._expansion.value

    @override
    def expand(self) -> Expansion:
        return self._expansion
