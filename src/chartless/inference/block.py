"""Unknowns by name: what has the same name in two terms is the same."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from chartless.types import Floats

Values: TypeAlias = Mapping[str, Floats]
"""Unknowns by the names of their blocks; of a curve its coordinates."""


def curve_name(channel: str) -> str:
    """Name of the curve of a channel, among blocks."""
    return f"curve/{channel}"


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Unknowns that belong together, N numbers with a Gaussian prior."""

    name: str
    """Such as "exposures", which all channels share, or "scene/R" of one channel."""
    mean: Floats
    """Of the prior, shape (N,)."""
    precision: Floats
    """Inverse covariance of the prior, shape (N, N)."""
    basis: Floats | None = None
    """Directions in which the numbers can move, shape (D, N); None if in all."""
    held: bool = False
    """Whether the numbers stay at their mean: their error widens the others, and evidence does not
    move them."""
    centred: bool = False
    """Whether a constant more or less makes no difference; then their mean is kept at 0."""

    @property
    def size(self) -> int:
        """D, or N without a basis."""
        return self.mean.size if self.basis is None else len(self.basis)

    def moved(self, values: Floats, step: Floats) -> Floats:
        """Values after a step, shape (D,)."""
        there = values + (step if self.basis is None else step @ self.basis)
        return there - there.mean() if self.centred else there

    def along(self, gradient: Floats) -> Floats:
        """Gradient in the directions in which the numbers move, shape (D,)."""
        return gradient if self.basis is None else self.basis @ gradient

    @property
    def precision_along(self) -> Floats:
        """Precision of the prior in these directions, shape (D, D)."""
        if self.basis is None:
            return self.precision
        return self.basis @ self.precision @ self.basis.T
