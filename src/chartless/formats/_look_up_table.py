"""Look-up tables of one dimension in text, from brightness to light."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from typing_extensions import override

from chartless.formats._base import AbstractFormat, Encoded, ExportSettings, Keeps, Source
from chartless.formats._tables import calibration_of, inverse_table, noted_verdict
from chartless.result.calibration import Calibration
from chartless.types import Floats

_WIDEST = 1e6
_RESAMPLED = 4096


class Sampled(NamedTuple):
    """Irradiance at uniform steps of brightness."""

    table: Floats
    """Shape (L, 1 or 3)."""
    low: Sequence[float] = (0.0,)
    """Brightness of the first entry, one for each channel or one for all."""
    high: Sequence[float] = (1.0,)
    """Brightness of the last entry."""


@dataclass(frozen=True, slots=True)
class AbstractLookUpTable(AbstractFormat):
    """A format of look-up tables, as programs that grade or composite pictures take them."""

    precision: ClassVar[float] = 6e-8
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at white")

    @abstractmethod
    def text_of(self, table: Floats, note: str) -> str:
        """Text of a file with this table, shape (L, 1 or 3), on the domain 0 … 1.

        The note is a line for its reader, empty if there is none.
        """

    @abstractmethod
    def sampled(self, source: Source) -> Sampled:
        """Table in a file; raises as `decode` does."""

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        return Encoded(self.text_of(table, noted_verdict(calibration)).encode())

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of as many channels as the table has; R, G and B may be equal.

        A table on a domain of its own is read at 4096 levels by straight lines, its ends beyond.
        """
        table, *domain = self.sampled(source)
        n_channels = table.shape[1]
        ends = np.array([np.broadcast_to(each, n_channels) for each in domain])
        if np.array_equal(ends, [[0] * n_channels, [1] * n_channels]):
            return calibration_of(table, source, self.name)
        interval = " … ".join(" ".join(f"{each:g}" for each in end) for end in ends)
        if not (np.abs(ends).max() <= _WIDEST and np.all(ends[0] < ends[1])):
            msg = f"its domain {interval} is not a range of brightness"
            raise ValueError(msg)
        brightness = np.linspace(0, 1, max(_RESAMPLED, len(table)))
        columns = [
            np.interp(brightness, np.linspace(first, last, len(table)), column)
            for first, last, column in zip(*ends, table.T, strict=True)
        ]
        remark = f"read the part 0 … 1 of its domain {interval}, at {len(brightness)} levels"
        return calibration_of(np.column_stack(columns), source, self.name, remarks=[remark])
