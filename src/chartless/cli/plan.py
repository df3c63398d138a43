"""``chartless plan``: which kinds of evidence frames hold, before any pixel is read."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from chartless.cli._kinds import chosen, with_kind_options
from chartless.cli._options import AsJson, parse_times
from chartless.cli._terminal import print_json, print_line, print_table


@with_kind_options
def plan(
    frames: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Pictures or one video, as for calibrate; patterns such as 'shots/*.png'.",
            show_default=False,
        ),
    ] = None,
    evidence: Annotated[
        str, typer.Option(help="auto, or kinds by name, such as noise or raw,bracket.")
    ] = "auto",
    method: Annotated[
        str | None, typer.Option(help="Method, as for calibrate.", show_default=False)
    ] = None,
    times: Annotated[
        str | None,
        typer.Option(help="Relative exposures, as for calibrate.", show_default=False),
    ] = None,
    time_error: Annotated[
        float | None,
        typer.Option(help="Relative error of the exposures.", show_default=False),
    ] = None,
    as_json: AsJson = False,
    **options: Any,  # noqa: ANN401 - of the kinds of evidence
) -> int:
    """Say which kinds of evidence FRAMES hold.

    Of each kind it says whether calibrate would use it, and why or why not. It reads names and
    camera settings, no pixels.

    \b
    Example:
        chartless plan bracket/*.jpg
        chartless plan burst/*.png --evidence noise
        chartless plan IMG_1.JPG IMG_2.JPG --raw IMG_1.CR2 --raw IMG_2.CR2
    """
    from chartless.errors import with_options
    from chartless.evidence.registry import KINDS
    from chartless.frames.sequence import expanded
    from chartless.workflow import plan as plan_of

    found = plan_of(
        expanded(frames or ()),
        method=method,
        evidence=evidence,
        times=None if times is None else parse_times(times),
        time_error=time_error,
        **chosen(options),
    )
    taken = {each.kind: each for each in found.taken}
    rows: list[tuple[str, bool, int, str]] = []
    for each in (*found.taken, *found.left):
        ask = "" if each.kind in taken else "; to use it, name it in `evidence`"
        rows.append((each.kind, each.kind in taken, each.n_frames, f"{each.sentence}{ask}"))
    rows += [(each.kind, False, 0, str(each)) for each in found.declined]
    rows.sort(key=lambda row: list(KINDS).index(row[0]))
    if as_json:
        names = ("kind", "used", "frames", "reason")
        print_json({"kinds": [dict(zip(names, row, strict=True)) for row in rows]})
        return 0
    print_table(
        ["evidence", "what it is", "used", "frames", "why, or why not"],
        [
            [name, KINDS[name].title, "yes" if used else "no", str(n or ""), with_options(why)]
            for name, used, n, why in rows
        ],
        left=(0, 1, 2, 4),
    )
    print()
    print_line(f"calibrate would use {found.reason}", sys.stdout)
    return 0
