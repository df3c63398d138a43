"""Raw files by LibRaw: what each site of the sensor stored.

Where a file holds compressed levels with a table that undoes it (DNG's LinearizationTable, the
curves of lossy Nikon and Sony files), LibRaw has applied the table: what it gives is linear if the
maker says so. Nothing is interpolated here, and no colour converted.
"""

import os
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from chartless.errors import ImageError, how_to_install
from chartless.frames.frame import CameraSettings, Frame, Origin, RawPicture
from chartless.types import Floats, Floats32

if TYPE_CHECKING:
    import rawpy

_SUFFIXES = (
    *(".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dng", ".erf", ".iiq", ".kdc", ".mrw"),
    *(".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".srw"),
)
_WHITE = (1 << 16) - 1
_NEARLY = 0.95  # of saturation, from where on a sensor need not be linear
_ROUNDING = 12**-0.5  # levels
_ORIENTATIONS = {3: 3, 5: 8, 6: 6}  # LibRaw's to EXIF's
_ERRORS = threading.Lock()


def is_raw(path: Path) -> bool:
    """Whether the name is that of a raw file."""
    return path.suffix.lower() in _SUFFIXES


def raw_frame(path: Path, sha256: str) -> Frame:
    """Levels of single sites, one of each colour in a repeat of the pattern.

    A Bayer pattern gives a quarter of the sites in red, green and blue each: the second green is
    left out, as a mean of two has less noise than a site. Black is taken off, and levels up to
    white are spread over 16 bits.

    Raises
    ------
    ImageError
        If LibRaw cannot read the file, or its pixels are no single sites.
    """
    with _opened(path) as raw:
        mosaic = _mosaic(path, raw)
        settings = _settings(raw)
        orientation = _ORIENTATIONS.get(raw.sizes.flip, 1)
    high, wide = mosaic.pattern.shape
    rows, columns = mosaic.levels.shape[0] // high, mosaic.levels.shape[1] // wide
    planes = []
    for numbers in mosaic.colours:
        row, column = np.argwhere(np.isin(mosaic.pattern, numbers))[0]
        black, white = mosaic.ends(mosaic.pattern[row, column])
        table = (np.arange(_WHITE + 1.0) - black) * (_WHITE / (white - black))
        spread = np.rint(table.clip(0, _WHITE)).astype(np.uint16)
        planes.append(spread[mosaic.levels[row::high, column::wide][:rows, :columns]])
    black, white = mosaic.ends(mosaic.pattern[0, 0])
    remark = f"read levels {black:g} to {white:g} of the sensor as 0 to {_WHITE}"
    if len(planes) > 1:
        remark += f", one site of each colour in {high} × {wide}"
    levels = np.stack(planes, axis=-1)
    return Frame(path, levels, settings, orientation, (remark,), sha256, origin=Origin.RAW)


def raw_settings(path: Path) -> CameraSettings:
    """What the camera noted; raises as `raw_frame` does."""
    with _opened(path) as raw:
        return _settings(raw)


def raw_picture(path: Path, sha256: str) -> RawPicture:
    """Light in cells, means of all sites of a colour; raises as `raw_frame` does."""
    with _opened(path) as raw:
        mosaic = _mosaic(path, raw)
        balance = _white_balance(raw)
    high, wide = cell = mosaic.cell
    rows, columns = mosaic.levels.shape[0] // high, mosaic.levels.shape[1] // wide
    light: list[Floats32] = []
    saturated = np.zeros((rows, columns), dtype=bool)
    least_range = np.inf
    for numbers in mosaic.colours:
        total = np.zeros((rows, columns), dtype=np.float32)
        sites = np.argwhere(np.isin(mosaic.pattern_of_cell, numbers))
        for row, column in sites:
            black, white = mosaic.ends(mosaic.pattern_of_cell[row, column])
            own = mosaic.levels[row::high, column::wide][:rows, :columns].astype(np.float32)
            own = (own - np.float32(black)) / np.float32(white - black)
            saturated |= own >= _NEARLY
            total += own
            least_range = min(least_range, white - black)
        total /= len(sites)
        light.append(total)
    return RawPicture(
        path=path,
        light=np.stack(light if len(light) > 1 else 3 * light, axis=-1),
        saturated=saturated,
        cell=cell,
        white_balance=balance if len(light) > 1 else np.ones(3),
        error=_ROUNDING / least_range,
        sha256=sha256,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Mosaic:
    """The visible part of a sensor."""

    levels: npt.NDArray[np.uint16]
    pattern: npt.NDArray[np.uint8]
    """LibRaw's number of the colour of each site, until they repeat."""
    colours: tuple[tuple[int, ...], ...]
    """LibRaw's numbers of red, of green and of blue; for a grey sensor, of its only colour."""
    black: tuple[float, ...]
    """Level of black by number of the colour."""
    white: tuple[float, ...]

    @property
    def cell(self) -> tuple[int, int]:
        """Height and width of the part of the sensor that is one pixel of light."""
        high, wide = self.pattern.shape
        return (2, 2) if (high, wide) == (1, 1) else (high, wide)

    @property
    def pattern_of_cell(self) -> npt.NDArray[np.uint8]:
        """As `pattern`, of the size of a cell."""
        return np.broadcast_to(self.pattern, self.cell)

    def ends(self, number: int) -> tuple[float, float]:
        """Black and white of a colour."""
        return self.black[number], self.white[number]


def _mosaic(path: Path, raw: "rawpy.RawPy") -> _Mosaic:
    import rawpy

    pattern = raw.raw_pattern
    if raw.raw_type is not rawpy.RawType.Flat or pattern is None:
        msg = (
            "holds pixels that its maker or a converter made of several sites, not the sites "
            "themselves: give the raw file as the camera wrote it"
        )
        raise ImageError(str(path), msg)
    high, wide = pattern.shape
    levels = raw.raw_image_visible.copy()  # it goes with the file
    numbers = raw.raw_colors_visible[:high, :wide].copy()
    if min(levels.shape[0] // high, levels.shape[1] // wide) < 1:
        msg = "has fewer pixels than colours: copy it again from the camera or card"
        raise ImageError(str(path), msg)
    colours: list[tuple[int, ...]]
    names = raw.color_desc.decode("ascii", "replace")
    if pattern.size == 1:
        numbers, colours = np.zeros((1, 1), dtype=np.uint8), [(0,)]
    else:
        colours = [
            tuple(number for number, name in enumerate(names) if name == wanted) for wanted in "RGB"
        ]
        if any(not np.isin(numbers, each).any() for each in colours):
            msg = f"has a sensor of the colours {names}: only red, green and blue are understood"
            raise ImageError(str(path), msg)
    black = tuple(float(level) for level in raw.black_level_per_channel)
    noted = raw.camera_white_level_per_channel or (raw.white_level,) * len(black)
    white = tuple(min(float(level), float(raw.white_level)) for level in noted)
    if any(low >= high for low, high in zip(black, white, strict=True)):
        msg = f"has black at {max(black):g} and white at {min(white):g}: no levels between"
        raise ImageError(str(path), msg)
    return _Mosaic(levels, numbers, tuple(colours), black, white)


def _white_balance(raw: "rawpy.RawPy") -> Floats:
    """Factors of red, green and blue relative to green; 1 if the file has none."""
    for factors in (raw.camera_whitebalance, raw.daylight_whitebalance):
        balance = np.array(factors[:3], dtype=np.float64)
        if np.all((balance > 0) & np.isfinite(balance)):
            return np.asarray(balance / balance[1])
    return np.ones(3)


def _settings(raw: "rawpy.RawPy") -> CameraSettings:
    noted = raw.other
    return CameraSettings(
        exposure_time=_positive(noted.shutter_speed),
        f_number=_positive(noted.aperture),
        iso=_positive(noted.iso_speed),
    )


def _positive(value: float) -> float | None:
    return float(value) if 0 < value < np.inf else None


@contextmanager
def _opened(path: Path) -> Iterator["rawpy.RawPy"]:
    """Yield the file, unpacked; refuse what LibRaw cannot read, or only in part."""
    try:
        import rawpy
    except ImportError as error:
        msg = f"is a raw file, which rawpy reads: {how_to_install('raw')}"
        raise ImageError(str(path), msg) from error
    raw = rawpy.RawPy()
    try:
        with _complaints() as complaints:
            try:
                raw.open_file(str(path))
                raw.unpack()
            except rawpy.LibRawFileUnsupportedError as error:
                msg = (
                    "is not a raw file that LibRaw "
                    f"{'.'.join(map(str, rawpy.libraw_version))} supports: update rawpy, or "
                    "convert the file to DNG"
                )
                raise ImageError(str(path), msg) from error
            except (rawpy.LibRawError, rawpy.NotSupportedError, NotImplementedError) as error:
                raise _damaged(path) from error
        if complaints:
            raise _damaged(path)
        yield raw
    finally:
        raw.close()


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collect what C code prints on standard error: all that LibRaw says of half a file."""
    collected: list[str] = []
    with _ERRORS, tempfile.TemporaryFile() as file:
        own = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield collected
        finally:
            os.dup2(own, 2)
            os.close(own)
            file.seek(0)
            collected += file.read().decode(errors="replace").splitlines()


def _damaged(path: Path) -> ImageError:
    return ImageError(str(path), "is damaged or cut short: copy it again from the camera or card")
