"""pfstools: the curves that ``pfshdrcalibrate`` saves and applies.

Matrices in Octave's text format, one for each channel and one of weights, without which nothing is
loaded. Their names are not read: the order gives the channels. There are as many rows as levels, a
power of two. Pixels of no less irradiance than white count as overexposed, so that curves must rise
up to the last level.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._octave import announces, matrices, matrix_text, require_levels
from chartless.formats._tables import above_zero, calibration_of, inverse_table, strictly_increasing
from chartless.result.calibration import Calibration
from chartless.types import Floats32

_USUAL_LEVELS = 256
_COLUMNS = 3


@final
@dataclass(frozen=True, slots=True)
class PfsTools(AbstractFormat):
    """The file of ``pfshdrcalibrate --response-file``, with ``--luminance`` for one channel."""

    name: ClassVar[str] = "pfstools"
    title: ClassVar[str] = "pfstools response"
    suffix: ClassVar[str] = ".m"
    programs: ClassVar[str] = "pfshdrcalibrate -f; Octave"
    tested_with: ClassVar[str] = "pfshdrcalibrate"
    precision: ClassVar[float] = 1e-7
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Matrices of 256 levels, or of another power of two; black is above 0 for its logarithm.

        The weights are those of Robertson et al. (2003), exp(-4) at the ends: with a weight at
        every level, a single picture becomes linear at all of them.
        """
        n_levels = settings.levels_or(_USUAL_LEVELS)
        if n_levels & (n_levels - 1):
            msg = f"pfstools has tables of 256, 512, 1024 … levels, not of {n_levels}"
            raise ParameterError(msg)
        table = strictly_increasing(above_zero(inverse_table(calibration, n_levels), calibration))
        names = ("IY",) if table.shape[1] == 1 else ("IR", "IG", "IB")
        blocks = [_curve(name, column) for name, column in zip(names, table.T, strict=True)]
        return Encoded("".join([*blocks, _weights(n_levels)]).encode())

    @override
    def recognises(self, source: Source) -> bool:
        return announces(source, _COLUMNS)

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of one curve or three; levels of no irradiance were not seen."""
        curves = matrices(source, _COLUMNS)
        if len({len(curve) for curve in curves}) > 1:
            msg = "its curves have different numbers of levels"
            raise ValueError(msg)
        for curve in curves:
            require_levels(curve[:, 1])
        table = np.array([curve[:, 2] for curve in curves]).T
        return calibration_of(np.where(table > 0, table, np.nan), source, self.name)


register_format(PfsTools())


def _curve(name: str, irradiance: Floats32) -> str:
    columns = [np.log10(irradiance), np.arange(irradiance.size), irradiance]
    return (
        f"# Camera response curve, channel {name}\n"
        "# data layout: log10(response) | camera output | response\n"
        + matrix_text(np.column_stack(columns), " %.8e %4d %.8e", name)
    )


def _weights(n_levels: int) -> str:
    weights = np.exp(-4 * np.linspace(-1, 1, n_levels) ** 2)
    columns = [weights, np.arange(n_levels)]
    return "# Weighting function\n# data layout: weight | camera output\n" + matrix_text(
        np.column_stack(columns), " %.8e %4d", "W"
    )
