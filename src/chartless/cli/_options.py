"""Options that several commands share, and how their texts are read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._terminal import naming
from chartless.errors import ParameterError

if TYPE_CHECKING:
    from chartless.curves import AbstractCurve
    from chartless.types import Floats

CALIBRATION_HELP = (
    "File that calibrate wrote, a response of another program, or a name such as srgb, gamma:0.45, "
    "slog3 or icc; chartless models lists them."
)

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
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with status 3 if the result is doubtful.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object for machines.")]


def require_outputs(calibration: Path | None, report: Path | None) -> None:
    """Refuse places where a calibration or its report cannot be written, before the work."""
    if report is not None:
        from chartless.report import require_page

        require_page(report)
        if calibration is not None and calibration.resolve() == report.resolve():
            msg = f"{calibration} cannot be both calibration and report: choose another --report"
            raise ParameterError(msg)
    if calibration is not None:
        from chartless._files import require_writable

        require_writable(calibration)


def parse_numbers(text: str, count: int) -> tuple[float, ...]:
    """So many numbers with commas between them; raises ValueError for anything else."""
    numbers = tuple(float(part) for part in text.split(","))
    if len(numbers) != count:
        raise ValueError
    return numbers


def parse_pair(text: str) -> tuple[float, float]:
    """Noise U, V from the text ``U,V``."""
    try:
        slope, floor = parse_numbers(text, 2)
    except ValueError:
        msg = f"noise must be two numbers U,V such as 0.17,0.7, not {text!r}"
        raise ParameterError(msg) from None
    return slope, floor


def parse_times(text: str) -> list[float] | list[str] | str:
    """Exposures from ``1,2,4``, ``1/30,1/8``, a file with one line for each, or ``unknown``.

    Words are names of unknown exposures: ``a,b,b,c``.
    The time of a line is its last word, so that lists of files and times will do.
    """
    from chartless.evidence.exposures import parsed_times

    path = Path(text)
    if not path.is_file():
        return parsed_times(text.split(","))
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    kept = (line.split("#")[0].split() for line in lines)
    with naming(path):
        return parsed_times([words[-1] for words in kept if words])


def parse_curve(text: str) -> "AbstractCurve":
    """Curve from a file of samples, a truth.json of ``simulate``, or a name such as ``srgb``."""
    path = Path(text)
    if path.suffix.lower() in (".csv", ".txt", ".json") or path.is_file():
        from chartless.curves.file import read_curve

        return read_curve(path)
    from chartless.curves import named_curve

    return named_curve(text)


def parse_samples(path: Path) -> "tuple[Floats, Floats]":
    """Irradiance and brightness of a measured curve in a file, or of a named one."""
    from chartless.curves.file import read_samples
    from chartless.curves.named import is_curve_name, named_curve
    from chartless.models import UNIFORM_IRRADIANCE

    if path.is_file() or not is_curve_name(str(path)):
        return read_samples(path)
    return UNIFORM_IRRADIANCE, named_curve(str(path)).response(UNIFORM_IRRADIANCE)
