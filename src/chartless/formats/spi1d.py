"""Imageworks' one-dimensional look-up table, the plainest of those OpenColorIO reads."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.formats._base import Source, register_format
from chartless.formats._look_up_table import AbstractLookUpTable, Sampled
from chartless.formats._text import (
    fields_of,
    floats,
    lines_of,
    rows_of,
    table_of,
    without_comments,
)
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class Spi1d(AbstractLookUpTable):
    """A look-up table from brightness to light, for OpenColorIO and the programs built on it.

    In an OpenColorIO configuration it is the way of a camera's colour space to linear light:
    ``to_scene_reference: !<FileTransform> {src: camera.spi1d, interpolation: linear}``. In Nuke,
    ``OCIOFileTransform`` takes the file itself.
    """

    name: ClassVar[str] = "spi1d"
    title: ClassVar[str] = "Imageworks 1D look-up table"
    suffix: ClassVar[str] = ".spi1d"
    programs: ClassVar[str] = "OpenColorIO (Nuke, Blender, Houdini)"
    tested_with: ClassVar[str] = "OpenColorIO"

    @override
    def text_of(self, table: Floats, note: str) -> str:
        n_entries, n_channels = table.shape
        head = f"Version 1\nFrom 0.0 1.0\nLength {n_entries}\nComponents {n_channels}\n"
        return f"{head}{{\n{rows_of(table)}\n}}\n"

    @override
    def recognises(self, source: Source) -> bool:
        words = source.head.split()
        return "Version" in words and "Length" in words

    @override
    def sampled(self, source: Source) -> Sampled:
        lines = without_comments(lines_of(source))
        if not ("{" in lines and "}" in lines):
            msg = "has no table between braces, or it is cut short"
            raise ValueError(msg)
        start, end = lines.index("{"), lines.index("}")
        fields = fields_of(lines[:start])
        n_entries, n_channels = int(fields["LENGTH"]), int(fields["COMPONENTS"])
        table = table_of(lines[start + 1 : end], n_entries, n_channels)
        low, high = floats(fields.get("FROM", "0 1"), 2)
        return Sampled(table, [low], [high])


register_format(Spi1d())
