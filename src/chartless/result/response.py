"""The value that every calibration returns: one channel's curve, noise and trustworthiness."""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError
from chartless.evidence.bracket.estimates import ExposureEstimate
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.estimates import NoiseError
from chartless.evidence.raw.estimates import RawEstimate
from chartless.flags import Flag, Pattern
from chartless.models import UNIFORM_IRRADIANCE
from chartless.noise import AffineNoise
from chartless.types import Floats


class Status(Enum):
    """How an estimation ended."""

    CONVERGED = "converged"
    LIMIT_REACHED = "limit-reached"


@dataclass(frozen=True, slots=True)
class SearchHistory:
    """How an objective improved, for plots."""

    objective: str
    """Name in `chartless.methods.ism.objectives.OBJECTIVES`."""
    values: tuple[float, ...]
    """Best value at the start and after each round."""
    evaluations: int
    """How often the objective was evaluated."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Response:
    """A camera's response in one channel, estimated.

    Plotting, files and formats live in modules of their own; this is only a value.
    """

    name: str
    """Channel: "R", "G", "B" or "Y"."""
    curve: AbstractCurve
    """f and its inverse g."""
    noise: AffineNoise | None
    """Noise of a single frame in irradiance; None where the method does not tell it."""
    n_levels: int
    """Levels L of the frames as calibrated; `inverse_lut` has one entry for each."""
    observed_levels: tuple[int, int]
    """Lowest and highest level seen. Beyond them the curve is extrapolated."""
    n_pairs: int
    """Pixel pairs that were counted."""
    method: str
    """Name in `chartless.methods.CALIBRATORS`."""
    status: Status
    flags: tuple[Flag, ...] = ()
    similarity: float | None = None
    """Goodness of fit, 0 … 1: image similarity as a share of what the true model would reach
    on so many pixels; None where the method does not tell it."""
    deviance: float | None = None
    """Goodness of fit of the likelihood: deviance of the level pairs over what chance gives, 1 if
    the model explains them; None where the method does not tell it."""
    pattern: Pattern | None = None
    """How the level pairs differ from what the model expects, where that is a misfit."""
    log_evidence: float | None = None
    """Logarithm of the probability of the pairs under the family, by Laplace, for comparing
    families on the same frames; None where the method does not tell it."""
    noise_error: NoiseError | None = None
    """Of the noise parameters, where the method tells one."""
    inverse_lut_std: Floats | None = None
    """Standard deviation of `inverse_lut`, shape (L,), where the method tells one."""
    shape_std: Floats | None = None
    """The part of `inverse_lut_std` that is not one factor for all levels, shape (L,): what counts
    where light is compared with light. None where the method does not divide it."""
    white_std: float | None = None
    """The other part: relative deviation of the light at white against that of all levels. It is
    large where frames do not show how levels go over into white."""
    inverse_lut_std_with_dark: Floats | None = None
    """What `inverse_lut_std` would be after two frames with the lens covered, shape (L,); None
    where there were some, for a family and where the method makes no use of them."""
    parameter_covariance: Floats | None = None
    """Of the parameters of the family, in their order, shape (P, P); None without a family and
    where the method does not tell it."""
    outliers: float | None = None
    """Share of the pairs left out because they changed far more than noise explains; None where
    the method leaves none out."""
    exposures: ExposureEstimate | None = None
    """Of a bracket, where the method tells it."""
    raw: RawEstimate | None = None
    """Of raw files, where there were some."""
    history: SearchHistory | None = None
    table: Cooccurrence | None = None
    """The evidence, for plots and for estimating again, without what was left out."""

    @property
    def inverse_lut(self) -> Floats:
        """Irradiance g at each level, shape (L,), 0 … 1."""
        return self.curve.inverse(np.arange(self.n_levels) / (self.n_levels - 1))

    @property
    def response_lut(self) -> Floats:
        """Brightness f on a uniform grid of irradiance, shape (1024,), 0 … 1."""
        return self.curve.response(UNIFORM_IRRADIANCE)

    @property
    def exposure_misfit(self) -> float | None:
        """Goodness of fit of a bracket, 0 if the curve explains it.

        How far the light of two exposures is from their ratio: relative, in the median. None where
        the method does not tell what they show.
        """
        if self.exposures is None or not any(each.upper for each in self.exposures.transfers):
            return None
        apart = [each.apart(self.curve, self.n_levels) for each in self.exposures.transfers]
        return float(np.median(np.abs(np.concatenate(apart))))

    def at_levels(self, n_levels: int) -> "Response":
        """Return the same curve for frames of another number of levels; without the evidence."""
        last = self.n_levels - 1
        scale = (n_levels - 1) / last
        low, high = self.observed_levels

        def spread(std: Floats | None) -> Floats | None:
            if std is None:
                return None
            return np.interp(np.linspace(0, last, n_levels), np.arange(last + 1), std)

        return replace(
            self,
            n_levels=n_levels,
            observed_levels=(int(low * scale), int(high * scale)),
            inverse_lut_std=spread(self.inverse_lut_std),
            shape_std=spread(self.shape_std),
            inverse_lut_std_with_dark=None,
            exposures=None if self.exposures is None else self.exposures.scaled(scale),
            table=None,
        )

    def __repr__(self) -> str:
        """One line: tables of hundreds of levels tell nothing in a terminal."""
        what = (self.method, f"{self.n_levels} levels", self.status.value)
        return f"<Response {self.name}: {', '.join((*what, *(each.code for each in self.flags)))}>"

    def _repr_html_(self) -> str:
        from chartless.report import card

        return card([self])

    def with_flags(self, *flags: Flag) -> "Response":
        """Return the same response with more flags, each at most once, in a fixed order."""
        held = {*self.flags, *flags}
        return replace(self, flags=tuple(flag for flag in Flag if flag in held))


def rmse(curve: AbstractCurve | Response, truth: AbstractCurve | Response) -> float:
    """Root of the mean squared difference of two responses over 1024 irradiances.

    The measure of the source paper; brightness runs from 0 to 1.

    Parameters
    ----------
    curve, truth : AbstractCurve or Response
        Of a `Response`, such as ``calibration.channel("G")``, its curve is taken.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        If either is something else.

    Examples
    --------
    >>> from chartless import named_curve, rmse
    >>> round(rmse(named_curve("srgb"), named_curve("gamma:0.45")), 3)
    0.006
    """
    difference = _brightness("curve", curve) - _brightness("truth", truth)
    return float(np.sqrt(np.mean(difference**2)))


def _brightness(name: str, given: AbstractCurve | Response) -> Floats:
    curve = given.curve if isinstance(given, Response) else given
    if not isinstance(curve, AbstractCurve):
        msg = (
            f"{name} must be a curve or a Response, such as named_curve('srgb') or "
            f"calibration.channel('G'), not {type(curve).__name__}"
        )
        raise ParameterError(msg)
    return curve.response(UNIFORM_IRRADIANCE)
