"""PPISP: the camera responses of a radiance field, four numbers for each channel.

A JSON object whose ``crf_params`` are those of the program's state, of the shape cameras × 3
channels × 4: toe, shoulder, gamma and center as they are trained, before softplus and sigmoid; see
`chartless.models.Ppisp`. What else is in the object is for people.
"""

import json
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless._version import __version__
from chartless.curves import AbstractCurve, ModelCurve
from chartless.curves.fitting import fit
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._nearest import residual, rms
from chartless.formats._tables import RGB, calibration_of_curves, noted_verdict
from chartless.models import Ppisp as Family
from chartless.result.calibration import Calibration

_FAMILY = Family()
_KEY = "crf_params"
_LEVELS = np.linspace(0.0, 1.0, 256)
_LARGEST = 1e3  # of a number that was trained; softplus of its negative is 0


@final
@dataclass(frozen=True, slots=True)
class Ppisp(AbstractFormat):
    """The camera response of PPISP, by the numbers that it trains.

    ``torch.tensor(json.load(file)["crf_params"])`` is ``crf_params`` of a ``PPISP`` with one
    camera, shape (1, 3, 4): to start training from, or to keep fixed. Exposure, vignetting and
    colour correction come before it and are not in the file. The numbers are those of the nearest
    curve; its error is in the file, and said. A file of one camera is read as well: what a radiance
    field was trained with can be compared with a calibration.
    """

    name: ClassVar[str] = "ppisp"
    title: ClassVar[str] = "PPISP response"
    suffix: ClassVar[str] = ".ppisp.json"
    programs: ClassVar[str] = "PPISP, which trains radiance fields (crf_params)"
    tested_with: ClassVar[str] = "reference formula"
    precision: ClassVar[float] = 1e-6
    keeps: ClassVar[Keeps] = Keeps(
        channels="each",
        scale="1 at white",
        verdict="an entry",
        curves="nearest of four parameters",
    )
    takes: ClassVar[frozenset[str]] = frozenset()

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Numbers of three channels, equal ones for a single channel."""
        curves = [each.curve for each in calibration.channels]
        nearest = [_nearest(each) for each in curves]
        errors = [rms(*pair) for pair in zip(curves, nearest, strict=True)]
        repeats = len(RGB) // len(nearest)
        content = {
            _KEY: [[list(each.parameters) for each in nearest] * repeats],
            "channels": RGB,
            "parameters": _FAMILY.parameter_names,
            "rmse": errors * repeats,
            "chartless": __version__,
            "verdict": noted_verdict(calibration),
        }
        lost = residual("four parameters", calibration, nearest)
        return Encoded((json.dumps(content, indent=1) + "\n").encode(), (lost,))

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.lstrip().startswith("{") and f'"{_KEY}"' in source.head

    @override
    def decode(self, source: Source) -> Calibration:
        numbers = np.array(json.loads(source.text)[_KEY], dtype=np.float64)
        if numbers.shape != (1, len(RGB), _FAMILY.n_parameters):
            shape = " × ".join(map(str, numbers.shape))
            msg = f"{_KEY} are 1 × 3 × 4 numbers, toe, shoulder, gamma and center, not {shape}"
            raise ValueError(msg)
        if not np.all(np.abs(numbers) <= _LARGEST):
            msg = f"{_KEY} must be numbers up to {_LARGEST:g}"
            raise ValueError(msg)
        curves = [ModelCurve(_FAMILY.name, tuple(each)) for each in numbers[0].tolist()]
        return calibration_of_curves(curves, source, self.name)


register_format(Ppisp())


def _nearest(curve: AbstractCurve) -> ModelCurve:
    """Nearest member, by brightness at uniform irradiance; the curve itself if it is one."""
    if isinstance(curve, ModelCurve) and curve.model == _FAMILY.name:
        parameters = np.array(curve.parameters)
    else:
        # At the levels all curves through them are the same, whatever they are between.
        irradiance, first = np.unique(curve.inverse(_LEVELS), return_index=True)
        found = fit(_FAMILY, irradiance, _LEVELS[first], weights=np.gradient(irradiance))
        parameters = found.parameters
    return ModelCurve(_FAMILY.name, tuple(parameters.clip(-_LARGEST, _LARGEST).tolist()))
