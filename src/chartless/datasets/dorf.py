"""The Database of Response Functions (DoRF): 201 measured curves of films and cameras.

M. D. Grossberg and S. K. Nayar, "What is the Space of Camera Response Functions?", CVPR 2003.
No licence is stated, so the curves are no part of this package: each user fetches them.
"""

import os
import re
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
import numpy.typing as npt

from chartless.datasets._base import DATASETS, Archive, DatasetError, fetch
from chartless.types import Floats, Floats32

N_CURVES, N_SAMPLES = 201, 1024
KINDS = ("film", "digital", "gamma", "unknown")

_MEMBER = "dorfCurves.txt"
_SAME_IRRADIANCE = 1e-6

ARCHIVE = Archive(
    name="dorf",
    what="201 measured response curves of films and cameras",
    licence="none stated: each user downloads it; not to be redistributed",
    url="https://www.cs.columbia.edu/CAVE/software/dorf/response/dorfCurves.zip",
    file_name="dorfCurves.zip",
    sha256="d030d1ee3cd3243b412dd817b7479873f3680aaea33baaa9c127752880eacd63",
    other_forms=(_MEMBER, "dorf*.npz"),
)
DATASETS.register(ARCHIVE.name, ARCHIVE)


@dataclass(frozen=True, slots=True, eq=False)
class Dorf:
    """Measured curves, one in each row.

    Attributes
    ----------
    irradiance : ndarray of float64, shape (1024,)
        Increasing from 0 to 1; read-only.
    curves : ndarray of float64, shape (201, 1024)
        Brightness at these irradiances, from 0 to 1 and never decreasing; read-only. The
        values are rounded to single precision, so that every form of the file gives the same.
    names : tuple of str
        Name of each curve as the file spells it, with the colour of its channel.
    scales : tuple of str
        Label of each curve that says how it was published, such as ``graph-log-log-neg``.
    """

    irradiance: Floats
    curves: Floats
    names: tuple[str, ...]
    scales: tuple[str, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each curve is of, one of `KINDS`; see `kind_of`."""
        return tuple(map(kind_of, self.names, self.scales))

    @property
    def cameras(self) -> tuple[str, ...]:
        """Camera or film stock of each curve; curves with the same key belong together.

        The key is the name without channel, exposure and development time (`camera_of`).
        Curves without a name belong to those they equal, or else to their neighbours without
        a name. Equal curves always share a key, and so do their cameras.
        """
        keys: list[str] = []
        for row, (name, kind) in enumerate(zip(self.names, self.kinds, strict=True)):
            if not _is_unnamed(name):
                keys.append(camera_of(name, kind))
            elif keys and _is_unnamed(keys[-1]):
                keys.append(keys[-1])
            else:
                keys.append(f"unnamed_{row:03d}")
        for rows in self.duplicates:
            known = [keys[row] for row in rows if not _is_unnamed(keys[row])]
            first, equal = (known or [keys[rows[0]]])[0], {keys[row] for row in rows}
            keys = [first if key in equal else key for key in keys]
        return tuple(keys)

    @property
    def distinct(self) -> tuple[int, ...]:
        """Rows that equal no row before them, increasing: 190 of the 201."""
        return tuple(rows[0] for rows in self._equal_rows())

    @property
    def duplicates(self) -> tuple[tuple[int, ...], ...]:
        """Sets of two rows or more that are equal bit for bit, increasing."""
        return tuple(rows for rows in self._equal_rows() if len(rows) > 1)

    def left_out(self, row: int) -> npt.NDArray[np.bool_]:
        """Mask of the rows that remain when the camera of `row` is left out.

        Parameters
        ----------
        row : int
            From 0 to 200.

        Returns
        -------
        ndarray of bool, shape (201,)
            False for every curve of that camera or film stock.
        """
        cameras = self.cameras
        return np.array([camera != cameras[row] for camera in cameras])

    def _equal_rows(self) -> list[tuple[int, ...]]:
        rows: dict[bytes, tuple[int, ...]] = {}
        for row, curve in enumerate(self.curves):
            content = curve.tobytes()
            rows[content] = (*rows.get(content, ()), row)
        return list(rows.values())


def kind_of(name: str, scale: str) -> str:
    """Kind of a curve, as far as its labels show it.

    Film is published on logarithmic axes. Curves on linear axes are of image sensors,
    digital cameras and video cameras, together called digital, or powers of the irradiance.

    Parameters
    ----------
    name, scale : str
        Name and scale label of the curve.

    Returns
    -------
    str
        One of `KINDS`.

    Examples
    --------
    >>> kind_of("Kodachrome-25Red", "graph-log-log-pos")
    'film'
    >>> kind_of("KAI-0372", "graph-lin-lin")
    'digital'
    """
    if scale.startswith("gamma") or name.lower().startswith("gamma"):
        return "gamma"
    if "log-log" in scale:
        return "film"
    return "digital" if "lin-lin" in scale else "unknown"


_REMARK = re.compile(r" *\(.*\)$|_dup$")
_FILM_CHANNEL = re.compile(r"[-_ ]?(CD)?[-_ ]?(Red|Green|Blue)?$")
_DEVELOPMENT = re.compile(r"[-_ ]?\d+ ?min$")
_DIGITAL_CHANNEL = re.compile(r"[-_ ]?(Red|Green|Blue|R|G|B)$")
_NUMBER = re.compile(r"[-_ ]\d+_of_\d+$")
_SERIES = {  # cameras measured several times: their names differ by exposure or by day
    "Kodak_dscs315": re.compile("dscs?315", re.IGNORECASE),
    "Canon_Optura": re.compile("optura|98111[134]", re.IGNORECASE),
}


def camera_of(name: str, kind: str) -> str:
    """Camera or film stock of a curve, which its channels and exposures share.

    Film of another speed is another stock, while development times of one stock belong
    together. Each power of the irradiance stands alone.

    Parameters
    ----------
    name : str
        Name of the curve.
    kind : str
        One of `KINDS`.

    Returns
    -------
    str

    Examples
    --------
    >>> camera_of("Portra_400VCCDRed", "film")
    'Portra_400VC'
    >>> camera_of("FP2900ZR_dup", "digital")
    'FP2900Z'
    """
    if kind == "gamma":
        return name
    name = _REMARK.sub("", name)
    if kind == "film":
        return _DEVELOPMENT.sub("", _FILM_CHANNEL.sub("", name)) or name
    for camera, pattern in _SERIES.items():
        if pattern.search(name):
            return camera
    return _NUMBER.sub("", _DIGITAL_CHANNEL.sub("", name)) or name


def load_dorf(path: str | os.PathLike[str] | None = None) -> Dorf:
    """Read the curves; fetch them first if they are nowhere on this computer.

    Parameters
    ----------
    path : path-like, optional
        The published ``.zip``, the ``.txt`` in it, an ``.npz`` with the arrays ``I`` (1024,),
        ``B`` (201, 1024), ``name`` and ``scale_class`` (201,), or a folder that holds one of
        them. By default what `chartless.datasets.fetch` finds: in the folder ``dorf`` of
        CHARTLESS_DATA, in the cache of this user, or by downloading it.

    Returns
    -------
    Dorf

    Raises
    ------
    DatasetError
        If a file is missing, damaged or not DoRF, or cannot be downloaded.

    Examples
    --------
    >>> dorf = load_dorf()  # doctest: +SKIP
    >>> dorf.curves.shape, len(dorf.distinct)  # doctest: +SKIP
    ((201, 1024), 190)
    """
    path = fetch(ARCHIVE.name) if path is None else Path(path)
    if path.is_dir():
        folder, found = path, ARCHIVE.find_in(path)
        if found is None:
            forms = ", ".join((ARCHIVE.file_name, *ARCHIVE.other_forms))
            msg = f"{folder}: holds no DoRF data: it should contain one of {forms}"
            raise DatasetError(msg)
        path = found
    read = _READERS.get(path.suffix.lower())
    if read is None:
        msg = f"{path}: is not a known form of the DoRF data: give a file in {', '.join(_READERS)}"
        raise DatasetError(msg)
    try:
        with path.open("rb") as stream:
            return read(stream)
    except (ValueError, OSError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        msg = f"{path}: cannot be read as DoRF: {reason}; download it from {ARCHIVE.url}"
        raise DatasetError(msg) from error


def _read_zip(stream: IO[bytes]) -> Dorf:
    with zipfile.ZipFile(stream) as archive:
        members = [name for name in archive.namelist() if Path(name).name == _MEMBER]
        if not members:
            msg = f"it holds no {_MEMBER}"
            raise ValueError(msg)
        with archive.open(members[0]) as member:
            return _read_text(member)


def _read_text(stream: IO[bytes]) -> Dorf:
    """Records of six lines: name, scale label, ``I =``, numbers, ``B =``, numbers."""
    lines = stream.read().decode("utf-8", errors="replace").rstrip().split("\n")
    if len(lines) != 6 * N_CURVES:
        msg = f"it has {len(lines)} lines, not {6 * N_CURVES}: six for each of {N_CURVES} curves"
        raise ValueError(msg)
    for number, line in enumerate(lines):
        label = {2: "I=", 4: "B="}.get(number % 6)
        if label and "".join(line.split()) != label:
            msg = f"line {number + 1} should be {label[0]!r} and an equals sign: {line[:20]!r}"
            raise ValueError(msg)
    irradiance = np.stack([_numbers(lines[row], row + 1) for row in range(3, len(lines), 6)])
    curves = np.stack([_numbers(lines[row], row + 1) for row in range(5, len(lines), 6)])
    differs = ~np.isclose(irradiance, irradiance[0], rtol=0.0, atol=_SAME_IRRADIANCE).all(axis=1)
    if differs.any():
        line_number = 6 * int(differs.argmax()) + 4
        msg = f"line {line_number} holds a different irradiance from line 4"
        raise ValueError(msg)
    names, scales = ([line.strip() for line in lines[place::6]] for place in (0, 1))
    return _checked(irradiance[0], curves, names, scales)


def _numbers(line: str, line_number: int) -> Floats32:
    try:
        values = np.array(line.split(), dtype=np.float64)
    except ValueError:
        msg = f"line {line_number} has something that is not a number"
        raise ValueError(msg) from None
    if values.size != N_SAMPLES:
        msg = f"line {line_number} has {values.size} numbers, not {N_SAMPLES}"
        raise ValueError(msg)
    with np.errstate(over="ignore"):  # infinity is refused with the name of its curve
        return values.astype(np.float32)


def _read_npz(stream: IO[bytes]) -> Dorf:
    if not zipfile.is_zipfile(stream):  # numpy would take it for a pickle
        msg = "it is not an .npz archive"
        raise ValueError(msg)
    stream.seek(0)
    expected = {
        "I": ((N_SAMPLES,), "f"),
        "B": ((N_CURVES, N_SAMPLES), "f"),
        "name": ((N_CURVES,), "U"),
        "scale_class": ((N_CURVES,), "U"),
    }
    arrays = {}
    with np.load(stream, allow_pickle=False) as content:
        for key, (shape, letter) in expected.items():
            if key not in content.files:
                msg = f"it holds no array {key}"
                raise ValueError(msg)
            array = np.asarray(content[key])
            if array.shape != shape or array.dtype.kind != letter:
                what = "numbers" if letter == "f" else "texts"
                msg = f"{key} should be {what} of shape {shape}: {array.dtype} {array.shape}"
                raise ValueError(msg)
            arrays[key] = array
    with np.errstate(over="ignore"):
        irradiance, curves = (arrays[key].astype(np.float32) for key in ("I", "B"))
    return _checked(irradiance, curves, arrays["name"].tolist(), arrays["scale_class"].tolist())


_READERS: dict[str, Callable[[IO[bytes]], Dorf]] = {
    ".zip": _read_zip,
    ".txt": _read_text,
    ".npz": _read_npz,
}


def _checked(
    irradiance: Floats32, curves: Floats32, names: Sequence[str], scales: Sequence[str]
) -> Dorf:
    """Curves of float64 after a look at each; single precision makes 0 and 1 exact."""
    # Compared, not subtracted: NaN fails every comparison, and infinities stay silent.
    increases = (irradiance[1:] > irradiance[:-1]).all()
    if not (increases and irradiance[0] == 0 and irradiance[-1] == 1):
        msg = "the irradiance should increase from 0 to 1"
        raise ValueError(msg)
    rises = (curves[:, 1:] >= curves[:, :-1]).all(axis=1)
    good = rises & (curves[:, 0] == 0) & (curves[:, -1] == 1)
    if not good.all():
        row = int(good.argmin())
        msg = f"curve {row} ({names[row]}) should go from 0 to 1 and never decrease"
        raise ValueError(msg)
    wide = irradiance.astype(np.float64), curves.astype(np.float64)
    for array in wide:
        array.setflags(write=False)
    return Dorf(*wide, names=tuple(names), scales=tuple(scales))


def _is_unnamed(name: str) -> bool:
    return not name or name.startswith("unnamed")
