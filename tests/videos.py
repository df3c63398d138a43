"""Videos made with PyAV, plane by plane, so that it is known what each sample is."""

from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt

Planes = tuple[npt.NDArray[Any], ...]


def write_video(
    path: Path,
    frames: Iterable[Planes],
    *,
    pixels: str = "yuv420p",
    codec: str = "ffv1",
    options: Mapping[str, str] | None = None,
    colour_range: int = 0,
    matrix: int = 2,
    times: Iterable[int] | None = None,
    interlaced: bool = False,
) -> Path:
    """Write planes as the frames of a video, 25 to the second or at times in milliseconds."""
    clock = None if times is None else iter(times)
    with av.open(path, "w") as container:
        stream = container.add_stream(codec, rate=25, options=dict(options or {}))
        stream.pix_fmt = pixels
        stream.codec_context.color_range = colour_range
        stream.codec_context.colorspace = matrix
        if clock is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for number, planes in enumerate(frames):
            frame = video_frame(planes, pixels)
            if number == 0:
                stream.height, stream.width = frame.height, frame.width
            frame.color_range, frame.colorspace = colour_range, matrix
            frame.pts = number if clock is None else next(clock)
            frame.time_base = Fraction(1, 25 if clock is None else 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def video_frame(planes: Planes, pixels: str) -> av.VideoFrame:
    height, width = planes[0].shape[:2]
    frame = av.VideoFrame(width, height, pixels)
    for plane, samples in zip(frame.planes, planes, strict=True):
        rows = np.frombuffer(plane, samples.dtype).reshape(-1, plane.line_size // samples.itemsize)
        flat = samples.reshape(samples.shape[0], -1)
        rows[: flat.shape[0], : flat.shape[1]] = flat
    return frame


def grey_planes(luma: npt.NDArray[Any], middle: int = 128) -> Planes:
    """Luma with the chroma of grey, of half its size."""
    half = tuple((side + 1) // 2 for side in luma.shape)
    return (luma, *(np.full(half, middle, luma.dtype) for _ in range(2)))
