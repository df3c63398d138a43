"""The calibration that a name means."""

from collections.abc import Iterable
from pathlib import Path

from chartless.curves.named import is_curve_name
from chartless.curves.transfer import TRANSFER_FUNCTIONS
from chartless.errors import UnknownNameError
from chartless.formats.named._base import NAMED, Request
from chartless.formats.named._transfer import transfer_calibration
from chartless.result.calibration import Calibration


def known_names() -> dict[str, str]:
    """Names of calibrations, each with what it is; families of curves are not among them."""
    return {
        **{name: str(each) for name, each in TRANSFER_FUNCTIONS.items()},
        **{name: each.title for name, each in NAMED.items()},
    }


def named_calibration(text: str, pictures: Iterable[Path] = ()) -> Calibration | None:
    """Calibration of a name; None if nothing has this name.

    Parameters
    ----------
    text : str
        A name in `known_names` or ``MODEL:PARAMETER,…``, as for `chartless.curves.named_curve`.
    pictures : iterable of Path
        Pictures that it is for.

    Raises
    ------
    ChartlessError
        If what follows the colon of the name has no meaning, or there is no such calibration for
        the pictures.
    """
    name, _, argument = text.partition(":")
    if name.lower() in NAMED:
        return NAMED[name.lower()].make(Request(text, argument, tuple(pictures)))
    return transfer_calibration(Request(text, argument)) if is_curve_name(text) else None


def require_name(text: str) -> None:
    """Raise UnknownNameError for a text that can only be a name: without folder and extension."""
    name, colon, _ = text.partition(":")
    if Path(text).name == text and (colon or not Path(text).suffix):
        kind = "file or transfer function"
        raise UnknownNameError(kind, name, [*known_names(), "gamma"])
