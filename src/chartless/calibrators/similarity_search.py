"""The search of the source paper: alternate between curve and noise, a few steps at a time."""

from dataclasses import dataclass, field
from functools import partial
from typing import final

import numpy as np
from typing_extensions import override

from chartless._optimize import nelder_mead
from chartless.calibrators._base import CALIBRATORS, AbstractCalibrator, Progress
from chartless.cooccurrence import Cooccurrence
from chartless.curves import ModelCurve
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.models import AbstractModel, AmeegcExact
from chartless.noise import AffineNoise
from chartless.objectives import OBJECTIVES, half_levels
from chartless.response import Response, SearchHistory, Status
from chartless.types import Floats
from chartless.whitening import whitening

# Limits of the noise search in 8-bit units. U of cameras lies in 0.01 … 0.5, V in 0.1 … 100
# (the source paper simulates 0.01 … 0.06 and 9 … 25); beyond the limits nothing changes.
_LEAST_8BIT = (1e-3, 1e-2)
_MOST_8BIT = (1e1, 1e4)
# A round that gains less than this share is no longer getting anywhere.
_SETTLED = 1e-3
# A cosine below this means that the model does not explain the pairs: simulated frames
# reach 0.9 … 0.99 whatever the scene.
_POOR_COSINE = 0.8


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SimilaritySearch(AbstractCalibrator):
    """Maximise image similarity by rounds of Nelder–Mead on curve and noise in turn.

    Rounds, iterations and start are those of the source paper. The size of the first
    simplex and its shrinking, and that the noise goes first, are ours: the paper does not
    say. With simplices of constant size the search stalls after a few rounds.

    Parameters
    ----------
    model : AbstractModel
        Family of curves; must have whitening numbers (see `chartless.whitening`).
    objective : str
        Name in `OBJECTIVES`: "bin" or "sampled".
    rounds : int
        Rounds of one search over the noise and one over the curve.
    iterations : int
        Iterations of each of these searches, at most.
    start : (float, float)
        Noise U, V to start from, in 8-bit units; the curve starts as f(I) = I.
    curve_step : float
        First simplex in whitened curve parameters: 1 is a standard deviation among cameras.
    noise_step : float
        First simplex in ln u and ln v.
    shrink : float
        Factor on both steps from one round to the next.
    """

    model: AbstractModel = field(default_factory=AmeegcExact)
    objective: str = "bin"
    rounds: int = 15
    iterations: int = 10
    start: tuple[float, float] = (0.06, 1.0)
    curve_step: float = 0.5
    noise_step: float = 0.5
    shrink: float = 0.9

    def __post_init__(self) -> None:
        if self.rounds < 1 or self.iterations < 1:
            msg = "a search needs at least one round of one iteration"
            raise ParameterError(msg)
        AffineNoise.from_8bit(*self.start)  # raises if it is no noise

    @override
    def calibrate(
        self, table: Cooccurrence, *, channel: str = "Y", progress: Progress | None = None
    ) -> Response:
        objective = OBJECTIVES[self.objective]
        pairs = objective.prepare(table.symmetric)
        brightness = half_levels(table.n_levels)
        whitened = whitening(self.model.name)

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
        for done in range(self.rounds):
            scale = self.shrink**done
            noise_found = nelder_mead(
                partial(cost, inverse(curve)),
                log_noise,
                steps=np.full(2, self.noise_step * scale),
                max_iterations=self.iterations,
            )
            log_noise = noise_found.x
            curve_found = nelder_mead(
                partial(cost_of_curve, log_noise=log_noise),
                curve,
                steps=np.full(curve.size, self.curve_step * scale),
                max_iterations=self.iterations,
            )
            curve = curve_found.x
            values.append(-curve_found.value)
            evaluations += noise_found.evaluations + curve_found.evaluations
            if progress is not None:
                progress((done + 1) / self.rounds)

        settled = values[-1] - values[-2] <= _SETTLED * abs(values[-1])
        response = Response(
            name=channel,
            curve=ModelCurve(self.model.name, tuple(map(float, whitened.colour(curve)))),
            noise=_noise(log_noise),
            n_levels=table.n_levels,
            observed_levels=table.observed_levels,
            n_pairs=table.n_pairs,
            method=f"ism-{self.objective}",
            status=Status.CONVERGED if settled else Status.LIMIT_REACHED,
            history=SearchHistory(self.objective, tuple(values), evaluations),
            table=table,
        )
        doubts = (
            (Flag.SEARCH_UNFINISHED, not settled),
            (Flag.NOISE_AT_BOUND, _at_limit(log_noise)),
            (Flag.MISFIT, self.objective == "bin" and values[-1] < _POOR_COSINE),
        )
        return response.with_flags(*(flag for flag, holds in doubts if holds))


def _log_noise(slope: float, floor: float) -> Floats:
    noise = AffineNoise.from_8bit(slope, floor)
    return np.log([max(noise.slope, np.finfo(float).tiny), noise.floor])


_LOG_LEAST, _LOG_MOST = _log_noise(*_LEAST_8BIT), _log_noise(*_MOST_8BIT)


def _noise(log_noise: Floats) -> AffineNoise:
    slope, floor = np.exp(np.clip(log_noise, _LOG_LEAST, _LOG_MOST))
    return AffineNoise(float(slope), float(floor))


def _at_limit(log_noise: Floats) -> bool:
    return bool(np.any((log_noise <= _LOG_LEAST) | (log_noise >= _LOG_MOST)))


CALIBRATORS.register("ism-bin", partial(SimilaritySearch, objective="bin"))
CALIBRATORS.register("ism-sampled", partial(SimilaritySearch, objective="sampled"))
