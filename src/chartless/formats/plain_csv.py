"""Plain comma-separated values: a row for each level, for spreadsheets and scripts."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import GREY, RGB, calibration_of, inverse_table
from chartless.formats._text import lines_of
from chartless.result.calibration import Calibration
from chartless.types import Floats

_LEVEL, _SEEN = "level", "seen"


@final
@dataclass(frozen=True, slots=True)
class Csv(AbstractFormat):
    """Columns ``level``, irradiance of each channel, its deviation and whether it was seen."""

    name: ClassVar[str] = "csv"
    title: ClassVar[str] = "table of comma-separated values"
    suffix: ClassVar[str] = ".csv"
    programs: ClassVar[str] = "spreadsheets, pandas, R"
    tested_with: ClassVar[str] = "NumPy"
    precision: ClassVar[float] = 1e-9
    keeps: ClassVar[Keeps] = Keeps(
        channels="each", scale="1 at white", range="a column", band="a column"
    )

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        table = inverse_table(calibration, settings.n_levels)
        level = np.arange(len(table))
        header, columns = [_LEVEL], [level.astype(float)]
        for response, irradiance in zip(calibration.channels, table.T, strict=True):
            shown = response if len(table) == response.n_levels else response.at_levels(len(table))
            low, high = shown.observed_levels
            header += [response.name]
            columns += [irradiance]
            if shown.inverse_lut_std is not None:
                header += [f"{response.name} deviation"]
                columns += [shown.inverse_lut_std]
            header += [f"{response.name} {_SEEN}"]
            columns += [(low <= level) & (level <= high)]
        rows = (",".join(f"{each:.10g}" for each in row) for row in np.column_stack(columns))
        return Encoded("\n".join([",".join(header), *rows, ""]).encode())

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.partition("\n")[0].split(",")[0].strip().lower() == _LEVEL

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of a table with a column for each channel; other columns are left out."""
        lines = lines_of(source)
        header = [cell.strip() for cell in lines[0].split(",")] if lines else []
        names = next((each for each in (RGB, GREY) if set(each) <= set(header)), None)
        if names is None:
            msg = f"its first line names no columns R, G and B, or Y, but {','.join(header)[:60]}"
            raise ValueError(msg)
        places = [header.index(name) for name in names]
        table = _numbers(lines[1:], places, len(header))
        return calibration_of(table, source, self.name, names=names)


register_format(Csv())


def _numbers(lines: list[str], places: list[int], n_columns: int) -> Floats:
    values = np.empty((len(lines), len(places)))
    for number, line in enumerate(lines):
        row = line.split(",")
        if len(row) != n_columns:
            msg = f"line {number + 2} has {len(row)} columns, not {n_columns}"
            raise ValueError(msg)
        values[number] = [float(row[place]) for place in places]
    return values
