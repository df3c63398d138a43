"""Read one picture file level for level, or say in one line why not.

OpenImageIO decodes. It also helps where calibration must not be helped: it expands palettes,
stretches 10 bits to 16, converts CMYK, multiplies colours by alpha and fills in the missing
part of a JPEG. Each of these is refused here, switched off or undone.
"""

import hashlib
import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio  # noqa: N813 - as its own documentation does

from chartless._files.given import NOT_A_FILE, address_in
from chartless.errors import ImageError
from chartless.frames.compression import JPEG_BLOCK, Blocks
from chartless.frames.frame import CameraSettings, Frame, Origin, Picture, RawPicture
from chartless.images._depth import FEWEST_BITS, MOST_BITS, narrowed, significant_bits
from chartless.images._png import SIGNATURE as PNG_SIGNATURE
from chartless.images._png import PngHeader, read_png_header
from chartless.images._raw import is_raw, raw_frame, raw_picture, raw_settings
from chartless.types import Levels

MAX_PIXELS = 1 << 30
"""No camera makes more; a header that claims more is damaged or hostile."""

_FORMATS = ("png", "tiff", "jpeg", "bmp", "pnm", "webp", "jpeg2000", "openexr")
_MAGIC = (
    PNG_SIGNATURE,
    b"\xff\xd8\xff",  # JPEG
    b"II*\0",  # TIFF
    b"MM\0*",
    b"II+\0",  # BigTIFF
    b"MM\0+",
    b"BM",
    b"RIFF",  # WebP
    b"\0\0\0\x0cjP  ",  # JPEG 2000
    b"v/1\x01",  # OpenEXR
)
_FLOATS = (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
_MOST_STOPS, _SAME_SHUTTER = 64, 0.12  # stops; 1/30 s and 1/32 s are 0.09 apart
_WIDENED = (10, 12, 14)
"""Bits of a TIFF file that OpenImageIO scales to 16."""
_PHOTOMETRY = "tiff:PhotometricInterpretation"
_WHITE_IS_ZERO, _PALETTE = 0, 3
_PHOTOMETRIC = (_WHITE_IS_ZERO, 1, 2, 6)  # TIFF: grey, grey, RGB, YCbCr
_CHROMA = {"4:4:4": (1, 1), "4:2:2": (1, 2), "4:4:0": (2, 1), "4:2:0": (2, 2), "4:1:1": (1, 4)}
"""Rows and columns of pixels that share a chroma sample."""
_PNM_HEADER = re.compile(rb"P[2356](?:\s+(?:#[^\n]*\n\s*)*(\d+)){3}\s")
_TOO_LARGE = re.compile(r"limit|may not exceed|header claims")


def read_frame(path: str | os.PathLike[str], *, raw: bool = False) -> Frame:
    """Read the levels of a picture of 8 to 16 bits as they are stored.

    Parameters
    ----------
    path : path-like
        A PNG, TIFF, JPEG, BMP, PNM, WebP, JPEG 2000 or integer EXR file, recognised by its
        content.
    raw : bool
        Whether a raw file, recognised by its suffix, will do. Single sites of the sensor are read:
        red, green and blue of a Bayer pattern, at half the size.

    Returns
    -------
    Frame
        The first of several pages; without alpha; with the bits that the levels have, not
        those that the file has room for. `Frame.remarks` says so.

    Raises
    ------
    ImageError
        If the file is missing, unreadable, damaged or cut short, or holds anything but grey or
        RGB levels of 8 to 16 bits.
    """
    path = Path(path)
    head = _read_head(path, raw=raw)
    if is_raw(path):
        return raw_frame(path, digest(path))
    png = _check_png(path) if head.startswith(PNG_SIGNATURE) else None
    source = _open(path, head)
    spec = source.spec()
    _refuse_unfit(path, source.format_name(), spec, head)

    n_channels = 1 if spec.nchannels <= 2 else 3  # noqa: PLR2004 - grey and alpha
    samples = source.read_image(0, 0, 0, n_channels, "unknown")  # "unknown": as stored
    reason = source.geterror()
    if samples is None or reason:  # a short JPEG has levels, and a reason to distrust them
        raise _damaged(path) from OSError(reason)
    remarks = _remarks(source, spec, png)
    stored = _stored_bits(source.format_name(), spec, head)
    noted = stored if stored < 8 * samples.itemsize else None
    levels, white = _levels(path, samples, noted if png is None else png.significant_bits)
    if white.bit_length() != stored:
        remarks.append(f"read {white.bit_length()} bits of samples that have room for {stored}")
    if samples.itemsize > 1 and spec.get_int_attribute(_PHOTOMETRY, 1) == _WHITE_IS_ZERO:
        levels = white - levels  # OpenImageIO inverts 8 bits alone
    settings, blocks = _settings(spec), _blocks(source.format_name(), spec, head)
    of_camera = settings.camera is not None or blocks is not None
    return Frame(
        path=path,
        levels=levels,
        settings=settings,
        orientation=_orientation(spec),
        remarks=tuple(remarks),
        sha256=digest(path),
        white=white,
        blocks=blocks,
        origin=Origin.CAMERA if of_camera else Origin.UNKNOWN,
    )


def _blocks(file_format: str, spec: oiio.ImageSpec, head: bytes) -> Blocks | None:
    """Pixels that the file codes together; None of files without loss."""
    if file_format == "jpeg":
        # "4:2:2" and the like: chroma of a block of 8 × 8 stands for so many more pixels.
        chroma = spec.get_string_attribute("jpeg:subsampling", "4:4:4")
        down, right = _CHROMA.get(chroma, (2, 2))
        if spec.nchannels == 1:
            down, right = 1, 1
        return Blocks(down * JPEG_BLOCK, right * JPEG_BLOCK)
    lossy_webp = file_format == "webp" and b"VP8L" not in head[:64]
    # Wavelets of JPEG 2000 have no blocks; what they ring over is about as wide as those of WebP.
    return Blocks(16, 16) if lossy_webp or file_format == "jpeg2000" else None


def _stored_bits(file_format: str, spec: oiio.ImageSpec, head: bytes) -> int:
    """Bits of a sample in the file."""
    if file_format == "pnm":
        return _pnm_maximum(head).bit_length()
    bits: int = spec.get_int_attribute("oiio:BitsPerSample", 8 * spec.format.size())
    return bits


def _levels(path: Path, samples: npt.NDArray[Any], noted: int | None) -> tuple[Levels, int]:
    """Levels of as many bits as they have, and white."""
    bits = 8 * samples.itemsize
    if bits > FEWEST_BITS:
        bits = significant_bits(samples, noted)
    if bits <= MOST_BITS:
        levels = samples if bits == 8 * samples.itemsize else narrowed(samples, bits)
        return levels, (1 << bits) - 1
    if samples.max() >> MOST_BITS:
        msg = f"holds levels of {bits} bits: convert it to 8 or 16 bits"
        raise ImageError(str(path), msg)
    return _levels(path, samples.astype(np.uint16), noted)


def read_settings(path: str | os.PathLike[str], *, raw: bool = False) -> CameraSettings:
    """Read what the camera noted about a picture, without its pixels; `raw` as in `read_frame`.

    Raises
    ------
    ImageError
        If the file is missing, unreadable or no picture.
    """
    path = Path(path)
    head = _read_head(path, raw=raw)
    return raw_settings(path) if is_raw(path) else _settings(_open(path, head).spec())


def read_profile(path: str | os.PathLike[str]) -> bytes | None:
    """Read the ICC profile that a picture holds, as it is; None if it holds none.

    Raises
    ------
    ImageError
        If the file is missing, unreadable or no picture.
    """
    path = Path(path)
    head = _read_head(path)
    profile = _open(path, head).spec().getattribute("ICCProfile")
    return None if profile is None else np.asarray(profile, dtype=np.uint8).tobytes()


def read_size(path: str | os.PathLike[str]) -> tuple[int, int]:
    """Width and height that a picture claims, from its header alone.

    Raises
    ------
    ImageError
        If the file is missing, unreadable or no picture, or claims more pixels than any camera has.
    """
    path = Path(path)
    head = _read_head(path)
    png = _check_png(path) if head.startswith(PNG_SIGNATURE) else None
    if png is not None:
        return png.width, png.height
    spec = _open(path, head).spec()
    _refuse_size(path, spec.width, spec.height)
    return spec.width, spec.height


def read_raw(path: str | os.PathLike[str]) -> RawPicture:
    """Read the light of a raw file in cells of its colour pattern, nothing interpolated.

    Parameters
    ----------
    path : path-like
        A file that LibRaw knows, whatever its suffix.

    Raises
    ------
    ImageError
        If the file is missing, unreadable, damaged, or holds no single sites of a sensor of red,
        green and blue or without colours; or if rawpy is not installed.
    """
    path = Path(path)
    _read_head(path, raw=True)
    return raw_picture(path, digest(path))


def read_values(path: str | os.PathLike[str]) -> Picture:
    """Read a picture as floating point: light, or levels divided by the largest.

    Parameters
    ----------
    path : path-like
        An EXR, HDR or floating-point TIFF file, or anything that `read_frame` reads.

    Returns
    -------
    Picture

    Raises
    ------
    ImageError
        As for `read_frame`, and if a value is not finite.
    """
    path = Path(path)
    head = _read_head(path)
    source = None if head.startswith(PNG_SIGNATURE) else _open(path, head)
    if source is None or source.spec().format.basetype not in _FLOATS:
        frame = read_frame(path)
        values = frame.levels.astype(np.float32) / np.float32(frame.white)
        return Picture(values, frame.orientation, frame.remarks)
    spec = source.spec()
    _refuse_size(path, spec.width, spec.height)
    n_channels = 1 if spec.nchannels <= 2 else 3  # noqa: PLR2004 - grey and alpha
    light = source.read_image(0, 0, 0, n_channels, "float")
    reason = source.geterror()
    if light is None or reason:
        raise _damaged(path) from OSError(reason)
    if not np.isfinite(light).all():
        msg = "holds values that are not finite: repair it first"
        raise ImageError(str(path), msg)
    return Picture(light, _orientation(spec), tuple(_remarks(source, spec, None)))


def _read_head(path: Path, *, raw: bool = False) -> bytes:
    """Return the first bytes of the file; refuse what cannot be a picture at all."""
    head = require_file(path)
    if is_raw(path) and not raw:  # the TIFF reader would return the thumbnail
        msg = "is a raw file, whose levels are linear already: give the camera's JPEG, PNG or TIFF"
        raise ImageError(str(path), msg)
    return head


def require_file(path: Path) -> bytes:
    """Return the first bytes of a file; refuse what is none, is empty or cannot be read."""
    try:
        is_folder, size = path.is_dir(), path.stat().st_size
        head = b"" if is_folder or not size else _first_bytes(path)
        str(path).encode()  # OpenImageIO takes names as UTF-8
    except (FileNotFoundError, NotADirectoryError) as error:
        address = address_in(path)
        if address is not None:
            raise ImageError(address, NOT_A_FILE) from error
        msg = "does not exist: check the name"
        raise ImageError(str(path), msg) from error
    except PermissionError as error:
        msg = "may not be read: change its permissions"
        raise ImageError(str(path), msg) from error
    except UnicodeEncodeError as error:
        msg = "has a name that is not valid UTF-8: rename it"
        raise ImageError(os.fsencode(path).decode(errors="replace"), msg) from error
    except OSError as error:
        msg = f"cannot be read ({error.strerror}): copy it elsewhere and try again"
        raise ImageError(str(path), msg) from error
    if is_folder:
        msg = "is a folder: name the pictures in it"
        raise ImageError(str(path), msg)
    if not size:
        msg = "is empty: copy it again from the camera or card"
        raise ImageError(str(path), msg)
    return head


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(4096)


def _check_png(path: Path) -> PngHeader:
    png = read_png_header(path)
    if png is None:
        raise _damaged(path)
    if png.has_palette:
        raise _palette(path)
    _refuse_depth(path, png.bit_depth)
    _refuse_size(path, png.width, png.height)
    return png


def _open(path: Path, head: bytes) -> oiio.ImageInput:
    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)  # else colours are multiplied by alpha
    source = oiio.ImageInput.open(str(path), as_stored)
    if source is not None:
        return source
    reason = oiio.geterror()  # unread, it would be printed at exit
    if _TOO_LARGE.search(reason):
        raise _too_large(path) from OSError(reason)
    if "bits per sample" in reason:
        msg = "stores samples with an unsupported number of bits: convert it to 8 or 16 bits"
        raise ImageError(str(path), msg) from OSError(reason)
    if head.startswith(_MAGIC):
        raise _damaged(path) from OSError(reason)
    msg = "is not a picture in a known format: use PNG, TIFF or JPEG files"
    raise ImageError(str(path), msg) from OSError(reason)


