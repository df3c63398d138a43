"""Frames of a video, level for level: luma as it is stored, or colours computed from it.

Luma Y′ is one plane at full resolution, so its noise is that of its own pixels. Red, green and blue
need chroma, which most videos store for every other pixel: two pixels then share part of their
noise. So luma is what calibration reads unless colours are asked for.

PyAV decodes. It is an extra, and only this module imports it.
"""

import os
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from chartless.errors import ImageError, how_to_install
from chartless.frames.frame import Frame, Origin, TimedFrame
from chartless.images._depth import FEWEST_BITS, MOST_BITS
from chartless.images._read import require_file
from chartless.types import Levels

if TYPE_CHECKING:
    import av
    from av.video.format import VideoFormatComponent

_SUFFIXES = (
    *(".3gp", ".avi", ".flv", ".m2ts", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg", ".mts"),
    *(".mxf", ".nut", ".ogv", ".ts", ".webm", ".wmv", ".y4m"),
)
_WEBCAM = "/dev/video"
_LIMITED, _FULL, _UNSPECIFIED = 1, 2, 2  # AVColorRange and AVColorSpace of FFmpeg
_HD = 720  # lines; what players assume of untagged videos changes there
_MOST_OF, _SPARE = 0.9, 0.5  # of what a file announces; seconds
_SAMPLING = {
    (1, 1): "444", (2, 1): "422", (2, 2): "420", (4, 1): "411", (1, 2): "440", (4, 4): "410",
}  # fmt: skip
_ORIENTATION = {90: 8, -90: 6, 180: 3, -180: 3}  # EXIF, by degrees counter-clockwise


def is_video(path: str | os.PathLike[str]) -> bool:
    """Whether the name is that of a video or a webcam (``/dev/video0``)."""
    name = os.fspath(path)
    return name.startswith(_WEBCAM) or Path(name).suffix.lower() in _SUFFIXES


def read_video(
    path: str | os.PathLike[str], *, colour: bool = False
) -> Generator[TimedFrame, None, None]:
    """Decode a video frame by frame; one is held at a time.

    Parameters
    ----------
    path : path-like
        A file that FFmpeg reads, or a Video4Linux device, whose frames never end.
    colour : bool
        Whether red, green and blue are computed from luma and chroma. Each chroma sample stands
        for all pixels that share it. Without, luma is read as it is stored.

    Yields
    ------
    TimedFrame
        In limited range, luma is 0 at 16 and white, 219, at 235; with 10 bits, 0 at 64 and 876 at
        940. What lies outside is clipped. Videos that store colours have them in any case.
        `Frame.remarks` says what was read and what was taken for granted. Frames have no digest.

    Raises
    ------
    ImageError
        If the file is missing or no video, damaged, interlaced, or of a kind that hides the
        levels; or if PyAV is not installed.
    """
    path = Path(path)
    is_file = not os.fspath(path).startswith(_WEBCAM)
    if is_file:
        require_file(path)
    try:
        import av
    except ImportError as error:
        msg = f"is a video, which needs PyAV: {how_to_install('video')}"
        raise ImageError(str(path), msg) from error
    place = 0
    try:
        with av.open(os.fspath(path), format=None if is_file else "v4l2") as container:
            if not container.streams.video:
                msg = "has no pictures: give a video"
                raise ImageError(str(path), msg)
            container.streams.video[0].thread_type = "AUTO"
            time = None
            for decoded in container.decode(video=0):
                place += 1
                time = decoded.time
                yield TimedFrame(time, _frame(path, decoded, colour=colour))
            if is_file and _is_cut(container, place, time):
                msg = f"ends after frame {place}, before its time: copy it again or cut it before"
                raise ImageError(str(path), msg)
    except av.error.FFmpegError as error:
        where = f"after frame {place}" if place else "or no video"
        msg = f"is damaged {where} ({error.strerror}): copy it again or cut it before"
        if not is_file:
            msg = (
                f"gives no pictures ({error.strerror}): check that the camera is connected and "
                "not in use"
            )
        raise ImageError(str(path), msg) from error
    if not place:
        msg = "has no frames: copy it again"
        raise ImageError(str(path), msg)


def _is_cut(container: "av.container.InputContainer", n_frames: int, time: float | None) -> bool:
    """Whether the file announces much more of its pictures than there was."""
    stream = container.streams.video[0]
    if stream.frames:
        return n_frames < _MOST_OF * stream.frames
    if stream.duration is None or stream.time_base is None:
        length = _of_container(container)
    else:
        length = float(stream.duration * stream.time_base)
    return time is not None and time + _SPARE < _MOST_OF * length


def _of_container(container: "av.container.InputContainer") -> float:
    """Duration in seconds; 0 if unknown, or if there is sound too, whose duration it may be."""
    if container.duration is None or len(container.streams) > 1:
        return 0.0
    return container.duration / 1e6


def _frame(path: Path, decoded: "av.VideoFrame", *, colour: bool) -> Frame:
    _refuse_unfit(path, decoded)
    scale = _scale(decoded)
    planar = _unpacked(decoded)
    components = planar.format.components
    is_rgb, white = planar.format.is_rgb, scale.luma
    if colour and not is_rgb and len(components) > 1:
        matrix = _matrix(path, decoded)
        levels, white = _colours(planar, scale, matrix), (1 << scale.bits) - 1
        what = f"R′G′B′ computed from Y′CbCr by {matrix.name}{matrix.assumed}"
    else:
        used = components if is_rgb else components[:1]
        stored = np.stack([_plane(planar, each) for each in used], axis=-1)
        levels = np.clip(stored, scale.black, scale.black + white) - stored.dtype.type(scale.black)
        what = "R′G′B′ read as stored" if is_rgb else "Y′ read as stored, without chroma"
    return Frame(
        path=path,
        levels=levels,
        orientation=_ORIENTATION.get(decoded.rotation, 1),
        remarks=(f"{what}; {scale}",),
        white=white,
        origin=Origin.VIDEO,
    )


def _refuse_unfit(path: Path, decoded: "av.VideoFrame") -> None:
    form = decoded.format
    bits = {each.bits for each in form.components if not each.is_alpha}
    if decoded.is_corrupt:
        msg = "is damaged, and the decoder guessed what is missing: copy it again or cut it before"
    elif decoded.interlaced_frame:
        msg = (
            "is interlaced: the lines of a frame are from two moments, and deinterlacing mixes "
            "their noise; record progressive video"
        )
    elif form.has_palette or form.is_bayer or form.name.startswith("xyz"):
        msg = f"stores its pixels as {form.name}, which hides the levels: convert it to YUV or RGB"
    elif len(bits) > 1 or not FEWEST_BITS <= min(bits) <= MOST_BITS:
        msg = f"stores its pixels as {form.name}: convert it to 8 to 16 bits"
    else:
        return
    raise ImageError(str(path), msg)


def _unpacked(decoded: "av.VideoFrame") -> "av.VideoFrame":
    """The same samples with a plane for each component; none is changed."""
    form = decoded.format
    components = [each for each in form.components if not each.is_alpha]
    if len({each.plane for each in components}) == len(form.components):
        return decoded
    bits = components[0].bits
    if form.is_rgb:
        name = "gbrp"
    elif len(components) == 1:
        name = "gray"
    else:
        name = f"yuv{_SAMPLING[_sharing(components)]}p"
    return decoded.reformat(format=name if bits == FEWEST_BITS else f"{name}{bits}le")


def _sharing(components: "Sequence[VideoFormatComponent]") -> tuple[int, int]:
    """Pixels along and down that share a chroma sample."""
    luma, chroma = components[0], components[1]
    return round(luma.width / chroma.width), round(luma.height / chroma.height)


class _Scale(NamedTuple):
    """What the samples of a video mean."""

    bits: int
    black: int
    luma: int
    """Samples from black to white."""
    chroma: int
    """Samples from -1/2 to 1/2."""
    assumed: str
    """A word if the video does not say so itself."""

    def __str__(self) -> str:
        return f"{self.bits} bits, black {self.black}, white {self.black + self.luma}{self.assumed}"


def _scale(decoded: "av.VideoFrame") -> _Scale:
    form = decoded.format
    bits, tagged = form.components[0].bits, decoded.color_range
    is_luma = not form.is_rgb and len(form.components) > 1 and not form.name.startswith("yuvj")
    is_full = tagged == _FULL if tagged in {_LIMITED, _FULL} else not is_luma
    assumed = "" if tagged in {_LIMITED, _FULL} else " (assumed: not recorded in the video)"
    if is_full:
        top = (1 << bits) - 1
        return _Scale(bits, 0, top, top, assumed)
    unit = 1 << (bits - FEWEST_BITS)
    return _Scale(bits, 16 * unit, 219 * unit, 224 * unit, assumed)


class _Matrix(NamedTuple):
    name: str
    red: float
    """Weight of red in luma."""
    blue: float
    assumed: str = ""


def _matrix(path: Path, decoded: "av.VideoFrame") -> _Matrix:
    tagged = decoded.colorspace
    if tagged == _UNSPECIFIED:
        likely = _MATRICES[1 if decoded.height >= _HD else 6]
        assumed = f" (assumed from its {decoded.height} lines: not recorded in the video)"
        return likely._replace(assumed=assumed)
    if tagged not in _MATRICES:
        msg = (
            f"stores its colours by the matrix {tagged} of H.273: calibrate from its luma, or "
            "convert it to BT.709"
        )
        raise ImageError(str(path), msg)
    return _MATRICES[tagged]


_MATRICES = {  # ITU-T H.273 (2021), table 4
    1: _Matrix("BT.709", 0.2126, 0.0722),
    5: _Matrix("BT.601", 0.299, 0.114),
    6: _Matrix("BT.601", 0.299, 0.114),
    9: _Matrix("BT.2020", 0.2627, 0.0593),
}


def _plane(frame: "av.VideoFrame", component: "VideoFormatComponent") -> Levels:
    """Samples of one component, shape (M, N)."""
    plane = frame.planes[component.plane]
    order = ">" if frame.format.is_big_endian else "<"
    stored: np.dtype[Any] = np.dtype("u1" if component.bits == FEWEST_BITS else f"{order}u2")
    rows = np.frombuffer(memoryview(plane), stored)
    samples = rows.reshape(-1, plane.line_size // stored.itemsize)
    levels: Levels = samples[: component.height, : component.width].astype(stored.newbyteorder("="))
    return levels


def _colours(planar: "av.VideoFrame", scale: _Scale, matrix: _Matrix) -> Levels:
    """Red, green and blue of full range, shape (M, N, 3)."""
    components = planar.format.components[:3]
    y, *chroma = (_plane(planar, each).astype(np.float32) for each in components)
    luma = (y - scale.black) / scale.luma
    middle = 1 << (scale.bits - 1)
    cb, cr = (_spread((each - middle) / scale.chroma, y.shape, components) for each in chroma)
    r = luma + 2 * (1 - matrix.red) * cr
    b = luma + 2 * (1 - matrix.blue) * cb
    g = (luma - matrix.red * r - matrix.blue * b) / (1 - matrix.red - matrix.blue)
    brightness = np.stack([r, g, b], axis=-1).clip(0, 1)
    levels: Levels = np.rint(brightness * ((1 << scale.bits) - 1)).astype(
        np.uint8 if scale.bits == FEWEST_BITS else np.uint16
    )
    return levels


def _spread(
    chroma: npt.NDArray[np.floating],
    shape: tuple[int, ...],
    components: "Sequence[VideoFormatComponent]",
) -> npt.NDArray[np.floating]:
    """Chroma of each pixel: of the sample that it shares with others."""
    across, down = _sharing(components)
    return chroma.repeat(down, axis=0)[: shape[0]].repeat(across, axis=1)[:, : shape[1]]
