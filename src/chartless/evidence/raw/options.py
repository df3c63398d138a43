"""What users may choose about raw files."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from chartless.evidence.options import Option, option


@dataclass(frozen=True, slots=True)
class Options:
    """What users may choose about raw files.

    Parameters
    ----------
    raw : sequence of paths
        The raw file of each frame, of the same name but for the folder and the suffix.
    """

    raw: Sequence[str | os.PathLike[str]] = option(
        (),
        Option(
            "files",
            "raw file of a picture, of the same name but for the suffix, for the light of each "
            "pixel; may be repeated.",
        ),
    )
