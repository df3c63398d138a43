"""Curve without evidence: a constant likelihood, and the estimate from a prior alone."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from typing_extensions import override

from chartless.curves import SampledCurve
from chartless.curves.space import FreeCurve
from chartless.inference.block import Block, Values, curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.posterior import at_levels, at_mode
from chartless.inference.search import maximise
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class ConstantTerm(AbstractTerm):
    """Term that reads a curve and does not depend on it: the posterior is the prior."""

    channel: str

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return (curve_name(self.channel),)

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        return ()

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "ConstantFit":
        return ConstantFit(edges[curve_name(self.channel)].size)


@final
@dataclass(frozen=True, slots=True)
class ConstantFit(AbstractFit):
    """The constant, 0."""

    n_edges: int

    @override
    def log_likelihood(self) -> float:
        return 0.0

    @override
    def expand(self) -> Expansion:
        n = self.n_edges
        return Expansion(0.0, np.zeros(n), np.zeros((n, n)))


def typical_estimate(space: FreeCurve) -> CurveEstimate:
    """Typical curve of a prior, with the bands of the prior."""
    channel = "Y"
    found = ChannelMode(
        maximise([ConstantTerm(channel)], {curve_name(channel): space}, {}), channel
    )
    return with_mode(CurveEstimate.of(at_mode(found, space, skewed=True), space), found)


def with_mode(estimate: CurveEstimate, found: ChannelMode) -> CurveEstimate:
    """Return an estimate with the curve of the mode instead of the mean of light.

    Where little is known, next to white, the steepest curves dominate a mean of light.
    """
    curve = SampledCurve.from_inverse(at_levels(found.edges))
    light = curve.inverse(np.linspace(0.0, 1.0, estimate.inverse_lut.size))
    return replace(estimate, curve=curve, inverse_lut=light)
