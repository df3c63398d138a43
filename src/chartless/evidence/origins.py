"""How probable each population of cameras is, by the files alone."""

from collections.abc import Iterable
from types import MappingProxyType

from chartless.curves.populations import PopulationWeights
from chartless.frames.frame import Origin

OF_ORIGIN = MappingProxyType(
    {
        Origin.UNKNOWN: PopulationWeights(digital=0.7, dorf=0.15, gamma=0.1, log=0.05),
        Origin.CAMERA: PopulationWeights(digital=0.9, dorf=0.05, gamma=0.04, log=0.01),
        Origin.RAW: PopulationWeights(digital=0.1, dorf=0.05, gamma=0.84, log=0.01),
        Origin.VIDEO: PopulationWeights(digital=0.6, dorf=0.05, gamma=0.15, log=0.2),
    }
)
"""Weights of populations by the origin of files.

They are judgements: evidence soon outweighs them, and without evidence the most common
population decides. Colour tags do not count: cameras tag pictures as sRGB or Rec. 709 and
record another curve (docs/design/0014-populations.md).
"""


def weights_of(origins: Iterable[Origin]) -> PopulationWeights:
    """Weights for files of one camera: those of the first origin that is known."""
    known = (each for each in origins if each is not Origin.UNKNOWN)
    return OF_ORIGIN[next(known, Origin.UNKNOWN)]
