"""radical: a library that corrects response and vignetting of RGB cameras.

Five unsigned integers, little-endian: a mark, the type of an OpenCV matrix, the number of its
dimensions, its rows and columns; then 256 × 3 float32, blue first, irradiance 1 at level 128.
"""

from dataclasses import dataclass
from struct import Struct
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
    above_zero,
    calibration_of,
    in_colour,
    inverse_table,
    strictly_increasing,
)
from chartless.result.calibration import Calibration

_LEVELS, _UNIT_LEVEL = 256, 128
_NAMES = ("B", "G", "R")
_MARK = 0xC4A1FDD9
_THREE_FLOATS = 21  # CV_32FC3
_HEADER = Struct("<5I")
_SHAPES = ((1, _LEVELS), (_LEVELS, 1))


@final
@dataclass(frozen=True, slots=True)
class Radical(AbstractFormat):
    """The file of ``radical::RadiometricResponse``."""

    name: ClassVar[str] = "radical"
    title: ClassVar[str] = "radical response"
    suffix: ClassVar[str] = ".crf"
    programs: ClassVar[str] = "radical::RadiometricResponse"
    tested_with: ClassVar[str] = "reference parser"
    precision: ClassVar[float] = 2e-7
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at level 128")
    takes: ClassVar[frozenset[str]] = frozenset()

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Matrix of 1 × 256; every entry is above 0 and the one before, as it is searched."""
        table = in_colour(above_zero(inverse_table(calibration, _LEVELS), calibration))[:, ::-1]
        bgr = strictly_increasing(table / table[_UNIT_LEVEL])
        header = _HEADER.pack(_MARK, _THREE_FLOATS, 2, *_SHAPES[0])
        return Encoded(header + bgr.astype("<f4").tobytes())

    @override
    def recognises(self, source: Source) -> bool:
        return source.content.startswith(_MARK.to_bytes(4, "little"))

    @override
    def decode(self, source: Source) -> Calibration:
        mark, kind, _, *shape = _HEADER.unpack_from(source.content)
        if (mark, kind) != (_MARK, _THREE_FLOATS) or tuple(shape) not in _SHAPES:
            msg = "it does not hold 256 × 3 numbers of 32 bits"
            raise ValueError(msg)
        values = np.frombuffer(source.content, "<f4", offset=_HEADER.size)
        table = values.reshape(_LEVELS, len(_NAMES))
        return calibration_of(table, source, self.name, names=_NAMES)


register_format(Radical())
