"""Write float arrays as EXR, TIFF, PNG or Radiance HDR, whole or not at all."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does

from chartless._files import atomic_path
from chartless.errors import ImageError, OutputError, ParameterError

DataType: TypeAlias = Literal["auto", "float", "uint16", "uint8"]
"""How samples are stored; "auto" is the most precise that the format holds."""

Metadata: TypeAlias = Mapping[str, str | int | float | tuple[float, ...]]
"""Attributes by their name in OpenImageIO, such as ``"ExposureTime"``."""

_Samples: TypeAlias = npt.NDArray[np.float32 | np.uint8 | np.uint16]

_DATA_TYPES: dict[str, tuple[DataType, ...]] = {  # the first is "auto"
    ".exr": ("float",),
    ".tif": ("float", "uint16", "uint8"),
    ".tiff": ("float", "uint16", "uint8"),
    ".png": ("uint16", "uint8"),
    ".hdr": ("float",),
}
_UPRIGHT = (".png", ".hdr")  # their viewers know no orientation
_UNCALIBRATED = 65535  # EXIF ColorSpace
_UNKNOWN = "unknown"  # as the identifiers of the Color Interop Forum have it
_PRIMARIES = "those of the camera, not measured"
_BUFFER = 1 << 16
_PNG_FILTER = {"uint8": 0x40, "uint16": 0x08}  # PNG_FILTER_AVG, PNG_FILTER_NONE of libpng
_PNG_LEVEL = 1  # of zlib: a third of the time of the usual 6 for some per cent of size


def write_image(
    path: str | os.PathLike[str],
    values: npt.NDArray[np.floating],
    *,
    data_type: DataType = "auto",
    orientation: int = 1,
    linear: bool = True,
    metadata: Metadata | None = None,
) -> None:
    """Write values as a picture in the format that the extension names.

    Parameters
    ----------
    path : path-like
        ``.exr`` (float32), ``.tif`` (float32 or integers), ``.png`` (integers) or ``.hdr``.
        Replaced only when the new file is complete.
    values : ndarray of float, shape (height, width, 1 or 3), range 0 … 1
        Integers are rounded, and clipped to the range; floats are stored as they are. Radiance
        HDR is colour alone, and keeps three numbers of 8 bits with one exponent: errors are up
        to 0.8 % of the largest, and what is negative becomes 0.
    data_type : {"auto", "float", "uint16", "uint8"}
        "auto": float32 for EXR and TIFF, uint16 for PNG.
    orientation : int
        EXIF orientation 1 … 8 of the picture, kept as metadata in EXR and TIFF. PNG and HDR
        viewers ignore it, so the pixels are turned instead.
    linear : bool
        Label the picture as linear light where the format can: PNG by its gamma, EXR in words.
        No pixel depends on it. Primaries are those of the camera, which nobody has measured: no
        file claims others.
    metadata : mapping, optional
        More attributes. EXR keeps them all, TIFF those that EXIF and TIFF know, HDR none.

    Raises
    ------
    ImageError
        If the format is not written, or does not hold `data_type`.
    OutputError
        If nothing can be written there.
    ParameterError
        If `values` are not a picture, or `data_type` or `orientation` do not exist.
    """
    path = Path(path)
    stored = stored_type(path, data_type)
    _refuse_unfit(values, stored, orientation)
    samples = _encode(values, stored)
    suffix = path.suffix.lower()
    if suffix in _UPRIGHT:
        samples, orientation = np.ascontiguousarray(upright(samples, orientation)), 1
    if suffix == ".hdr" and samples.shape[2] == 1:
        samples = np.repeat(samples, 3, axis=2)
    with atomic_path(path) as temporary:
        reason = _save(temporary, samples, stored, orientation, metadata or {}, linear=linear)
        if reason:
            msg = "cannot be written: check that the disk has room"
            raise OutputError(str(path), msg) from OSError(reason)
        _check_room(temporary)


def stored_type(path: str | os.PathLike[str], data_type: DataType = "auto") -> DataType:
    """Return how `write_image` would store samples there.

    Raises
    ------
    ImageError
        If the format that the extension names is not written, or does not hold `data_type`.
    ParameterError
        If `data_type` does not exist.
    """
    path = Path(path)
    if data_type not in get_args(DataType):
        msg = f"unknown data type {data_type!r}: use {', '.join(get_args(DataType))}"
        raise ParameterError(msg)
    known = _DATA_TYPES.get(path.suffix.lower())
    if known is None:
        msg = f"pictures are written as {', '.join(_DATA_TYPES)}, not as {path.suffix!r}"
        raise ImageError(str(path), msg)
    if data_type == "auto":
        return known[0]
    if data_type not in known:
        fitting = [suffix for suffix, types in _DATA_TYPES.items() if data_type in types]
        msg = f"a {path.suffix} file does not hold {data_type} samples: use {', '.join(fitting)}"
        raise ImageError(str(path), msg)
    return data_type


def _refuse_unfit(values: npt.NDArray[np.floating], stored: DataType, orientation: int) -> None:
    if values.ndim != 3 or values.shape[2] not in (1, 3) or not values.size:  # noqa: PLR2004
        msg = f"a picture has the shape (height, width, 1 or 3), not {values.shape}"
    elif not 1 <= orientation <= 8:  # noqa: PLR2004 - EXIF
        msg = f"orientation must lie between 1 and 8, not {orientation}"
    elif stored != "float" and np.isnan(values).any():
        msg = "integers cannot hold NaN: write the values as float, to EXR or TIFF"
    else:
        return
    raise ParameterError(msg)


def _encode(values: npt.NDArray[np.floating], stored: DataType) -> _Samples:
    if stored == "float":
        return np.ascontiguousarray(values, dtype=np.float32)
    samples = np.empty(values.shape, dtype=stored)
    white = np.iinfo(samples.dtype).max
    for row, own in zip(values, samples, strict=True):  # as all in doubles would leave the cache
        own[...] = np.rint(np.multiply(row.clip(0, 1), white, dtype=np.float64))
    return samples


def upright(samples: _Samples, orientation: int) -> _Samples:
    """Turn and mirror a picture, shape (height, width, C), as a viewer would for this orientation.

    Parameters
    ----------
    samples : ndarray of float32, uint8 or uint16
    orientation : int
        EXIF orientation 1 … 8.
    """
    if orientation > 4:  # noqa: PLR2004 - 5 … 8 store columns as rows
        samples = samples.swapaxes(0, 1)
    rows, columns = samples, samples[:, ::-1]
    return {
        1: rows, 2: columns, 3: columns[::-1], 4: rows[::-1],
        5: rows, 6: columns, 7: columns[::-1], 8: rows[::-1],
    }[orientation]  # fmt: skip


def _save(
    path: Path,
    samples: _Samples,
    stored: DataType,
    orientation: int,
    metadata: Metadata,
    *,
    linear: bool,
) -> str:
    """Write the file; return what went wrong, "" if nothing did."""
    height, width, n_channels = samples.shape
    spec = oiio.ImageSpec(width, height, n_channels, stored)
    spec.attribute("Orientation", orientation)
    spec.attribute("Exif:ColorSpace", _UNCALIBRATED)  # the TIFF writer reports an empty EXIF
    suffix = path.suffix.lower()
    if suffix == ".png":
        spec.attribute("oiio:ColorSpace", _UNKNOWN)  # else it would be called sRGB
        if linear:
            spec.attribute("oiio:Gamma", 1.0)
        # Trying all filters takes most of the time. 16 bits are mostly what a table made of fewer
        # levels: their few values repeat, and a filter would hide it.
        spec.attribute("png:filter", _PNG_FILTER[stored])
        spec.attribute("png:compressionLevel", _PNG_LEVEL)
    if suffix == ".exr" and linear and n_channels > 1:
        spec.attribute("chartless:primaries", _PRIMARIES)
    for name, value in metadata.items():
        if isinstance(value, tuple):
            spec.attribute(name, f"float[{len(value)}]", value)
        else:
            spec.attribute(name, value)
    target = oiio.ImageOutput.create(str(path))
    if target is None:
        return str(oiio.geterror())
    if target.open(str(path), spec):
        target.write_image(samples)
        target.close()
    return str(target.geterror())  # return values are True even when the disk is full


def _check_room(path: Path) -> None:
    """Raise OSError if the disk is full: the library ignores errors of its last buffer."""
    size = path.stat().st_size
    with path.open("ab") as file:
        file.write(bytes(_BUFFER))
    os.truncate(path, size)
