"""Look-up tables of Iridas, now Adobe: .cube of one dimension."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.formats._base import Source, register_format
from chartless.formats._cube import AbstractCube


@final
@dataclass(frozen=True, slots=True)
class Cube(AbstractCube):
    """A look-up table from brightness to light, of one dimension.

    ``ffmpeg -i camera.mp4 -vf format=gbrpf32le,lut1d=camera.cube …`` linearises a film with it;
    OpenColorIO takes it wherever it takes a file of a look-up table. Many programs read .cube of
    three dimensions alone, and some end values at 1.
    """

    name: ClassVar[str] = "cube"
    title: ClassVar[str] = "Adobe (Iridas) .cube, 1D"
    programs: ClassVar[str] = "FFmpeg (lut1d), OpenColorIO"

    @override
    def head(self, n_entries: int) -> str:
        return (
            'TITLE "Camera response: brightness to light"\n'
            f"LUT_1D_SIZE {n_entries}\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1 1 1\n"
        )

    @override
    def recognises(self, source: Source) -> bool:
        head = source.head.upper()
        return "LUT_1D_SIZE" in head or "LUT_3D_SIZE" in head


register_format(Cube())
