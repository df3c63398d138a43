"""Calibrations to files of other programs, and back."""

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from struct import error as StructError  # noqa: N812 - the name in the standard library
from xml.etree.ElementTree import ParseError

from chartless._files import atomic_path, require_writable
from chartless.errors import CalibrationFileError, ChartlessError, ParameterError
from chartless.formats._base import (
    FORMATS,
    HEAD,
    AbstractFormat,
    Encoded,
    ExportSettings,
    Source,
)
from chartless.formats._tables import recorded_verdict
from chartless.formats.calibration_file import FORMAT, load
from chartless.formats.named import named_calibration, require_name
from chartless.result.calibration import Calibration
from chartless.result.verdict import Grade
from chartless.types import Floats32

_DAMAGE = (
    ValueError, TypeError, LookupError, ArithmeticError, RecursionError, StructError, ParseError,
)  # fmt: skip


def encode_response(
    calibration: Calibration, name: str, settings: ExportSettings | None = None
) -> Encoded:
    """Content of a file of another program.

    Parameters
    ----------
    calibration : Calibration
    name : str
        A name in `FORMATS`.
    settings : ExportSettings, optional

    Raises
    ------
    UnknownNameError
        If there is no such format.
    ParameterError
        If the format is only read, or cannot hold this calibration.
    """
    return FORMATS[name].encode(calibration, settings or ExportSettings())


def export_response(
    calibration: Calibration,
    path: str | os.PathLike[str],
    name: str,
    settings: ExportSettings | None = None,
) -> tuple[str, tuple[Path, ...]]:
    """Write a calibration for another program.

    Parameters
    ----------
    calibration : Calibration
    path : path-like
        File to write; it appears whole or not at all.
    name : str
        A name in `FORMATS`.
    settings : ExportSettings, optional

    Returns
    -------
    (str, tuple of Path)
        What was lost, in one line, empty if nothing; and the files written, `path` first and then
        those that the other program wants in the same folder.

    Raises
    ------
    UnknownNameError, ParameterError
        As `encode_response` does.
    OutputError
        If nothing can be written there.
    """
    path = Path(path)
    require_writable(path)
    settings = replace(settings or ExportSettings(), suffix=path.suffix.lower())
    encoded = encode_response(calibration, name, settings)
    for picture, values in encoded.pictures.items():
        _require_same_size(path.parent / picture, values)
    with atomic_path(path) as temporary:
        temporary.write_bytes(encoded.content)
    beside, kept = [], []
    for picture, values in encoded.pictures.items():
        from chartless.images import write_image

        target = path.parent / picture
        if target.exists():  # it may have been measured
            kept.append(f"a new {picture}, as there is one already")
            continue
        write_image(target, values, data_type="uint16", linear=False)
        beside.append(target)
    encoded = replace(encoded, lost=(*encoded.lost, *kept))
    return _lost(FORMATS[name], calibration, encoded), (path, *beside)


def import_response(path: str | os.PathLike[str], name: str | None = None) -> Calibration:
    """Read a response curve of another program.

    Parameters
    ----------
    path : path-like
    name : str, optional
        A name in `FORMATS`; without, the first format that recognises the file.

    Returns
    -------
    Calibration
        As a rule without noise; what was filled or scaled is in ``provenance["remarks"]``.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    CalibrationFileError
        If the file cannot be read, is damaged or of no known format.
    """
    source = Source.read(Path(path))
    found = recognised(source) if name is None else FORMATS[name]
    if found is None:
        known = ", ".join(each.name for each in FORMATS.values() if each.is_read)
        msg = f"{path}: is not in a known format ({known}): give its `name` if you know it"
        if _is_own(source):
            msg = f"{path}: is already a calibration of chartless: use it as it is"
        raise CalibrationFileError(msg)
    return _decoded(found, source)


def load_calibration(path: str | os.PathLike[str], *, pictures: Iterable[Path] = ()) -> Calibration:
    """Read a calibration from a file, or make that of a named transfer function.

    Parameters
    ----------
    path : path-like
        A file of ours or of another program, recognised by content. Or, where there is no such
        file, a name: of `known_names`, such as ``srgb``, ``slog3`` or ``icc``, or
        ``MODEL:PARAMETER,…`` such as ``gamma:0.45``.
    pictures : iterable of Path
        Pictures that it is for: ``icc`` is the profile in them.

    Raises
    ------
    CalibrationFileError
        As `import_response` and `chartless.formats.calibration_file.load` do.
    UnknownNameError
        If there is neither such a file nor such a name.
    ParameterError, ImageError
        If what follows the colon of a name has no meaning, or ``icc`` finds no curves.

    Examples
    --------
    >>> load_calibration("srgb").channel("Y").curve.inverse(0.5).round(4)
    np.float64(0.214)
    """
    text = os.fspath(path)
    if not Path(text).is_file():
        named = named_calibration(text, pictures)
        if named is not None:
            return named
        if not Path(text).exists():
            require_name(text)
    try:
        source = Source.read(Path(path))
    except CalibrationFileError:  # our own may be larger, and say more clearly what is wrong
        return load(path)
    found = recognised(source)
    return load(path) if found is None else _decoded(found, source)


def is_calibration(path: str | os.PathLike[str]) -> bool:
    """Whether `load_calibration` takes the file for one; False if it cannot be read."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            head = Source(path, file.read(HEAD))
        return _is_own(head) or recognised(Source.read(path)) is not None
    except (OSError, CalibrationFileError):
        return False


def recognised(source: Source) -> AbstractFormat | None:
    """First format that takes the file for its own; None if none does."""
    if _is_own(source):
        return None
    for each in FORMATS.values():
        if each.is_read and each.recognises(source):
            return each
    return None


def _decoded(found: AbstractFormat, source: Source) -> Calibration:
    try:
        calibration = found.decode(source)
    except ChartlessError:
        raise
    except _DAMAGE as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        what = " ".join(what.split())[:160]
        msg = f"{source.path}: not a sound {found.title} file: {what}"
        raise CalibrationFileError(msg) from error
    recorded = recorded_verdict(source)
    if not recorded or recorded.startswith(f"{Grade.GOOD.value}:"):
        return calibration
    known = calibration.provenance
    remark = f"{source.path}: chartless wrote it with the verdict {recorded}"
    return replace(calibration, provenance={**known, "remarks": [*known["remarks"], remark]})


def _is_own(source: Source) -> bool:
    """Whether it is a calibration file, which is no format of another program."""
    return f'"{FORMAT}"' in source.head


def _require_same_size(path: Path, values: Floats32) -> None:
    """Refuse to keep a picture of another camera beside the file."""
    from chartless.images import read_frame

    if path.exists() and read_frame(path).levels.shape[:2] != values.shape[:2]:
        height, width = values.shape[:2]
        msg = (
            f"{path} exists already and is not of {width} × {height} pixels: move it away or "
            "export to another folder"
        )
        raise ParameterError(msg)


def _lost(each: AbstractFormat, calibration: Calibration, encoded: Encoded) -> str:
    """What the file does not say of this calibration."""
    keeps = each.keeps
    first = calibration.channels[0]
    full = (0, first.n_levels - 1)
    lost = []
    if len(calibration.channels) > 1 and keeps.channels != "each":
        lost.append(f"the channels became {keeps.channels}")
    if not keeps.band and any(r.inverse_lut_std is not None for r in calibration.channels):
        lost.append("the error band")
    if not keeps.range and any(r.observed_levels != full for r in calibration.channels):
        lost.append("which levels were observed")
    return "; ".join([*lost, *encoded.lost])
