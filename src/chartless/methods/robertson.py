"""Robertson, Borman & Stevenson 2003: light of the pixels and a table of g in turn."""

from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.methods._base import CALIBRATORS
from chartless.methods._exposures import AbstractExposureCalibrator
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class RobertsonCalibrator(AbstractExposureCalibrator):
    """Minimise Σ w (g − t x)² over the table g and each pixel's light x in turn [1]_.

    Two exposures are used at a time, so a comparagram is all that is needed:
    x = (w_i t g_i + w_j t′ g_j)/(w_i t² + w_j t′²) for a pair, and g at a level is the
    mean of t x over its pixels. Levels without pixels are interpolated. Pixels that are
    white in the longer exposure are left out: with them, g at white would be the mean
    over all brighter light too.

    Parameters
    ----------
    rounds : int
        Most rounds.
    tolerance : float
        Change of g, relative to its value at the middle level, that counts as
        converged.

    References
    ----------
    .. [1] Robertson et al. (2003), "Estimation-theoretic approach to dynamic range enhancement
       using multiple exposures", J. Electronic Imaging 12(2), doi:10.1117/1.1557695.
    """

    rounds: int = 300
    tolerance: float = 1e-3

    def __post_init__(self) -> None:
        if self.rounds < 1 or not 0 < self.tolerance < np.inf:
            given = f"{self.rounds!r} and {self.tolerance!r}"
            msg = f"rounds must be 1 or more and tolerance above 0, not {given}"
            raise ParameterError(msg)

    @property
    @override
    def method(self) -> str:
        return "robertson"

    @override
    def inverse_lut(self, counts: ExposureCounts) -> tuple[Floats, bool]:
        n_levels = counts.n_levels
        level = np.arange(n_levels)
        middle = (n_levels - 1) / 2
        sure = np.exp(-4 * ((level - middle) / middle) ** 2)
        times = np.exp(counts.log_exposures - counts.log_exposures.mean())
        pairs = []
        for table in counts.forward:
            # The light of pixels that are white in the longer exposure is unknown.
            longer, shorter = np.nonzero(table.counts[:-1])
            pairs.append(
                (
                    longer,
                    shorter,
                    table.counts[longer, shorter],
                    times[table.longer],
                    times[table.shorter],
                )
            )
        longer, shorter, weight = (np.concatenate([pair[k] for pair in pairs]) for k in range(3))
        sizes = [pair[0].size for pair in pairs]
        long, short = (np.repeat([pair[k] for pair in pairs], sizes) for k in (3, 4))
        both, amounts = np.concatenate([longer, shorter]), np.concatenate([weight, weight])
        card = np.bincount(both, amounts, n_levels)
        seen = card > 0
        certainty = sure[longer] * long**2 + sure[shorter] * short**2
        lut = level / middle
        settled = False
        for _ in range(self.rounds):
            light = (
                sure[longer] * long * lut[longer] + sure[shorter] * short * lut[shorter]
            ) / certainty
            moments = np.concatenate([long * light, short * light]) * amounts
            new = np.interp(
                level, level[seen], np.bincount(both, moments, n_levels)[seen] / card[seen]
            )
            new /= np.interp(middle, level, new)
            settled = bool(np.abs(new - lut).max() < self.tolerance)
            lut = new
            if settled:
                break
        return lut, settled


CALIBRATORS.register("robertson", RobertsonCalibrator)
