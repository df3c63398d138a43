"""Measured curves: a line for each sample, irradiance and brightness, each from 0 to 1.

What ``chartless fit``, ``chartless compare`` and ``chartless simulate --response`` read as well.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import SampledCurve
from chartless.curves.file import samples_of
from chartless.errors import ParameterError
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import (
    calibration_of_curves,
    inverse_table,
    luma,
    strictly_increasing,
)
from chartless.formats._text import lines_of, without_comments
from chartless.result.calibration import Calibration

_HEADER = "irradiance,brightness\n"


@final
@dataclass(frozen=True, slots=True)
class Curve(AbstractFormat):
    """A line for each sample of one response: irradiance and brightness, from 0,0 to 1,1.

    Blanks or semicolons between the two are read as well. Of three channels the curve of the
    picture made grey is written.
    """

    name: ClassVar[str] = "curve"
    title: ClassVar[str] = "two-column curve"
    suffix: ClassVar[str] = ".csv"
    programs: ClassVar[str] = "chartless fit, compare, simulate; spreadsheets"
    tested_with: ClassVar[str] = "NumPy"
    precision: ClassVar[float] = 1e-7
    keeps: ClassVar[Keeps] = Keeps(channels="one, their luma", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Sample for each level; irradiance increases even where levels share one."""
        rising = strictly_increasing(luma(inverse_table(calibration, settings.n_levels)))[:, 0]
        irradiance = rising / np.float64(rising[-1])
        samples = np.column_stack([irradiance, np.linspace(0.0, 1.0, irradiance.size)])
        return Encoded((_HEADER + "".join(f"{x:.12g},{y:.12g}\n" for x, y in samples)).encode())

    @override
    def recognises(self, source: Source) -> bool:
        lines = [line.strip() for line in source.head.split("\n")]
        top = without_comments(filter(None, lines))[:2]  # the first may name the columns
        try:
            return samples_of("\n".join(top)).size > 0
        except ValueError:
            return False

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of one channel, Y."""
        lines_of(source)  # refuses texts longer than any curve
        irradiance, brightness = samples_of(source.text).T.tolist()
        try:
            curve = SampledCurve(tuple(irradiance), tuple(brightness))
        except ParameterError as error:  # which is about a request, not a file
            raise ValueError(str(error)) from error
        return calibration_of_curves([curve], source, self.name)


register_format(Curve())
