"""Curve and noise of one channel at a mode."""

from dataclasses import dataclass

import numpy as np

from chartless.inference.block import curve_name
from chartless.inference.noise_block import affine, noise_name
from chartless.inference.search import Mode
from chartless.noise import AffineNoise
from chartless.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class ChannelMode:
    """View of a mode for one channel."""

    mode: Mode
    channel: str

    @property
    def edges(self) -> Floats:
        """Irradiance between the levels, shape (L − 1,)."""
        return self.mode.edges[curve_name(self.channel)]

    @property
    def coordinates(self) -> Floats:
        """Coordinates of the curve, shape (P,)."""
        return self.mode.values[curve_name(self.channel)]

    @property
    def log_noise(self) -> Floats | None:
        """(ln u, ln v); None if no term reads the noise."""
        return self.mode.values.get(noise_name(self.channel))

    @property
    def curve_place(self) -> slice:
        """Place of the coordinates in the factor of the mode."""
        return self.mode.places[curve_name(self.channel)]

    @property
    def noise_place(self) -> slice | None:
        """Place of the noise in the factor of the mode; None if no term reads it."""
        return self.mode.places.get(noise_name(self.channel))

    @property
    def noise_mix(self) -> Floats:
        """Derivatives of (ln u, ln v) by the unknowns of the noise, shape (D, 2)."""
        basis = self.mode.blocks[noise_name(self.channel)].basis
        return np.eye(2) if basis is None else basis

    @property
    def noise(self) -> AffineNoise:
        """Noise; a term must read it."""
        assert self.log_noise is not None
        return affine(self.log_noise)

    @property
    def log_floor(self) -> float:
        """Logarithm of v; a term must read the noise."""
        assert self.log_noise is not None
        return float(self.log_noise[1])

    @property
    def ratio(self) -> float:
        """Ratio r = u/v; a term must read the noise."""
        return self.noise.ratio

    @property
    def known(self) -> float:
        """Evidence that always counts in full: the noise prior and the firm part."""
        return self.mode.log_prior(noise_name(self.channel)) + self.mode.firm

    def weighted(self, share: float) -> float:
        """Evidence, with the pairs at their weight along the ridge."""
        return share * (self.mode.log_evidence - self.known) + self.known
