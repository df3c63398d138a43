"""Frames split into channels of one number of levels, and whether frames belong together."""

import math

import numpy as np
import numpy.typing as npt

from chartless.errors import ParameterError, UnfitFramesError
from chartless.frames.frame import Frame
from chartless.frames.levels import level_table
from chartless.types import Bools, Levels

CHANNELS = ("auto", "rgb", "luma")
"""Ways to split a frame: as it is; red, green and blue; or the luma of the three."""
MOST_STOPS = 0.1
"""Difference of exposure that frames of one exposure may have; rounding of EXIF stays below."""
LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)
"""Weights of red, green and blue in Y of JPEG files: ITU-R BT.601."""


def planes_of(frame: Frame, channels: str, n_levels: int) -> dict[str, Levels]:
    """Levels of each channel, by its name, reduced to so many.

    Parameters
    ----------
    frame : Frame
    channels : str
        "auto" (those of the frame), "rgb" or "luma".
    n_levels : int
        See `chartless.frames.levels.level_table`.

    Raises
    ------
    ParameterError
        If `channels` or `n_levels` does not suit the frame.
    """
    if channels not in CHANNELS:
        msg = f"channels must be one of {', '.join(CHANNELS)}, not {channels!r}"
        raise ParameterError(msg)
    levels = frame.levels
    n_channels = levels.shape[-1]
    if n_channels == 1 and channels == "rgb":
        msg = f"{frame.path} is grey and has no red, green and blue: use `channels='auto'`"
        raise ParameterError(msg)
    if channels == "luma" and n_channels == 3:  # noqa: PLR2004 - red, green, blue
        luma: Levels = np.rint(levels @ LUMA).astype(levels.dtype)
        planes = {"Y": luma}
    else:
        planes = {name: levels[..., c] for c, name in enumerate(frame.channel_names)}
    reduce = level_table(frame.white, n_levels)
    if reduce.size == n_levels:
        return planes
    return {name: reduce[plane] for name, plane in planes.items()}


def require_alike(first: Frame, other: Frame, *, one_exposure: bool = True) -> None:
    """Refuse frames of different size, channels, bit depth, camera or exposure.

    Parameters
    ----------
    first, other : Frame
    one_exposure : bool
        Whether the exposure must be the same; if not, the camera must be, where both files name it.

    Raises
    ------
    UnfitFramesError
        With both files and what is different.
    """
    a, b = first.levels, other.levels
    cameras = first.settings.camera, other.settings.camera
    if a.shape[:2] != b.shape[:2]:
        what = "size", _size(a), _size(b)
    elif a.shape[2] != b.shape[2]:
        what = "channels", f"{a.shape[2]}", f"{b.shape[2]}"
    elif first.bit_depth != other.bit_depth:
        what = "bit depth", f"{first.bit_depth} bits", f"{other.bit_depth} bits"
    elif first.white != other.white:
        what = "white level", f"{first.white}", f"{other.white}"
    elif one_exposure and _stops(first, other) > MOST_STOPS:
        what = "exposure", str(first.settings), str(other.settings)
    elif not one_exposure and None not in cameras and cameras[0] != cameras[1]:
        what = "camera", str(cameras[0]), str(cameras[1])
    else:
        return
    setting = "one setting" if one_exposure else "settings that differ in exposure alone"
    msg = (
        f"the frames differ in {what[0]}: {first.path} has {what[1]}, {other.path} has "
        f"{what[2]}; give frames from one camera with {setting}"
    )
    raise UnfitFramesError(msg)


def require_mask(mask: Bools | None, frame: Frame) -> None:
    """Refuse a mask of another size than the frames; raises ParameterError."""
    if mask is not None and mask.shape != frame.levels.shape[:2]:
        msg = f"the mask is {_size(mask)}, the frames are {_size(frame.levels)} pixels"
        raise ParameterError(msg)


def _stops(first: Frame, other: Frame) -> float:
    """Difference of exposure in stops; 0 where a file does not record it."""
    if first.settings.exposure is None or other.settings.exposure is None:
        return 0.0
    return abs(math.log2(first.settings.exposure / other.settings.exposure))


def _size(array: npt.NDArray[np.generic]) -> str:
    return f"{array.shape[1]} × {array.shape[0]}"
