"""Light and level of the same blocks of pixels."""

from dataclasses import dataclass

import numpy as np

from chartless.types import Floats, Indices


@dataclass(frozen=True, slots=True, eq=False)
class RawBlocks:
    """Light and level of uniform blocks of pixels, in one channel."""

    level: Floats
    """Mean level of each block, shape (N,)."""
    light: Floats
    """White-balanced red, green and blue of the raw file, arbitrary scale, (N, 3)."""
    chroma: Floats
    """Distance of the block from grey, 0 … 1, shape (N,)."""
    radius: Floats
    """Distance from the middle of the picture as a share of half its diagonal, shape (N,)."""
    shot: Indices
    """Number of the shot, shape (N,)."""
    base: Floats
    """Weights of red, green and blue for a camera without a matrix, shape (3,), of sum 1."""
    light_error: float
    """Error of the black level of the raw file, in units of the light."""
    n_levels: int

    @property
    def n_shots(self) -> int:
        """Number of shots, with or without blocks."""
        return int(self.shot.max(initial=-1)) + 1

    @property
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level of the blocks."""
        return int(np.floor(self.level.min())), int(np.ceil(self.level.max()))
