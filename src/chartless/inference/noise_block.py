"""Noise of single frames as unknowns that several terms share."""

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
    """Whether r = u/v is fixed, so that ln u and ln v move together: level pairs of one
    exposure hardly constrain r."""

    @property
    def name(self) -> str:
        """Name of the block."""
        return noise_name(self.channel)

    @property
    def mix(self) -> Floats:
        """Derivatives of (ln u, ln v) by the unknowns, shape (D, 2)."""
        return np.ones((1, 2)) if self.holds_ratio else np.eye(2)

    @property
    def block(self) -> Block:
        """Block of the two unknowns."""
        return Block(self.name, self.prior.mean, self.prior.precision, basis=self.mix)

    def noise(self, values: Values) -> AffineNoise:
        """Noise at given values."""
        return affine(values[self.name])


def noise_name(channel: str) -> str:
    """Block name of the noise of a channel."""
    return f"noise/{channel}"


def affine(log_noise: Floats) -> AffineNoise:
    """Noise with given (ln u, ln v)."""
    slope, floor = np.exp(log_noise)
    return AffineNoise(float(slope), float(floor))
