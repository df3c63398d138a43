"""Where lossy compression mixed pixels: its blocks, of a file or of a picture that once was one.

JPEG codes luma in blocks of 8 × 8 pixels and, with reduced chroma, colour in blocks of 16 × 16.
What is clipped inside a block rings through all of it: a pixel beside a white one that shows 252
may be white, and one that shows white may not be. Blocks without a clipped pixel are not touched
by that.

A picture that was saved without loss afterwards still shows the blocks: their coefficients were
rounded, most of them to zero, and stay there (Fan & de Queiroz 2003, "Identification of bitmap
compression history: JPEG detection and quantizer estimation", doi:10.1109/TIP.2002.807361).
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from chartless.types import Bools, Floats32, Levels

JPEG_BLOCK = 8
"""Rows and columns of pixels that JPEG codes together."""
_LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601, as JPEG files take it
_N_BANDS, _ALL_BANDS, _MOST_COLUMNS = 6, 60, 640  # of the picture: at a glance, and at most
# Rounding the levels of a decoded picture moves coefficients of luma by 0.2 to 0.3.
_ZERO = 0.7
_FIRST_ORDER, _LAST_ORDER = 3, 9  # of coefficients: those that are coarsely rounded but not empty
_LEAST_RANGE = 6.0  # levels in a block: flat ones are zero in any grid
_ENOUGH_BLOCKS, _LEAST_BLOCKS = 20, 8  # of each phase: at a glance, and to say anything
# Share of zero coefficients above the median of all 64 phases, in deviations of these: 11 and more
# in JPEG of quality 80 to 95 saved as PNG, 4 at most in pictures that never were one.
_CLEAR, _CLEAR_SHARE = 8.0, 0.03


@dataclass(frozen=True, slots=True)
class Blocks:
    """A grid of pixels that were coded together."""

    height: int
    width: int
    down: int = 0
    """Row at which a block begins."""
    right: int = 0
    """Column at which a block begins."""

    def touched(self, pixels: Bools) -> Bools:
        """All pixels of the blocks that hold one of some pixels, shape (M, N)."""
        before = -self.down % self.height, -self.right % self.width
        size = (self.height, self.width)
        padding = [
            (first, -(first + length) % block)
            for first, length, block in zip(before, pixels.shape, size, strict=True)
        ]
        whole = np.pad(pixels, padding)
        rows, columns = whole.shape[0] // self.height, whole.shape[1] // self.width
        held = whole.reshape(rows, self.height, columns, self.width).any(axis=(1, 3))
        spread = np.repeat(np.repeat(held, self.height, axis=0), self.width, axis=1)
        inside = tuple(
            slice(first, first + length)
            for (first, _), length in zip(padding, pixels.shape, strict=True)
        )
        return spread[inside]


class FormerBlocks(NamedTuple):
    """What a picture shows of compression in its past."""

    blocks: Blocks | None
    """The grid; None if there is none to be seen."""
    sure: bool
    """Whether the picture has enough detail to decide."""


def former_blocks(levels: Levels) -> FormerBlocks:
    """Find the grid of 8 × 8 blocks that a picture of 8 bits still shows.

    Parameters
    ----------
    levels : ndarray of uint8 or uint16, shape (M, N, C)
        Levels of more than 8 bits are never a JPEG's.
    """
    if levels.dtype != np.uint8:
        return FormerBlocks(None, sure=True)
    if min(levels.shape[:2]) < 2 * JPEG_BLOCK:
        return FormerBlocks(None, sure=False)
    zeros, seen = _zeros(levels, _N_BANDS)
    if seen.min() < _ENOUGH_BLOCKS:
        zeros, seen = _zeros(levels, _ALL_BANDS)
    if seen.min() < _LEAST_BLOCKS:
        return FormerBlocks(None, sure=False)
    share = zeros / seen
    middle = float(np.median(share))
    spread = 1.4826 * float(np.median(np.abs(share - middle)))
    best = int(share.argmax())
    above = float(share.flat[best]) - middle
    if above < max(_CLEAR * spread, _CLEAR_SHARE):
        return FormerBlocks(None, sure=bool(seen.min() >= _ENOUGH_BLOCKS))
    down, right = np.unravel_index(best, share.shape)
    return FormerBlocks(Blocks(JPEG_BLOCK, JPEG_BLOCK, int(down), int(right)), sure=True)


def _zeros(levels: Levels, n_bands: int) -> tuple[Floats32, Floats32]:
    """Share of coefficients near zero, summed over blocks, and blocks, of each phase, (8, 8)."""
    n = JPEG_BLOCK
    height = levels.shape[0]
    transform = _cosines()
    order = np.add.outer(np.arange(n), np.arange(n))
    chosen = (order >= _FIRST_ORDER) & (order <= _LAST_ORDER)
    zeros, seen = np.zeros((n, n), np.float32), np.zeros((n, n), np.float32)
    starts = np.unique(np.linspace(0, height - (2 * n - 1), n_bands).astype(int))
    for start in starts:
        band = levels[start : start + 2 * n - 1, :_MOST_COLUMNS].astype(np.float32)
        luma = band @ _LUMA if band.shape[2] > 1 else band[..., 0]
        clipped = ((band == 0) | (band == 255)).any(axis=2)  # noqa: PLR2004 - 8 bits
        for phase in range(n):
            strip = luma[phase : phase + n]
            lowest, highest = _windows(strip.min(axis=0)), _windows(strip.max(axis=0))
            spans = highest.max(axis=1) - lowest.min(axis=1)
            whole = ~_windows(clipped[phase : phase + n].any(axis=0)).any(axis=1)
            usable = np.flatnonzero((spans >= _LEAST_RANGE) & whole)
            windows = _windows(transform @ strip)[:, usable]
            small = np.abs(windows @ transform.T) < _ZERO
            share = small.transpose(1, 0, 2)[:, chosen].mean(axis=1)
            column = usable % n
            row = (start + phase) % n
            zeros[row] += np.bincount(column, share, n)
            seen[row] += np.bincount(column, minlength=n)
    return zeros, seen


def _windows(values: NDArray[Any]) -> NDArray[Any]:
    """Views of a block's length, along a last axis of its own."""
    return sliding_window_view(values, JPEG_BLOCK, axis=-1)


def _cosines() -> Floats32:
    """Orthonormal cosine transform of one block, shape (8, 8)."""
    n = JPEG_BLOCK
    place = np.arange(n)
    rows = np.cos(np.pi * (place + 0.5) * place[:, np.newaxis] / n) * np.sqrt(2 / n)
    rows[0] /= np.sqrt(2)
    return np.asarray(rows, dtype=np.float32)
