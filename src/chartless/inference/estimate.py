"""Estimated curve with its error bands, and ways to widen them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.curves.space import AbstractCurveSpace, FamilyCurve
from chartless.inference.posterior import Posterior
from chartless.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class CurveEstimate:
    """Curve of one channel with its errors."""

    curve: AbstractCurve
    inverse_lut: Floats
    """Irradiance g at each level, shape (L,), 0 … 1."""
    std: Floats
    """Standard deviation of `inverse_lut`, shape (L,)."""
    shape_std: Floats | None = None
    """Part of `std` beyond a common factor, shape (L,); None if not divided."""
    white_std: float | None = None
    """Other part: relative deviation of light at white against that of all levels."""
    parameter_covariance: Floats | None = None
    """Covariance of the family's parameters, shape (P, P); None for a free curve."""

    @property
    def shape_or_all(self) -> Floats:
        """`shape_std`, or `std` if not divided, shape (L,)."""
        return self.std if self.shape_std is None else self.shape_std

    @classmethod
    def of(cls, posterior: Posterior, space: AbstractCurveSpace) -> "CurveEstimate":
        """Curve and bands of a posterior."""
        curve: AbstractCurve = SampledCurve.from_inverse(posterior.inverse)
        covariance = None
        if isinstance(space, FamilyCurve):
            parameters = space.parameters(posterior.best.coordinates)
            curve = ModelCurve(space.model.name, tuple(map(float, parameters)))
            covariance = space.parameter_covariance(posterior.coordinate_covariance)
        n_levels = posterior.inverse.size
        spread = posterior.spread
        return cls(
            curve=curve,
            inverse_lut=curve.inverse(np.arange(n_levels) / (n_levels - 1)),
            std=posterior.inverse_std,
            shape_std=None if spread is None else spread.shape,
            white_std=None if spread is None else spread.log_scale,
            parameter_covariance=covariance,
        )

    def with_exponent_error(self, error: float) -> "CurveEstimate":
        """Return the same curve with an additional deviation of ln γ in its bands.

        Where g^γ explains the evidence as well as g, the error of g is g ln g times
        that of ln γ; that of its scale is the mean of ln g, with weights g², times that
        of ln γ.
        """
        light = self.inverse_lut
        log_light = np.log(np.maximum(light, np.finfo(np.float64).tiny))
        white = self.white_std
        if white is not None:
            white = float(np.hypot(white, error * (light**2 @ log_light) / (light @ light)))
        return replace(self.with_level_errors(error * light * log_light), white_std=white)

    def with_level_errors(self, error: Floats) -> "CurveEstimate":
        """Return the same curve with an additional deviation of g, shape (L,)."""
        shape = self.shape_std
        return replace(
            self,
            std=np.hypot(self.std, error),
            shape_std=None if shape is None else np.hypot(shape, error),
        )

    def with_white_error(self, error: float) -> "CurveEstimate":
        """Return the same curve with an additional relative deviation at white."""
        if self.white_std is None or error == 0:
            return self
        below_white = np.append(self.inverse_lut[:-1], 0.0)
        return replace(
            self,
            std=np.hypot(self.std, error * below_white),
            white_std=float(np.hypot(self.white_std, error)),
        )

    def scaled(self, factor: float) -> "CurveEstimate":
        """Return the same curve with all deviations multiplied by `factor`."""
        shape, white, covariance = self.shape_std, self.white_std, self.parameter_covariance
        return replace(
            self,
            std=factor * self.std,
            shape_std=None if shape is None else factor * shape,
            white_std=None if white is None else factor * white,
            parameter_covariance=None if covariance is None else factor**2 * covariance,
        )


def with_mean_bands(estimates: Sequence[CurveEstimate]) -> CurveEstimate:
    """First of several estimates of one curve, with their mean variances."""

    def mean(values: Sequence[Floats | float | None]) -> Floats | None:
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        return np.asarray(np.sqrt(np.mean(np.array(known) ** 2, axis=0)))

    white = mean([each.white_std for each in estimates])
    std = mean([each.std for each in estimates])
    assert std is not None
    return replace(
        estimates[0],
        std=std,
        shape_std=mean([each.shape_std for each in estimates]),
        white_std=None if white is None else float(white),
    )
