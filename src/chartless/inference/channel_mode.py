"""A mode as one channel sees it: its curve and its noise."""

from dataclasses import dataclass

import numpy as np

from chartless.inference.block import curve_name
from chartless.inference.noise_block import affine, noise_name
from chartless.inference.search import Mode
from chartless.noise import AffineNoise
from chartless.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class ChannelMode:
    """A mode as one channel sees it."""

    mode: Mode
    channel: str

    @property
    def edges(self) -> Floats:
        """Shape (L − 1,)."""
        return self.mode.edges[curve_name(self.channel)]

    @property
    def coordinates(self) -> Floats:
        """Of the curve, shape (P,)."""
        return self.mode.values[curve_name(self.channel)]

    @property
    def log_noise(self) -> Floats | None:
        """(ln u, ln v); None where no term reads it."""
        return self.mode.values.get(noise_name(self.channel))

    @property
    def curve_place(self) -> slice:
        """Of the coordinates, in the factor of the mode."""
        return self.mode.places[curve_name(self.channel)]

    @property
    def noise_place(self) -> slice | None:
        """Of the noise, likewise."""
        return self.mode.places.get(noise_name(self.channel))

    @property
    def noise_mix(self) -> Floats:
        """How (ln u, ln v) change with each unknown of the noise, shape (D, 2)."""
        basis = self.mode.blocks[noise_name(self.channel)].basis
        return np.eye(2) if basis is None else basis

    @property
    def noise(self) -> AffineNoise:
        """Noise, where there is one."""
        assert self.log_noise is not None
        return affine(self.log_noise)

    @property
    def log_floor(self) -> float:
        """Ln v, where there is noise."""
        assert self.log_noise is not None
        return float(self.log_noise[1])

    @property
    def ratio(self) -> float:
        """R = u/v, where there is noise."""
        return self.noise.ratio

    @property
    def known(self) -> float:
        """Part of the evidence that is never weighted down: that of the noise prior, and firm."""
        return self.mode.log_prior(noise_name(self.channel)) + self.mode.firm

    def weighted(self, share: float) -> float:
        """Evidence, that of the pairs at their weight along the ridge."""
        return share * (self.mode.log_evidence - self.known) + self.known