def _refuse_unfit(path: Path, file_format: str, spec: oiio.ImageSpec, head: bytes) -> None:
    if spec.format.basetype in _FLOATS:
        msg = (
            "is floating point: it holds light, not levels; "
            "calibrate from the camera's own 8- or 16-bit files"
        )
        raise ImageError(str(path), msg)
    if file_format == "gif":
        raise _palette(path)
    if file_format not in _FORMATS:
        msg = f"is a {file_format} file, whose levels are uncertain: use PNG, TIFF or JPEG files"
        raise ImageError(str(path), msg)
    _refuse_size(path, spec.width, spec.height)
    _refuse_hidden_depth(path, file_format, spec, head)
    deep = file_format == "openexr" and spec.format.basetype == oiio.UINT32
    if spec.format.basetype not in (oiio.UINT8, oiio.UINT16) and not deep:
        msg = f"holds {spec.format} samples: convert it to unsigned 8 or 16 bits"
        raise ImageError(str(path), msg)
    colours = spec.get_string_attribute("jpeg:ColorSpace")
    if spec.get_int_attribute(_PHOTOMETRY, 1) not in _PHOTOMETRIC:
        colours = spec.get_string_attribute("tiff:ColorSpace") or "something else"
    if colours:
        msg = f"stores its colours as {colours}: calibrate from the camera's own RGB or grey files"
        raise ImageError(str(path), msg)
    if spec.nchannels > 4:  # noqa: PLR2004 - RGB and alpha
        msg = f"has {spec.nchannels} channels: save its red, green and blue alone"
        raise ImageError(str(path), msg)


