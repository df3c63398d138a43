"""Term of the posterior for level pairs of different exposures."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from typing_extensions import override

from chartless.evidence.bracket.likelihood import ExposureCounts, ExposureModel
from chartless.inference.block import Block, Values, curve_name
from chartless.inference.noise_block import NoiseBlock
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.noise import CAMERAS_OF_2008
from chartless.types import Floats

EXPOSURES = "exposures"
"""Name of the block of changes of each ln t from its given value, common to all
channels."""


def scatter_name(channel: str) -> str:
    """Name of the block of ln κ of a channel."""
    return f"scatter/{channel}"


def noise_between_name(channel: str) -> str:
    """Name of the block of noise between exposures, if frame noise is known better."""
    return f"noise between exposures/{channel}"


def noise_factor_name(channel: str) -> str:
    """Name of the block of the ln factor of that noise, once its shares are known."""
    return f"noise factor/{channel}"


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExposureTerm(AbstractTerm):
    """Level pairs of different exposures in one channel."""

    counts: ExposureCounts
    channel: str

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return (curve_name(self.channel),)

    @property
    def _noise(self) -> NoiseBlock | None:
        """Noise of frames; None if the counts have noise of their own."""
        return None if self.counts.own_noise else NoiseBlock(self.channel, CAMERAS_OF_2008)

    @property
    def _own(self) -> dict[str, slice]:
        """Names of the own unknowns, in their order, with their places."""
        first, end = self.counts.first_change, self.counts.own_mean.size
        of_noise = noise_factor_name if self.counts.has_relative_noise else noise_between_name
        places = {
            scatter_name(self.channel): slice(0, 1),
            of_noise(self.channel): slice(1, first),
            EXPOSURES: slice(first, end),
        }
        return {name: place for name, place in places.items() if place.start != place.stop}

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        counts = self.counts
        own = (
            Block(
                name,
                counts.own_mean[place],
                counts.own_precision[place, place],
                held=bool(counts.own_held[place].any()),
            )
            for name, place in self._own.items()
        )
        return (*(() if self._noise is None else (self._noise.block,)), *own)

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "ExposureFit":
        noise = None if self._noise is None else self._noise.noise(values)
        own = np.concatenate([values[name] for name in self._own])
        model = ExposureModel(self.counts, edges[curve_name(self.channel)], noise, own)
        return ExposureFit(model, self)

    @override
    def first_look(self, edges: Mapping[str, Floats], values: Values) -> "ExposureTerm":
        """Return the term with the tables conditioned on the longer exposure only.

        Conditioning on a shorter exposure multiplies its noise.
        """
        del edges, values
        return replace(self, counts=replace(self.counts, tables=self.counts.forward))

    @override
    def informed(self, edges: Mapping[str, Floats], values: Values) -> "ExposureTerm":
        """Return the term with weights, shifts and noise of rows, set only once."""
        if self.counts.tables[0].weight is not None:
            return self
        return replace(self, counts=self.fit(edges, values).model.informed())


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExposureFit(AbstractFit):
    """Level pairs of different exposures and their model."""

    model: ExposureModel
    term: ExposureTerm

    @override
    def log_likelihood(self) -> float:
        return self.model.log_likelihood()

    @override
    def expand(self) -> Expansion:
        return self.model.expand(np.zeros((0, 2)) if self.term.counts.own_noise else np.eye(2))
