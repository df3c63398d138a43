"""Histograms of pictures."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from chartless.evidence.base import AbstractEvidence
from chartless.evidence.typical.channel import LevelCounts
from chartless.frames.channels import planes_of, require_alike, require_mask
from chartless.frames.frame import Frame, FrameSource
from chartless.types import Bools, Indices


@dataclass(frozen=True, slots=True, eq=False)
class TypicalEvidence(AbstractEvidence):
    """Levels of pictures in all channels."""

    histograms: Mapping[str, Indices]
    """Pixels at each level, shape (L,), by channel."""
    sources: tuple[FrameSource, ...]
    bit_depth: int

    @property
    @override
    def channels(self) -> tuple[str, ...]:
        return tuple(self.histograms)

    @override
    def channel(self, name: str) -> LevelCounts:
        return LevelCounts(self.histograms[name])


def typical_evidence(
    frames: Iterable[Frame],
    *,
    n_levels: int,
    channels: str = "auto",
    mask: Bools | None = None,
    on_frame: Callable[[Frame], None] | None = None,
) -> TypicalEvidence:
    """Count the levels of pictures of one camera.

    Parameters
    ----------
    frames : iterable of Frame
        At least one.
    n_levels : int
        Number of levels after reduction.
    channels : str
        As for `chartless.frames.channels.planes_of`.
    mask : ndarray of bool, shape (M, N), optional
        Pixels to count.
    on_frame : callable, optional
        Called with each frame when it has been read.

    Raises
    ------
    UnfitFramesError
        If the pictures differ in size, channels or bit depth.
    ParameterError
        If `channels`, `n_levels` or the mask does not suit the frames.
    """
    first: Frame | None = None
    histograms: dict[str, Indices] = {}
    sources = []
    for frame in frames:
        if first is None:
            first = frame
            require_mask(mask, frame)
        require_alike(first, frame, one_exposure=False)
        for name, plane in planes_of(frame, channels, n_levels).items():
            counted = plane if mask is None else plane[mask]
            counts = np.bincount(counted.ravel(), minlength=n_levels)
            histograms[name] = histograms.get(name, 0) + counts
        sources.append(frame.source)
        if on_frame is not None:
            on_frame(frame)
    assert first is not None
    return TypicalEvidence(histograms, tuple(sources), first.bit_depth)