def _refuse_hidden_depth(path: Path, file_format: str, spec: oiio.ImageSpec, head: bytes) -> None:
    """Refuse samples that OpenImageIO has looked up, or widened in a way we do not undo."""
    if spec.get_int_attribute(_PHOTOMETRY, -1) == _PALETTE:
        raise _palette(path)
    bits_per_pixel = spec.get_int_attribute("bmp:bitsperpixel", 24)
    if bits_per_pixel == 16:  # noqa: PLR2004
        _refuse_depth(path, 5)
    elif bits_per_pixel < 8 or (bits_per_pixel == 8 and spec.nchannels > 1):  # noqa: PLR2004
        raise _palette(path)
    container = 8 * spec.format.size()
    stored = spec.get_int_attribute("oiio:BitsPerSample", container)
    _refuse_depth(path, stored, (container, *(_WIDENED if file_format == "tiff" else ())))
    if file_format == "pnm":
        maximum = _pnm_maximum(head)
        if maximum < 255 or maximum & (maximum + 1):  # noqa: PLR2004 - 8 bits
            msg = f"counts its levels to {maximum}, not to 2^b − 1: convert it to 8 or 16 bits"
            raise ImageError(str(path), msg)


def _pnm_maximum(head: bytes) -> int:
    """Level of white by the header; 0 if that is odd."""
    found = _PNM_HEADER.match(head)
    return int(found[1]) if found else 0


