"""What a named transfer function is, and the list of all of them."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from chartless._registry import Registry
from chartless.curves.curve import AbstractCurve
from chartless.models import checked_brightness
from chartless.types import Floats

_CODES, _BLACK, _RANGE = 1023, 64, 876
"""Largest code value of 10 bits, and black and the distance to white in limited range, as in
ITU-R BT.709-6, item 5.5."""
_SPELLING = str.maketrans("", "", "-._ ")


@dataclass(frozen=True, slots=True)
class AbstractFormula(ABC):
    """A formula as its source publishes it, in the units of the source."""

    @abstractmethod
    def encode(self, light: Floats) -> Floats:
        """Signal of light of 0 and above; increasing."""

    @abstractmethod
    def decode(self, signal: Floats) -> Floats:
        """Light of a signal in 0 … 1, never decreasing; negative for a signal below black."""


@final
@dataclass(frozen=True, slots=True)
class PublishedCurve(AbstractCurve):
    """A published formula as a response curve.

    Irradiance is light divided by that of the signal 1, so that g(1) = 1; where the formula has
    signals below that of black, they have the irradiance 0.

    Parameters
    ----------
    formula : AbstractFormula
    limited : bool
        Whether brightness 0 … 1 stands for the code values 64 … 940 of 10 bits, as after the
        conversion of video from limited to full range, not for 0 … 1023.
    """

    formula: AbstractFormula
    limited: bool = False

    @property
    def white(self) -> float:
        """Light of brightness 1, in the units of the source."""
        return float(self.formula.decode(self._signal(np.float64(1.0))))

    @override
    def response(self, irradiance: npt.ArrayLike) -> Floats:
        x = np.clip(np.asarray(irradiance, dtype=np.float64), 0.0, 1.0)
        signal = self.formula.encode(x * self.white)
        brightness = (_CODES * signal - _BLACK) / _RANGE if self.limited else signal
        return np.where(x == 1, 1.0, np.clip(brightness, 0.0, 1.0))

    @override
    def inverse(self, brightness: npt.ArrayLike) -> Floats:
        light = self.formula.decode(self._signal(checked_brightness(brightness)))
        return np.maximum(light, 0.0) / self.white

    def _signal(self, brightness: npt.NDArray[np.float64] | np.float64) -> Floats:
        if not self.limited:
            return np.asarray(brightness)
        return np.asarray((_BLACK + _RANGE * brightness) / _CODES)


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """A transfer function that users call by name."""

    name: str
    title: str
    """What its standard or maker calls it."""
    source: str
    """Document that defines it, with the place in it."""
    curve: AbstractCurve
    limited: AbstractCurve | None = None
    """The same for pictures from video whose limited range became the full one; None where the
    source defines the signal in that range already, or does not say."""
    aliases: tuple[str, ...] = ()
    """Other names, of standards that define the same function."""

    def __str__(self) -> str:
        return f"{self.title} ({self.source})"


TRANSFER_FUNCTIONS: Registry[TransferFunction] = Registry("transfer function")
"""Transfer functions by the name that users give them."""


def register_transfer_function(each: TransferFunction) -> None:
    """Add a transfer function."""
    TRANSFER_FUNCTIONS.register(each.name, each)


def find_transfer_function(name: str) -> TransferFunction | None:
    """Transfer function that a user means, in any spelling; None if there is none.

    Examples
    --------
    >>> find_transfer_function("S-Log3").name
    'slog3'
    >>> find_transfer_function("BT.709").name
    'rec709'
    """
    plain = _plain(name)
    for each in TRANSFER_FUNCTIONS.values():
        if plain in map(_plain, (each.name, *each.aliases)):
            return each
    return None


def _plain(name: str) -> str:
    return name.lower().translate(_SPELLING)
