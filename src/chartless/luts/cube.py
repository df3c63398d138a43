"""Look-up tables of Iridas, now Adobe: .cube of one dimension."""

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
from chartless.luts._cube import read_cube
from chartless.luts._tables import in_colour, inverse_table
from chartless.luts._text import rows_of


@final
@dataclass(frozen=True, slots=True)
class Cube(AbstractFormat):
    """A look-up table from brightness to light, of one dimension.

    ``ffmpeg -i camera.mp4 -vf format=gbrpf32le,lut1d=camera.cube …`` linearises a film with it;
    OpenColorIO takes it wherever it takes a file of a look-up table. Many programs read .cube of
    three dimensions alone, and some end values at 1.
    """

    name: ClassVar[str] = "cube"
    title: ClassVar[str] = "Adobe (Iridas) .cube, 1D"
    suffix: ClassVar[str] = ".cube"
    programs: ClassVar[str] = "FFmpeg (lut1d), OpenColorIO"
    tested_with: ClassVar[str] = "OpenColorIO, FFmpeg"
    precision: ClassVar[float] = 6e-8
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        head = (
            'TITLE "Camera response: brightness to light"\n'
            f"LUT_1D_SIZE {len(table)}\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1 1 1\n"
        )
        return Encoded(f"{head}{rows_of(in_colour(table))}\n".encode())

    @override
    def recognises(self, source: Source) -> bool:
        head = source.head.upper()
        return "LUT_1D_SIZE" in head or "LUT_3D_SIZE" in head

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of R, G and B, as the file has three columns whatever it was made from."""
        return read_cube(source, self.name)


register_format(Cube())
