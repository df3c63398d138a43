"""What levels stand for, per channel: irradiance, its variance, and where white begins."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from chartless.errors import ParameterError
from chartless.frames.frame import Frame
from chartless.noise import TYPICAL_8BIT, AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.types import Bools, Floats, Floats32

DEFAULT_NOISE = AffineNoise.from_8bit(*TYPICAL_8BIT)
"""Noise for calibrations that give none. It is a camera's at high ISO: it trusts long exposures
more than short ones, which costs little where it is wrong."""
DEVIATIONS = 3.0
"""Distance of the expected irradiance from white and black at which a frame is trusted."""
_END = 1 - 1e-6  # irradiance of levels that are white


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """What a level means, for each channel: tables of all channels one after the other."""

    offsets: npt.NDArray[np.intp]
    """Place of level 0 of each channel, shape (C,)."""
    light: Floats32
    """Middle of the irradiance that a level covers, shape (C · L,)."""
    rest: Floats32
    """Variance that is not the sensor's noise: Δ²/12 + s², shape (C · L,)."""
    saturated: Bools
    """Shape (C · L,)."""
    slope: Floats32
    """u, shape (C,)."""
    floor: Floats32
    """v, shape (C,)."""
    bound: Floats
    """Irradiance at white, shape (C,)."""
    lowest: Floats32
    """Expected irradiance from which a frame is trusted, shape (C,)."""
    highest: Floats32
    """And up to which."""

    @property
    def whites(self) -> npt.NDArray[np.intp]:
        """First saturated level of each channel, shape (C,)."""
        return np.asarray(self.saturated.reshape(self.offsets.size, -1).argmax(axis=1))


def tables_of(calibration: Calibration, frame: Frame, white: int | None) -> Tables:
    n_levels, n_channels = frame.white + 1, frame.levels.shape[2]
    if white is not None and not n_levels // 2 <= white < n_levels:
        msg = f"white must be a level between {n_levels // 2} and {n_levels - 1}, not {white}"
        raise ParameterError(msg)
    responses = calibration.channels
    if len(responses) not in (1, n_channels):
        msg = (
            f"the calibration has the channels {', '.join(each.name for each in responses)}, "
            f"{frame.path} has {n_channels}"
        )
        raise ParameterError(msg)
    if len(responses) == 1:
        responses = responses * n_channels
    channels = [_channel_table(each, n_levels, white) for each in responses]
    noises = [each.noise or DEFAULT_NOISE for each in responses]
    margin = np.array([DEVIATIONS * noise.std(1.0) for noise in noises])
    edges = np.array([each.white_edge for each in channels])
    return Tables(
        offsets=np.arange(n_channels) * n_levels,
        light=np.concatenate([each.light for each in channels]).astype(np.float32),
        rest=np.concatenate([each.rest for each in channels]).astype(np.float32),
        saturated=np.concatenate([each.saturated for each in channels]),
        slope=np.array([noise.slope for noise in noises], dtype=np.float32),
        floor=np.array([noise.floor for noise in noises], dtype=np.float32),
        bound=np.array([each.bound for each in channels]),
        lowest=np.array([DEVIATIONS * noise.std(0.0) for noise in noises], dtype=np.float32),
        highest=(edges - margin).astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _ChannelTable:
    light: Floats
    rest: Floats
    saturated: Bools
    bound: float
    white_edge: float
    """Irradiance at which white begins."""


def _channel_table(response: Response, n_levels: int, white: int | None) -> _ChannelTable:
    level = np.arange(n_levels)
    top = n_levels - 1
    centres = response.curve.inverse(level / top)
    edges = response.curve.inverse(
        np.append(level, n_levels).clip(0.5, top + 0.5) / top - 0.5 / top
    )
    edges[-1] = 1.0
    rest = np.diff(edges) ** 2 / 12
    if response.inverse_lut_std is not None:
        known = np.linspace(0.0, 1.0, response.n_levels)
        rest += np.interp(level / top, known, response.inverse_lut_std) ** 2
    # A curve that is 1 from a level on says that this level is white.
    first = min(top if white is None else white, int(np.argmax(centres >= _END)))
    return _ChannelTable(
        light=(edges[:-1] + edges[1:]) / 2,
        rest=rest,
        saturated=level >= first,
        bound=float(centres[first]),
        white_edge=float(edges[first]),
    )
