"""Pairs of light and level from raw files and JPEGs of the same shots.

A raw file holds light, its JPEG the levels that the camera made of it: direct evidence
of the curve, which needs neither noise nor exposures. Means of uniform blocks of pixels
are compared: sharpening and chroma subsampling change pixels near an edge, and lens
correction in the JPEG moves edges by a few pixels. Matrix, white balance and falloff
are left to the fit (`chartless.evidence.raw.term`).
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.errors import UnfitFramesError
from chartless.evidence.base import AbstractEvidence
from chartless.evidence.raw.blocks import RawBlocks
from chartless.evidence.raw.channel import RawPairs
from chartless.frames.channels import LUMA, planes_of, require_alike, require_mask
from chartless.frames.frame import Frame, FrameSource, RawPicture
from chartless.frames.registration import register
from chartless.types import Bools, Floats, Levels

MOST_BLOCKS = 1 << 16
"""Largest number of blocks of a shot, approximately."""
EVEN = 0.03
"""Deviation of the levels in a block, as a share of the highest level, above which it
is left out."""
_LEAST_SIDE = 8  # pixels of a block: as large as those of JPEG
_LEAST_MATCH = 0.3  # correlation of the detail of a raw file and its JPEG
_LEAST_LIGHT = 1e-4  # share of saturation


@final
@dataclass(frozen=True, slots=True, eq=False)
class RawEvidence(AbstractEvidence):
    """Evidence of shots stored both as raw file and as JPEG."""

    blocks: dict[str, RawBlocks]
    """Blocks of each channel, by name."""
    clipped: dict[str, float]
    """Share of the blocks of each channel that were left out as black or white."""
    bit_depth: int
    """Bit depth of the JPEGs."""
    sources: tuple[FrameSource, ...]
    """JPEG and raw file of each shot."""

    @property
    @override
    def channels(self) -> tuple[str, ...]:
        return tuple(self.blocks)

    @override
    def channel(self, name: str) -> RawPairs:
        return RawPairs(self.blocks[name])


def raw_evidence(
    pairs: Iterable[tuple[RawPicture, Frame]],
    *,
    channels: str = "auto",
    n_levels: int = 256,
    mask: Bools | None = None,
) -> RawEvidence:
    """Compare the light of raw files with the levels of JPEGs of the same shots.

    Parameters
    ----------
    pairs : iterable of (RawPicture, Frame)
        One for each shot, consumed one by one.
    channels : str
        As for `chartless.frames.channels.planes_of`.
    n_levels : int
        Levels of the JPEGs are reduced to this many.
    mask : ndarray of bool, shape (M, N), optional
        Only pixels of the JPEGs where it is True are used.

    Raises
    ------
    UnfitFramesError
        If there is no shot, a JPEG is not of the same shot and size as its raw file, or JPEGs
        differ in more than exposure.
    ParameterError
        If `channels`, `n_levels` or the mask does not suit the frames.
    """
    first: Frame | None = None
    shots: list[_Shot] = []
    sources: list[FrameSource] = []
    for raw, frame in pairs:
        if first is None:
            require_mask(mask, frame)
            first = frame
        require_alike(first, frame, one_exposure=False)
        planes = planes_of(frame, channels, n_levels)
        shots.append(_shot(raw, frame, planes, n_levels, mask))
        sources += [frame.source, raw.source]
    if first is None:
        msg = "calibration from raw files needs a picture and its raw file, none was given"
        raise UnfitFramesError(msg)
    return RawEvidence(
        blocks={name: _blocks(shots, name, n_levels) for name in shots[0].levels},
        clipped={name: _clipped(shots, name) for name in shots[0].levels},
        bit_depth=first.bit_depth,
        sources=tuple(sources),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Shot:
    """Uniform blocks of a shot, shape (N,) each."""

    levels: dict[str, Floats]
    inner: dict[str, Bools]
    """Whether no pixel is black or white."""
    light: Floats
    chroma: Floats
    radius: Floats
    light_error: Floats
    """Errors of red, green and blue, shape (3,)."""


def _shot(
    raw: RawPicture, frame: Frame, planes: dict[str, Levels], n_levels: int, mask: Bools | None
) -> _Shot:
    pixels, cells = _spans(raw, frame)
    top = n_levels - 1
    usable = ~_tiles(raw.saturated, cells).any(axis=(1, 3))
    if mask is not None:
        usable &= _tiles(mask, pixels).all(axis=(1, 3))
    means, inner = {}, {}
    for name, plane in planes.items():
        tiles = _tiles(plane, pixels)
        mean = tiles.mean(axis=(1, 3))
        square = np.square(tiles, dtype=np.uint32).mean(axis=(1, 3))
        usable &= square - mean**2 <= (EVEN * top) ** 2
        means[name] = mean
        inner[name] = (tiles.min(axis=(1, 3)) > 0) & (tiles.max(axis=(1, 3)) < top)
    light = _tiles(raw.light, cells).mean(axis=(1, 3), dtype=np.float64)
    usable &= (light > _LEAST_LIGHT).all(axis=-1)
    colours = _tiles(frame.levels, pixels).mean(axis=(1, 3))[usable]
    half = np.array(frame.levels.shape[:2]) / 2
    down, right = (
        span.first + span.side * (np.arange(span.n_blocks) + 0.5) - middle
        for span, middle in zip(pixels, half, strict=True)
    )
    away = np.hypot(down[:, np.newaxis], right)
    return _Shot(
        levels={name: mean[usable] for name, mean in means.items()},
        inner={name: each[usable] for name, each in inner.items()},
        light=light[usable] * raw.white_balance,
        chroma=np.ptp(colours, axis=1) / np.maximum(colours.max(axis=1), 1.0),
        radius=away[usable] / np.hypot(*half),
        light_error=raw.error * raw.white_balance,
    )


class _Span(NamedTuple):
    """Adjacent blocks along one axis."""

    first: int
    side: int
    n_blocks: int


def _tiles(plane: npt.NDArray[Any], spans: list[_Span]) -> npt.NDArray[Any]:
    """View a plane as blocks, shape (blocks, side, blocks, side, ...)."""
    cut = plane[tuple(slice(each.first, each.first + each.n_blocks * each.side) for each in spans)]
    down, across = spans
    return cut.reshape(down.n_blocks, down.side, across.n_blocks, across.side, *plane.shape[2:])


def _spans(raw: RawPicture, frame: Frame) -> tuple[list[_Span], list[_Span]]:
    """Rows and columns of blocks in pixels of the JPEG, and the same in cells of the raw file."""
    size, there = frame.levels.shape[:2], raw.light.shape[:2]
    shape = [length // cell for length, cell in zip(size, raw.cell, strict=True)]
    side = math.ceil(max(_LEAST_SIDE, math.sqrt(math.prod(size) / MOST_BLOCKS)) / max(raw.cell))
    sizes = (
        f"{frame.path} is {size[1]} × {size[0]} pixels, "
        f"{raw.path} {there[1] * raw.cell[1]} × {there[0] * raw.cell[0]}"
    )
    advice = "give the JPEG of the same shot at full size, as the camera wrote it"
    if min(shape) < side or shape[0] > there[0] or shape[1] > there[1]:
        msg = f"{sizes}: {advice}"
        raise UnfitFramesError(msg)
    whole = [_Span(0, cell, length) for cell, length in zip(raw.cell, shape, strict=True)]
    shown = _tiles(frame.levels, whole).mean(axis=(1, 3, 4), dtype=np.float32)
    place = register(shown, np.sqrt(np.maximum(raw.light.mean(axis=-1), 0)))
    if place.correlation < _LEAST_MATCH:
        msg = (
            f"{frame.path} does not show the same scene as {raw.path} (correlation "
            f"{place.correlation:.2f}; {sizes}): {advice}"
        )
        raise UnfitFramesError(msg)
    pixels, cells = [], []
    shifts = place.down, place.right
    for shift, own, other, cell in zip(shifts, shape, there, raw.cell, strict=True):
        first = max(0, -shift)
        n_blocks = (min(own, other - shift) - first) // side
        pixels.append(_Span(first * cell, side * cell, n_blocks))
        cells.append(_Span(first + shift, side, n_blocks))
    return pixels, cells


def _blocks(shots: list[_Shot], channel: str, n_levels: int) -> RawBlocks:
    """Blocks of all shots that are neither black nor white in this channel."""
    kept = [shot.inner[channel] for shot in shots]
    base = LUMA / LUMA.sum() if channel == "Y" else np.eye(3)["RGB".index(channel)]

    def joined(values: Callable[[_Shot], Floats]) -> Floats:
        return np.concatenate([values(s)[each] for s, each in zip(shots, kept, strict=True)])

    return RawBlocks(
        level=joined(lambda shot: shot.levels[channel]),
        light=joined(lambda shot: shot.light),
        chroma=joined(lambda shot: shot.chroma),
        radius=joined(lambda shot: shot.radius),
        shot=np.repeat(np.arange(len(shots)), [np.count_nonzero(each) for each in kept]),
        base=base.astype(np.float64),
        light_error=float(max(shot.light_error @ base for shot in shots)),
        n_levels=n_levels,
    )


def _clipped(shots: list[_Shot], channel: str) -> float:
    inner = np.concatenate([shot.inner[channel] for shot in shots])
    return 1.0 - float(inner.mean()) if inner.size else 0.0
