"""Mitsunaga & Nayar 1999: polynomial g of chosen order, refined exposure ratios."""

from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.methods._base import CALIBRATORS
from chartless.methods._exposures import AbstractExposureCalibrator
from chartless.types import Floats

_MOST_ROUNDS, _SETTLED = 100, 1e-4
_DARK = 0.02  # brightness below which good fits to steep cameras may dip slightly


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MitsunagaCalibrator(AbstractExposureCalibrator):
    """Least squares on g(M_longer) − ρ g(M_shorter) of neighbouring exposures, with g(1) = 1 [1]_.

    Where exposures are not exact, each ρ is refined in turn with the polynomial, to the
    mean of g(M_longer)/g(M_shorter) over the pixels. A power of the curve with the same
    power of the ratios explains a bracket equally well, so the ratio of the longest to
    the shortest exposure is held.

    Parameters
    ----------
    most_order : int
        Highest order tried. The increasing polynomial with the least error is used:
        others oscillate at bright levels that the scene does not show.

    References
    ----------
    .. [1] Mitsunaga & Nayar (1999), "Radiometric self calibration", CVPR,
       doi:10.1109/CVPR.1999.786966.
    """

    most_order: int = 10

    def __post_init__(self) -> None:
        if not 1 <= self.most_order <= 20:  # noqa: PLR2004 - beyond, powers are alike
            msg = f"most_order must lie between 1 and 20, not {self.most_order!r}"
            raise ParameterError(msg)

    @property
    @override
    def method(self) -> str:
        return "mitsunaga"

    @override
    def inverse_lut(self, counts: ExposureCounts) -> tuple[Floats, bool]:
        pairs = _neighbours(counts)
        fits = [
            _fitted(pairs, order, refine=counts.exposure_error > 0 and not counts.held)
            for order in range(1, self.most_order + 1)
        ]
        brightness = np.linspace(0.0, 1.0, counts.n_levels)
        curves = [np.vander(brightness, fit[0].size, increasing=True) @ fit[0] for fit in fits]
        seen = brightness >= _DARK
        falls = [bool(np.any(np.diff(curve[seen]) < 0)) for curve in curves]
        best = min(range(len(fits)), key=lambda place: (falls[place], fits[place][1]))
        return curves[best], fits[best][2]


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Pixels that are neither black nor white in either of two exposures."""

    longer: Floats
    """Brightness M in the longer exposure, shape (N,)."""
    shorter: Floats
    weight: Floats
    """Weights with a sum of 1, shape (N,)."""
    ratio: float
    """Nominal ρ."""


def _neighbours(counts: ExposureCounts) -> list[_Pair]:
    order = np.argsort(counts.log_exposures, kind="stable")
    place = np.argsort(order)
    pairs = []
    for table in counts.forward:
        if place[table.longer] - place[table.shorter] != 1:
            continue
        inner = table.counts[1:-1, 1:-1]
        rows, columns = np.nonzero(inner)
        if rows.size:
            step = counts.log_exposures[table.longer] - counts.log_exposures[table.shorter]
            weight = inner[rows, columns] / inner.sum()
            top = counts.n_levels - 1
            pairs.append(_Pair((rows + 1) / top, (columns + 1) / top, weight, float(np.exp(step))))
    return pairs


def _fitted(pairs: list[_Pair], order: int, *, refine: bool) -> tuple[Floats, float, bool]:
    """Coefficients c_0 … c_N, their squared error and whether the ratios converged."""
    ratios = np.array([pair.ratio for pair in pairs])
    log_ratios = np.log(ratios)
    powers = [
        [np.vander(side, order + 1, increasing=True) for side in (pair.longer, pair.shorter)]
        for pair in pairs
    ]
    root = np.sqrt(np.concatenate([pair.weight for pair in pairs]))
    before = np.zeros(order + 1)
    settled = False
    for _ in range(_MOST_ROUNDS):
        rows = np.concatenate(
            [
                longer - ratio * shorter
                for (longer, shorter), ratio in zip(powers, ratios, strict=True)
            ]
        )
        # g(1) = 1 leaves c_N = 1 − Σ c_n.
        design = (rows[:, :-1] - rows[:, -1:]) * root[:, np.newaxis]
        target = -rows[:, -1] * root
        head = np.linalg.lstsq(design, target)[0]
        coefficients = np.append(head, 1 - head.sum())
        error = float(np.sum((design @ head - target) ** 2))
        settled = bool(np.abs(coefficients - before).max() < _SETTLED)
        if settled or not refine:
            settled = True
            break
        before = coefficients
        for place, (longer, shorter) in enumerate(powers):
            bright, dark = longer @ coefficients, shorter @ coefficients
            lit = (dark > 0) & (bright > dark)
            if lit.any():
                ratios[place] = np.average(
                    (bright / np.where(lit, dark, 1))[lit], weights=pairs[place].weight[lit]
                )
        # Otherwise the rounds drift along the powers.
        ratios **= log_ratios.sum() / np.log(ratios).sum()
    return coefficients, error, settled


CALIBRATORS.register("mitsunaga", MitsunagaCalibrator)
