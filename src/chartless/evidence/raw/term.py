"""Term of the posterior for JPEG levels given the light of raw files.

The scatter of the blocks, and with it their weights, is measured again after each look.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from typing_extensions import override

from chartless.evidence.raw.likelihood import RawModel, Shown
from chartless.inference.block import Block, Values, curve_name
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.types import Floats

_MOST_LOOKS, _SETTLED = 12, 0.003  # change of ln of the scatter between looks


def raw_name(channel: str) -> str:
    """Name of the block of unknowns between raw files and irradiance in a channel."""
    return f"raw/{channel}"


@final
@dataclass(frozen=True, slots=True, eq=False)
class RawTerm(AbstractTerm):
    """Levels of blocks in one channel, given their light."""

    model: RawModel
    channel: str
    scatter: float = math.inf
    """Relative deviation of the irradiance of grey blocks from that of the curve."""
    variance: Floats | None = None
    """Variance of the level of each block, shape (N,), from the last look; None before
    the first."""
    share: Floats | None = None
    """Weight of each block, likewise."""
    inner: bool = False
    """Whether blocks predicted close to black or white are left out."""
    looks: int = 0

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return (curve_name(self.channel),)

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        precision = self.model.own_precision
        return (Block(raw_name(self.channel), np.zeros(len(precision)), precision),)

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "RawFit":
        assert self.variance is not None
        assert self.share is not None
        shown = self._shown(edges, values)
        return RawFit(self.model, shown, self.variance, self.share)

    @override
    def first_look(self, edges: Mapping[str, Floats], values: Values) -> "RawTerm":
        shown = self._shown(edges, values)
        scatter = self.model.scatter(shown)
        variance = self.model.variance(shown, scatter)
        return replace(self, scatter=scatter, variance=variance, share=self.model.share)

    @override
    def informed(self, edges: Mapping[str, Floats], values: Values) -> "RawTerm":
        shown = self._shown(edges, values)
        # Only decrease it, or weights and scatter could oscillate.
        scatter = min(self.scatter, self.model.scatter(shown))
        settled = math.log(self.scatter / scatter) < _SETTLED
        enough = settled or self.looks >= _MOST_LOOKS
        if enough and self.inner:
            return self
        variance = self.model.variance(shown, scatter)
        share = self.share
        if enough:
            share = self.model.inner_share(shown, variance)
        elif share is None:
            share = self.model.share
        return replace(
            self,
            scatter=scatter,
            variance=variance,
            share=share,
            inner=enough or self.inner,
            looks=self.looks + 1,
        )

    def _shown(self, edges: Mapping[str, Floats], values: Values) -> Shown:
        return self.model.shown(edges[curve_name(self.channel)], values[raw_name(self.channel)])


@final
@dataclass(frozen=True, eq=False)
class RawFit(AbstractFit):
    """Model of the blocks at one state of the unknowns."""

    model: RawModel
    shown: Shown
    variance: Floats
    share: Floats

    @cached_property
    def _cost(self) -> float:
        return self.model.cost(self.shown, self.variance, self.share)

    @override
    def log_likelihood(self) -> float:
        return -self._cost

    @override
    def expand(self) -> Expansion:
        gradient, information = self.model.normal(self.shown, self.variance, self.share)
        return Expansion(-self._cost, -gradient, information)
