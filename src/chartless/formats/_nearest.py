"""How far the nearest curve of a format that holds few is from the one wanted."""

from collections.abc import Sequence

import numpy as np

from chartless.curves import AbstractCurve
from chartless.models import UNIFORM_IRRADIANCE
from chartless.result.calibration import Calibration
from chartless.types import Floats

_LEVELS = np.linspace(0.0, 1.0, 256)


def difference(brightness: Floats, irradiance: Floats) -> str:
    """Differences of brightness at uniform irradiance and of irradiance at levels, in words."""
    return (
        f"rms {np.sqrt(np.mean(brightness**2)):.4f}, "
        f"max {np.abs(brightness).max():.4f} of brightness, "
        f"max {np.abs(irradiance).max():.4f} of irradiance"
    )


def rms(wanted: AbstractCurve, found: AbstractCurve) -> float:
    """Root mean square of the difference of brightness at uniform irradiance."""
    return float(np.sqrt(np.mean(_brightness(wanted, found) ** 2)))


def residual(what: str, calibration: Calibration, found: Sequence[AbstractCurve]) -> str:
    """What the curves of the file cannot follow: that of the channel that is farthest off."""
    channels = zip(calibration.channels, found, strict=True)
    pairs = {each.name: (each.curve, near) for each, near in channels}
    name, (wanted, near) = max(pairs.items(), key=lambda item: rms(*item[1]))
    off = difference(_brightness(wanted, near), wanted.inverse(_LEVELS) - near.inverse(_LEVELS))
    return f"what {what} cannot follow: {off}{f' ({name})' if len(pairs) > 1 else ''}"


def _brightness(wanted: AbstractCurve, found: AbstractCurve) -> Floats:
    return wanted.response(UNIFORM_IRRADIANCE) - found.response(UNIFORM_IRRADIANCE)
