"""The typical curve of digital cameras: ``typical``, with a band."""

from chartless.curves.populations import Population, population_prior
from chartless.curves.space import free_curve
from chartless.errors import ParameterError
from chartless.formats.named._base import (
    NamedCalibration,
    Request,
    assumed_calibration,
    register_named,
)
from chartless.result.calibration import Calibration

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

    estimate = typical_estimate(free_curve(population_prior(Population.DIGITAL)))
    return assumed_calibration(
        request,
        estimate.curve,
        ["the typical curve of digital cameras: assumed, not measured"],
        bit_depth=_BIT_DEPTH,
        inverse_lut_std=estimate.std,
        shape_std=estimate.shape_std,
        white_std=estimate.white_std,
    )


register_named(
    NamedCalibration("typical", "the typical curve of digital cameras", typical_calibration)
)
