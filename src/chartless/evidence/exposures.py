"""Exposures of frames: as given, as recorded by the camera, or unknown.

They are known before a pixel is read, and decide which kinds of evidence frames hold.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TypeAlias

import numpy as np

from chartless.errors import ParameterError
from chartless.frames.channels import MOST_STOPS
from chartless.frames.frame import CameraSettings
from chartless.types import Floats

UNKNOWN = "unknown"
"""Value of `times` for unknown exposures."""
EXIF_ERROR = 0.02
"""Relative error of exposures recorded by a camera, the accuracy of shutters and
apertures."""
UNKNOWN_ERROR = 1.5
"""Deviation of ln t where nothing is known: a factor of four or five either way."""
LEAST_EXPOSURE, MOST_EXPOSURE = 1e-18, 1e18
"""Limits of an exposure. Radiance is irradiance over exposure, in single precision,
which ends at 10⁻³⁸ and 10³⁸; files of Radiance HDR write 0 below 10⁻³². Within these
limits ten digits of irradiance fit. Cameras record t · ISO/N² between 10⁻⁸ and 10¹⁰."""
MOST_RATIO = 2.0**64
"""Largest ratio of two exposures. Weights in a merged picture are proportional to the
square of the exposure, and must not vanish in single precision. The sun and a starlit
scene are 44 stops apart."""
MOST_ERROR = 10.0
"""Largest relative error of exposures: more than `UNKNOWN_ERROR` makes no difference,
and the matrices of the likelihood lose their digits at 10⁸."""
_EXACT = 1e-6  # relative error below which exposures are exact
_DISAGREE = 0.5  # stops between times given and EXIF


Groups: TypeAlias = tuple[tuple[int, ...], ...]
"""Numbers of the frames of each exposure."""
Times: TypeAlias = Sequence[float] | Sequence[str] | str | None
"""Exposures as a user gives them."""


@dataclass(frozen=True, slots=True, eq=False)
class Exposures:
    """Exposures of frames."""

    groups: Groups
    """Numbers of the frames of each exposure, from the shortest; unknown exposures are
    in the order of their first frames."""
    log_exposures: Floats | None
    """ln t of each group; None if unknown."""
    error: float
    """Deviation of each ln t."""
    source: str
    """Source of the exposures, for messages."""

    def __str__(self) -> str:
        """Return text such as "a bracket of 3 exposures, 1 to 16 by EXIF"."""
        text = f"a bracket of {len(self.groups)} exposures"
        if self.log_exposures is None:
            return f"{text}, their ratios unknown"
        return f"{text}, 1 to {math.exp(np.ptp(self.log_exposures)):.4g} by {self.source}"

    @property
    def repeated(self) -> Groups:
        """Groups of two or more frames."""
        return tuple(group for group in self.groups if len(group) > 1)


def parsed_times(parts: Sequence[str]) -> list[float] | list[str] | str:
    """Parse exposures: numbers, fractions such as 1/30, names, or the word unknown.

    Raises
    ------
    ParameterError
        If they are none of these.
    """
    parts = [part.strip() for part in parts]
    if parts == [UNKNOWN]:
        return UNKNOWN
    if len(parts) > 1 and all(part.isalpha() for part in parts):
        return parts
    try:
        times = [float(Fraction(part) if "/" in part else part) for part in parts]
    except (ValueError, ArithmeticError):
        times = [math.nan]
    if not all(map(math.isfinite, times)):
        given = ",".join(parts)[:60]
        msg = f"`times` must be numbers or fractions such as 1/30,1/8,1/2, not {given!r}"
        raise ParameterError(msg)
    return times


def exposures_of(
    names: Sequence[Path],
    settings: Sequence[CameraSettings],
    *,
    times: Times = None,
    time_error: float | None = None,
    checked: bool = True,
) -> Exposures | None:
    """Return the exposures of frames, as given or as recorded by the camera.

    Parameters
    ----------
    names : sequence of Path
        Names of the frames, for messages.
    settings : sequence of CameraSettings
    times : sequence of float or of str or "unknown", optional
        Relative exposure of each frame. Where the ratios are unknown, names of the
        exposures, equal for frames of the same exposure; "unknown" if all differ.
    time_error : float, optional
        Relative error of the exposures, at most `MOST_ERROR`; by default 0 for `times`
        and `EXIF_ERROR` for EXIF. Not allowed for unknown exposures.
    checked : bool
        Whether `times` must agree with EXIF.

    Returns
    -------
    Exposures or None
        None if neither `times` nor the files give them.

    Raises
    ------
    ParameterError
        If a setting is invalid or contradicts the files.
    """
    time_error = _checked_error(time_error)
    times = _plain(times)
    if isinstance(times, str) and times != UNKNOWN:
        msg = f"times are numbers, names of exposures or {UNKNOWN!r}, not {times!r}"
        raise ParameterError(msg)
    labels = _labels(times, len(names))
    if labels is not None:
        _require_known(time_error)
        return Exposures(_labelled(labels), None, UNKNOWN_ERROR, "`times`")
    noted = noted_exposures(settings)
    if times is not None:
        exposures = _given(times, names)
        if noted is not None and checked:
            _require_agreement(names, exposures, np.asarray(noted))
        return Exposures(*_grouped(np.log(exposures)), time_error or 0.0, "`times`")
    if noted is None:
        return None
    require_exposures(np.asarray(noted), [f"the exposure of {name} by EXIF" for name in names])
    error = EXIF_ERROR if time_error is None else time_error
    return Exposures(*_grouped(np.log(noted)), error, "EXIF")


def _labels(times: Times, n_frames: int) -> list[str] | None:
    """Names of the exposures if these are unknown; None if times are numbers."""
    if times == UNKNOWN:
        return [str(place) for place in range(n_frames)]
    if times is None or isinstance(times, str):
        return None
    labels = [each for each in times if isinstance(each, str)]
    if labels and len(labels) < len(times):
        msg = f"times are all numbers or all names of exposures, not {labels[0]!r} among numbers"
        raise ParameterError(msg)
    if labels:
        _require_one_each(len(labels), n_frames)
    return labels or None


def _labelled(labels: Sequence[str]) -> Groups:
    """Group frames by name, in the order of their first frames."""
    groups: dict[str, list[int]] = {}
    for place, label in enumerate(labels):
        groups.setdefault(label, []).append(place)
    return tuple(map(tuple, groups.values()))


def _require_known(time_error: float | None) -> None:
    """Refuse `time_error` for unknown exposures."""
    if time_error is not None:
        msg = (
            "`time_error` is the error of known exposures, but these are unknown: give "
            "`times` as numbers, or omit `time_error`"
        )
        raise ParameterError(msg)


def _checked_error(time_error: float | None) -> float | None:
    if time_error is None:
        return None
    if not isinstance(time_error, int | float) or not 0 <= time_error <= MOST_ERROR:
        msg = (
            f"time_error must be a number, 0 or above, and at most {MOST_ERROR:g}, not "
            f"{time_error!r}: it is relative, 0.1 for 10 %"
        )
        raise ParameterError(msg)
    return time_error if time_error >= _EXACT else 0.0


def _plain(times: object) -> Times:
    """Convert times to a list of numbers or names; leave text and None unchanged."""
    if times is None or isinstance(times, str):
        return times
    listed = times.tolist() if isinstance(times, np.ndarray) else times
    if not isinstance(listed, list | tuple) or not all(
        isinstance(each, str | int | float | np.integer | np.floating) for each in listed
    ):
        msg = f"times must be numbers or names, one for each frame, not {listed!r:.80}"
        raise ParameterError(msg)
    return list(listed)


def noted_exposures(settings: Sequence[CameraSettings]) -> list[float] | None:
    """Exposure of each frame by EXIF, up to a factor; None if a file lacks it.

    It is t · ISO/N² if all files record the three, and the time t alone if none records
    more.
    """
    exposures = [each.exposure for each in settings]
    if all(each is None for each in exposures):
        # Older cameras and edited files record the time alone.
        alike = {(each.f_number, each.iso) for each in settings}
        exposures = [each.exposure_time for each in settings] if len(alike) == 1 else exposures
    known = [each for each in exposures if each is not None]
    return known if len(known) == len(exposures) else None


def _given(times: Sequence[float] | Sequence[str] | str, names: Sequence[Path]) -> Floats:
    exposures = np.asarray(times, dtype=np.float64)
    _require_one_each(exposures.size, len(names))
    require_exposures(exposures, [f"the time of {name}" for name in names])
    return exposures


def require_exposures(exposures: Floats, names: Sequence[str]) -> None:
    """Refuse exposures that no picture can have, or that single precision cannot hold.

    Parameters
    ----------
    exposures : ndarray, shape (K,)
    names : sequence of str
        Name of each exposure in messages.

    Raises
    ------
    ParameterError
        If an exposure is not above 0, not finite, or beyond `LEAST_EXPOSURE`, `MOST_EXPOSURE` or
        `MOST_RATIO`.
    """
    for name, exposure in zip(names, exposures, strict=True):
        if not 0 < exposure < math.inf:
            msg = f"{name} must be above 0, not {exposure:g}"
            raise ParameterError(msg)
        if not LEAST_EXPOSURE <= exposure <= MOST_EXPOSURE:
            msg = (
                f"{name} must be between {LEAST_EXPOSURE:g} and {MOST_EXPOSURE:g}, not "
                f"{exposure:g}: give times in seconds, or relative to one of the frames"
            )
            raise ParameterError(msg)
    if exposures.max() > MOST_RATIO * exposures.min():
        shortest, longest = int(exposures.argmin()), int(exposures.argmax())
        msg = (
            f"{names[longest]} is {exposures[longest]:g}, {names[shortest]} is "
            f"{exposures[shortest]:g}: these are more than {math.log2(MOST_RATIO):.0f} stops "
            "apart, more than any scene spans; check the times"
        )
        raise ParameterError(msg)


def _require_one_each(n_times: int, n_frames: int) -> None:
    if n_times != n_frames:
        msg = f"{n_times} times were given for {n_frames} frames: give one for each"
        raise ParameterError(msg)


def _require_agreement(names: Sequence[Path], given: Floats, noted: Floats) -> None:
    apart = np.log2(given / given[0]) - np.log2(noted / noted[0])
    apart -= np.sort(apart)[apart.size // 2]  # a mean of two would halve the distance
    worst = int(np.abs(apart).argmax())
    if abs(apart[worst]) > _DISAGREE:
        msg = (
            f"{names[worst]}: its EXIF exposure is {abs(apart[worst]):.1f} stops from `times`: "
            "omit `times` or, if it is right, add `evidence='bracket'`"
        )
        raise ParameterError(msg)


def _grouped(log_exposures: Floats) -> tuple[Groups, Floats]:
    """Group frames by exposure, from the shortest; return groups and ln t of each."""
    groups: list[list[int]] = []
    for place in np.argsort(log_exposures, kind="stable"):
        step = math.inf
        if groups:
            step = (log_exposures[place] - log_exposures[groups[-1][0]]) / math.log(2)
        if step > MOST_STOPS:
            groups.append([])
        groups[-1].append(int(place))
    levels = np.array([log_exposures[group].mean() for group in groups])
    return tuple(tuple(sorted(group)) for group in groups), levels
