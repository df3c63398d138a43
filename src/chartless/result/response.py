"""The value that every calibration returns: one channel's curve, noise and trustworthiness."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from importlib import import_module

import numpy as np

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.models import UNIFORM_IRRADIANCE
from chartless.noise import AffineNoise, NoiseError
from chartless.result.account import Account, Fit
from chartless.types import Floats


class Status(Enum):
    """How an estimation ended."""

    CONVERGED = "converged"
    LIMIT_REACHED = "limit-reached"
    ASSUMED = "assumed"
    """Nothing was estimated: the curve is typical of cameras, or was named."""


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
    """Noise of a single frame in irradiance; None where the method does not estimate it."""
    n_levels: int
    """Levels L of the frames as calibrated; `inverse_lut` has one entry for each."""
    observed_levels: tuple[int, int]
    """Lowest and highest level seen. Beyond them the curve is extrapolated."""
    n_pairs: int
    """Pixels, pairs of them or blocks that were compared; 0 if another program made the curve or
    somebody named it."""
    method: str
    """Name in `chartless.methods.CALIBRATORS`; of a curve that was read, the format of its file,
    and of one that was named, "named"."""
    status: Status
    flags: tuple[Flag, ...] = ()
    accounts: tuple[Account, ...] = ()
    """What each kind of evidence says besides the curve."""
    log_evidence: float | None = None
    """Logarithm of the probability of the evidence under the family, by Laplace, for comparing
    families on the same frames; None where the method does not give it."""
    noise_error: NoiseError | None = None
    """Error of the noise parameters, where the method estimates one."""
    inverse_lut_std: Floats | None = None
    """Standard deviation of `inverse_lut`, shape (L,), where the method estimates one."""
    shape_std: Floats | None = None
    """The part of `inverse_lut_std` that is not one factor for all levels, shape (L,): what counts
    where light is compared with light. None where the method does not divide it."""
    white_std: float | None = None
    """The other part: relative deviation of the light at white against that of all levels. It is
    large where frames do not show how levels go over into white."""
    parameter_covariance: Floats | None = None
    """Covariance of the parameters of the family, in their order, shape (P, P); None without a
    family and where the method does not estimate it."""
    history: SearchHistory | None = None

    @property
    def inverse_lut(self) -> Floats:
        """Irradiance g at each level, shape (L,), 0 … 1."""
        return self.curve.inverse(np.arange(self.n_levels) / (self.n_levels - 1))

    @property
    def response_lut(self) -> Floats:
        """Brightness f on a uniform grid of irradiance, shape (1024,), 0 … 1."""
        return self.curve.response(UNIFORM_IRRADIANCE)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the kinds of evidence that have an account."""
        return tuple(each.kind for each in self.accounts)

    @property
    def fits(self) -> tuple[Fit, ...]:
        """How well the curve explains the evidence of all kinds."""
        return tuple(fit for each in self.accounts for fit in each.fits)

    def account(self, kind: str) -> Account:
        """What a kind of evidence says besides the curve; LookupError if there is none.

        Examples
        --------
        >>> response = calibration.channel("G")  # doctest: +SKIP
        >>> response.account("bracket")["scatter"]  # doctest: +SKIP
        0.021
        """
        for each in self.accounts:
            if each.kind == kind:
                return each
        msg = f"no account of {kind} in {', '.join(self.kinds) or 'this response'}"
        raise LookupError(msg)

    def at_levels(self, n_levels: int) -> "Response":
        """Return the same curve for frames of another number of levels."""
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
            accounts=tuple(each.at_levels(n_levels) for each in self.accounts),
        )

    def __repr__(self) -> str:
        """One line: tables of hundreds of levels are of no use in a terminal."""
        what = (self.method, f"{self.n_levels} levels", self.status.value)
        return f"<Response {self.name}: {', '.join((*what, *(each.code for each in self.flags)))}>"

    def _repr_html_(self) -> str:
        return html_card([self])

    def with_flags(self, *flags: Flag) -> "Response":
        """Return the same response with more flags, each at most once, in a fixed order."""
        held = {*self.flags, *flags}
        return replace(self, flags=tuple(flag for flag in Flag if flag in held))


def html_card(channels: Sequence[Response]) -> str:
    """HTML fragment that a notebook shows of responses.

    Reports, which draw it, lie above results and load matplotlib: they are found by name, and only
    when a notebook asks.
    """
    return str(import_module("chartless.report").card(channels))


def rmse(curve: AbstractCurve | Response, truth: AbstractCurve | Response) -> float:
    """Root of the mean squared difference of two responses over 1024 irradiances.

    The measure of the source paper; brightness runs from 0 to 1.

    Parameters
    ----------
    curve, truth : AbstractCurve or Response
        The curve of a `Response`, such as ``calibration.channel("G")``, is taken.

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
