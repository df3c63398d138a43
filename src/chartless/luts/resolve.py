"""Look-up tables of DaVinci Resolve: .cube of one dimension, with the range of its input."""

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
class Resolve(AbstractFormat):
    """The same table as ``cube``, in the language that DaVinci Resolve gives that name.

    Put it into the folder that *Project Settings → Color Management → Open LUT Folder* shows,
    press *Update Lists*, then choose it for clips in the Media Pool by right click, *1D LUT*.
    """

    name: ClassVar[str] = "resolve"
    title: ClassVar[str] = "DaVinci Resolve .cube, 1D"
    suffix: ClassVar[str] = ".cube"
    programs: ClassVar[str] = "DaVinci Resolve, OpenColorIO"
    tested_with: ClassVar[str] = "OpenColorIO, FFmpeg"
    precision: ClassVar[float] = 6e-8
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        head = f"LUT_1D_SIZE {len(table)}\nLUT_1D_INPUT_RANGE 0.0 1.0\n"
        return Encoded(f"{head}{rows_of(in_colour(table))}\n".encode())

    @override
    def recognises(self, source: Source) -> bool:
        return "LUT_1D_INPUT_RANGE" in source.head.upper()

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of R, G and B, as the file has three columns whatever it was made from."""
        return read_cube(source, self.name)


register_format(Resolve())