def _refuse_depth(path: Path, bits: int, allowed: tuple[int, ...] = (8, 16)) -> None:
    if bits not in allowed:
        msg = f"stores {bits}-bit samples: convert it to 8 or 16 bits"
        raise ImageError(str(path), msg)


def _refuse_size(path: Path, width: int, height: int) -> None:
    if width < 1 or height < 1:
        msg = "has no pixels: copy it again from the camera or card"
        raise ImageError(str(path), msg)
    if width * height > MAX_PIXELS:
        raise _too_large(path)


def _damaged(path: Path) -> ImageError:
    return ImageError(str(path), "is damaged or cut short: copy it again from the camera or card")


def _palette(path: Path) -> ImageError:
    return ImageError(str(path), "has a palette, which hides the levels: convert it to grey or RGB")


def _too_large(path: Path) -> ImageError:
    return ImageError(str(path), "claims to be larger than any photograph: check or crop it")


def _remarks(source: oiio.ImageInput, spec: oiio.ImageSpec, png: PngHeader | None) -> list[str]:
    remarks = []
    if spec.nchannels in (2, 4):
        remarks.append(_alpha_remark(source.format_name(), spec))
    if spec.get_int_attribute(_PHOTOMETRY, 1) == _WHITE_IS_ZERO:
        remarks.append("inverted the levels: the file stores white as 0")
    if png.animated if png else source.seek_subimage(1, 0):
        remarks.append("read the first of several pages")
    source.geterror()  # "no such page"
    return remarks


