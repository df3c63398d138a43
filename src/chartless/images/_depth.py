"""How many bits the samples of a file really have.

Sensors count to 10, 12 or 14 bits, files have room for 8, 16 or 32. What is left over is filled
with zeros, with the sample's own upper bits, or by scaling. Every way keeps the sample as it is in
the upper bits, and what the lower ones hold shows how many those are.
"""

import numpy as np
import numpy.typing as npt

from chartless.types import Levels

FEWEST_BITS = 8
MOST_BITS = 16
_ENOUGH = 64
"""Levels that must occur before a pattern among them is no chance."""

_Samples = npt.NDArray[np.unsignedinteger]


def significant_bits(samples: _Samples, noted: int | None = None) -> int:
    """Bits of the levels that were widened to fill these samples.

    Parameters
    ----------
    samples : ndarray of uint16 or uint32
    noted : int, optional
        What the file says; believed if the samples do not contradict it.

    Returns
    -------
    int
        8 … 16, or the bits of the type if nothing shows that they were widened.
    """
    container = 8 * samples.itemsize
    seen = _distinct(samples)
    if noted is not None and FEWEST_BITS <= noted <= MOST_BITS and _fits(seen, noted, container):
        return noted
    if seen.size >= _ENOUGH:
        for bits in range(FEWEST_BITS, min(container, MOST_BITS + 1)):
            if _fits(seen, bits, container):
                return bits
    return container


def narrowed(samples: _Samples, bits: int) -> Levels:
    """Levels of so many bits, of samples in whose upper bits they stand.

    Parameters
    ----------
    samples : ndarray of uint16 or uint32
    bits : int
        8 … 16.

    Returns
    -------
    ndarray of uint8 if they fit, or of uint16; shape of `samples`
    """
    upper = samples >> (8 * samples.itemsize - bits)
    return upper.astype(np.uint8) if bits == FEWEST_BITS else upper.astype(np.uint16)


def _distinct(samples: _Samples) -> npt.NDArray[np.int64]:
    if samples.itemsize > 2:  # noqa: PLR2004 - more values than one would count
        return np.unique(samples).astype(np.int64)
    return np.flatnonzero(np.bincount(samples.ravel(), minlength=1 << 16))


def _fits(samples: npt.NDArray[np.int64], bits: int, container: int) -> bool:
    """Whether one of the known ways makes all samples of their upper bits."""
    level = samples >> (container - bits)
    repeated = np.zeros_like(level)
    for place in range(container - bits, -bits, -bits):
        repeated |= level << place if place >= 0 else level >> -place
    white = (1 << bits) - 1
    scaled, rest = np.divmod(level * ((1 << container) - 1), white)
    ways = (level << (container - bits), repeated, scaled, scaled + (2 * rest > white))
    return any(np.array_equal(way, samples) for way in ways)
