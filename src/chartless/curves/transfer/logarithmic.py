"""Logarithmic curves of cameras, as their makers publish them; light is reflectance.

The signal is that of full range, code value over 1023 of 10 bits. Makers whose documents list the
code values of recordings have a second curve for pictures from recordings of limited range, in
which programs have put the code 64 to 0 and 940 to 1. ARRI, Blackmagic, RED and Apple define the
signal after that step.
"""

from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np
from typing_extensions import override

from chartless.curves.transfer._base import (
    AbstractFormula,
    PublishedCurve,
    TransferFunction,
    register_transfer_function,
)
from chartless.types import Floats

_LN_10, _LOG10_2 = float(np.log(10)), float(np.log10(2))


class Toe(NamedTuple):
    """The straight line slope · x + offset, up to x = end."""

    slope: float
    offset: float
    end: float


@final
@dataclass(frozen=True, slots=True)
class Logarithm(AbstractFormula):
    """y = c log₁₀(a x + b) + d, below the end of the toe its straight line.

    Published numbers are rounded, so that the two do not quite meet: each is held to its own side
    of the signal where the logarithm begins.
    """

    a: float
    b: float
    c: float
    d: float
    toe: Toe | None = None

    @override
    def encode(self, light: Floats) -> Floats:
        begin = 0.0 if self.toe is None else self.toe.end
        logarithm = self._logarithm(np.maximum(light, begin))
        if self.toe is None:
            return logarithm
        line = np.minimum(self.toe.slope * light + self.toe.offset, self._logarithm(begin))
        return np.where(light < begin, line, logarithm)

    @override
    def decode(self, signal: Floats) -> Floats:
        exponential: Floats = (np.power(10.0, (signal - self.d) / self.c) - self.b) / self.a
        if self.toe is None:
            return exponential
        line = np.minimum((signal - self.toe.offset) / self.toe.slope, self.toe.end)
        return np.where(signal < self._logarithm(self.toe.end), line, exponential)

    def _logarithm(self, light: Floats | float) -> Floats:
        signal: Floats = self.c * np.log10(self.a * np.asarray(light) + self.b) + self.d
        return signal


@final
@dataclass(frozen=True, slots=True)
class NLog(AbstractFormula):
    """x = 650 (y + 0.0075)^⅓, from x = 452 on 150 ln y + 619, over 1023."""

    @override
    def encode(self, light: Floats) -> Floats:
        root = np.minimum(650 * np.cbrt(light + 0.0075), _N_CUT)
        logarithm = np.maximum(150 * np.log(np.maximum(light, _N_LIGHT)) + 619, _N_CUT)
        code: Floats = np.where(light < _N_LIGHT, root, logarithm)
        return code / 1023

    @override
    def decode(self, signal: Floats) -> Floats:
        code = 1023 * signal
        cube = np.minimum(np.power(code / 650, 3) - 0.0075, _N_LIGHT)
        exponential = np.maximum(np.exp((code - 619) / 150), _N_LIGHT)
        return np.where(code < _N_CUT, cube, exponential)


@final
@dataclass(frozen=True, slots=True)
class AppleLog(AbstractFormula):
    """P = c (R − R₀)², from R = 0.01 on γ log₂(R + β) + δ."""

    @override
    def encode(self, light: Floats) -> Floats:
        square = np.minimum(_SIGMA * (light - _R_0) ** 2, _APPLE_CUT)
        logarithm = _GAMMA * np.log2(light + _BETA) + _DELTA
        return np.where(light < _R_T, square, np.maximum(logarithm, _APPLE_CUT))

    @override
    def decode(self, signal: Floats) -> Floats:
        root = np.sqrt(np.maximum(signal, 0) / _SIGMA) + _R_0
        exponential = np.maximum(np.exp2((signal - _DELTA) / _GAMMA) - _BETA, _R_T)
        return np.where(signal < _APPLE_CUT, root, exponential)


_N_CUT, _N_LIGHT = 452, 0.328
_R_0, _R_T, _SIGMA = -0.05641088, 0.01, 47.28711236
_BETA, _GAMMA, _DELTA = 0.00964052, 0.08550479, 0.69336945
_APPLE_CUT = _SIGMA * (_R_T - _R_0) ** 2

_LOGC4_A, _LOGC4_B, _LOGC4_C = (2**18 - 16) / 117.45, (1023 - 95) / 1023, 95 / 1023
_LOG3G10_B, _LOG3G10_C = 155.975327, 0.01


