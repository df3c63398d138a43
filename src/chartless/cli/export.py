"""``chartless export`` and ``chartless import``: response curves of other programs."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._options import CALIBRATION_HELP, AsJson
from chartless.cli._terminal import (
    print_json,
    print_summary,
    print_table,
    remark,
    remark_foreign,
    remark_verdict,
)
from chartless.errors import ParameterError, with_options

if TYPE_CHECKING:
    from chartless.formats import AbstractFormat, ExportSettings


def export(
    calibration: Annotated[
        Path | None,
        typer.Argument(help=CALIBRATION_HELP, show_default=False),
    ] = None,
    to: Annotated[
        str | None,
        typer.Option("--to", help="Format, see --list [by the output's name].", show_default=False),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="File to write [beside the calibration].", show_default=False
        ),
    ] = None,
    levels: Annotated[
        int | None,
        typer.Option(
            help="Number of entries of the table [chosen by the format].", show_default=False
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            help="dso, hugin: size of the camera's pictures, 640x480.", show_default=False
        ),
    ] = None,
    project: Annotated[
        Path | None,
        typer.Option(
            help="hugin: project to copy with this response for all pictures in it.",
            show_default=False,
        ),
    ] = None,
    list_formats: Annotated[
        bool, typer.Option("--list", help="List the formats, what each keeps and who reads it.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write a calibration for another program.

    \b
    Example:
        chartless export --list
        chartless export camera.json --to cube
        chartless export camera.json --to dso --size 640x480 -o pcalib.txt
        chartless export slog3 --to cube
    """
    if list_formats:
        _print_formats(as_json=as_json)
        return
    from chartless.formats import FORMATS, ExportSettings, export_response, load_calibration

    if calibration is None:
        msg = "give the calibration to export, or --list"
        raise ParameterError(msg)
    name = to or _name_by_suffix(output)
    camera = load_calibration(calibration)
    target = output or calibration.with_name(_file_name(_stem(calibration), FORMATS[name]))
    if target.resolve() == calibration.resolve():
        msg = f"{target} is the calibration itself and would be overwritten: give another -o"
        raise ParameterError(msg)
    if output is None and target.exists():  # the calibration may have been imported from it
        msg = f"{target} exists already: name the file to write with -o"
        raise ParameterError(msg)
    settings = ExportSettings(
        n_levels=levels, size=None if size is None else _parse_size(size), project=project
    )
    _require_used(FORMATS[name], settings)
    lost, files = export_response(camera, target, name, settings)
    if lost:
        remark(f"lost or changed in {target}: {lost}")
    remark_foreign(camera)
    remark_verdict(calibration, camera)
    if as_json:
        from chartless.result.verdict import verdict

        print_json(
            {
                "format": name,
                "files": [str(each) for each in files],
                "lost": with_options(lost),
                "verdict": verdict(camera.channels).to_json(),
            }
        )
        return
    for each in files:
        print(each)


def import_(
    file: Annotated[
        Path, typer.Argument(help="Response curve of another program.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Calibration to write [beside FILE; with --json none].",
            show_default=False,
        ),
    ] = None,
    from_: Annotated[
        str | None,
        typer.Option("--from", help="Format [by the file's content].", show_default=False),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a calibration of another program's response curve.

    \b
    Example:
        chartless import response.yml -o camera.json
        chartless import curve.m --from pfstools --json
    """
    from chartless._files import require_writable
    from chartless.formats import FORMATS, import_response
    from chartless.formats.calibration_file import save, to_json

    target = output or (None if as_json else file.with_suffix(".json"))
    if target is not None:
        if output is None and target.exists():
            msg = f"{target} exists already: name the calibration to write with -o"
            raise ParameterError(msg)
        require_writable(target)
        if target.resolve() == file.resolve():
            msg = f"{target} is the file to import and would be overwritten: choose another output"
            raise ParameterError(msg)
    calibration = import_response(file, from_)
    if target is not None:
        save(calibration, target)
    for text in calibration.provenance["remarks"]:
        remark(text)
    if as_json:
        print_json(to_json(calibration))
    else:
        method = FORMATS[calibration.channels[0].method]
        print(f"read as {method.name}, {method.title}\n")
        print_summary(calibration)
        print(f"\ncalibration written to {target}")


def _print_formats(*, as_json: bool) -> None:
    from chartless.formats import FORMATS

    if as_json:
        content = [
            {
                "name": each.name,
                "title": each.title,
                "suffix": each.suffix,
                "written": each.is_written,
                "read": each.is_read,
                "programs": each.programs,
                "channels": each.keeps.channels,
                "curves": each.keeps.curves or None,
                "scale": each.keeps.scale,
                "range": each.keeps.range or None,
                "band": each.keeps.band or None,
                "verdict": each.keeps.verdict or None,
            }
            for each in FORMATS.values()
        ]
        print_json({"formats": content})
        return
    header = ["format", "file", "channels", "error, range", "read by"]
    rows = [
        [
            each.name,
            each.suffix,
            each.keeps.curves or each.keeps.channels,
            "kept" if each.keeps.band and each.keeps.range else "-",
            each.programs,
        ]
        for each in FORMATS.values()
    ]
    print_table(header, rows, left=range(len(header)))


def _stem(calibration: Path) -> str:
    """Name of the file without its extension; of a named calibration the name as one word."""
    if calibration.is_file():
        return calibration.stem
    return re.sub(r"[^\w.-]+", "_", str(calibration))


def _file_name(stem: str, each: "AbstractFormat") -> str:
    """Name of a file beside the calibration; with that of the format where several end alike."""
    from chartless.formats import FORMATS

    alike = [other for other in FORMATS.values() if other.suffix == each.suffix]
    shared = len(alike) > 1 and each.suffix[1:] != each.name
    return f"{stem}_{each.name}{each.suffix}" if shared else f"{stem}{each.suffix}"


def _require_used(each: "AbstractFormat", settings: "ExportSettings") -> None:
    """Refuse what the format has no use for."""
    for name, option in _OPTIONS.items():
        if getattr(settings, name) is not None and name not in each.takes:
            msg = f"{each.name} does not use {option}: omit it"
            raise ParameterError(msg)


def _name_by_suffix(output: Path | None) -> str:
    """Return the format of that name, or the only one whose files end so."""
    from chartless.formats import FORMATS

    name = "" if output is None else output.name.lower()
    suffix = "" if output is None else output.suffix.lower()
    fitting = [
        each.name for each in FORMATS.values() if each.is_written and name.endswith(each.suffix)
    ]
    if suffix[1:] in fitting:
        return suffix[1:]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        msg = f"{suffix} files can have several formats: give --to {' or --to '.join(fitting)}"
    else:
        msg = "name the format with --to; chartless export --list shows them"
    raise ParameterError(msg)


def _parse_size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        width = height = 0
    if not (0 < width <= _MOST_PIXELS and 0 < height <= _MOST_PIXELS):
        msg = f"--size must be width and height such as 640x480, not {text[:40]!r}"
        raise ParameterError(msg)
    return width, height


_MOST_PIXELS = 1 << 15  # of a side
_OPTIONS = {"n_levels": "--levels", "size": "--size", "project": "--project"}
