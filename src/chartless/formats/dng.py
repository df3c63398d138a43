"""The LinearizationTable of DNG files (tag 50712): linear values of the stored ones.

A raw picture that was stored through a curve is made linear by a table of 16-bit integers in its
file, one table for all samples; values beyond the table take its last entry. It is applied before
black is subtracted, and white must then be 65535 (tag WhiteLevel, "Digital Negative Specification",
Adobe).

The table is written as text, an integer in each line, for a program that has the picture::

    exiftool "-IFD0:LinearizationTable<=table.txt" raw.dng

Read are such texts, what ``exiftool -b -LinearizationTable raw.dng`` prints, and DNG files.
"""

from dataclasses import dataclass
from struct import error as StructError  # noqa: N812 - the name in the standard library
from struct import unpack_from
from typing import ClassVar, final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import MOST_LEVELS, calibration_of, inverse_table, luma
from chartless.result.calibration import Calibration

_WHITE = (1 << 16) - 1
_MOST_TEXT = 8 * MOST_LEVELS
_DIGITS = b"0123456789 \t\r\n"
_TIFF = {b"II*\0": "<", b"MM\0*": ">"}
_LINEARIZATION_TABLE, _SUB_IFDS = 50712, 330
_SHORT, _LONGS = 3, (4, 13)
_MOST_DIRECTORIES = 32


@final
@dataclass(frozen=True, slots=True)
class Dng(AbstractFormat):
    """Integers for the LinearizationTable of a DNG file."""

    name: ClassVar[str] = "dng"
    title: ClassVar[str] = "DNG LinearizationTable"
    suffix: ClassVar[str] = ".txt"
    programs: ClassVar[str] = "exiftool, tifffile; raw converters once it is in a DNG"
    tested_with: ClassVar[str] = "LibRaw, exiftool"
    precision: ClassVar[float] = 8e-6
    keeps: ClassVar[Keeps] = Keeps(channels="one, their luma", scale="65535 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Entry for each value that the frames can have, 256 or 65,536."""
        n_levels = settings.levels_or(1 << calibration.bit_depth)
        values = np.rint(_WHITE * luma(inverse_table(calibration, n_levels))[:, 0]).astype(int)
        together = int(np.count_nonzero(np.diff(values) == 0))
        lost = [f"the difference of {together} neighbouring levels"] if together else []
        return Encoded(("\n".join(map(str, values)) + "\n").encode(), tuple(lost))

    @override
    def recognises(self, source: Source) -> bool:
        if source.content[:4] not in _TIFF:
            words = source.content[:100].split()
            return len(words) > 1 and not source.content.translate(None, _DIGITS)
        try:
            _from_tiff(source.content)
        except (ValueError, StructError):  # any other TIFF, or half of one
            return False
        return True

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of one channel, Y."""
        is_tiff = source.content[:4] in _TIFF
        values = _from_tiff(source.content) if is_tiff else _from_text(source.content)
        if not 2 <= values.size <= MOST_LEVELS:  # noqa: PLR2004
            msg = f"its table has {values.size} entries, not 2 to {MOST_LEVELS}"
            raise ValueError(msg)
        return calibration_of(values[:, np.newaxis], source, self.name)


register_format(Dng())


def _from_text(content: bytes) -> npt.NDArray[np.uint16]:
    if len(content) > _MOST_TEXT:
        msg = f"it is longer than {MOST_LEVELS} integers"
        raise ValueError(msg)
    values = [int(word) for word in content.split()]
    if values and not 0 <= min(values) <= max(values) <= _WHITE:
        msg = "its integers are not all between 0 and 65535"
        raise ValueError(msg)
    return np.array(values, dtype=np.uint16)


def _from_tiff(content: bytes) -> npt.NDArray[np.uint16]:
    """Table in the first directory that has one."""
    order = _TIFF[content[:4]]
    waiting = list(unpack_from(f"{order}I", content, 4))
    for _ in range(_MOST_DIRECTORIES):
        if not waiting:
            break
        directory = waiting.pop(0)
        (n_fields,) = unpack_from(f"{order}H", content, directory)
        after = directory + 2 + 12 * n_fields
        for field in range(directory + 2, after, 12):
            tag, kind, count, offset = unpack_from(f"{order}2H2I", content, field)
            if tag == _LINEARIZATION_TABLE and kind == _SHORT:
                place = offset if count > 2 else field + 8  # noqa: PLR2004 - two fit in the field
                return np.frombuffer(content, f"{order}u2", count, place).astype(np.uint16)
            if tag == _SUB_IFDS and kind in _LONGS:
                place, count = offset if count > 1 else field + 8, min(count, _MOST_DIRECTORIES)
                waiting += unpack_from(f"{order}{count}I", content, place)
        waiting += [each for each in unpack_from(f"{order}I", content, after) if each]
    msg = "it has no LinearizationTable"
    raise ValueError(msg)
