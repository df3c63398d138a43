"""The curves of the ICC profile in a picture: ``icc``, or ``icc:photo.jpg``."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from chartless.errors import ImageError, ParameterError
from chartless.formats._tables import GREY, calibration_of
from chartless.formats.named._base import (
    METHOD,
    NamedCalibration,
    Request,
    provenance,
    register_named,
)
from chartless.result.calibration import Calibration
from chartless.result.response import Status
from chartless.types import Floats

_DAMAGE = (ValueError, LookupError, ArithmeticError)


def embedded_calibration(request: Request) -> Calibration:
    """Calibration by the profile that all pictures hold, one channel if its curves are equal.

    Raises
    ------
    ParameterError
        If there is no picture, or pictures hold different curves.
    ImageError
        If a picture cannot be read, holds no profile, or one without a curve for each channel.
    """
    pictures = (Path(request.argument),) if request.argument else request.pictures
    if not pictures:
        msg = f"{request.text} is the profile in a picture: name the picture, as in icc:photo.jpg"
        raise ParameterError(msg)
    first, *others = pictures
    table, names, description = _profile_in(first)
    for other in others:
        if not np.array_equal(_profile_in(other)[0], table):
            msg = f"{first} and {other} have ICC profiles of different curves: use one at a time"
            raise ParameterError(msg)
    return _calibration(request, first, table, names, description)


register_named(NamedCalibration("icc", "the ICC profile in the picture", embedded_calibration))


def _profile_in(path: Path) -> tuple[Floats, tuple[str, ...], str]:
    """Irradiance at uniform brightness, names of its columns, and what the profile is called."""
    from chartless.formats.icc import curves_of, description_of
    from chartless.images import read_profile

    content = read_profile(path)
    if content is None:
        msg = "has no ICC profile: name its transfer function instead, such as srgb"
        raise ImageError(str(path), msg)
    try:
        table, names = curves_of(content)
        return table, names, description_of(content)
    except _DAMAGE as error:
        raise ImageError(str(path), f"ICC profile: {error}") from error


def _calibration(
    request: Request, path: Path, table: Floats, names: tuple[str, ...], description: str
) -> Calibration:
    from chartless.formats._base import Source
    from chartless.images import digest

    if np.array_equal(table, np.broadcast_to(table[:, :1], table.shape)):
        table, names = table[:, :1], GREY
    try:
        made = calibration_of(table, Source(path, b""), METHOD, names=names)
    except ValueError as error:
        raise ImageError(str(path), f"ICC profile: {error}") from error
    called = f" {description!r}" if description else ""
    said = f"the ICC profile{called} in {path}: assumed, not measured"
    known = provenance(request, [said], inputs=[{"file": str(path), "sha256": digest(path)}])
    known["remarks"] += made.provenance["remarks"]
    return replace(
        made,
        channels=tuple(replace(each, status=Status.ASSUMED) for each in made.channels),
        provenance=known,
    )