def _register(
    name: str, title: str, source: str, formula: AbstractFormula, *, recorded: bool = False
) -> None:
    """Add a curve, and its second if the formula is that of the code values of recordings."""
    limited = PublishedCurve(formula, limited=True) if recorded else None
    function = TransferFunction(name, title, source, PublishedCurve(formula), limited)
    register_transfer_function(function)


_register(
    "logc3",
    "ARRI LogC3, EI 800",
    "ALEXA Log C Curve: Usage in VFX, 2017, table for linear scene exposure",
    Logarithm(5.555556, 0.052272, 0.247190, 0.385537, Toe(5.367655, 0.092809, 0.010591)),
)
_register(
    "logc4",
    "ARRI LogC4",
    "LogC4 Logarithmic Color Space Specification, 2022, 4.1",
    Logarithm(_LOGC4_A, 64, _LOGC4_B / 14 / _LOG10_2, _LOGC4_C - 6 * _LOGC4_B / 14),
)
_register(
    "bmdfilm5",
    "Blackmagic Film Generation 5",
    "Blackmagic Generation 5 Color Science, 2021",
    Logarithm(
        1,
        0.005494072432257808,
        0.08692876065491224 * _LN_10,
        0.5300133392291939,
        Toe(8.283605932402494, 0.09246575342465753, 0.005),
    ),
)
_register(
    "log3g10",
    "RED Log3G10",
    "White Paper on REDWideGamutRGB and Log3G10, 2017",
    Logarithm(_LOG3G10_B, _LOG3G10_B * _LOG3G10_C + 1, 0.224282, 0),
)
_register("applelog", "Apple Log", "Apple Log Profile White Paper, 2023", AppleLog())
_register(
    "dlog",
    "DJI D-Log",
    "White Paper on D-Log and D-Gamut, 2017",
    Logarithm(0.9892, 0.0108, 0.256663, 0.584555, Toe(6.025, 0.0929, 0.0078)),
)
_register(
    "slog2",
    "Sony S-Log2",
    "S-Log2 Technical Paper, 2012",
    # The signal is that of limited range, of exposure: reflectance over 0.9.
    Logarithm(
        155 / 219 / 0.9,
        0.037584,
        876 / 1023 * 0.432699,
        (64 + 876 * (0.616596 + 0.03)) / 1023,
    ),
    recorded=True,
)
_register(
    "slog3",
    "Sony S-Log3",
    "Technical Summary for S-Gamut3.Cine/S-Log3 and S-Gamut3/S-Log3, 1.0, appendix",
    Logarithm(
        1 / 0.19,
        0.01 / 0.19,
        261.5 / 1023,
        420 / 1023,
        Toe((171.2102946929 - 95) / 0.01125 / 1023, 95 / 1023, 0.01125),
    ),
    recorded=True,
)
_register(
    "vlog",
    "Panasonic V-Log",
    "VARICAM V-Log/V-Gamut, 2014, 2",
    Logarithm(1, 0.00873, 0.241514, 0.598206, Toe(5.6, 0.125, 0.01)),
    recorded=True,
)
_register(
    "canonlog2",
    "Canon Log 2",
    "Canon Input Transform Version 202007 (1.2)",
    Logarithm(87.09937546 / 0.9, 1, 0.24136077, 0.092864125),
    recorded=True,
)
_register(
    "canonlog3",
    "Canon Log 3",
    "Canon Input Transform Version 202007 (1.2)",
    Logarithm(
        14.98325 / 0.9,
        1,
        0.36726845,
        0.12240537,
        Toe(1.9754798 / 0.9, 0.12512219, 0.014 * 0.9),
    ),
    recorded=True,
)
_register(
    "flog",
    "Fujifilm F-Log",
    "F-Log Data Sheet 1.1, 2022, 2",
    Logarithm(0.555556, 0.009468, 0.344676, 0.790453, Toe(8.735631, 0.092864, 0.00089)),
    recorded=True,
)
_register(
    "flog2",
    "Fujifilm F-Log2",
    "F-Log2 Data Sheet 1.0, 2022, 2",
    Logarithm(5.555556, 0.064829, 0.245281, 0.384316, Toe(8.799461, 0.092864, 0.000889)),
    recorded=True,
)
_register(
    "nlog",
    "Nikon N-Log",
    "N-Log Specification Document 1.0.0, 2018, 2",
    NLog(),
    recorded=True,
)
