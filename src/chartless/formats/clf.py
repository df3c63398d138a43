"""Common LUT Format of the Academy, version 3: an XML list of operations, here one LUT1D.

Read are lists of a single LUT1D, as a curve for each channel is nothing more. What stands between
the tags of its array is cut out before the rest is parsed, so that no number becomes a node.
"""

import re
from dataclasses import dataclass
from typing import ClassVar, final
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree as ET
from xml.sax.saxutils import escape

import numpy as np
from typing_extensions import override

from chartless._version import __version__
from chartless.formats._base import Keeps, Source, register_format
from chartless.formats._look_up_table import AbstractLookUpTable, Sampled
from chartless.formats._tables import MOST_LEVELS
from chartless.formats._text import rows_of
from chartless.types import Floats

_SPACE = "urn:AMPAS:CLF:v3.0"
_ARRAY = re.compile(r"<((?:[\w.-]+:)?Array)\b([^<>]*)>([^<]*)</\1\s*>")
_DESCRIBING = {"Info", "Description", "InputDescriptor", "OutputDescriptor"}
_LONGEST_OUTLINE = 1 << 16


@final
@dataclass(frozen=True, slots=True)
class Clf(AbstractLookUpTable):
    """A look-up table from brightness to light that says what it is.

    The Academy's exchange format: Resolve and Flame read it, and OpenColorIO in all programs built
    on it (``FileTransform``). Put before a transform from the camera's primaries, which are not in
    it, it makes an input transform for ACES.
    """

    name: ClassVar[str] = "clf"
    title: ClassVar[str] = "Academy Common LUT Format"
    suffix: ClassVar[str] = ".clf"
    programs: ClassVar[str] = "ACES: OpenColorIO, DaVinci Resolve, Flame"
    tested_with: ClassVar[str] = "OpenColorIO"
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white", verdict="a description")

    @override
    def text_of(self, table: Floats, note: str) -> str:
        described = f"\n<Description>{escape(note)}</Description>" if note else ""
        n_entries, n_channels = table.shape
        rows = rows_of(table)
        return f"""\
<?xml version="1.0" encoding="UTF-8"?>
<ProcessList xmlns="{_SPACE}" id="urn:uuid:{uuid5(NAMESPACE_URL, rows)}" \
name="Camera response" compCLFversion="3.0">
<Description>Inverse camera response, found by chartless {__version__}</Description>{described}
<InputDescriptor>Camera RGB, brightness as recorded, white 1</InputDescriptor>
<OutputDescriptor>Camera RGB, linear light, white 1</OutputDescriptor>
<LUT1D id="response" name="brightness to light" inBitDepth="32f" outBitDepth="32f" \
interpolation="linear">
<Array dim="{n_entries} {n_channels}">
{rows}
</Array>
</LUT1D>
</ProcessList>
"""

    @override
    def recognises(self, source: Source) -> bool:
        return "ProcessList" in source.head

    @override
    def sampled(self, source: Source) -> Sampled:
        """Table of a list of one LUT1D of 1 or 3 channels, of any bit depths."""
        text = source.text
        array = _ARRAY.search(text)
        if array is None:
            msg = "holds no array of numbers, or it is cut short"
            raise ValueError(msg)
        name, attributes, numbers = array.groups()
        outline = f"{text[: array.start()]}<{name}{attributes}/>{text[array.end() :]}"
        return Sampled(_table(_dimensions(outline), numbers))


register_format(Clf())


def _dimensions(outline: str) -> list[int]:
    """Entries and channels of the only array of a file; ValueError if it is no curve."""
    if len(outline) > _LONGEST_OUTLINE:
        msg = "holds more than one array: only a single LUT1D is a response curve"
        raise ValueError(msg)
    if re.search("<!(?!--)", outline):
        # It may be a bomb.
        msg = "it declares a document type, which the format does not have"
        raise ValueError(msg)
    root = ET.fromstring(outline)  # noqa: S314 - without a document type there are no entities
    operations = [node for node in root if _local(node) not in _DESCRIBING]
    parts = [part for node in operations for part in node if _local(part) not in _DESCRIBING]
    names = [_local(node) for node in (*operations, *parts)]
    if names != ["LUT1D", "Array"]:
        msg = f"holds {', '.join(names)[:60]}: only a single LUT1D is a response curve"
        raise ValueError(msg)
    for name in ("halfDomain", "rawHalfs"):
        if operations[0].get(name, "false") != "false":
            msg = f"its table is of the bits of half floats ({name}), not of levels"
            raise ValueError(msg)
    return [int(each) for each in parts[0].get("dim", "").split()]


def _local(node: ET.Element) -> str:
    return node.tag.rpartition("}")[2]


def _table(dimensions: list[int], numbers: str) -> Floats:
    if len(dimensions) != 2 or not 0 < dimensions[0] <= MOST_LEVELS or dimensions[1] not in (1, 3):  # noqa: PLR2004
        size = " ".join(map(str, dimensions))[:40]
        msg = f"its array is of {size or 'no size'}, not of up to {MOST_LEVELS} entries by 1 or 3"
        raise ValueError(msg)
    wanted = dimensions[0] * dimensions[1]
    words = numbers.split(maxsplit=wanted)
    if len(words) != wanted:
        msg = f"its array should be of {' × '.join(map(str, dimensions))} numbers and is not"
        raise ValueError(msg)
    return np.array([float(each) for each in words]).reshape(dimensions)
