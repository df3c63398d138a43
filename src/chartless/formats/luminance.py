"""Luminance HDR: the response curve of its wizard and its command line.

4096 rows for brightness from 0 to 1, of which the program takes the nearest, each with the
logarithm and the irradiance itself for red, green and blue. Version 2.6 keeps comma-separated
values, as written here to ``.csv``; before it there was one matrix in Octave's text format, as
written to ``.m``, with the number of the row in front. That looks like a file of pfstools, whose
matrices have three columns.
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
from chartless.formats._octave import announces, matrices, matrix_text, require_levels
from chartless.formats._tables import (
    above_zero,
    calibration_of,
    in_colour,
    strictly_increasing,
    table_through_levels,
)
from chartless.formats._text import columns_of
from chartless.result.calibration import Calibration
from chartless.types import Floats

_LEVELS = 4096
_COLUMNS = 7
_HEADER = "log10(Ir),Ir,log10(Ig),Ig,log10(Ib),Ib"
_MATRIX_HEADER = """\
# Camera response curve, channels Ir, Ig, Ib\x20
# data layout: camera output | log10(response Ir) | response Ir | log10(response Ig) \
| response Ig | log10(response Ib) | response Ib\x20
"""


@final
@dataclass(frozen=True, slots=True)
class Luminance(AbstractFormat):
    """The response curve that Luminance HDR loads and saves."""

    name: ClassVar[str] = "luminance"
    title: ClassVar[str] = "Luminance HDR response"
    suffix: ClassVar[str] = ".csv"
    programs: ClassVar[str] = "Luminance HDR 2.6 (before it .m)"
    tested_with: ClassVar[str] = "Luminance HDR"
    precision: ClassVar[float] = 2e-7
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")
    takes: ClassVar[frozenset[str]] = frozenset()

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Table of 4096 rows; black is above 0 for its logarithm."""
        table = above_zero(table_through_levels(calibration, _LEVELS, nearest=True), calibration)
        values = strictly_increasing(in_colour(table))
        pairs = np.stack([np.log10(values), values], axis=-1).reshape(_LEVELS, -1)
        if settings.suffix == ".m":
            rows = np.column_stack([np.arange(_LEVELS), pairs])
            row_format = " %4d" + 3 * " %15.9f %15.9e" + " "
            return Encoded((_MATRIX_HEADER + matrix_text(rows, row_format)).encode())
        text = io.StringIO()
        np.savetxt(text, pairs, ",".join(3 * ["%15.9f,%15.9e"]), header=_HEADER, comments="")
        return Encoded(text.getvalue().encode())

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.startswith(_HEADER) or announces(source, _COLUMNS)

    @override
    def decode(self, source: Source) -> Calibration:
        if source.head.startswith(_HEADER):
            return calibration_of(columns_of(source, (1, 3, 5)), source, self.name)
        return calibration_of(_matrix(source), source, self.name)


register_format(Luminance())


def _matrix(source: Source) -> Floats:
    found = matrices(source, _COLUMNS)
    if len(found) != 1:
        msg = f"it has {len(found)} matrices of {_COLUMNS} columns, not one"
        raise ValueError(msg)
    require_levels(found[0][:, 0])
    return found[0][:, 2::2]
