"""ICC profiles of an input device: a curve for each channel and the primaries.

ICC.1:2001-04 (version 2.4): a header of 128 bytes, a list of tags, the tags. A tag of type
``curv`` is a table of 16 bits from device to light, one of type ``para`` a formula. Primaries
cannot be known without a chart, so those of sRGB are written and named in the description.
"""

import struct
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, ClassVar, final

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
from chartless.formats._tables import (
    GREY,
    MOST_LEVELS,
    RGB,
    calibration_of,
    in_colour,
    inverse_table,
    noted_verdict,
)
from chartless.result.calibration import Calibration
from chartless.result.verdict import known_verdict
from chartless.types import Floats

MOST_ENTRIES = 4096
"""Largest number of entries of curves written."""
DESCRIPTION = "Camera response by chartless, primaries of sRGB assumed"

_WHITE = (0.9642, 1.0, 0.8249)
"""D50, to which colours of profiles are adapted."""
_PRIMARIES = {
    b"rXYZ": (0.43607, 0.22249, 0.01392),
    b"gXYZ": (0.38515, 0.71687, 0.09708),
    b"bXYZ": (0.14307, 0.06061, 0.71410),
}
"""Primaries of sRGB, as in the ICC's own profile sRGB2014.icc."""
_CURVES = ((RGB, (b"rTRC", b"gTRC", b"bTRC")), (GREY, (b"kTRC",)))
_HEADER = ">I4xI4s4s4s6H4s28x3i48x"
_VERSION = 0x02400000
_MARK, _MARK_AT, _TAGS_AT = b"acsp", 36, 128
_MOST_TAGS = 100
_N_PARAMETERS = (1, 3, 4, 5, 7)
"""Number of parameters of each of the functions of a formula."""
_DEFAULTS = [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
_SHIFTED = 2
"""Function whose c is added to all of the curve."""
_BRIGHTNESS: Floats = np.linspace(0.0, 1.0, MOST_ENTRIES)
_FULL = 65535
_FIRST_TEXT = struct.Struct(">20xII")  # of a multiLocalizedUnicodeType: its size and place
_LONGEST_TEXT = 100


@final
@dataclass(frozen=True, slots=True)
class Icc(AbstractFormat):
    """An input profile for photo programs, with the primaries of sRGB for the unknown ones.

    darktable: put it into ``~/.config/darktable/color/in`` and choose it in *input color profile*;
    elsewhere assign it to the picture. Entries are of 16 bits, so that near black of a steep curve
    levels can fall together. More entries do not help there: at the levels they are the same.
    """

    name: ClassVar[str] = "icc"
    title: ClassVar[str] = "ICC input profile"
    suffix: ClassVar[str] = ".icc"
    programs: ClassVar[str] = "darktable and other programs with LittleCMS"
    tested_with: ClassVar[str] = "LittleCMS (Pillow), OpenColorIO"
    precision: ClassVar[float] = 7.7e-6
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white", verdict="a description")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Profile with an entry for each level, up to 4096."""
        n_levels = calibration.channels[0].n_levels
        n_entries = settings.n_levels or min(n_levels, MOST_ENTRIES)
        if n_entries > MOST_ENTRIES:
            msg = f"an ICC profile is written with up to {MOST_ENTRIES} levels, not {n_entries}"
            raise ParameterError(msg)
        entries = np.rint(_FULL * inverse_table(calibration, n_entries))
        curves = [_curve(column) for column in in_colour(entries).T]
        judged = known_verdict(calibration.channels)
        grade = "" if judged is None else f"; verdict: {judged.grade.value}"
        note = noted_verdict(calibration)
        tags = {
            b"desc": _description(DESCRIPTION + grade),
            **({b"dmdd": _description(note)} if note else {}),
            b"cprt": b"text\0\0\0\0No copyright\0",
            b"wtpt": _xyz(_WHITE),
            **{name: _xyz(colour) for name, colour in _PRIMARIES.items()},
            **dict(zip(_CURVES[0][1], curves, strict=True)),
        }
        lost = ["the camera's primaries, which are unknown: those of sRGB stand in"]
        if n_entries < n_levels:
            lost.append(f"levels between its {n_entries} entries")
        joined = int((np.diff(entries, axis=0) == 0).sum(axis=0).max())
        if joined:
            lost.append(f"levels that 16 bits cannot distinguish from the one below: {joined}")
        return Encoded(_profile(tags), tuple(lost))

    @override
    def recognises(self, source: Source) -> bool:
        return source.content[_MARK_AT : _MARK_AT + 4] == _MARK

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of the curves of a profile of any class, in colour or grey."""
        table, names = curves_of(source.content)
        return calibration_of(table, source, self.name, names=names)


register_format(Icc())


def curves_of(content: bytes) -> tuple[Floats, tuple[str, ...]]:
    """Irradiance at uniform brightness that a profile has, and the channel of each column.

    Raises
    ------
    ValueError
        If the profile is damaged, or has no curve for each channel.
    """
    tags = _tags(content)
    for names, keys in _CURVES:
        if tags.keys() >= set(keys):
            return _side_by_side([_samples(tags[key]) for key in keys]), names
    msg = "has no curve for each channel (rTRC, gTRC, bTRC): its tables mix them"
    raise ValueError(msg)


def description_of(content: bytes) -> str:
    """What a sound profile calls itself; empty if it does not, or in a way that is not known."""
    tag = bytes(_tags(content).get(b"desc", b""))
    if tag.startswith(b"mluc") and len(tag) >= _FIRST_TEXT.size:
        size, start = _FIRST_TEXT.unpack_from(tag)
        text = tag[start : start + size].decode("utf-16-be", errors="replace")
    else:
        text = tag[12:].split(b"\0")[0].decode("latin-1")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:_LONGEST_TEXT]


def _profile(tags: dict[bytes, bytes]) -> bytes:
    at = _TAGS_AT + 4 + 12 * len(tags)
    directory, data = struct.pack(">I", len(tags)), b""
    for name, content in tags.items():
        directory += struct.pack(">4sII", name, at + len(data), len(content))
        data += content + b"\0" * (-len(content) % 4)
    spaces, now = (b"scnr", b"RGB ", b"XYZ "), datetime.now(UTC).timetuple()[:6]
    white = map(_fixed, _WHITE)
    header = struct.pack(_HEADER, at + len(data), _VERSION, *spaces, *now, _MARK, *white)
    return header + directory + data


def _fixed(value: float) -> int:
    return round(value * 65536)


def _xyz(colour: tuple[float, float, float]) -> bytes:
    return struct.pack(">4s4x3i", b"XYZ ", *map(_fixed, colour))


def _description(text: str) -> bytes:
    """ASCII alone, followed by empty Unicode and ScriptCode."""
    return struct.pack(f">4s4xI{len(text) + 1}s78x", b"desc", len(text) + 1, text.encode())


def _curve(column: Floats) -> bytes:
    return struct.pack(">4s4xI", b"curv", len(column)) + column.astype(">u2").tobytes()


def _unpacked(form: str, data: bytes | memoryview, at: int) -> tuple[Any, ...]:
    if at + struct.calcsize(form) > len(data):
        msg = "is cut short"
        raise ValueError(msg)
    return struct.unpack_from(form, data, at)


def _tags(content: bytes) -> dict[bytes, memoryview]:
    (n_tags,) = _unpacked(">I", content, _TAGS_AT)
    if n_tags > _MOST_TAGS:
        msg = f"lists {n_tags} tags, more than any profile has"
        raise ValueError(msg)
    tags = {}
    for i in range(n_tags):
        name, start, size = _unpacked(">4sII", content, _TAGS_AT + 4 + 12 * i)
        if start + size > len(content):
            msg = f"its tag {name.decode('latin-1')!r} is cut short"
            raise ValueError(msg)
        tags[name] = memoryview(content)[start : start + size]
    return tags


def _samples(tag: memoryview) -> Floats:
    """Irradiance at uniform brightness, of a tag that is a curve."""
    kind = bytes(tag[:4])
    if kind == b"curv":
        (count,) = _unpacked(">I", tag, 8)
        if count == 0:
            return np.array([0.0, 1.0])
        if count > MOST_LEVELS or 12 + 2 * count > len(tag):
            msg = f"a curve should have {count} entries, and its tag has fewer"
            raise ValueError(msg)
        entries = np.frombuffer(tag, ">u2", count, 12)
        return np.power(_BRIGHTNESS, entries[0] / 256) if count == 1 else entries / _FULL
    if kind == b"para":
        return _formula(tag)
    msg = f"a curve is of the type {kind.decode('latin-1')!r}, neither table (curv) nor formula"
    raise ValueError(msg)


def _formula(tag: memoryview) -> Floats:
    """Irradiance of a parametricCurveType, whose functions have the numbers 0 … 4."""
    (function,) = _unpacked(">H", tag, 8)
    if function >= len(_N_PARAMETERS):
        msg = f"a curve is of the unknown function {function}"
        raise ValueError(msg)
    n_parameters = _N_PARAMETERS[function]
    fixed: tuple[int, ...] = _unpacked(f">{n_parameters}i", tag, 12)
    g, a, b, c, d, e, f = [each / 65536 for each in fixed] + _DEFAULTS[n_parameters:]
    with np.errstate(all="ignore"):  # what is not finite counts as missing
        power: Floats = np.power(np.maximum(a * _BRIGHTNESS + b, 0), g)
    if function == _SHIFTED:
        return power + c
    return np.where(d <= _BRIGHTNESS, power + e, c * _BRIGHTNESS + f)


def _side_by_side(curves: list[Floats]) -> Floats:
    """Table of curves; if they are of different lengths, at 4096 levels by straight lines."""
    if len({len(each) for each in curves}) > 1:
        curves = [np.interp(_BRIGHTNESS, np.linspace(0, 1, len(each)), each) for each in curves]
    return np.column_stack(curves)
