"""Differences of two consecutive frames other than noise."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from chartless.types import Bools, Floats, Floats32, Levels

_BLOCK, _BAND, _ENOUGH = 16, 32, 1 << 19  # pixels: patch, rows in a band, all bands


@dataclass(frozen=True, slots=True)
class PairCheck:
    """Differences of two consecutive frames other than noise, in one channel.

    Shares refer to the mean squared difference of the frames.
    """

    displacement: float
    """Length of the shift that fits the difference best, in pixels."""
    displacement_share: float
    """Share explained by that shift."""
    patch_share: float
    """Share in patches of 16 × 16 pixels and larger; pixel noise has none."""
    neighbour_correlation: float
    """Correlation of the difference between neighbouring pixels, mean of both directions."""
    channel_correlation: float = 0.0
    """Largest absolute correlation of the difference between channels."""
    outliers: float = 0.0
    """Share of pixels that changed far more than noise explains."""
    drift: float = 0.0
    """Change of brightness relative to the level, in the channel where it is largest."""
    drift_share: float = 0.0
    """Share explained by that change."""
    resemblance: float = 1.0
    """Correlation of the levels of the frames, see `resemblance`."""
    one_scene: bool = True
    """Whether the frames show one scene; only checked if they are unfit otherwise."""


def check_pair(
    first: Levels,
    second: Levels,
    mask: Bools | None = None,
    *,
    drift: Floats | None = None,
    outlying: Bools | None = None,
    follows: Levels | None = None,
) -> PairCheck:
    """Compare two frames of one channel.

    Parameters
    ----------
    first, second : ndarray of uint8 or uint16, shape (M, N)
    mask : ndarray of bool, shape (M, N), optional
        Pixels outside it count as unchanged.
    drift : ndarray, shape (2L − 1,), optional
        Change of brightness by the sum of the levels, which is subtracted from the
        difference.
    outlying : ndarray of bool, shape (L, L), optional
        Pairs of levels that count as unchanged, except for the displacement: where a shift
        is seen best, at edges, it looks like an outlier.
    follows : ndarray of uint16, shape (L,), optional
        Level of the second frame, of another exposure, that corresponds to each level
        of the first; pixels black or white in either count as unchanged.
    """
    scene, later = _bands(first), _bands(second)
    difference = later - scene
    if follows is not None:
        top = np.float32(follows.size - 1)
        usable = (scene > 0) & (scene < top) & (later > 0) & (later < top)
        scene = follows.astype(np.float32)[scene.astype(np.intp)]
        difference = (later - scene) * usable
    if drift is not None:
        difference -= drift.astype(np.float32)[(scene + later).astype(np.intp)]
    if mask is not None:
        difference *= _bands(mask)
    energy = _dot(difference, difference)
    if energy == 0:
        return PairCheck(0.0, 0.0, 0.0, 0.0)

    mean = scene + later
    across = np.float32(0.25) * (mean[:, 1:-1, 2:] - mean[:, 1:-1, :-2])
    down = np.float32(0.25) * (mean[:, 2:, 1:-1] - mean[:, :-2, 1:-1])
    core = difference[:, 1:-1, 1:-1]
    cross = _dot(across, down)
    normal = np.array([[_dot(across, across), cross], [cross, _dot(down, down)]])
    pull = np.array([_dot(across, core), _dot(down, core)])
    shift = np.linalg.lstsq(normal, pull, rcond=1e-6)[0]
    displacement_share = float(shift @ pull) / energy
    if outlying is not None:
        difference *= ~outlying[scene.astype(np.intp), later.astype(np.intp)]
        energy = max(_dot(difference, difference), float(np.finfo(np.float32).tiny))
    horizontal = _dot(difference[:, :, 1:], difference[:, :, :-1])
    vertical = _dot(difference[:, 1:], difference[:, :-1])
    return PairCheck(
        displacement=float(np.hypot(*shift)),
        displacement_share=displacement_share,
        patch_share=_patch_share(difference, energy),
        neighbour_correlation=0.5 * (horizontal + vertical) / energy,
    )


def channel_correlation(
    first: Sequence[Levels], second: Sequence[Levels], mask: Bools | None = None
) -> float:
    """Largest absolute correlation of the noise between channels.

    The frame difference is itself differenced between neighbouring pixels, so that a
    change of brightness or a large moving object has little effect.

    Parameters
    ----------
    first, second : sequence of ndarray of uint8 or uint16, shape (M, N)
        Channels of each frame.
    mask : ndarray of bool, shape (M, N), optional
        Pixels outside it count as unchanged.

    Returns
    -------
    float
        0 … 1; 0 for a single channel.
    """
    noise = []
    for one, other in zip(first, second, strict=True):
        difference = _bands(other) - _bands(one)
        if mask is not None:
            difference *= _bands(mask)
        noise.append(np.diff(difference, axis=2))
    largest = 0.0
    for a, b in combinations(noise, 2):
        size = np.sqrt(_dot(a, a) * _dot(b, b))
        if size > 0:
            largest = max(largest, abs(_dot(a, b)) / float(size))
    return largest


def _bands(frame: Levels | npt.NDArray[np.bool_]) -> Floats32:
    """Evenly spaced bands of 32 rows, at most half a million pixels: (B, 32, N).

    They suffice for every measure here, and checks do not slow the reading of large
    frames.
    """
    rows, columns = frame.shape
    height = min(_BAND, rows)
    n_bands = rows // height
    wanted = max(1, min(n_bands, _ENOUGH // (height * columns)))
    chosen = np.linspace(0, n_bands - 1, wanted).round().astype(int)
    bands = frame[: n_bands * height].reshape(n_bands, height, columns)[chosen]
    return np.asarray(bands, dtype=np.float32)


def _dot(a: Floats32, b: Floats32) -> float:
    return float(np.einsum("bmn,bmn->", a, b))  # works on slices, without a copy


def _patch_share(difference: Floats32, energy: float) -> float:
    bands, rows, columns = difference.shape
    down, across = rows // _BLOCK, columns // _BLOCK
    trimmed = difference[:, : down * _BLOCK, : across * _BLOCK]
    blocks = trimmed.reshape(bands, down, _BLOCK, across, _BLOCK).sum(axis=(2, 4))
    share = _dot(blocks, blocks) / _BLOCK**2 / energy
    # White noise leaves 1/256 of its energy in the means of 16 × 16 pixels: not a patch.
    return max(0.0, (_BLOCK**2 * share - 1.0) / (_BLOCK**2 - 1.0))
