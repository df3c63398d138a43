"""Imageworks' one-dimensional look-up table, the plainest of those OpenColorIO reads."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.calibration import Calibration
from chartless.luts._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.luts._tables import inverse_table
from chartless.luts._text import (
    calibration_on,
    fields_of,
    floats,
    lines_of,
    rows_of,
    table_of,
    without_comments,
)


@final
@dataclass(frozen=True, slots=True)
class Spi1d(AbstractFormat):
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
    precision: ClassVar[float] = 6e-8
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        n_entries, n_channels = table.shape
        head = f"Version 1\nFrom 0.0 1.0\nLength {n_entries}\nComponents {n_channels}\n"
        return Encoded(f"{head}{{\n{rows_of(table)}\n}}\n".encode())

    @override
    def recognises(self, source: Source) -> bool:
        words = source.head.split()
        return "Version" in words and "Length" in words

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of a table of 1 or 3 components; one of its own domain is resampled."""
        lines = without_comments(lines_of(source))
        if not ("{" in lines and "}" in lines):
            msg = "has no table between braces, or it is cut short"
            raise ValueError(msg)
        start, end = lines.index("{"), lines.index("}")
        fields = fields_of(lines[:start])
        n_entries, n_channels = int(fields["LENGTH"]), int(fields["COMPONENTS"])
        table = table_of(lines[start + 1 : end], n_entries, n_channels)
        low, high = floats(fields.get("FROM", "0 1"), 2)
        return calibration_on([low], [high], table, source, self.name)


register_format(Spi1d())
