"""What the two .cube languages have in common; both are read here, whichever wrote the file."""

from chartless.calibration import Calibration
from chartless.luts._base import Source
from chartless.luts._text import (
    calibration_on,
    fields_of,
    floats,
    lines_of,
    table_of,
    without_comments,
)

N_CHANNELS = 3
_STARTS_NUMBER = "+-.0123456789"


def read_cube(source: Source, method: str) -> Calibration:
    """Calibration of a one-dimensional .cube file, Adobe's or Resolve's.

    Raises
    ------
    ValueError
        If it is damaged, or holds a table of three dimensions.
    """
    lines = without_comments(lines_of(source))
    start = next((i for i, line in enumerate(lines) if line[0] in _STARTS_NUMBER), len(lines))
    fields = fields_of(lines[:start])
    if "LUT_3D_SIZE" in fields:
        msg = "holds a table of three dimensions, which mixes the channels: no response curves"
        raise ValueError(msg)
    table = table_of(lines[start:], int(fields["LUT_1D_SIZE"]), N_CHANNELS)
    low, high = floats(fields.get("LUT_1D_INPUT_RANGE", "0 1"), 2)
    return calibration_on(
        floats(fields.get("DOMAIN_MIN", f"{low} {low} {low}"), N_CHANNELS),
        floats(fields.get("DOMAIN_MAX", f"{high} {high} {high}"), N_CHANNELS),
        table,
        source,
        method,
    )
