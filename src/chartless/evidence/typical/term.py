"""Term of a log-likelihood that is constant."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.inference.block import Block, Values, curve_name
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
