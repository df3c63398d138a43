"""Options for measured points."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chartless.evidence.options import Option, option

if TYPE_CHECKING:  # the command line avoids NumPy
    import os


@dataclass(frozen=True, slots=True)
class Options:
    """Options for measured points.

    Parameters
    ----------
    points : path, optional
        Table of points, a row each: irradiance, brightness from 0 to 1 and, if known, the standard
        deviation of the brightness and the channel. See
        `chartless.evidence.points.gather.read_points`.
    points_absolute : bool
        Whether an irradiance of 1 is that of white. If not, irradiance is known up to a
        factor, which differs between channels.
    """

    points: "str | os.PathLike[str] | None" = option(
        None,
        Option(
            "file",
            "table (CSV) of measured points with the columns irradiance and brightness (0 to 1) "
            "and, if known, std and channel: patches of a chart, a step wedge.",
        ),
    )
    points_absolute: bool = option(
        False, Option("flag", "irradiance 1 is that of white; without it, irradiance is relative.")
    )
