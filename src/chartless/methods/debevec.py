"""Debevec & Malik 1997: a smooth table of ln g over the levels, by least squares."""

from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.methods._base import CALIBRATORS
from chartless.methods._exposures import AbstractExposureCalibrator
from chartless.types import Floats

_GAUGE = 1e-9  # ln g is known up to a constant; levels without weight have no value


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class DebevecCalibrator(AbstractExposureCalibrator):
    """Least squares on ln g(O) − ln E − ln t, with the irradiance E of each pixel eliminated.

    For two exposures, this leaves the residual ln g_j − ln g_i − ln ρ, with the weight
    W_i W_j/(W_i + W_j), where W is the square of the source's hat function [1]_.

    Parameters
    ----------
    smoothness : float
        λ: weight of the squared second differences of ln g, with a hat of at most 1.
    samples : float
        Number of pixels to which the counts of two exposures are scaled, as the source
        samples some; with more, the curve follows the pixels rather than λ.

    References
    ----------
    .. [1] Debevec & Malik (1997), "Recovering high dynamic range radiance maps from photographs",
       SIGGRAPH, doi:10.1145/258734.258884.
    """

    smoothness: float = 100.0
    samples: float = 100.0

    def __post_init__(self) -> None:
        for name in ("smoothness", "samples"):
            value = getattr(self, name)
            if not 0 < value < np.inf:
                msg = f"{name} must be a number above 0, not {value!r}"
                raise ParameterError(msg)

    @property
    @override
    def method(self) -> str:
        return "debevec"

    @override
    def inverse_lut(self, counts: ExposureCounts) -> tuple[Floats, bool]:
        n_levels = counts.n_levels
        hat = np.minimum(np.arange(n_levels), np.arange(n_levels)[::-1]).astype(np.float64)
        hat *= 2 / (n_levels - 1)
        square = hat**2
        together = (
            square * square[:, np.newaxis] / np.maximum(square + square[:, np.newaxis], 1e-30)
        )
        normal, pull = np.zeros((n_levels, n_levels)), np.zeros(n_levels)
        for table in counts.forward:
            weight = together * table.counts
            weight *= self.samples / max(float(table.counts.sum()), 1.0)
            step = counts.log_exposures[table.longer] - counts.log_exposures[table.shorter]
            normal -= weight + weight.T
            normal[np.diag_indices(n_levels)] += weight.sum(axis=1) + weight.sum(axis=0)
            pull += step * (weight.sum(axis=1) - weight.sum(axis=0))
        bend = np.diff(np.eye(n_levels), 2, axis=0) * hat[1:-1, np.newaxis]
        normal += self.smoothness * bend.T @ bend + _GAUGE * np.eye(n_levels)
        log_light = np.linalg.solve(normal, pull)
        return np.exp(log_light - log_light.max()), True


CALIBRATORS.register("debevec", DebevecCalibrator)
