"""What a name for a whole calibration provides, and the list of all of them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chartless._registry import Registry
from chartless._version import __version__
from chartless.curves import AbstractCurve
from chartless.formats._tables import GREY
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.types import JsonObject

METHOD = "named"
"""`Response.method` of a curve that was named."""


@dataclass(frozen=True, slots=True)
class Request:
    """A name as a user gave it."""

    text: str
    """All of it."""
    argument: str = ""
    """What follows the colon; empty without one."""
    pictures: tuple[Path, ...] = ()
    """Pictures that the calibration is for, where they are known."""


@dataclass(frozen=True, slots=True)
class NamedCalibration:
    """A name, and what makes a calibration for it."""

    name: str
    title: str
    """What it is, in a few words."""
    make: Callable[[Request], Calibration]
    """Calibration for a request; raises a ChartlessError if it cannot be made."""


NAMED: Registry[NamedCalibration] = Registry("calibration")
"""Names of whole calibrations."""


def register_named(each: NamedCalibration) -> None:
    """Add a name."""
    NAMED.register(each.name, each)


def assumed_calibration(
    request: Request,
    curve: AbstractCurve,
    remarks: list[str],
    *,
    bit_depth: int,
    **errors: Any,  # noqa: ANN401 - fields of a response
) -> Calibration:
    """Calibration of one curve, assumed of all channels alike.

    Parameters
    ----------
    request : Request
    curve : AbstractCurve
    remarks : list of str
        Sentences without a full stop, for the provenance.
    bit_depth : int
        Of the table in files.
    **errors
        Deviations of the `Response`, where they are known.
    """
    n_levels = 1 << bit_depth
    response = Response(
        name=GREY[0],
        curve=curve,
        noise=None,
        n_levels=n_levels,
        observed_levels=(0, n_levels - 1),
        n_pairs=0,
        method=METHOD,
        status=Status.ASSUMED,
        **errors,
    )
    return Calibration(
        channels=(response,), bit_depth=bit_depth, provenance=provenance(request, remarks)
    )


def provenance(request: Request, remarks: list[str], **more: Any) -> JsonObject:  # noqa: ANN401
    """Where a named calibration is from, as a calibration holds it."""
    return {
        "chartless": __version__,
        "settings": {"method": METHOD, "name": request.text},
        "remarks": [f"{request.text}: {each}" for each in remarks],
        **more,
    }
