"""A frame before and after, small enough for a page."""

import io
from typing import NamedTuple

import numpy as np
from PIL import Image

from chartless.curves import named_curve
from chartless.frames.frame import Frame
from chartless.result.calibration import Calibration
from chartless.types import Floats, Floats32, Levels

_LONGEST = 640  # pixels of a side, at most
_QUALITY = 82


class Preview(NamedTuple):
    """A small picture with its text."""

    title: str
    jpeg: bytes
    size: tuple[int, int]
    """Width and height."""
    text: str
    """What it shows, for those who do not see it."""


def previews(calibration: Calibration, frame: Frame) -> list[Preview]:
    """The frame as the camera wrote it, and the light that the calibration makes of it.

    Both are shown upright and reduced by averaging, the second in light. Light is encoded with
    sRGB, as screens expect it.

    Raises
    ------
    ParameterError
        If the frame's channels are not those of the calibration.
    """
    from chartless.images import upright

    light = _reduced(calibration.linearize(frame.levels))
    brightness = _reduced(frame.levels) / np.iinfo(frame.levels.dtype).max
    height, width, _ = upright(frame.levels, frame.orientation).shape
    name = frame.path.name
    return [
        Preview(
            "As the camera wrote it",
            *_encoded(brightness, frame.orientation),
            f"{name}, {width} × {height} pixels, mean brightness {brightness.mean():.2f}.",
        ),
        Preview(
            "Linear light, shown in sRGB",
            *_encoded(named_curve("srgb").response(light), frame.orientation),
            f"The same linearised, mean irradiance {light.mean():.2f}, encoded for display.",
        ),
    ]


def _reduced(values: Floats32 | Levels) -> Floats:
    """Means of square blocks, so many pixels wide that few enough are left."""
    height, width, n_channels = values.shape
    side = -(-max(height, width) // _LONGEST)
    rows, columns = -(-height // side), -(-width // side)
    outside = ((0, rows * side - height), (0, columns * side - width), (0, 0))
    whole = np.pad(values, outside, mode="edge")
    blocks = whole.reshape(rows, side, columns, side, n_channels)
    return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float64))


def _encoded(brightness: Floats, orientation: int) -> tuple[bytes, tuple[int, int]]:
    """JPEG of brightness 0 … 1, and its size."""
    from chartless.images import upright

    levels = upright(np.rint(255 * brightness.clip(0, 1)).astype(np.uint8), orientation)
    picture = Image.fromarray(levels[..., 0] if levels.shape[-1] == 1 else levels)
    file = io.BytesIO()
    picture.save(file, "JPEG", quality=_QUALITY, optimize=True)
    return file.getvalue(), picture.size
