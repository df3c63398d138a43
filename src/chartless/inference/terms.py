"""The parts of which a log-likelihood is the sum: each kind of evidence, with unknowns of its own.

All parts see one curve, by its edges, and one noise. Level pairs of one exposure need the
distribution of light in the scene besides, those of different exposures a scatter and perhaps the
exposures themselves: unknowns that no other part sees.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.evidence.bracket.likelihood import ExposureCounts, ExposureModel
from chartless.evidence.noise.likelihood import (
    Expansion,
    PairCounts,
    PairModel,
    Scene,
    scene_precision,
)
from chartless.evidence.noise.stabilised import on_even_scale
from chartless.noise import AffineNoise
from chartless.types import Bools, Floats


class AbstractFit(ABC):
    """One part at one state of knowledge."""

    @abstractmethod
    def log_likelihood(self) -> float:
        """Logarithm of the probability of what was counted."""

    @property
    @abstractmethod
    def firm(self) -> float:
        """What of it is to be believed at full weight about the ratio of the noise parameters."""

    @abstractmethod
    def expand(self, mix: Floats) -> Expansion:
        """Log-likelihood, gradient and information in (edges, noise, own unknowns).

        Parameters
        ----------
        mix : ndarray, shape (D, 2)
            How (ln u, ln v) change with each of the D unknowns of the noise.
        """


class AbstractTerm(ABC):
    """One kind of evidence, counted."""

    @property
    @abstractmethod
    def own_mean(self) -> Floats:
        """Prior mean of the own unknowns, shape (N,)."""

    @property
    @abstractmethod
    def own_precision(self) -> Floats:
        """Inverse of their prior covariance, shape (N, N)."""

    @property
    def own_held(self) -> Bools:
        """Own unknowns that stay at their mean, shape (N,): what else is found errs with them."""
        return np.zeros(self.own_mean.size, dtype=bool)

    @abstractmethod
    def fit(self, edges: Floats, noise: AffineNoise, own: Floats) -> AbstractFit:
        """Part of the likelihood at a state."""

    def normalised(self, own: Floats) -> Floats:
        """Own unknowns without what makes no difference."""
        return own


@final
@dataclass(frozen=True, slots=True, eq=False)
class PairTerm(AbstractTerm):
    """Level pairs of one exposure; its own unknowns are the log-weights of the scene."""

    counts: PairCounts
    n_nodes: int

    @property
    @override
    def own_mean(self) -> Floats:
        return np.zeros(self.n_nodes)

    @property
    @override
    def own_precision(self) -> Floats:
        return scene_precision(self.n_nodes)

    @override
    def fit(self, edges: Floats, noise: AffineNoise, own: Floats) -> "PairFit":
        nodes = on_even_scale(self.n_nodes, noise.ratio)
        return PairFit(PairModel(edges, noise, Scene(nodes, own)), self.counts)

    @override
    def normalised(self, own: Floats) -> Floats:
        return np.asarray(own - own.mean())


@final
@dataclass(frozen=True, slots=True, eq=False)
class PairFit(AbstractFit):
    """Level pairs of one exposure and their model."""

    model: PairModel
    counts: PairCounts

    @override
    def log_likelihood(self) -> float:
        return self.model.log_likelihood(self.counts)

    @property
    @override
    def firm(self) -> float:
        dark = self.counts.dark
        return float(dark @ np.log(self.model.dark)) if dark.any() else 0.0

    @override
    def expand(self, mix: Floats) -> Expansion:
        return self.model.expand(self.counts, mix @ self.model.noise_directions)


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExposureTerm(AbstractTerm):
    """Level pairs of different exposures."""

    counts: ExposureCounts

    @property
    @override
    def own_mean(self) -> Floats:
        return self.counts.own_mean

    @property
    @override
    def own_precision(self) -> Floats:
        return self.counts.own_precision

    @property
    @override
    def own_held(self) -> Bools:
        return self.counts.own_held

    @override
    def fit(self, edges: Floats, noise: AffineNoise, own: Floats) -> "ExposureFit":
        return ExposureFit(ExposureModel(self.counts, edges, noise, own))


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExposureFit(AbstractFit):
    """Level pairs of different exposures and their model."""

    model: ExposureModel

    @override
    def log_likelihood(self) -> float:
        return self.model.log_likelihood()

    @property
    @override
    def firm(self) -> float:
        return self.model.log_likelihood()

    @override
    def expand(self, mix: Floats) -> Expansion:
        return self.model.expand(mix)
