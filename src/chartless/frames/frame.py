"""Pictures as values: what a file held; no file format is known here."""

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chartless.frames.compression import Blocks
from chartless.types import Bools, Floats, Floats32, Levels


class Origin(Enum):
    """What a file is, as far as it shows."""

    UNKNOWN = "unknown"
    CAMERA = "camera"
    """Picture that names the camera that took it, or is compressed with loss, as cameras do."""
    RAW = "raw"
    """Levels of a sensor."""
    VIDEO = "video"


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """What the camera noted about a picture; None where the file does not say."""

    exposure_time: float | None = None
    """Seconds; where the file records that a nominal 1/30 s is 1/32 s, the latter."""
    f_number: float | None = None
    iso: float | None = None
    camera: str | None = None
    """Maker and model."""

    @property
    def exposure(self) -> float | None:
        """Exposure t · ISO / N² up to a constant factor, if EXIF gives all three."""
        if self.exposure_time is None or self.f_number is None or self.iso is None:
            return None
        return self.exposure_time * self.iso / self.f_number**2

    def __str__(self) -> str:
        known = (
            (self.exposure_time, "{:g} s"),
            (self.f_number, "f/{:g}"),
            (self.iso, "ISO {:g}"),
        )
        settings = ", ".join(text.format(value) for value, text in known if value is not None)
        return settings or "nothing"


@dataclass(frozen=True, slots=True)
class FrameSource:
    """Where a frame came from."""

    path: Path
    sha256: str
    """Digest of the file or, without one, of its levels."""
    remarks: tuple[str, ...]
    """Remarks made when it was read."""
    span: tuple[int, int] | None = None
    """First and last frame used of a video, from 1; None for a picture."""
    n_used: int | None = None
    """How many of these were used, where not all; 0 for a picture that was given and not used."""
    lossy: bool = False
    """Whether compression changed the pixels, as far as file or pixels show."""
    origin: Origin = Origin.UNKNOWN


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Levels of one picture file, and what the camera noted about it.

    Parameters
    ----------
    path : Path
        The file.
    levels : ndarray of uint8 or uint16, shape (height, width, channels), C-contiguous
        As stored: no colour conversion, no rotation. One channel (grey) or three (RGB).
        From 0, which is black, to `white`, none above.
    settings : CameraSettings
        From EXIF.
    orientation : int
        EXIF orientation 1 … 8: how a viewer should turn the picture. 1 is as stored.
    remarks : tuple of str
        What reading left out or chose, for the user: "dropped the alpha channel".
    sha256 : str
        Digest of the file, in hexadecimal digits; empty if there is none.
    white : int
        The level of brightness 1: 4095 of 12 bits, 219 of the luma of most videos. Without, the
        largest that the type of the levels holds.
    blocks : Blocks, optional
        Pixels that lossy compression coded together, as far as the file shows.
    origin : Origin
    """

    path: Path
    levels: Levels
    settings: CameraSettings = field(default_factory=CameraSettings)
    orientation: int = 1
    remarks: tuple[str, ...] = ()
    sha256: str = ""
    white: int = 0
    blocks: Blocks | None = None
    origin: Origin = Origin.UNKNOWN

    def __post_init__(self) -> None:
        if not self.white:
            object.__setattr__(self, "white", int(np.iinfo(self.levels.dtype).max))

    @property
    def bit_depth(self) -> int:
        """Bits that the levels need, 8 … 16."""
        return self.white.bit_length()

    @property
    def source(self) -> FrameSource:
        """Where it came from: what is kept when the levels are forgotten."""
        lossy = self.blocks is not None
        return FrameSource(self.path, self.sha256, self.remarks, lossy=lossy, origin=self.origin)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """``("Y",)`` or ``("R", "G", "B")``."""
        return ("Y",) if self.levels.shape[2] == 1 else ("R", "G", "B")


class TimedFrame(NamedTuple):
    """A frame of a video."""

    time: float | None
    """Seconds from the start of the video; None if it does not say."""
    frame: Frame


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Values of one picture file, of levels or of light.

    Parameters
    ----------
    values : ndarray of float32, shape (height, width, channels)
        Levels divided by the largest, 0 … 1, or what a floating-point file holds.
    orientation : int
        As in `Frame`.
    remarks : tuple of str
        As in `Frame`.
    """

    values: Floats32
    orientation: int = 1
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class RawPicture:
    """Light of one raw file, in cells: the least parts of the sensor that have all colours.

    Parameters
    ----------
    path : Path
        The file.
    light : ndarray of float32, shape (height, width, 3)
        Red, green and blue of each cell, black being 0 and saturation 1; means where a cell has
        several sites of a colour. A sensor without colours has three alike.
    saturated : ndarray of bool, shape (height, width)
        Whether a site in the cell is at saturation or close to it.
    cell : tuple of int
        Height and width of a cell in pixels, (2, 2) for a Bayer pattern.
    white_balance : ndarray of float64, shape (3,)
        Factors by which the camera multiplied red, green and blue.
    error : float
        How far black may be from 0: half a level of the file.
    remarks, sha256
        As in `Frame`.
    """

    path: Path
    light: Floats32
    saturated: Bools
    cell: tuple[int, int]
    white_balance: Floats
    error: float
    remarks: tuple[str, ...] = ()
    sha256: str = ""

    @property
    def source(self) -> FrameSource:
        """As in `Frame`; the picture beside a raw file is that of a camera."""
        return FrameSource(self.path, self.sha256, self.remarks, origin=Origin.CAMERA)
