"""NumPy archive: all that a script wants of a calibration, without chartless.

=================  ========  =====================================================================
``channels``       (C,)      names: Y, or R, G and B
``brightness``     (L,)      of the levels, 0 … 1
``inverse_lut``    (L, C)    irradiance at them, 0 … 1
``inverse_lut_std``  (L, C)  its deviation, NaN where the method gave none
``observed_levels``  (C, 2)  lowest and highest level seen
``noise``          (C, 2)    u and v of the variance uI + v, NaN where the method gave none
``irradiance``     (1024,)   grid of the response, 0 … 1
``response_lut``   (1024, C)  brightness on it, 0 … 1
``verdict``        ()        how far to trust them, a text; empty if nothing is known
=================  ========  =====================================================================
"""

import io
import math
import re
import zipfile
import zlib
from dataclasses import dataclass, replace
from typing import Any, ClassVar, final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import (
    GREY,
    MOST_LEVELS,
    RGB,
    calibration_of,
    inverse_table,
    noted_verdict,
)
from chartless.models import UNIFORM_IRRADIANCE
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.response import Response

_NAMES = "channels"
_READ = (_NAMES, "inverse_lut", "inverse_lut_std", "observed_levels", "noise")
_MOST_MEMBERS = 64
_MOST_INFLATED = 1 << 22  # more than 65,536 × 3 doubles
_PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1
_HEADER = re.compile(
    rb"\x93NUMPY\x01\x00..\{'descr': '([<>|][fiuU]\d{1,2})', 'fortran_order': (?:True|False), "
    rb"'shape': \(((?:\d{1,7}, ?)*\d{0,7})\), \} *\n",
    re.DOTALL,
)


@final
@dataclass(frozen=True, slots=True)
class Npz(AbstractFormat):
    """Arrays of an archive that ``numpy.load`` reads."""

    name: ClassVar[str] = "npz"
    title: ClassVar[str] = "NumPy archive"
    suffix: ClassVar[str] = ".npz"
    programs: ClassVar[str] = "NumPy, scripts"
    tested_with: ClassVar[str] = "NumPy"
    precision: ClassVar[float] = 1e-9
    keeps: ClassVar[Keeps] = Keeps(
        channels="each", scale="1 at white", range="an array", band="an array", verdict="a text"
    )

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        shown = [_at_levels(each, len(table)) for each in calibration.channels]
        unknown = np.full(len(table), np.nan)
        deviations = [each.inverse_lut_std for each in shown]
        noises = [each.noise for each in shown]
        file = io.BytesIO()
        np.savez_compressed(
            file,
            channels=np.array([each.name for each in shown]),
            brightness=np.linspace(0.0, 1.0, len(table)),
            inverse_lut=table,
            inverse_lut_std=np.column_stack([unknown if d is None else d for d in deviations]),
            observed_levels=np.array([each.observed_levels for each in shown]),
            noise=np.array([(np.nan,) * 2 if n is None else (n.slope, n.floor) for n in noises]),
            irradiance=UNIFORM_IRRADIANCE,
            response_lut=np.column_stack([each.response_lut for each in shown]),
            verdict=np.array(noted_verdict(calibration)),
        )
        return Encoded(file.getvalue())

    @override
    def recognises(self, source: Source) -> bool:
        return source.content.startswith(b"PK\x03\x04") and b"inverse_lut.npy" in source.content

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration with what the archive says of noise, levels seen and deviation."""
        arrays = _arrays(source.content)
        table = arrays["inverse_lut"]
        names = next((each for each in (GREY, RGB) if np.array_equal(arrays[_NAMES], each)), ())
        if not names or table.shape[1:] != (len(names),):
            msg = "its inverse_lut has no column for each of Y, or of R, G and B"
            raise ValueError(msg)
        if len(table) > MOST_LEVELS:
            msg = f"its inverse_lut has {len(table)} levels, more than {MOST_LEVELS}"
            raise ValueError(msg)
        calibration = calibration_of(table, source, self.name, names=names)
        channels = tuple(
            _completed(each, place, arrays) for place, each in enumerate(calibration.channels)
        )
        return replace(calibration, channels=channels)


register_format(Npz())


def _at_levels(response: Response, n_levels: int) -> Response:
    return response if response.n_levels == n_levels else response.at_levels(n_levels)


def _completed(response: Response, place: int, arrays: dict[str, npt.NDArray[Any]]) -> Response:
    """Response with the rest of what is known of the channel at a place."""
    n_levels = len(arrays["inverse_lut"])
    if "noise" in arrays:
        slope, floor = arrays["noise"][place].tolist()
        if math.isfinite(slope) and math.isfinite(floor):
            response = replace(response, noise=_noise(slope, floor))
    if n_levels != response.n_levels:  # too few or too many to calibrate with
        return response
    if "observed_levels" in arrays:
        low, high = (int(each) for each in arrays["observed_levels"][place])
        if not 0 <= low <= high < n_levels:
            msg = f"channel {response.name} was seen at levels {low} to {high} of {n_levels}"
            raise ValueError(msg)
        response = replace(response, observed_levels=(low, high))
    if "inverse_lut_std" in arrays:
        deviation = arrays["inverse_lut_std"][:, place]
        if deviation.size == n_levels and np.all(np.isfinite(deviation) & (deviation >= 0)):
            response = replace(response, inverse_lut_std=deviation)
    return response


def _noise(slope: float, floor: float) -> AffineNoise:
    try:
        return AffineNoise(slope, floor)
    except ParameterError as error:  # which is about a request, not a file
        raise ValueError(str(error)) from error


def _arrays(content: bytes) -> dict[str, npt.NDArray[Any]]:
    """Arrays of an archive by their names; ValueError if they are damaged or too large."""
    if content.count(b"PK\x01\x02") > _MOST_MEMBERS:
        msg = f"it has more than {_MOST_MEMBERS} members"
        raise ValueError(msg)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {each.filename.removesuffix(".npy"): each for each in archive.infolist()}
            return {
                name: _array(name, _inflated(archive, members[name]))
                for name in _READ
                if name in members
            }
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError) as error:
        msg = f"it is damaged ({error})"
        raise ValueError(msg) from error


def _inflated(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    if member.flag_bits & _ENCRYPTED or member.compress_type not in _PLAIN:
        msg = f"{member.filename} is encrypted or compressed in a way that NumPy does not use"
        raise ValueError(msg)
    if member.file_size > _MOST_INFLATED:
        msg = f"{member.filename} has {member.file_size} bytes, more than any response curve"
        raise ValueError(msg)
    with archive.open(member) as file:
        return file.read(_MOST_INFLATED)


def _array(name: str, content: bytes) -> npt.NDArray[Any]:
    """Array, of float64 but for the names; its header and size must agree before NumPy reads it."""
    header = _HEADER.match(content)
    if header is None or (b"U" in header[1]) != (name == _NAMES):
        msg = f"{name} is not a plain array of numbers or names"
        raise ValueError(msg)
    shape = [int(each) for each in header[2].split(b",") if each.strip()]
    size = math.prod(shape) * np.dtype(header[1].decode()).itemsize
    if size != len(content) - header.end():
        msg = f"{name} should have {size} bytes, not {len(content) - header.end()}"
        raise ValueError(msg)
    array: npt.NDArray[Any] = np.load(io.BytesIO(content), allow_pickle=False)
    with np.errstate(invalid="ignore", over="ignore"):  # what does not fit is unknown
        return array if name == _NAMES else array.astype(np.float64)
