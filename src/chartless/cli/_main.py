"""The program: commands, and the one place where errors become a line and an exit status."""

import contextlib
import io
import json
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated

import typer
from typer.exceptions import Abort, TyperException

from chartless._version import __version__
from chartless.cli._terminal import print_line
from chartless.cli.calibrate import calibrate
from chartless.cli.compare import compare
from chartless.cli.data import app as data
from chartless.cli.demo import demo
from chartless.cli.export import export, import_
from chartless.cli.fit import fit
from chartless.cli.linearize import linearize
from chartless.cli.merge import merge
from chartless.cli.models import models
from chartless.cli.plan import plan
from chartless.cli.reproduce import app as reproduce
from chartless.cli.serve import serve
from chartless.cli.show import show
from chartless.cli.simulate import simulate
from chartless.cli.watch import watch
from chartless.errors import ChartlessError, with_options

BAD_INPUT, INTERNAL, INTERRUPTED = 2, 1, 130

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,  # plain help: starts faster, pipes well
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 96},
)
for command in (
    demo,
    plan,
    calibrate,
    watch,
    linearize,
    merge,
    show,
    simulate,
    fit,
    compare,
    models,
):
    app.command()(command)
app.command()(serve)
app.command()(export)
app.command("import")(import_)
app.add_typer(data, name="data")
app.add_typer(reproduce, name="reproduce")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"chartless {__version__}")
        raise typer.Exit


@app.callback()
def program(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Find a camera's response function from the pictures it already takes.

    \b
    Example:
        chartless calibrate a.jpg b.jpg -o camera.json
        chartless linearize camera.json a.jpg -o linear.exr
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program and return its exit status.

    Set CHARTLESS_DEBUG to see the traceback of an error.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # names of files may not fit the terminal
            stream.reconfigure(errors="backslashreplace")
    try:
        status = int(app(given or ["--help"], standalone_mode=False) or 0)
        sys.stdout.flush()
    except TyperException as error:
        text = f"{error.format_message()} (see {_command_of(error)} --help)"
        return _fail(text, given, BAD_INPUT)
    except ChartlessError as error:
        return _fail(str(error), given, BAD_INPUT)
    except (KeyboardInterrupt, Abort):
        status = INTERRUPTED
    except (BrokenPipeError, SystemExit):
        # Typer exits when the reader of our output has gone, as `head` does.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return _fail(f"{error.strerror or error}: {error.filename or 'output'}", given, BAD_INPUT)
    except Exception as error:  # noqa: BLE001 - no traceback reaches a user
        text = f"internal error: {type(error).__name__}: {error}; please report it"
        return _fail(text, given, INTERNAL)
    return _fail("interrupted", given, INTERRUPTED) if status == INTERRUPTED else status


def _command_of(error: TyperException) -> str:
    """Name of the command whose arguments are wrong, as a user would type it."""
    names: list[str] = []
    context = getattr(error, "ctx", None)
    while context is not None and context.parent is not None:
        names.insert(0, str(context.info_name))
        context = context.parent
    return " ".join(["chartless", *names])


def _fail(message: str, given: list[str], status: int) -> int:
    if os.environ.get("CHARTLESS_DEBUG"):
        traceback.print_exc()
    line = " ".join(message.split())
    with contextlib.suppress(OSError):  # of a full disk or a closed pipe
        print_line(f"chartless: error: {line}", sys.stderr)
        if "--json" in given:
            print(json.dumps({"error": with_options(line)}), flush=True)
    return status
