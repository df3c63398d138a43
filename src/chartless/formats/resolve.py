"""Look-up tables of DaVinci Resolve: .cube of one dimension, with the range of its input."""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.formats._base import Source, register_format
from chartless.formats._cube import AbstractCube


@final
@dataclass(frozen=True, slots=True)
class Resolve(AbstractCube):
    """The same table as ``cube``, in the language that DaVinci Resolve gives that name.

    Put it into the folder that *Project Settings → Color Management → Open LUT Folder* shows,
    press *Update Lists*, then choose it for clips in the Media Pool by right click, *1D LUT*.
    """

    name: ClassVar[str] = "resolve"
    title: ClassVar[str] = "DaVinci Resolve .cube, 1D"
    programs: ClassVar[str] = "DaVinci Resolve, OpenColorIO"

    @override
    def head(self, n_entries: int) -> str:
        return f"LUT_1D_SIZE {n_entries}\nLUT_1D_INPUT_RANGE 0.0 1.0\n"

    @override
    def recognises(self, source: Source) -> bool:
        return "LUT_1D_INPUT_RANGE" in source.head.upper()


register_format(Resolve())
