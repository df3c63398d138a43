"""What people see while they wait and when it is done."""

import json
import shutil
import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, TextIO

from chartless.errors import ParameterError, with_options

if TYPE_CHECKING:  # the library takes half a second to import: --help does without
    from chartless.evidence.reader import Progress
    from chartless.experiments import OnCase
    from chartless.result.calibration import Calibration
    from chartless.types import JsonObject

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
    print_line(f"chartless: note: {text}", sys.stderr)


def remark_verdict(path: Path, calibration: "Calibration") -> None:
    """Print in one line how far to trust a calibration that is not good."""
    from chartless.result.verdict import Grade, known_verdict

    judged = known_verdict(calibration.channels)
    if judged is not None and judged.grade is not Grade.GOOD:
        remark(f"{path}: {judged.brief}")


def remark_foreign(calibration: "Calibration") -> None:
    """Print what was remarked on reading the curve of another program."""
    from chartless.result.verdict import is_foreign

    if is_foreign(calibration.channels):
        for text in calibration.provenance.get("remarks", ()):
            remark(text)


def print_line(text: str, stream: TextIO) -> None:
    """Print a sentence: one line for programs, on a terminal not broken within words.

    Arguments that it names are printed as options.
    """
    text = with_options(text)
    if stream.isatty():
        width = shutil.get_terminal_size().columns
        text = fill(text, width, break_long_words=False, break_on_hyphens=False)
    print(text, file=stream)


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
    from chartless.result.summary import (
        doubts,
        error_text,
        fit_text,
        noise_text,
        status_text,
        white_text,
    )
    from chartless.result.verdict import verdict

    divided = any(response.shape_std is not None for response in calibration.channels)
    errors_of = ["shape", "white"] if divided else ["error"]
    header = ["channel", "U", "V", "levels seen", *errors_of, "fit", "status"]
    rows = []
    for response in calibration.channels:
        low, high = response.observed_levels
        rows.append(
            [
                response.name,
                noise_text("slope", response, 3),
                noise_text("floor", response, 1),
                f"{low} to {high}",
                *(
                    [error_text(response.shape_std), white_text(response)]
                    if divided
                    else [error_text(response.inverse_lut_std)]
                ),
                fit_text(response),
                status_text(response),
            ]
        )
    if errors is not None:
        header.insert(1, "RMSE")
        for row, error in zip(rows, errors, strict=True):
            row.insert(1, f"{error:.4f}")
    print_table(header, rows)
    print()
    print_line(str(verdict(calibration.channels)), sys.stdout)
    for doubt in doubts(calibration):
        remark(f"{doubt.code} ({', '.join(doubt.channels)}): {doubt.advice}")
        for detail in doubt.details:
            remark(detail)


def print_tables(calibration: "Calibration") -> None:
    """Print what is worth looking at of each frame."""
    for reading in calibration.evidence:
        for table in reading.tables:
            header = [column.label.lower() for column, _ in table.shown]
            print_table(header, list(zip(*(cells for _, cells in table.shown), strict=True)))
            print()


def write_report(calibration: "Calibration", path: Path) -> None:
    """Write a report with one of the frames, and say so where there is none to show."""
    from chartless.report import example_frame, save
    from chartless.result.verdict import is_foreign

    frame = example_frame(calibration)
    inputs = calibration.provenance.get("inputs", [])
    kept = any(each.example is not None for each in calibration.evidence)
    has_pictures = kept or not (calibration.evidence or is_foreign(calibration.channels))
    if frame is None and has_pictures and not any("frames" in each for each in inputs):
        remark("the report shows no picture: the frames were moved or have changed")
    save(calibration, path, frame)