def _alpha_remark(file_format: str, spec: oiio.ImageSpec) -> str:
    if spec.alpha_channel < 0:
        return f"dropped the channel {spec.channelnames[-1]}"
    if file_format == "tiff" and not spec.get_int_attribute("oiio:UnassociatedAlpha"):
        return "dropped the alpha channel, by which the file stores its colours multiplied"
    return "dropped the alpha channel"


def digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _number(spec: oiio.ImageSpec, name: str) -> float | None:
    """EXIF number, None if absent or nonsense; the first of several."""
    value = spec.getattribute(name)
    if isinstance(value, tuple) and value:
        value = value[0]
    if not isinstance(value, int | float) or not 0 < value < math.inf:
        return None
    return float(value)


def _settings(spec: oiio.ImageSpec) -> CameraSettings:
    iso = _number(spec, "Exif:PhotographicSensitivity") or _number(spec, "Exif:ISOSpeedRatings")
    return CameraSettings(
        exposure_time=_exposure_time(spec),
        f_number=_number(spec, "FNumber"),
        iso=iso,
        camera=_camera(spec),
    )


def _exposure_time(spec: oiio.ImageSpec) -> float | None:
    """Return the time by ShutterSpeedValue (APEX, exact) if it means the same as the label."""
    label = _number(spec, "ExposureTime")
    apex = spec.getattribute("Exif:ShutterSpeedValue")
    if label is None or not isinstance(apex, int | float) or not abs(apex) < _MOST_STOPS:
        return label
    exact = 2.0 ** -float(apex)
    return exact if abs(math.log2(exact / label)) < _SAME_SHUTTER else label


def _camera(spec: oiio.ImageSpec) -> str | None:
    maker, model = (_text(spec.get_string_attribute(name)) for name in ("Make", "Model"))
    repeated = model.lower().startswith(maker.lower())
    return (model if repeated else f"{maker} {model}".strip()) or None


def _text(value: str) -> str:
    """EXIF text on one line, without the bytes that are not text."""
    clean = value.encode(errors="replace").decode()
    return " ".join("".join(c if c.isprintable() else " " for c in clean).split())


def _orientation(spec: oiio.ImageSpec) -> int:
    orientation: int = spec.get_int_attribute("Orientation", 1)
    return orientation if 1 <= orientation <= 8 else 1  # noqa: PLR2004 - EXIF
