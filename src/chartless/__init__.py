"""Find a camera's response function from the pictures it already takes, with no colour chart.

    >>> import chartless
    >>> calibration = chartless.calibrate(["a.jpg", "b.jpg"])  # doctest: +SKIP
    >>> linear = calibration.linearize(levels)  # doctest: +SKIP

Names are loaded on first use, so importing this package costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from chartless._version import __version__

if TYPE_CHECKING:
    from chartless.curves import ModelCurve as ModelCurve
    from chartless.curves import SampledCurve as SampledCurve
    from chartless.curves import named_curve as named_curve
    from chartless.curves.comparison import compare as compare
    from chartless.curves.fitting import fit as fit
    from chartless.curves.fitting import fit_many as fit_many
    from chartless.errors import ChartlessError as ChartlessError
    from chartless.evidence.noise.cooccurrence import Cooccurrence as Cooccurrence
    from chartless.flags import Flag as Flag
    from chartless.formats import load_calibration as load_calibration
    from chartless.formats.calibration_file import load as load
    from chartless.formats.calibration_file import save as save
    from chartless.methods import CALIBRATORS as CALIBRATORS
    from chartless.models import MODELS as MODELS
    from chartless.noise import AffineNoise as AffineNoise
    from chartless.noise import NoisePrior as NoisePrior
    from chartless.result.calibration import Calibration as Calibration
    from chartless.result.response import Response as Response
    from chartless.result.response import rmse as rmse
    from chartless.simulate import simulate_frames as simulate_frames
    from chartless.workflow import calibrate as calibrate
    from chartless.workflow import plan as plan

_HOME = {
    "Calibration": "result.calibration",
    "load": "formats.calibration_file",
    "load_calibration": "formats",
    "save": "formats.calibration_file",
    "CALIBRATORS": "methods",
    "Cooccurrence": "evidence.noise.cooccurrence",
    "ModelCurve": "curves",
    "SampledCurve": "curves",
    "named_curve": "curves",
    "ChartlessError": "errors",
    "compare": "curves.comparison",
    "fit": "curves.fitting",
    "fit_many": "curves.fitting",
    "Flag": "flags",
    "MODELS": "models",
    "AffineNoise": "noise",
    "NoisePrior": "noise",
    "Response": "result.response",
    "rmse": "result.response",
    "simulate_frames": "simulate",
    "calibrate": "workflow",
    "plan": "workflow",
}

__all__ = ["__version__", *_HOME]  # noqa: PLE0604 - all strings


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"chartless.{_HOME[name]}"), name)
    msg = f"module 'chartless' has no attribute {name!r}"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    return sorted(__all__)
