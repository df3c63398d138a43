"""The noise of single frames as unknowns that several terms share."""

from dataclasses import dataclass

import numpy as np

from chartless.inference.block import Block, Values
from chartless.noise import AffineNoise, NoisePrior
from chartless.types import Floats


@dataclass(frozen=True, slots=True)
class NoiseBlock:
    """Unknowns (ln u, ln v) of a channel."""

    channel: str
    prior: NoisePrior
    holds_ratio: bool = False
    """Whether r = u/v stays what it is: ln u and ln v move together. Level pairs of one exposure
    hardly tell r."""

    @property
    def name(self) -> str:
        """Of the block."""
        return noise_name(self.channel)

    @property
    def mix(self) -> Floats:
        """How (ln u, ln v) change with each unknown that moves, shape (D, 2)."""
        return np.ones((1, 2)) if self.holds_ratio else np.eye(2)

    @property
    def block(self) -> Block:
        """Block of the two numbers."""
        return Block(self.name, self.prior.mean, self.prior.precision, basis=self.mix)

    def noise(self, values: Values) -> AffineNoise:
        """U and v at a state."""
        return affine(values[self.name])


def noise_name(channel: str) -> str:
    """Name of the noise of a channel, among blocks."""
    return f"noise/{channel}"


def affine(log_noise: Floats) -> AffineNoise:
    """Noise of (ln u, ln v)."""
    slope, floor = np.exp(log_noise)
    return AffineNoise(float(slope), float(floor))
