"""Search of the source paper: alternate between curve and noise, a few steps each."""

import math
from dataclasses import dataclass, field
from functools import partial
from typing import final

import numpy as np
from typing_extensions import override

from chartless._numeric.optimize import Minimum, nelder_mead
from chartless.curves import ModelCurve
from chartless.curves.whitening import whitening
from chartless.errors import ParameterError, UnknownNameError
from chartless.evidence.base import ChannelEvidence
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.flags import Flag
from chartless.methods._base import CALIBRATORS, AbstractChannelCalibrator, ChannelProgress
from chartless.methods.ism.objectives import OBJECTIVES, BinnedPairs, half_levels
from chartless.models import AbstractModel, AmeegcExact
from chartless.noise import AffineNoise
from chartless.result.response import Response, SearchHistory, Status
from chartless.types import Floats

# Limits of the noise search in 8-bit units. U of cameras lies in 0.01 … 0.5, V in 0.1 … 100
# (the source paper simulates 0.01 … 0.06 and 9 … 25).
_LEAST_8BIT, _MOST_8BIT = (1e-3, 1e-2), (1e1, 1e4)
# A search stopped at the limit of rounds is flagged if its last round gained more than this.
_STILL_IMPROVING = 1e-3
# Share of the attainable similarity below which the model does not explain the pairs. Of 40
# simulated cameras 37 reach 0.9; the others are the worst estimates.
_POOR = 0.85


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FoundCurve:
    """Result of a search."""

    parameters: Floats
    """Parameters of the curve, shape (P,)."""
    noise: AffineNoise
    status: Status
    attained: float | None
    """Similarity as a share of what the true model would reach; None if not a cosine."""
    history: SearchHistory


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SimilaritySearch(AbstractChannelCalibrator):
    """Maximise image similarity by rounds of Nelder–Mead on noise and curve in turn.

    Rounds, iterations and start are those of the source paper. The size of the first
    simplex, its shrinking, the order (noise first) and early stopping are ours: the
    paper does not give them. With simplices of constant size the search stalls after a
    few rounds.

    Parameters
    ----------
    model : AbstractModel
        Family of curves.
    objective : str
        Name in `OBJECTIVES`: "bin" or "sampled".
    rounds : int
        Most rounds, each of one search over the noise and one over the curve.
    iterations : int
        Iterations of each of these searches.
    start : (float, float)
        Noise U, V to start from, in 8-bit units; the curve starts as f(I) = I.
    curve_step : float
        Size of the first simplex in whitened curve parameters: 1 is a standard
        deviation among cameras.
    noise_step : float
        Size of the first simplex in ln u and ln v.
    shrink : float
        Factor on both steps from one round to the next.
    tolerance : float
        The search has converged when two rounds, and one more with steps of the first size,
        gain less than this. With 0 all rounds are run.

    Raises
    ------
    ParameterError
        If a setting is out of range.
    """

    model: AbstractModel = field(default_factory=AmeegcExact)
    objective: str = "bin"
    rounds: int = 15
    iterations: int = 10
    start: tuple[float, float] = (0.06, 1.0)
    curve_step: float = 0.5
    noise_step: float = 0.5
    shrink: float = 0.9
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("rounds", "iterations"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < 1:
                msg = f"{name} must be a whole number above 0, not {value!r}"
                raise ParameterError(msg)
        for name, most in (("curve_step", 10.0), ("noise_step", 10.0), ("shrink", 1.0)):
            value = getattr(self, name)
            if not 0 < value <= most:
                msg = f"{name} must lie above 0 and not above {most:g}, not {value!r}"
                raise ParameterError(msg)
        if not 0 <= self.tolerance < math.inf:
            msg = f"tolerance must not be negative, not {self.tolerance!r}"
            raise ParameterError(msg)
        if self.objective not in OBJECTIVES:
            kind = "objective"
            raise UnknownNameError(kind, self.objective, OBJECTIVES)
        AffineNoise.from_8bit(*self.start)  # raises if the noise is invalid

    @property
    @override
    def method(self) -> str:
        return f"ism-{self.objective}"

    @override
    def _estimate(self, evidence: ChannelEvidence, progress: ChannelProgress | None) -> Response:
        table = evidence[LevelPairs].table
        found = self.search(table, progress=progress)
        curve = ModelCurve(self.model.name, tuple(map(float, found.parameters)))
        response = Response(
            name=evidence.channel,
            curve=curve,
            noise=found.noise,
            n_levels=table.n_levels,
            observed_levels=table.observed_levels,
            n_pairs=table.n_pairs,
            method=self.method,
            status=found.status,
            accounts=(account_of_pairs(table, similarity=found.attained),),
            history=found.history,
        )
        values = found.history.values
        still_improving = values[-1] - values[-2] > _STILL_IMPROVING * abs(values[-1])
        unfinished = found.status is Status.LIMIT_REACHED and still_improving
        doubts = (
            (Flag.SEARCH_UNFINISHED, unfinished),
            (Flag.NOISE_AT_BOUND, _at_limit(np.log([found.noise.slope, found.noise.floor]))),
            (Flag.MISFIT, found.attained is not None and found.attained < _POOR),
            (Flag.NOT_MONOTONE, bool(np.any(np.diff(response.response_lut) < 0))),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))

    def search(
        self, table: Cooccurrence, *, progress: ChannelProgress | None = None
    ) -> "FoundCurve":
        """Find the curve and the noise that explain a table, without judging them."""
        objective = OBJECTIVES[self.objective]
        pairs = objective.prepare(table.symmetric)
        brightness = half_levels(table.n_levels)
        whitened = whitening(self.model)

        def inverse(curve: Floats) -> Floats:
            return self.model.inverse(brightness, whitened.colour(curve))

        def cost(inverse: Floats, log_noise: Floats) -> float:
            return -objective.evaluate(pairs, inverse, _noise(log_noise))

        def cost_of_curve(curve: Floats, log_noise: Floats) -> float:
            admitted = self.model.admits(whitened.colour(curve))
            return cost(inverse(curve), log_noise) if admitted else np.inf

        curve = whitened.whiten(self.model.identity)
        log_noise = _log_noise(*self.start)
        values = [-cost(inverse(curve), log_noise)]
        evaluations = 1
        age = 0  # rounds since the steps had their first size
        status = Status.LIMIT_REACHED
        while len(values) <= self.rounds:
            scale = self.shrink**age
            noise_found = self._search(
                partial(cost, inverse(curve)), log_noise, self.noise_step * scale
            )
            log_noise = _within_limits(noise_found.x)
            curve_found = self._search(
                partial(cost_of_curve, log_noise=log_noise), curve, self.curve_step * scale
            )
            curve = curve_found.x
            values.append(-curve_found.value)
            evaluations += noise_found.evaluations + curve_found.evaluations
            if progress is not None:
                progress((len(values) - 1) / self.rounds)
            gains = np.diff(values[-3:])
            if age == 0 and len(values) > 2 and gains[-1] < self.tolerance:  # noqa: PLR2004
                status = Status.CONVERGED
                break
            quiet = gains.size == 2 and bool(np.all(gains < self.tolerance))  # noqa: PLR2004
            age = 0 if quiet else age + 1

        if progress is not None and len(values) <= self.rounds:
            progress(1.0)
        return FoundCurve(
            parameters=whitened.colour(curve),
            noise=_noise(log_noise),
            status=status,
            attained=_attained(pairs, values[-1]),
            history=SearchHistory(self.objective, tuple(values), evaluations),
        )

    def _search(self, cost: "partial[float]", start: Floats, step: float) -> Minimum:
        steps = np.full(start.size, step)
        return nelder_mead(cost, start, steps=steps, max_iterations=self.iterations)


def _attained(pairs: object, value: float) -> float | None:
    """Similarity as a share of what the true model would reach; None if not a cosine."""
    if not isinstance(pairs, BinnedPairs) or pairs.ceiling == 0:
        return None
    return min(1.0, value / pairs.ceiling)


def _log_noise(slope: float, floor: float) -> Floats:
    noise = AffineNoise.from_8bit(slope, floor)
    return np.log([max(noise.slope, np.finfo(float).tiny), noise.floor])


_LOG_LEAST, _LOG_MOST = _log_noise(*_LEAST_8BIT), _log_noise(*_MOST_8BIT)


def _within_limits(log_noise: Floats) -> Floats:
    return np.clip(log_noise, _LOG_LEAST, _LOG_MOST)


def _noise(log_noise: Floats) -> AffineNoise:
    slope, floor = np.exp(_within_limits(log_noise))
    return AffineNoise(float(slope), float(floor))


def _at_limit(log_noise: Floats) -> bool:
    return bool(np.any((log_noise <= _LOG_LEAST) | (log_noise >= _LOG_MOST)))


CALIBRATORS.register("ism-bin", partial(SimilaritySearch, objective="bin"))
CALIBRATORS.register("ism-sampled", partial(SimilaritySearch, objective="sampled"))
