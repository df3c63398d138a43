"""AliceVision and Meshroom: the response of their HDR nodes, comma-separated values.

A row for each entry: its number, which is not read, and irradiance of red, green and blue by their
places; each row ends in a comma. Between the rows there are straight lines. There must be as many
rows as the merging node's ``channelQuantizationPower`` says, 1024 unless it is set.
"""

import io
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import (
    calibration_of,
    in_colour,
    strictly_increasing,
    table_through_levels,
)
from chartless.formats._text import columns_of
from chartless.result.calibration import Calibration

_USUAL_LEVELS = 1024
_HEADER = "rgbCurve,Red,Green,Blue,"


@final
@dataclass(frozen=True, slots=True)
class AliceVision(AbstractFormat):
    """The ``response_….csv`` of LdrToHdrCalibration, which LdrToHdrMerge reads."""

    name: ClassVar[str] = "alicevision"
    title: ClassVar[str] = "AliceVision response"
    suffix: ClassVar[str] = ".csv"
    programs: ClassVar[str] = "AliceVision LdrToHdrMerge, Meshroom"
    tested_with: ClassVar[str] = "reference parser"
    precision: ClassVar[float] = 1e-7
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Table of 1024 entries; more digits than AliceVision writes, so that no toe is lost."""
        n_rows = settings.levels_or(_USUAL_LEVELS)
        table = strictly_increasing(in_colour(table_through_levels(calibration, n_rows)))
        text = io.StringIO()
        columns = np.column_stack([np.arange(n_rows), table])
        np.savetxt(text, columns, fmt="%d" + 3 * ",%.9g" + ",", header=_HEADER, comments="")
        return Encoded(text.getvalue().encode())

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.partition("\n")[0].split(",")[1:4] == _HEADER.split(",")[1:4]

    @override
    def decode(self, source: Source) -> Calibration:
        return calibration_of(columns_of(source, (1, 2, 3)), source, self.name)


register_format(AliceVision())
