"""Options that several commands share, and how their texts are read."""

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.errors import ParameterError

if TYPE_CHECKING:
    from chartless.calibration import Calibration
    from chartless.curves import AbstractCurve

Jobs = Annotated[int, typer.Option(min=1, help="Processes; results do not depend on it.")]
Scheduler = Annotated[
    str | None,
    typer.Option(
        help="Address of a Dask scheduler to run on, tcp://host:port.", show_default=False
    ),
]
Report = Annotated[
    Path | None,
    typer.Option(
        "--report", help="Report to write: one .html page, for people.", show_default=False
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object for machines.")]


def parse_pair(text: str) -> tuple[float, float]:
    """Noise U, V from the text ``U,V``."""
    try:
        slope, floor = (float(part) for part in text.split(","))
    except ValueError:
        msg = f"noise must be two numbers U,V such as 0.03,16, not {text!r}"
        raise ParameterError(msg) from None
    return slope, floor


def parse_times(text: str) -> list[float] | list[str] | str:
    """Exposures from ``1,2,4``, ``1/30,1/8``, a file with one line for each, or ``unknown``.

    Words are names of unknown exposures: ``a,b,b,c``.
    The time of a line is its last word, so that lists of files and times will do.
    """
    if text == "unknown":
        return text
    path = Path(text)
    parts = text.split(",")
    if path.is_file():
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        kept = (line.split("#")[0].split() for line in lines)
        parts = [words[-1] for words in kept if words]
    if len(parts) > 1 and all(part.strip().isalpha() for part in parts):
        return [part.strip() for part in parts]
    try:
        return [float(Fraction(part.strip())) for part in parts]
    except (ValueError, ArithmeticError):
        where = f"{path}: " if path.is_file() else ""
        given = ",".join(parts)[:60]
        msg = f"{where}--times must be numbers or fractions such as 1/30,1/8,1/2, not {given!r}"
        raise ParameterError(msg) from None


def parse_curve(text: str) -> "AbstractCurve":
    """Curve from a file of samples, a truth.json of ``simulate``, or a name such as ``srgb``."""
    path = Path(text)
    if path.suffix.lower() in (".csv", ".txt", ".json") or path.is_file():
        from chartless.curve_file import read_curve

        return read_curve(path)
    from chartless.curves import named_curve

    return named_curve(text)


def load_calibration(path: Path) -> "Calibration":
    """Calibration from a file of ours or of another program, told apart by content."""
    from chartless.calibration_file import load
    from chartless.luts import import_response, is_foreign

    return import_response(path) if is_foreign(path) else load(path)
