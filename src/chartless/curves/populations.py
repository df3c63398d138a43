"""Populations of cameras: their priors, and how common each is.

Film and digital cameras respond differently, and renderers, scanners and video cameras use
published transfer functions. Each of these populations has a prior of its own. The prior of
a camera is their mixture, with weights for what its files are
(`chartless.evidence.origins`); evidence then changes the weights
(`chartless.inference.populations`). docs/design/0014-populations.md has the
measurements.
"""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from enum import Enum
from functools import cache
from importlib import resources

import numpy as np

from chartless.curves.curve import AbstractCurve
from chartless.curves.named import named_curve
from chartless.curves.prior import (
    N_BINS,
    CurvePrior,
    LogSlopeBasis,
    bin_edges,
    grouped_basis,
    log_slopes_of,
    mixed,
)
from chartless.curves.transfer import TRANSFER_FUNCTIONS
from chartless.errors import ParameterError, UnknownNameError
from chartless.types import Floats

_PLAIN, _EXPONENTS = ("linear", "srgb", "rec709"), (0.4, 0.45, 0.5, 0.55)
_NOT_LOG = (*_PLAIN, "adobergb", "hlg")
# Share of DoRF's deviations in the priors of published functions, for curves that are nearly
# such: without them the band from raw pairs of an sRGB camera held 0.86 of its levels
# within three deviations, with them all.
_UNLIKE = 0.1


class Population(Enum):
    """Cameras that a prior describes; the value is its name, and that of its data if any."""

    DIGITAL = "digital"
    """Pictures of digital cameras, as they come from the camera."""
    DORF = "dorf"
    """Film and cameras of the last century: the Database of Response Functions."""
    GAMMA = "gamma"
    """Plain transfer functions: linear, sRGB, Rec. 709 and powers."""
    LOG = "log"
    """Log curves of video cameras, as published."""


@dataclass(frozen=True, slots=True)
class PopulationWeights:
    """How probable each population is before any evidence, up to a common factor.

    Raises
    ------
    ParameterError
        If a weight is negative or not finite, or none is above 0.
    """

    digital: float = 0.0
    dorf: float = 0.0
    gamma: float = 0.0
    log: float = 0.0

    def __post_init__(self) -> None:
        weights = astuple(self)
        if not all(0 <= each < np.inf for each in weights) or not any(weights):
            msg = f"weights of populations are 0 or above, and one of them above 0, not {weights}"
            raise ParameterError(msg)

    @classmethod
    def parsed(cls, text: str) -> "PopulationWeights":
        """Weights from names and weights such as ``digital:3,dorf:1``; alone, a name has 1.

        Raises
        ------
        UnknownNameError
            If a name is not that of a population.
        ParameterError
            If a weight is no number, or a name is given twice.
        """
        weights: dict[str, float] = {}
        for part in text.split(","):
            name, _, weight = part.strip().partition(":")
            known = [each.value for each in Population]
            if name not in known:
                kind = "population"
                raise UnknownNameError(kind, name, known)
            if name in weights:
                msg = f"population {name!r} is given twice"
                raise ParameterError(msg)
            try:
                weights[name] = float(weight or 1)
            except ValueError:
                msg = f"the weight of a population is a number, not {weight!r}"
                raise ParameterError(msg) from None
        return cls(**weights)

    @property
    def most_common(self) -> Population:
        """Population of the largest weight."""
        weights = astuple(self)
        return list(Population)[weights.index(max(weights))]

    def prior(
        self, n_levels: int = N_BINS, *, replaced: Mapping[Population, CurvePrior] | None = None
    ) -> CurvePrior:
        """Mixture of the priors of the populations.

        Parameters
        ----------
        n_levels : int
        replaced : mapping from Population to CurvePrior, optional
            Priors instead of those of the package, for experiments that leave cameras out.
        """
        if replaced is None:
            return _mixture(self, n_levels)
        return _mixed(self, n_levels, replaced)


@cache
def population_prior(population: Population, n_levels: int = N_BINS) -> CurvePrior:
    """Prior of a population of cameras."""
    return population_basis(population).prior(n_levels)


def measured_prior(n_levels: int = N_BINS) -> CurvePrior:
    """Prior of the 190 distinct curves of the Database of Response Functions."""
    return population_prior(Population.DORF, n_levels)


@cache
def population_basis(population: Population) -> LogSlopeBasis:
    """Basis of a population, from data of the package or from published functions."""
    if population is Population.GAMMA:
        powers = [named_curve(f"gamma:{exponent}") for exponent in _EXPONENTS]
        others = [[TRANSFER_FUNCTIONS[name].curve] for name in _PLAIN]
        return _basis_of([*others, powers])
    if population is Population.LOG:
        return _basis_of(
            [[each.curve] for name, each in TRANSFER_FUNCTIONS.items() if name not in _NOT_LOG]
        )
    file = resources.files("chartless.curves").joinpath(f"{population.value}.npz")
    with file.open("rb") as stream:
        arrays = np.load(stream, allow_pickle=False)
        mean, components = (arrays[name].astype(np.float64) for name in ("mean", "components"))
    return LogSlopeBasis(mean, components)


def _basis_of(groups: Sequence[Sequence[AbstractCurve]]) -> LogSlopeBasis:
    """Mean and components of the log slopes of curves, each group counted once."""
    edges = bin_edges(N_BINS)
    return grouped_basis(
        [[_log_slopes(curve, edges) for curve in group] for group in groups],
        _UNLIKE * population_basis(Population.DORF).components,
    )


def _log_slopes(curve: AbstractCurve, edges: Floats) -> Floats:
    light = curve.inverse(edges).clip(0.0, 1.0)
    return log_slopes_of((light - light[0]) / (light[-1] - light[0]))


@cache
def _mixture(weights: PopulationWeights, n_levels: int) -> CurvePrior:
    return _mixed(weights, n_levels, {})


def _mixed(
    weights: PopulationWeights, n_levels: int, replaced: Mapping[Population, CurvePrior]
) -> CurvePrior:
    parts = [
        (weight, replaced.get(population) or population_prior(population, n_levels))
        for population, weight in zip(Population, astuple(weights), strict=True)
        if weight
    ]
    return parts[0][1] if len(parts) == 1 else mixed(parts)
