"""A calibration in short texts: what the terminal and the report both say."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chartless.flags import Flag
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.result.verdict import deviation
from chartless.types import Floats, JsonObject

_ALIKE = 0.0005  # relative, of exposures: not seen in four digits
_MOST_DECIMALS = 5  # of the noise; what is less is as good as none


@dataclass(frozen=True, slots=True)
class Doubt:
    """A flag or a pattern of misfit, in words."""

    code: str
    """As in `Flag`; "misfit, peaked" and the like for patterns."""
    channels: tuple[str, ...]
    advice: str
    """What it means and what to do."""
    detail: str = ""
    """What that would change, in numbers."""


def n_frames(calibration: Calibration) -> int:
    """Frames that were given for a calibration; of a video those used."""
    inputs = calibration.provenance.get("inputs", [])
    return sum(map(_frames_of, inputs))


def doubts(calibration: Calibration) -> list[Doubt]:
    """What is doubtful about a calibration, with what to do; empty if nothing is."""
    found = []
    for flag, names in calibration.flags.items():
        detail = ""
        if flag is Flag.DARK_LEVELS_UNSEEN:
            changes = ", ".join(_change_by_dark(calibration.channel(name)) for name in names)
            detail = f"two frames with the lens covered (`dark`) would bring the error of {changes}"
        found.append(Doubt(flag.code, tuple(names), flag.advice, detail))
        if flag is Flag.MISFIT:
            found += [
                Doubt(f"misfit, {pattern.code}", tuple(misfits), pattern.advice)
                for pattern, misfits in calibration.patterns.items()
            ]
    return found


def noise_text(which: Literal["slope", "floor"], response: Response, digits: int) -> str:
    """U or V with two digits of its deviation; to so many and one more where that is not known."""
    if response.noise is None:
        return "-"
    value = float(getattr(response.noise, f"{which}_8bit"))
    if response.noise_error is None:
        return f"{value:.{digits + 1}f}"
    error = value * float(getattr(response.noise_error, f"log_{which}"))
    least = 10.0**-_MOST_DECIMALS
    if max(value, error) < least:
        return f"< {least:.{_MOST_DECIMALS}f}"
    first = math.floor(math.log10(max(error, least)))  # digit of the deviation
    decimals = min(max(1 - first, 0), _MOST_DECIMALS)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def found_exposures(given: Sequence[float], response: Response) -> list[float]:
    """Exposures as the pictures show them, in units of those given; empty if they are these."""
    known = () if response.exposures is None else response.exposures.relative
    if len(known) != len(given) or min(known, default=0) <= 0:
        return []
    found = np.array(known) / known[int(np.argmin(given))] * min(given)
    return [] if np.allclose(found, given, rtol=_ALIKE, atol=0) else found.tolist()


def ratio_text(value: float) -> str:
    """Relative exposure in four digits."""
    return f"{float(f'{value:.4g}'):g}"  # 10230 and not 1.023e+04


def error_text(std: Floats | None) -> str:
    """Root mean square of the deviations of the inverse response."""
    return "-" if std is None else f"± {deviation(std):.3f}"


def white_text(response: Response) -> str:
    """Deviation of the light at white, apart from that of the shape."""
    return "-" if response.white_std is None else f"± {response.white_std:.1%}"


def fit_text(response: Response) -> str:
    """Goodness of fit, by the measure that the method has."""
    if response.raw is not None:
        return f"scatter {response.raw.scatter:.1%}"
    if response.deviance is not None:
        return f"deviance {response.deviance:.2f}"
    return "-" if response.similarity is None else f"similarity {response.similarity:.3f}"


def _frames_of(source: JsonObject) -> int:
    if "frames" not in source:
        return 1  # also of a picture that was not used
    first, last = source["frames"]
    return int(source.get("used", last - first + 1))


def _change_by_dark(response: Response) -> str:
    now, then = map(error_text, (response.inverse_lut_std, response.inverse_lut_std_with_dark))
    return f"{response.name} from {now} to {then}"
