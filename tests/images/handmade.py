"""Pictures written by hand, byte by byte, so that no library's opinion stands between."""

from struct import pack
from typing import Any
from zlib import compress, crc32

import numpy.typing as npt

Pixels = npt.NDArray[Any]


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return pack(">I", len(data)) + kind + data + pack(">I", crc32(kind + data))


def png_bytes(
    rows: bytes, width: int, height: int, *, bits: int = 8, colour_type: int = 2, extra: bytes = b""
) -> bytes:
    header = pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + png_chunk(b"IHDR", header)
        + extra
        + png_chunk(b"IDAT", compress(rows))
        + png_chunk(b"IEND", b"")
    )


def png_of(pixels: Pixels, extra: bytes = b"") -> bytes:
    """8- or 16-bit PNG of an array; 1, 2, 3 or 4 channels."""
    height, width, n_channels = pixels.shape
    rows = pixels.astype(pixels.dtype.newbyteorder(">"))
    return png_bytes(
        b"".join(b"\0" + row.tobytes() for row in rows),
        width,
        height,
        bits=8 * pixels.itemsize,
        colour_type={1: 0, 2: 4, 3: 2, 4: 6}[n_channels],
        extra=extra,
    )


def tiff_bytes(
    data: bytes,
    width: int,
    height: int,
    *,
    bits: int = 8,
    n_channels: int = 1,
    photometric: int = 1,
    colour_map: bool = False,
    alpha: int | None = None,
) -> bytes:
    """Little-endian TIFF of one strip; `alpha` is 1 (associated) or 2 (not)."""
    start = 8
    bits_offset = start + len(data)
    bits_data = pack("<H", bits) * max(n_channels, 2)
    tail = bits_data + (bytes(6 << bits) if colour_map else b"")
    tags = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, n_channels, bits if n_channels == 1 else bits_offset),
        (259, 3, 1, 1),
        (262, 3, 1, photometric),
        (273, 4, 1, start),
        (277, 3, 1, n_channels),
        (278, 4, 1, height),
        (279, 4, 1, len(data)),
    ]
    if colour_map:
        tags.append((320, 3, 3 << bits, bits_offset + len(bits_data)))
    if alpha is not None:
        tags.append((338, 3, 1, alpha))
    directory = pack("<H", len(tags)) + b"".join(pack("<HHII", *tag) for tag in tags) + bytes(4)
    return pack("<2sHI", b"II", 42, bits_offset + len(tail)) + data + tail + directory
