"""Frames that a camera would take of a scene: response, noise, clipping and rounding.

O = round((2^b − 1) f(clip(I + n))) with n ~ N(0, uI + v), drawn anew for each frame.
"""

from collections.abc import Iterator

import numpy as np

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError
from chartless.noise import AffineNoise
from chartless.types import Floats, Floats32, Levels

# The response is tabulated this finely, in √I so that steep toes are resolved.
_TABLE_SIZE = 1 << 16


def simulate_frames(
    scene: Floats | Floats32,
    curve: AbstractCurve,
    noise: AffineNoise,
    *,
    n_frames: int = 2,
    bit_depth: int = 8,
    seed: int | np.random.Generator = 0,
) -> Iterator[Levels]:
    """Take noisy frames of one still scene, one after the other.

    Parameters
    ----------
    scene : ndarray of float, shape (...), 0 and above
        True irradiance; above 1 it saturates.
    curve : AbstractCurve
        The camera's response.
    noise : AffineNoise
    n_frames : int
    bit_depth : int
        8 … 16.
    seed : int or numpy.random.Generator
        Equal seeds give equal frames.

    Returns
    -------
    iterator of ndarray of uint8 or uint16, shape of `scene`

    Raises
    ------
    ParameterError
        If the scene has no pixels, is negative or not finite somewhere, or the bit depth is
        another.
    """
    if not 8 <= bit_depth <= 16:  # noqa: PLR2004 - as cameras do
        msg = f"frames have 8 to 16 bits, not {bit_depth}"
        raise ParameterError(msg)
    if not (scene.size and np.all((scene >= 0) & (scene < np.inf))):
        msg = "a scene's irradiance must be finite and not negative"
        raise ParameterError(msg)
    rng = np.random.default_rng(seed)
    deviation = noise.std(scene)
    root = np.linspace(0.0, 1.0, _TABLE_SIZE)
    brightness = curve.response(root**2)
    top = (1 << bit_depth) - 1
    dtype = np.uint8 if bit_depth == 8 else np.uint16  # noqa: PLR2004

    def take(_: int) -> Levels:
        measured = scene + deviation * rng.standard_normal(scene.shape)
        seen = np.interp(np.sqrt(measured.clip(0.0, 1.0)), root, brightness)
        levels: Levels = np.rint(top * seen).astype(dtype)
        return levels

    return map(take, range(n_frames))
