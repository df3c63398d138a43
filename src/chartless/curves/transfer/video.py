"""Transfer functions of standards for displays, video and photographs."""

from dataclasses import dataclass
from typing import final

import numpy as np
from typing_extensions import override

from chartless.curves.curve import ModelCurve, SrgbCurve
from chartless.curves.transfer._base import (
    AbstractFormula,
    PublishedCurve,
    TransferFunction,
    register_transfer_function,
)
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class Rec709(AbstractFormula):
    """V = 4.5 L, from L = 0.018 on 1.099 L^0.45 − 0.099."""

    @override
    def encode(self, light: Floats) -> Floats:
        power = 1.099 * np.power(light, 0.45) - 0.099
        return np.where(light < _CUT, np.minimum(4.5 * light, 4.5 * _CUT), power)

    @override
    def decode(self, signal: Floats) -> Floats:
        power = np.power((signal + 0.099) / 1.099, 1 / 0.45)
        return np.where(signal < 4.5 * _CUT, signal / 4.5, np.maximum(power, _CUT))


@final
@dataclass(frozen=True, slots=True)
class HybridLogGamma(AbstractFormula):
    """E' = √(3 E), from E = 1/12 on a ln(12 E − b) + c."""

    @override
    def encode(self, light: Floats) -> Floats:
        logarithm = _A * np.log(np.maximum(12 * light, 1) - _B) + _C
        return np.where(light <= 1 / 12, np.sqrt(3 * light), logarithm)

    @override
    def decode(self, signal: Floats) -> Floats:
        exponential = (np.exp((signal - _C) / _A) + _B) / 12
        return np.where(signal <= 1 / 2, signal**2 / 3, exponential)


_CUT = 0.018
_A = 0.17883277
_B = 1 - 4 * _A
_C = 0.5 - _A * np.log(4 * _A)

register_transfer_function(
    TransferFunction(
        name="linear",
        title="no transfer function",
        source="levels proportional to light",
        curve=ModelCurve("gamma", (1.0,)),
    )
)
register_transfer_function(
    TransferFunction(
        name="srgb",
        title="sRGB",
        source="IEC 61966-2-1:1999, 5.2",
        curve=SrgbCurve(),
        aliases=("displayp3",),
    )
)
register_transfer_function(
    TransferFunction(
        name="adobergb",
        title="Adobe RGB (1998)",
        source="Adobe RGB (1998) Color Image Encoding, 2005-05, 4.3",
        curve=ModelCurve("gamma", (256 / 563,)),
    )
)
register_transfer_function(
    TransferFunction(
        name="rec709",
        title="Rec. 709",
        source="ITU-R BT.709-6, item 1.2",
        curve=PublishedCurve(Rec709()),
        aliases=("bt709", "rec601", "bt601", "rec2020", "bt2020"),
    )
)
register_transfer_function(
    TransferFunction(
        name="hlg",
        title="Hybrid Log-Gamma",
        source="ITU-R BT.2100-2, table 5",
        curve=PublishedCurve(HybridLogGamma()),
        aliases=("aribstdb67",),
    )
)
