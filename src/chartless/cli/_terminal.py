"""What people see while they wait and when it is done."""

import json
import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from chartless.errors import ParameterError

if TYPE_CHECKING:  # the library takes half a second to import: --help does without
    from chartless.calibration import Calibration
    from chartless.experiments import OnCase
    from chartless.response import Response
    from chartless.types import Floats, JsonObject
    from chartless.workflow import Progress

FLAGGED = 3
"""Exit status under --strict when a result is flagged."""


@contextmanager
def progress_bar() -> Iterator["Progress | None"]:
    """Yield a progress callback that draws on standard error, or None off a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def update(stage: str, share: float) -> None:
            bar.update(task, description=stage, completed=share)

        yield update


@contextmanager
def case_bar(what: str) -> Iterator["OnCase | None"]:
    """Yield a callback that draws how many cases are done, or None off a terminal."""
    with progress_bar() as progress:
        if progress is None:
            yield None
            return

        def on_case(done: int, total: int) -> None:
            progress(f"{what} {done}/{total}", done / max(total, 1))

        yield on_case


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the name of a file before what is wrong with its contents."""
    try:
        yield
    except ParameterError as error:
        msg = f"{path}: {error}"
        raise ParameterError(msg) from error


def remark(text: str) -> None:
    """Print a remark on standard error."""
    print(f"chartless: note: {text}", file=sys.stderr)


def print_json(content: "JsonObject") -> None:
    """Print one JSON object on standard output."""
    print(json.dumps(content, allow_nan=False))


def print_table(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, left: Collection[int] = (0,)
) -> None:
    """Print aligned columns, those numbered in `left` flush left and the others right."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
    for row in (header, *rows):
        cells = (
            cell.ljust(width) if place in left else cell.rjust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        print("  ".join(cells).rstrip())


def print_summary(calibration: "Calibration", errors: Sequence[float] | None = None) -> None:
    """Print a line for each channel, and what is doubtful as remarks.

    Parameters
    ----------
    calibration : Calibration
    errors : sequence of float, optional
        RMSE of each channel against a known truth.
    """
    from chartless.flags import Flag

    header = ["channel", "U", "V", "levels seen", "error", "fit", "status"]
    rows = []
    for response in calibration.channels:
        low, high = response.observed_levels
        rows.append(
            [
                response.name,
                _with_error("slope", response, 3),
                _with_error("floor", response, 1),
                f"{low} to {high}",
                _error(response.inverse_lut_std),
                _fit(response),
                response.status.value if not response.flags else "doubtful",
            ]
        )
    if errors is not None:
        header.insert(1, "RMSE")
        for row, error in zip(rows, errors, strict=True):
            row.insert(1, f"{error:.4f}")
    print_table(header, rows)
    for flag, names in calibration.flags.items():
        remark(f"{flag.code} ({', '.join(names)}): {flag.advice}")
        if flag is Flag.DARK_LEVELS_UNSEEN:
            changes = ", ".join(_change_by_dark(calibration.channel(name)) for name in names)
            remark(f"two frames with the lens covered (--dark) would bring the error of {changes}")
        if flag is Flag.MISFIT:
            for pattern, misfits in calibration.patterns.items():
                remark(f"misfit, {pattern.code} ({', '.join(misfits)}): {pattern.advice}")


def print_exposures(calibration: "Calibration") -> None:
    """Print a line for each exposure of a bracket; nothing for other calibrations."""
    rows = [
        [
            Path(each["file"]).name,
            f"{each['relative']:.4g}",
            f"{each['black']:.1%}",
            f"{each['white']:.1%}",
            "" if each["overlap"] is None else f"{each['overlap']:.0%}",
            "" if each["displacement"] is None else f"{each['displacement']:.1f} px",
        ]
        for each in calibration.provenance["exposures"] or []
    ]
    if rows:
        header = ["exposure", "relative", "black", "white", "shared with next", "displaced"]
        print_table(header, rows)
        print()


def _change_by_dark(response: "Response") -> str:
    now, then = map(_error, (response.inverse_lut_std, response.inverse_lut_std_with_dark))
    return f"{response.name} from {now} to {then}"


def _with_error(which: str, response: "Response", digits: int) -> str:
    if response.noise is None:
        return "-"
    value = float(getattr(response.noise, f"{which}_8bit"))
    if response.noise_error is None:
        return f"{value:.{digits + 1}f}"
    error = value * float(getattr(response.noise_error, f"log_{which}"))
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def _error(std: "Floats | None") -> str:
    """Root mean square of the deviations of the inverse response."""
    return "-" if std is None else f"± {float((std**2).mean()) ** 0.5:.3f}"


def _fit(response: "Response") -> str:
    if response.deviance is not None:
        return f"deviance {response.deviance:.2f}"
    return "-" if response.similarity is None else f"similarity {response.similarity:.3f}"
