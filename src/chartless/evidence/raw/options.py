"""Options for raw files."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from chartless.evidence.options import Option, option


@dataclass(frozen=True, slots=True)
class Options:
    """Options for raw files.

    Parameters
    ----------
    raw : sequence of paths
        Raw file of each frame, with the same name except for folder and suffix.
    """

    raw: Sequence[str | os.PathLike[str]] = option(
        (),
        Option(
            "files",
            "raw file of a picture, of the same name but for the suffix, for the light of each "
            "pixel; may be repeated.",
        ),
    )
