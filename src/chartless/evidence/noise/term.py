"""Term of the posterior for level pairs of frames of one exposure."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.curves.space import AbstractCurveSpace
from chartless.evidence.noise.likelihood import PairCounts, PairModel, Scene, scene_precision
from chartless.inference.block import Block, Values, curve_name
from chartless.inference.noise_block import NoiseBlock
from chartless.inference.stabilised import on_even_scale
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.types import Floats

PAIR_WEIGHT = 0.2
"""Weight of a pair of pixels in the likelihood: it keeps an imperfect model from being
overconfident, see docs/design/0006-likelihood.md."""
RIDGE_PAIRS = 10_000
"""Largest number of weighted pairs that distinguish ratios of the noise parameters.
They do so by how sharply the histogram of the scene rises and falls, and scenes differ
from the model for any number of pixels."""


def scene_name(channel: str) -> str:
    """Name of the block of the scene of a channel."""
    return f"scene/{channel}"


@final
@dataclass(frozen=True, slots=True, eq=False)
class PairTerm(AbstractTerm):
    """Level pairs of one exposure; its own unknowns are the log-weights of the scene."""

    counts: PairCounts
    n_nodes: int
    noise: NoiseBlock

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return (curve_name(self.noise.channel),)

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        scene = Block(
            scene_name(self.noise.channel),
            np.zeros(self.n_nodes),
            scene_precision(self.n_nodes),
            centred=True,
        )
        return self.noise.block, scene

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "PairFit":
        channel = self.noise.channel
        noise = self.noise.noise(values)
        scene = Scene(on_even_scale(self.n_nodes, noise.ratio), values[scene_name(channel)])
        model = PairModel(edges[curve_name(channel)], noise, scene)
        return PairFit(model, self.counts, self.noise.mix)


@final
@dataclass(frozen=True, slots=True, eq=False)
class PairFit(AbstractFit):
    """Level pairs of one exposure and their model."""

    model: PairModel
    counts: PairCounts
    mix: Floats
    """Derivatives of (ln u, ln v) by each unknown of the noise, shape (D, 2)."""

    @override
    def log_likelihood(self) -> float:
        return self.model.log_likelihood(self.counts)

    @property
    @override
    def firm(self) -> float:
        """Log-likelihood of dark frames."""
        dark = self.counts.dark
        return float(dark @ np.log(self.model.dark)) if dark.any() else 0.0

    @override
    def expand(self) -> Expansion:
        return self.model.expand(self.counts, self.mix @ self.model.noise_directions)


def ridge_share(counts: PairCounts, space: AbstractCurveSpace) -> float:
    """Weight of the pairs' evidence along the ridge, 0 … 1."""
    if not space.uses_ratio:
        return 0.0
    return min(1.0, RIDGE_PAIRS / max(counts.weight * counts.n_pairs, 1.0))
