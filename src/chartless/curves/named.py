"""Curves that users name: published transfer functions and members of families."""

from chartless.curves.curve import AbstractCurve, ModelCurve
from chartless.curves.transfer import TRANSFER_FUNCTIONS, TransferFunction, find_transfer_function
from chartless.errors import ParameterError, UnknownNameError
from chartless.models import MODELS

LIMITED = "limited"
"""What follows the name, and a colon, for pictures from video of limited range."""


def named_curve(text: str) -> AbstractCurve:
    """Curve that a user names.

    Parameters
    ----------
    text : str
        A name in `TRANSFER_FUNCTIONS` such as ``srgb`` or ``slog3``, spelled with capitals and
        hyphens or without; with ``:limited`` for pictures from video of limited range that became
        the full range. Or ``MODEL:PARAMETER,PARAMETER,…``.

    Raises
    ------
    UnknownNameError
        If nothing has this name.
    ParameterError
        If what follows the colon has no meaning.

    Examples
    --------
    >>> named_curve("gamma:0.5").response(0.25)
    array(0.5)
    >>> named_curve("S-Log3").inverse(0) == named_curve("slog3:limited").inverse(0) == 0
    np.True_
    """
    name, colon, values = text.partition(":")
    if name in MODELS:
        try:
            parameters = tuple(float(value) for value in values.split(",") if value)
        except ValueError:
            msg = f"parameters of {name} must be numbers separated by commas, not {values!r}"
            raise ParameterError(msg) from None
        return ModelCurve(name, parameters)
    found = find_transfer_function(name)
    if found is None:
        kind = "response"
        raise UnknownNameError(kind, name, [*TRANSFER_FUNCTIONS, *MODELS])
    return _of_range(found, values) if colon else found.curve


def is_curve_name(text: str) -> bool:
    """Whether `named_curve` knows the name, whatever follows its colon."""
    name = text.partition(":")[0]
    return name in MODELS or find_transfer_function(name) is not None


def _of_range(function: TransferFunction, values: str) -> AbstractCurve:
    if function.limited is None:
        msg = f"{function.name} takes no parameters, not {values!r}"
        raise ParameterError(msg)
    if values != LIMITED:
        msg = f"{function.name} takes {LIMITED!r} alone as a parameter, not {values!r}"
        raise ParameterError(msg)
    return function.limited
