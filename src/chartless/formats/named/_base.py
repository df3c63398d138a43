"""What a name for a whole calibration provides, and the list of all of them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chartless._registry import Registry
from chartless._version import __version__
from chartless.result.calibration import Calibration
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


def provenance(request: Request, remarks: list[str], **more: Any) -> JsonObject:  # noqa: ANN401
    """Where a named calibration is from, as a calibration holds it."""
    return {
        "chartless": __version__,
        "settings": {"method": METHOD, "name": request.text},
        "remarks": [f"{request.text}: {each}" for each in remarks],
        **more,
    }
