"""HDR Toolbox for MATLAB: the inverse response ``lin_fun`` in a MAT file.

A matrix of doubles, a row for each level and a column for each of red, green and blue, the largest
being 1. ``BuildHDR(stack, times, 'LUT', lin_fun)`` and ``RemoveCRF(img, 'LUT', lin_fun)`` take the
nearest row.

Files are read here and not by SciPy, which trusts the sizes in them: on damaged ones it crashes.
Read are versions 5 to 7 of the format ("MAT-File Format", The MathWorks), numbers alone.
"""

import io
import itertools
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from struct import Struct
from typing import ClassVar, TypeAlias, final

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
from chartless.formats._tables import MOST_LEVELS, calibration_of, in_colour, inverse_table
from chartless.result.calibration import Calibration

_USUAL_LEVELS = 256
_VARIABLE = "lin_fun"
_TITLE = "MATLAB 5.0 MAT-file: lin_fun, the inverse response for HDR Toolbox, by chartless"
_TITLE_BYTES, _HEADER_BYTES = 116, 128
_ORDERS = {b"IM": "<", b"MI": ">"}
_MATRIX, _COMPRESSED = 14, 15
_CLASS, _CLASSES, _COMPLEX = 0xFF, range(6, 16), 0x800  # of flags: numbers, not text or structures
_NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_Element: TypeAlias = tuple[int, memoryview]
_NOTHING: _Element = (0, memoryview(b""))
_MOST_VARIABLES = 256
_MOST_INFLATED = 1 << 22  # more than 65,536 × 3 doubles


@final
@dataclass(frozen=True, slots=True)
class HdrToolbox(AbstractFormat):
    """The variable ``lin_fun`` in a file that MATLAB and Octave load."""

    name: ClassVar[str] = "hdrtoolbox"
    title: ClassVar[str] = "MAT file of HDR Toolbox"
    suffix: ClassVar[str] = ".mat"
    programs: ClassVar[str] = "HDR Toolbox BuildHDR, RemoveCRF; MATLAB, Octave, SciPy"
    tested_with: ClassVar[str] = "SciPy"
    precision: ClassVar[float] = 1e-9
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Always three columns, as pictures in colour need them."""
        from scipy.io import savemat

        table = in_colour(inverse_table(calibration, settings.levels_or(_USUAL_LEVELS)))
        file = io.BytesIO()
        savemat(file, {_VARIABLE: table})  # type: ignore[arg-type]  # files are taken as well
        # SciPy's own title has the time, and files of the same content should be the same.
        return Encoded(_TITLE.encode().ljust(_TITLE_BYTES) + file.getvalue()[_TITLE_BYTES:])

    @override
    def recognises(self, source: Source) -> bool:
        return source.content.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"))

    @override
    def decode(self, source: Source) -> Calibration:
        if source.content.startswith(b"MATLAB 7.3"):
            msg = "MATLAB 7.3 is not read: save it with save('file.mat', 'lin_fun', '-v7')"
            raise ValueError(msg)
        table = _lin_fun(source.content)
        if len(table) > MOST_LEVELS:
            msg = f"{_VARIABLE} has {len(table)} rows, more than {MOST_LEVELS}"
            raise ValueError(msg)
        return calibration_of(table, source, self.name)


register_format(HdrToolbox())


def _lin_fun(content: bytes) -> npt.NDArray[np.number]:
    order = _ORDERS.get(content[_HEADER_BYTES - 2 : _HEADER_BYTES])
    if order is None:
        msg = "its header is damaged"
        raise ValueError(msg)
    for flags, shape, name, *values in _matrices(content, order):
        if bytes(name[1]) == _VARIABLE.encode():
            return _numbers(flags[1], shape[1], values[0] if values else _NOTHING, order)
    msg = f"it holds no variable {_VARIABLE}"
    raise ValueError(msg)


def _matrices(content: bytes, order: str) -> Iterator[list[_Element]]:
    """Flags, shape, name and first values of each variable."""
    variables = _elements(memoryview(content)[_HEADER_BYTES:], order)
    for each in itertools.islice(variables, _MOST_VARIABLES):
        inside = _elements(_inflated(each[1]), order) if each[0] == _COMPRESSED else iter([each])
        kind, data = next(inside, _NOTHING)
        parts = list(itertools.islice(_elements(data, order), 4))
        if kind == _MATRIX and len(parts) > 2:  # noqa: PLR2004 - without values it is empty
            yield parts


def _numbers(
    flags: memoryview, shape: memoryview, values: _Element, order: str
) -> npt.NDArray[np.number]:
    """Matrix of its parts; raises ValueError if it is none of real numbers."""
    flag = int.from_bytes(flags[:4], "little" if order == "<" else "big")
    dimensions = np.frombuffer(shape, f"{order}i4").tolist()
    is_real = (flag & _CLASS) in _CLASSES and not flag & _COMPLEX and values[0] in _NUMBERS
    if not is_real or len(dimensions) != 2 or min(dimensions) < 1:  # noqa: PLR2004
        msg = f"{_VARIABLE} is not a matrix of numbers"
        raise ValueError(msg)
    return np.frombuffer(values[1], order + _NUMBERS[values[0]]).reshape(dimensions, order="F")


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    """Type and content of each element; of one that is cut short what there is."""
    tag, at = Struct(f"{order}2I"), 0
    while at + tag.size <= len(data):
        kind, size = tag.unpack_from(data, at)
        if kind >> 16:  # a small one: the size is beside the type, the content in its place
            yield kind & 0xFFFF, data[at + 4 : at + 4 + min(kind >> 16, 4)]
            at += tag.size
        else:
            yield kind, data[at + tag.size : at + tag.size + size]
            at += tag.size + size + (0 if kind == _COMPRESSED else -size % 8)


def _inflated(data: memoryview) -> memoryview:
    try:
        return memoryview(zlib.decompressobj().decompress(data, _MOST_INFLATED))
    except zlib.error as error:
        msg = f"a compressed variable is damaged ({error})"
        raise ValueError(msg) from error
