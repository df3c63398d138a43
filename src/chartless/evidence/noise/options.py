"""Options for noise."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chartless.evidence.options import Option, option

if TYPE_CHECKING:  # the command line avoids NumPy
    import os
    from collections.abc import Sequence

    from chartless.types import Levels


@dataclass(frozen=True, slots=True, eq=False)
class Options:
    """Options for noise.

    Parameters
    ----------
    dark : sequence of paths or of ndarray
        Frames of the same camera with the same settings and the lens covered. They
        determine the noise and the curve at black, which helps where the scene has no
        dark parts.
    """

    dark: "Sequence[str | os.PathLike[str] | Levels]" = option(
        (),
        Option(
            "files",
            "frame with the lens covered and the same settings, for the noise at black; may be "
            "repeated.",
        ),
    )
