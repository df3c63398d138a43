"""Compare families by how well they describe measured curves for their number of parameters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chartless.curves.fitting import Fit, checked_samples, fit
from chartless.errors import ParameterError
from chartless.models import MODELS, UNIFORM_IRRADIANCE, AbstractModel
from chartless.types import Floats

HIGHEST_ORDER = 6
"""Highest order of the families of any order that are compared."""
FAR_OFF = 0.15
"""RMSE from which on a fit describes nothing: a linear camera is off by 0.2."""
_FEWEST = 5
_TOLERANCE = 1e-9
_LEAST_RMSE = 1e-9  # a curve known more exactly than this is a formula


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A family fitted to each of several measured curves, and judged."""

    model: AbstractModel
    fits: tuple[Fit, ...]
    """One for each curve."""
    aicc: float
    """Akaike's criterion, corrected for few samples."""
    bic: float
    """Schwarz's criterion. Both are infinite with fewer than two samples to a fitted number."""
    valid: bool
    """Whether all fitted curves are responses: see `is_valid`."""

    @property
    def rmse(self) -> float:
        """Root of the mean squared difference over all curves."""
        return float(np.sqrt(np.mean([fit.rmse**2 for fit in self.fits])))


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Families fitted to measured curves."""

    candidates: tuple[Candidate, ...]
    """Candidates in the order of `MODELS`."""
    n_independent: tuple[float, ...]
    """Number of independent samples of each curve, as the criteria count them."""

    @property
    def recommended(self) -> Candidate | None:
        """Least BIC among the valid responses that come near; None if there is none."""
        valid = [
            each
            for each in self.candidates
            if each.valid and np.isfinite(each.bic) and each.rmse < FAR_OFF
        ]
        return min(valid, key=lambda each: each.bic, default=None)


def default_models() -> list[str]:
    """Every family, those of any order up to `HIGHEST_ORDER`."""
    return [
        name for name, model in MODELS.items() if model.order <= HIGHEST_ORDER or name == "table"
    ]


def is_valid(fit: Fit) -> bool:
    """Whether a fitted curve runs from 0 to 1, never decreases and stays in [0, 1].

    Judged at 1024 irradiances, to 1e-9.
    """
    curve = fit.response(UNIFORM_IRRADIANCE)
    ends = abs(curve[0]) <= _TOLERANCE and abs(curve[-1] - 1) <= _TOLERANCE
    return bool(ends and fit.increases and stays_inside(curve))


def stays_inside(curve: Floats) -> bool:
    """Whether brightness stays in [0, 1], to 1e-9."""
    return bool(np.all((curve >= -_TOLERANCE) & (curve <= 1 + _TOLERANCE)))


def compare(
    curves: Sequence[tuple[Floats, Floats]],
    *,
    models: Sequence[str] | None = None,
    on_model: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Fit families to measured curves and judge them.

    Parameters
    ----------
    curves : sequence of (ndarray, ndarray), each of shape (N,), 0 … 1
        Irradiance and brightness of each curve.
    models : sequence of str, optional
        Names in `MODELS`; without, `default_models`. Those with fewer than two samples to
        spare are left out.
    on_model : callable, optional
        Called with the number of families done and the number in all.

    Returns
    -------
    Comparison

    Raises
    ------
    UnknownNameError, ParameterError
        As for `fit`.

    Notes
    -----
    With k fitted numbers (the variance is one) and n samples, AICc = n ln(RSS/n) + 2k +
    2k(k+1)/(n − k − 1) and BIC = n ln(RSS/n) + k ln n (Burnham and Anderson, *Model selection
    and multimodel inference*, 2002), summed over the curves. Both suppose independent errors.
    Those of a smooth, densely sampled curve are anything but, and the criteria would always
    ask for more parameters; so n is the number of independent samples,
    `independent_samples` of the closest fit.
    """
    if not curves:
        msg = "there is no curve to compare families on"
        raise ParameterError(msg)
    for irradiance, brightness in curves:
        checked_samples(irradiance, brightness)
    fewest = min(irradiance.size for irradiance, _ in curves)
    if fewest < _FEWEST:
        msg = f"families are compared on {_FEWEST} samples or more, not {fewest}"
        raise ParameterError(msg)
    names = [
        name
        for name in (default_models() if models is None else models)
        if MODELS[name].penalty is not None or MODELS[name].n_parameters <= fewest - 2
    ]
    if not names:
        msg = f"{fewest} samples are too few for any of the requested families"
        raise ParameterError(msg)
    fits: dict[str, tuple[Fit, ...]] = {}
    for done, name in enumerate(names, start=1):
        fits[name] = tuple(fit(name, irradiance, brightness) for irradiance, brightness in curves)
        if on_model is not None:
            on_model(done, len(names))
    counts = []
    for place, (irradiance, brightness) in enumerate(curves):
        # The table comes as close as its smoothness lets it, whatever the errors are.
        own = [each[place] for each in fits.values() if each[place].model.penalty is None]
        closest = min(own or [each[place] for each in fits.values()], key=lambda each: each.rmse)
        counts.append(independent_samples(closest.response(irradiance) - brightness))
    candidates = []
    for name, each in fits.items():
        criteria = [_criteria(one, n) for one, n in zip(each, counts, strict=True)]
        aicc, bic = np.sum(criteria, axis=0).tolist()
        valid = all(map(is_valid, each))
        candidates.append(Candidate(MODELS[name], each, aicc, bic, valid))
    return Comparison(tuple(candidates), tuple(counts))


def independent_samples(residual: Floats) -> float:
    """How many independent numbers residuals (N,) amount to: twice their changes of sign.

    White noise changes its sign N/2 times; a smooth difference of c zeros is known from some
    2c samples, however densely it was sampled (Rice's formula with the sampling theorem).
    """
    if np.sqrt(np.mean(residual**2)) < _LEAST_RMSE:  # rounding, not a difference
        return float(residual.size)
    signs = np.sign(residual)
    signs = signs[signs != 0]
    changes = int(np.count_nonzero(signs[1:] != signs[:-1]))
    return float(min(2 * changes + 1, residual.size))


def _criteria(fit: Fit, n: float) -> tuple[float, float]:
    """AICc and BIC of a fit with n independent samples."""
    k = fit.n_free + 1
    if n < 2 * k or n <= k + 1:  # BIC, for large n, would reward running through the samples
        return np.inf, np.inf
    misfit = 2 * n * float(np.log(max(fit.rmse, _LEAST_RMSE)))
    return misfit + 2 * k + 2 * k * (k + 1) / (n - k - 1), misfit + k * float(np.log(n))
