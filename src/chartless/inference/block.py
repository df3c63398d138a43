"""Named unknowns: the same name in two terms means the same unknowns."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from chartless.types import Floats

Values: TypeAlias = Mapping[str, Floats]
"""Unknowns by name of their block; the coordinates for a curve."""


def curve_name(channel: str) -> str:
    """Block name of the curve of a channel."""
    return f"curve/{channel}"


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Group of N unknowns with a Gaussian prior."""

    name: str
    """Name, such as "exposures", shared by channels, or "scene/R" of one channel."""
    mean: Floats
    """Mean of the prior, shape (N,)."""
    precision: Floats
    """Inverse covariance of the prior, shape (N, N)."""
    basis: Floats | None = None
    """Directions in which the unknowns can move, shape (D, N); None for all."""
    held: bool = False
    """Whether the unknowns stay at their mean: their error widens the others, and
    evidence does not move them."""
    centred: bool = False
    """Whether adding a constant changes nothing; the mean is then kept at 0."""

    @property
    def size(self) -> int:
        """Number of directions D, or N without a basis."""
        return self.mean.size if self.basis is None else len(self.basis)

    def moved(self, values: Floats, step: Floats) -> Floats:
        """Values after a step, shape (D,)."""
        there = values + (step if self.basis is None else step @ self.basis)
        return there - there.mean() if self.centred else there

    def along(self, gradient: Floats) -> Floats:
        """Gradient in the directions in which the unknowns can move, shape (D,)."""
        return gradient if self.basis is None else self.basis @ gradient

    @property
    def precision_along(self) -> Floats:
        """Precision of the prior in these directions, shape (D, D)."""
        if self.basis is None:
            return self.precision
        return self.basis @ self.precision @ self.basis.T
