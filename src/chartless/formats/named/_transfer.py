"""Calibrations of curves that `chartless.curves.named_curve` knows: one for all channels."""

from chartless.curves.curve import AbstractCurve, ModelCurve
from chartless.curves.named import named_curve
from chartless.curves.transfer import find_transfer_function
from chartless.formats.named._base import Request, assumed_calibration
from chartless.result.calibration import Calibration

BIT_DEPTH = 12
"""Of the tables in files; pictures of any depth are linearised by the formula itself. Straight
lines between 4096 levels of a transfer function are off by 1.3 steps of 16 bits at most."""


def transfer_calibration(request: Request) -> Calibration:
    """Calibration of one curve, assumed of all channels alike."""
    curve = named_curve(request.text)
    function = find_transfer_function(request.text.partition(":")[0])
    if function is None:
        remarks = _of_family(curve)
    else:
        limited = ", limited range" if request.argument else ""
        remarks = [f"named transfer function {function}{limited}: assumed, not measured"]
    return assumed_calibration(request, curve, remarks, bit_depth=BIT_DEPTH)


def _of_family(curve: AbstractCurve) -> list[str]:
    """Remarks on a member of a family, the second on a likely mistake."""
    remarks = ["named curve of a family: assumed, not measured"]
    if isinstance(curve, ModelCurve) and curve.model == "gamma" and curve.parameters[0] > 1:
        exponent = curve.parameters[0]
        remarks.append(
            f"it turns light into levels by the power {exponent:g}: of pictures for a display of "
            f"gamma {exponent:g} the curve is gamma:{1 / exponent:.4g}"
        )
    return remarks
