"""The typical curve of digital cameras: ``typical``, with a band."""

from chartless.curves.prior import Population
from chartless.curves.space import free_curve
from chartless.errors import ParameterError
from chartless.formats._tables import GREY
from chartless.formats.named._base import (
    METHOD,
    NamedCalibration,
    Request,
    provenance,
    register_named,
)
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status

_BIT_DEPTH = 8


def typical_calibration(request: Request) -> Calibration:
    """Calibration of the typical curve, assumed of all channels alike.

    Raises
    ------
    ParameterError
        If something follows the name.
    """
    if request.argument:
        msg = f"{request.text}: typical takes nothing after its name"
        raise ParameterError(msg)
    from chartless.inference.constant import typical_estimate

    n_levels = 1 << _BIT_DEPTH
    estimate = typical_estimate(free_curve(n_levels, Population.DIGITAL))
    response = Response(
        name=GREY[0],
        curve=estimate.curve,
        noise=None,
        n_levels=n_levels,
        observed_levels=(0, n_levels - 1),
        n_pairs=0,
        method=METHOD,
        status=Status.ASSUMED,
        inverse_lut_std=estimate.std,
        shape_std=estimate.shape_std,
        white_std=estimate.white_std,
    )
    remark = "the typical curve of digital cameras: assumed, not measured"
    return Calibration(
        channels=(response,), bit_depth=_BIT_DEPTH, provenance=provenance(request, [remark])
    )


register_named(
    NamedCalibration("typical", "the typical curve of digital cameras", typical_calibration)
)
