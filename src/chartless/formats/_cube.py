"""What the two .cube languages have in common; both are read, whichever wrote the file."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from typing_extensions import override

from chartless.formats._base import Keeps, Source
from chartless.formats._look_up_table import AbstractLookUpTable, Sampled
from chartless.formats._tables import in_colour
from chartless.formats._text import (
    fields_of,
    floats,
    lines_of,
    rows_of,
    table_of,
    without_comments,
)
from chartless.types import Floats

_N_CHANNELS = 3
_STARTS_NUMBER = "+-.0123456789"


@dataclass(frozen=True, slots=True)
class AbstractCube(AbstractLookUpTable):
    """A .cube file of one dimension, Adobe's or Resolve's; it has three columns in any case."""

    suffix: ClassVar[str] = ".cube"
    tested_with: ClassVar[str] = "OpenColorIO, FFmpeg"
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white", verdict="a comment")

    @abstractmethod
    def head(self, n_entries: int) -> str:
        """Lines before the table."""

    @override
    def text_of(self, table: Floats, note: str) -> str:
        comment = f"# {note}\n" if note else ""
        return f"{comment}{self.head(len(table))}{rows_of(in_colour(table))}\n"

    @override
    def sampled(self, source: Source) -> Sampled:
        lines = without_comments(lines_of(source))
        start = next((i for i, line in enumerate(lines) if line[0] in _STARTS_NUMBER), len(lines))
        fields = fields_of(lines[:start])
        if "LUT_3D_SIZE" in fields:
            msg = "holds a table of three dimensions, which mixes the channels: no response curves"
            raise ValueError(msg)
        table = table_of(lines[start:], int(fields["LUT_1D_SIZE"]), _N_CHANNELS)
        low, high = floats(fields.get("LUT_1D_INPUT_RANGE", "0 1"), 2)
        return Sampled(
            table,
            floats(fields.get("DOMAIN_MIN", f"{low} {low} {low}"), _N_CHANNELS),
            floats(fields.get("DOMAIN_MAX", f"{high} {high} {high}"), _N_CHANNELS),
        )
