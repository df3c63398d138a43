"""Brightness transfer functions between exposures, and a first curve from them.

The brightness transfer function T maps a level of the longer exposure to the level of
the same irradiance in the shorter one: g(T(O)) = g(O)/ρ (Grossberg & Nayar 2003,
doi:10.1109/TPAMI.2003.1240119). It is measured as the median of each row of a
comparagram, and gives a curve in milliseconds, from which the likelihood search starts.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from chartless.curves.prior import CurvePrior, irradiance_at_edges
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.types import Floats, Indices

# Relative deviation of irradiance by one median, besides rounding; residuals beyond
# three deviations get less and less weight.
_DOUBT, _FAR = 0.03, 3.0
_ROUNDS = 6
_HELD = 0.2  # error of exposures above which they are kept as given


class Transfer(NamedTuple):
    """A brightness transfer function, level by level."""

    level: Indices
    """Levels of the longer exposure whose pixels are neither black nor white in the shorter."""
    lower: Floats
    """Level of the shorter exposure, between 0 and L − 1."""


def brightness_transfer(counts: Floats) -> Transfer:
    """Transfer function of a comparagram, shape (L, L), rows of the longer exposure."""
    inner = np.arange(1, len(counts) - 1)
    level = inner[counts[inner].sum(axis=1) > 0]
    share = np.cumsum(counts[level], axis=1) / counts[level].sum(axis=1, keepdims=True)
    above = (share >= 0.5).argmax(axis=1)  # noqa: PLR2004 - the median
    rows = np.arange(level.size)
    below = np.where(above > 0, share[rows, above - 1], 0.0)
    lower = above - 0.5 + (0.5 - below) / (share[rows, above] - below)
    seen = (above > 0) & (above < len(counts) - 1)
    return Transfer(level[seen], lower[seen])


class TransferCurve(NamedTuple):
    """A curve fitted to transfer functions, with the corresponding exposures."""

    edges: Floats
    """Irradiance between the levels, shape (L − 1,)."""
    log_exposure_changes: Floats
    """Change of ln t of each exposure from its given value, shape (K,)."""


def transfer_curve(counts: ExposureCounts, prior: CurvePrior) -> TransferCurve:
    """Fit log slopes to ln g(O) − ln g(T(O)) = ln ρ, by least squares with a prior.

    Parameters
    ----------
    counts : ExposureCounts
    prior : CurvePrior
    """
    n_levels, n_exposures = counts.n_levels, counts.log_exposures.size
    transfers = [brightness_transfer(table.counts) for table in counts.forward]
    upper = np.concatenate([each.level for each in transfers])
    lower = np.concatenate([each.lower for each in transfers])
    sizes = [each.level.size for each in transfers]
    longer = np.repeat([table.longer for table in counts.forward], sizes)
    shorter = np.repeat([table.shorter for table in counts.forward], sizes)
    step = counts.log_exposures[longer] - counts.log_exposures[shorter]
    floor = lower.astype(np.intp)
    part = lower - floor
    # A residual is a weighted sum of five values: ln g of levels and changes of ln t.
    known = np.stack([upper, floor, floor + 1, n_levels + longer, n_levels + shorter], axis=1)
    one = np.ones(upper.size)
    factor = np.stack([one, part - 1, -part, -one, one], axis=1)
    size = n_levels + n_exposures
    cells = known[:, :, np.newaxis] * size + known[:, np.newaxis]
    products = factor[:, :, np.newaxis] * factor[:, np.newaxis]

    # Equal irradiances with equal exposures would fit any transfer function.
    free = 0 < counts.exposure_error < _HELD and not counts.held
    precision = np.zeros((size, size))
    precision[:n_levels, :n_levels] = prior.precision
    diagonal = np.arange(n_levels, size)
    precision[diagonal, diagonal] = 1 / counts.exposure_error**2 if free else 1e12
    mean = np.concatenate([prior.mean, np.zeros(n_exposures)])
    x = mean.copy()
    # ∂g_l/∂w_i: widths are the softmax of w, edges their sums.
    below = np.tril(np.ones((n_levels, n_levels)), -1) + 0.5 * np.eye(n_levels)
    for _ in range(_ROUNDS):
        edges = irradiance_at_edges(x[:n_levels])
        light = (edges[1:] + edges[:-1]) / 2
        width = np.diff(edges)
        values = np.concatenate([np.log(light), x[n_levels:]])
        residual = (factor * values[known]).sum(axis=1) - step
        rounding = (width[upper] / light[upper]) ** 2 + (width[floor] / light[floor]) ** 2
        variance = _DOUBT**2 + rounding / 12
        weight = 1 / (variance + (residual / _FAR) ** 2)
        weighted = products * weight[:, np.newaxis, np.newaxis]
        normal = np.bincount(cells.ravel(), weighted.ravel(), size**2).reshape(size, size)
        pulls = factor * (weight * residual)[:, np.newaxis]
        pull = np.bincount(known.ravel(), pulls.ravel(), size)
        jacobian = np.eye(size)
        jacobian[:n_levels, :n_levels] = (below - light[:, np.newaxis]) * width
        jacobian[:n_levels, :n_levels] /= light[:, np.newaxis]
        information = jacobian.T @ normal @ jacobian + precision
        gradient = -jacobian.T @ pull - precision @ (x - mean)
        x = x + cho_solve(cho_factor(information, lower=True, check_finite=False), gradient)
    return TransferCurve(irradiance_at_edges(x[:n_levels])[1:-1], x[n_levels:])
