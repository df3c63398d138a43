"""hdrgen and Photosphere: polynomials from brightness to light, in a file ``.rsp``.

Three lines for red, green and blue: the degree, 5 at most, and the coefficients, the highest power
first. Level i of 256 has brightness (i + 1/2)/256; the polynomials that the program finds are 1 at
brightness 1. Down from the last level, the polynomial holds as long as it is above 0 and rises, but
not below level 19: from there to 0 the program draws a straight line (panlib, ``phdrimg.h`` and
``phdrimg.cpp``, the classes ``PPolynomial`` and ``PHDImageMaker``).
"""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless._numeric.quadratic import constrained_step
from chartless.curves import SampledCurve
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._nearest import residual
from chartless.formats._tables import RGB, calibration_of, inverse_table
from chartless.formats._text import lines_of
from chartless.result.calibration import Calibration
from chartless.types import Floats

_DEGREE = 5
_TOE = 19  # P_LINRESP of panlib: the lowest level that is taken from the polynomial
_N_LEVELS = 256
_BRIGHTNESS = (np.arange(_N_LEVELS) + 0.5) / _N_LEVELS
_SEEN = _BRIGHTNESS[_TOE:]
_LEAST = 1e-6  # of light and of its slope, white being 1
_LEAST_SLOPE = 0.05
_LARGEST = 1e6
_SAME = 1e-3


@final
@dataclass(frozen=True, slots=True)
class HdrGen(AbstractFormat):
    """The response of ``hdrgen -r`` and of Photosphere: a polynomial for each channel.

    Below level 19, and where the polynomial falls, the program draws a straight line to black.
    Written are the nearest polynomials of degree 5 that rise from there on, and how far they are
    off: by little for most film, by much where light near white is compressed, as modern cameras
    do. Read are the curves as the program applies them.
    """

    name: ClassVar[str] = "hdrgen"
    title: ClassVar[str] = "hdrgen response"
    suffix: ClassVar[str] = ".rsp"
    programs: ClassVar[str] = "hdrgen, Photosphere and what calls them (Radiance)"
    tested_with: ClassVar[str] = "reference parser"
    precision: ClassVar[float] = 1e-7
    keeps: ClassVar[Keeps] = Keeps(
        channels="each", scale="1 at white", curves="nearest polynomials of degree 5"
    )
    takes: ClassVar[frozenset[str]] = frozenset()

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Three lines, equal ones for a single channel."""
        polynomials = [_nearest(column) for column in inverse_table(calibration, _N_LEVELS).T]
        lines = [" ".join([str(_DEGREE), *(f"{c:.15g}" for c in each)]) for each in polynomials]
        applied = [SampledCurve.from_inverse(_scaled(_applied(each))) for each in polynomials]
        return Encoded(
            "".join(f"{line}\n" for line in lines * (len(RGB) // len(lines))).encode(),
            (residual(f"polynomials of degree {_DEGREE}", calibration, applied),),
        )

    @override
    def recognises(self, source: Source) -> bool:
        lines = source.head.strip().split("\n")
        try:
            return len(lines) == len(RGB) and all(_polynomial(line).size for line in lines)
        except ValueError:
            return False

    @override
    def decode(self, source: Source) -> Calibration:
        lines = lines_of(source)
        if len(lines) != len(RGB):
            msg = f"it has {len(lines)} lines, not 3 for red, green and blue"
            raise ValueError(msg)
        polynomials = [_polynomial(line) for line in lines]
        table = np.column_stack([_scaled(_applied(each)) for each in polynomials])
        whites = [float(each.sum()) for each in polynomials]
        remarks = []
        if max(whites) - min(whites) > _SAME * max(whites):
            shown = ", ".join(f"{each:.4g}" for each in whites)
            remarks = [f"its white balance ({shown} at white) is no part of the response"]
        return calibration_of(table, source, self.name, remarks=remarks)


register_format(HdrGen())


def _polynomial(line: str) -> Floats:
    """Coefficients of a line, highest power first; raises ValueError if it is none."""
    degree, *coefficients = line.split() or [""]
    if not (degree.isdecimal() and 1 <= int(degree[:9]) <= _DEGREE):
        msg = f"a line begins with {degree[:20]!r}, not with a degree from 1 to {_DEGREE}"
        raise ValueError(msg)
    if len(coefficients) != int(degree) + 1:
        msg = f"a polynomial of degree {degree} has {int(degree) + 1} coefficients, "
        raise ValueError(msg + f"not {len(coefficients)}")
    values = np.array([float(each) for each in coefficients])
    if not np.all(np.abs(values) <= _LARGEST):
        msg = f"coefficients must be numbers up to {_LARGEST:g}"
        raise ValueError(msg)
    return values


def _applied(coefficients: Floats) -> Floats:
    """Light at each level as the program has it; raises ValueError if white is none."""
    light = np.asarray(np.polyval(coefficients, _BRIGHTNESS), dtype=np.float64)
    sound = (light > 0) & (np.polyval(np.polyder(coefficients), _BRIGHTNESS) > 0)
    sound[:_TOE] = False
    last = _N_LEVELS - 1 - int(np.argmin(sound[::-1]))  # highest level that is not taken
    if last == _N_LEVELS - 1:
        msg = "a polynomial falls or is not above 0 at white"
        raise ValueError(msg)
    light[: last + 1] = light[last + 1] * _BRIGHTNESS[: last + 1] / _BRIGHTNESS[last + 1]
    return light


def _scaled(light: Floats) -> Floats:
    """Table of the inverse response from 0 to 1; light at level 0 is that of half a level."""
    table: Floats = light / light[-1]
    table[0] = 0.0
    return table


def _nearest(table: Floats) -> Floats:
    """Coefficients, highest power first, of the polynomial nearest to g at the levels."""
    powers = np.arange(1, _DEGREE + 1)
    white = _BRIGHTNESS[-1]
    # 1 + Σ c (x^k − white^k) is 1 at the last level whatever c.
    basis = _BRIGHTNESS[:, np.newaxis] ** powers - white**powers
    toe = _BRIGHTNESS[:_TOE, np.newaxis] / _BRIGHTNESS[_TOE]
    offset = np.ones(_N_LEVELS)
    basis[:_TOE], offset[:_TOE] = toe * basis[_TOE], toe[:, 0]
    slope = np.gradient(table, 1 / (_N_LEVELS - 1))
    # Errors of light become those of brightness, at levels as frequent as in uniform light.
    weight = 1 / np.sqrt(np.maximum(slope, _LEAST_SLOPE))
    weight[0] = 0.0  # black is black in both
    # It is above 0 at the end of the toe, and rises at every level and between them.
    slopes = powers * _SEEN[:, np.newaxis] ** (powers - 1)
    steps = np.diff(basis[_TOE:], axis=0) * _N_LEVELS
    rows = -np.vstack([basis[_TOE], slopes, steps])
    room = np.append(1 - _LEAST, np.full(len(slopes) + len(steps), -_LEAST))
    start = np.eye(_DEGREE)[0]  # the straight line, which is allowed
    step = constrained_step(
        basis * weight[:, np.newaxis],
        (offset + basis @ start - table) * weight,
        rows,
        room - rows @ start,
    )
    found = start + step
    constant = 1 - found @ white**powers
    coefficients: Floats = np.append(found[::-1], constant) / (constant + found.sum())
    return coefficients
