"""``chartless show``: a calibration as a table and a picture."""

from pathlib import Path
from typing import Annotated

import typer

from chartless.cli._options import CALIBRATION_HELP, AsJson, Report, parse_curve
from chartless.cli._terminal import print_json, print_summary, remark_foreign, write_report
from chartless.errors import ParameterError


def show(
    calibration: Annotated[
        Path,
        typer.Argument(help=CALIBRATION_HELP, show_default=False),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture to draw: .png, .svg or .pdf.")
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(help="Known response to compare with: NAME[:params], CSV, or truth.json."),
    ] = None,
    report: Report = None,
    as_json: AsJson = False,
) -> None:
    """Show a calibration as a table, and with -o as curves.

    The report shows one of the frames too if they are still where calibrate found them.

    \b
    Example:
        chartless show camera.json
        chartless show camera.json -o camera.png --truth srgb
        chartless show camera.json --report camera.html
        chartless show slog3 --truth rec709
    """
    from chartless.formats import load_calibration
    from chartless.formats.calibration_file import to_json
    from chartless.result.response import rmse

    if report is not None:
        from chartless.report import require_page

        require_page(report)
    loaded = load_calibration(calibration)
    known = None if truth is None else parse_curve(truth)
    errors = None if known is None else [rmse(each.curve, known) for each in loaded.channels]
    if output is not None:
        from chartless.plotting import save_figure
        from chartless.report import overview

        save_figure(overview(loaded, truth=known), output)
    if report is not None:
        if report.resolve() == calibration.resolve():
            msg = f"{report} would overwrite the calibration: choose another --report"
            raise ParameterError(msg)
        write_report(loaded, report)
    if as_json:
        content = to_json(loaded)
        print_json(content if errors is None else {**content, "truth": {"rmse": errors}})
        return
    print_summary(loaded, errors)
    remark_foreign(loaded)
    if output is not None:
        print(f"\npicture written to {output}")
    if report is not None:
        print(f"\nreport written to {report}")
