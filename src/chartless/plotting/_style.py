"""What all figures share: colours, and how a figure becomes a file."""

import os
from pathlib import Path

from matplotlib.figure import Figure

from chartless._files import atomic_path
from chartless.errors import ImageError

# Okabe and Ito's colours, which most colour-blind readers can tell apart.
BLUE, ORANGE, GREEN, VERMILION = "#0072b2", "#e69f00", "#009e73", "#d55e00"
SKY, PURPLE, DARK = "#56b4e9", "#cc79a7", "#333333"
CHANNEL_COLOURS = {"R": VERMILION, "G": GREEN, "B": BLUE, "Y": DARK}
SERIES_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, DARK)
_FORMATS = (".png", ".svg", ".pdf")


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as .png, .svg or .pdf; whole or not at all.

    Raises
    ------
    ImageError
        If the extension is another.
    OutputError
        If the folder is missing or not writable.
    """
    path = Path(path)
    if path.suffix.lower() not in _FORMATS:
        msg = f"figures are written as {', '.join(_FORMATS)}, not as {path.suffix!r}"
        raise ImageError(str(path), msg)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=150)
