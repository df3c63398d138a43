"""Look-up tables of Rising Sun Research's cineSpace, of one dimension.

After marks and notes come three pre-tables that say where brightness meets the table, and then the
table. A pre-table of two points is its domain; one of more is a curve of its own.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from typing_extensions import override

from chartless.formats._base import Keeps, Source, register_format
from chartless.formats._look_up_table import AbstractLookUpTable, Sampled
from chartless.formats._tables import in_colour
from chartless.formats._text import floats, lines_of, rows_of, table_of, without_comments
from chartless.types import Floats

_MARK = "CSPLUTV100"
_UNIT = "2\n0.0 1.0\n0.0 1.0\n"
_N_CHANNELS = 3


@final
@dataclass(frozen=True, slots=True)
class Csp(AbstractLookUpTable):
    """A look-up table from brightness to light of cineSpace, for players and compositing.

    RV loads it as a look-up table of the file, Nuke by ``OCIOFileTransform``, FFmpeg by
    ``-vf format=gbrpf32le,lut1d=camera.csp``.
    """

    name: ClassVar[str] = "csp"
    title: ClassVar[str] = "cineSpace 1D look-up table"
    suffix: ClassVar[str] = ".csp"
    programs: ClassVar[str] = "RV, OpenColorIO, FFmpeg (lut1d)"
    tested_with: ClassVar[str] = "OpenColorIO, FFmpeg"
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white", verdict="metadata")

    @override
    def text_of(self, table: Floats, note: str) -> str:
        text = "\n".join(filter(None, ["Camera response: brightness to light", note]))
        notes = f"BEGIN METADATA\n{text}\nEND METADATA\n"
        head = f"{_MARK}\n1D\n\n{notes}\n{_UNIT * _N_CHANNELS}\n{len(table)}\n"
        return f"{head}{rows_of(in_colour(table))}\n"

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.lstrip().startswith(_MARK)

    @override
    def sampled(self, source: Source) -> Sampled:
        """Table of three columns; its pre-tables must be of two points that go to 0 and 1."""
        lines = without_comments(lines_of(source))
        if lines[1:2] != ["1D"]:
            msg = "is not a table of one dimension (1D): others mix the channels"
            raise ValueError(msg)
        start = lines.index("END METADATA") + 1 if "END METADATA" in lines else 2
        end = start + 3 * _N_CHANNELS
        domains = [_domain(lines[at : at + 3]) for at in range(start, end, 3)]
        if len(lines) <= end:
            msg = "has no table, or it is cut short"
            raise ValueError(msg)
        table = table_of(lines[end + 1 :], int(lines[end]), _N_CHANNELS)
        low, high = zip(*domains, strict=True)
        return Sampled(table, low, high)


register_format(Csp())


def _domain(lines: list[str]) -> list[float]:
    """Brightness at the ends of the table, of the three lines of a pre-table."""
    if lines[:1] != ["2"] or floats(lines[-1], 2) != [0, 1]:
        msg = "has a curve before its table: only two points that go to 0 and 1 are read"
        raise ValueError(msg)
    return floats(lines[1], 2)
