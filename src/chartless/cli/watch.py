"""``chartless watch``: a running camera or a video → calibration, drawn while it gets better."""

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._options import AsJson, Report, Strict, require_outputs
from chartless.cli._terminal import FLAGGED, print_json, print_summary, remark, write_report
from chartless.errors import ParameterError, UnfitFramesError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from chartless.frames.frame import TimedFrame
    from chartless.live import LiveEvidence
    from chartless.result.calibration import Calibration

_REDRAWN, _REPRINTED = 0.2, 1.0  # seconds between pictures and between lines
_WIDEST, _HIGHEST, _LEAST_HIGH = 100, 22, 5  # of the drawing, in characters
_OTHER_LINES = 10  # of the screen, besides drawing and channels


def watch(
    device: Annotated[
        Path,
        typer.Argument(
            metavar="DEVICE|VIDEO",
            help="Camera such as /dev/video0, or a video.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Calibration to write.", show_default=False),
    ] = None,
    until: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="Stop when the error of the curve is at most this share of the light at white; 0: "
            "never.",
        ),
    ] = 0.045,
    window: Annotated[
        int, typer.Option(min=10, help="Number of frame pairs to keep; older ones are dropped.")
    ] = 100,
    channels: Annotated[str, typer.Option(help="auto (luma), rgb or luma.")] = "auto",
    strict: Strict = False,
    report: Report = None,
    as_json: AsJson = False,
) -> int:
    """Watch a running camera until its response is known well enough.

    Point it at a still scene with dark and bright parts. Frames between which something moved are
    left out. The curve is that of the method nlf. It stops when the curve is good enough, at the
    end of a video, or at Ctrl-C, and writes what it has with -o. Exit status: 0 good enough, 3 not
    good enough, 2 nothing to calibrate from.

    \b
    Example:
        chartless watch /dev/video0 -o camera.json
        chartless watch clip.mp4 --until 0.03 -o camera.json --report camera.html
    """
    from chartless.formats.calibration_file import save, to_json
    from chartless.images import digest, read_video
    from chartless.live import LiveEvidence, lacking, live_calibration

    _require_camera(device)
    require_outputs(output, report)
    if output is not None and output.resolve() == device.resolve():
        msg = f"{output} is the video and would be overwritten: choose another output"
        raise ParameterError(msg)
    live = LiveEvidence(channels=channels, window=window)
    sha256 = digest(device) if device.is_file() else ""  # a camera has none
    why = "the video ended"
    try:
        with (
            closing(read_video(device, colour=channels == "rgb")) as video,
            _shown(device, live, until) as show,
        ):
            for estimate in _estimates(video, sha256, live, until):
                show(estimate)
    except KeyboardInterrupt:
        why = "stopped by Ctrl-C"
    calibration = live_calibration(live)
    lack = lacking(live, calibration, until)
    remark(f"{why}: {lack}" if lack else f"good enough after {live.n_frames} frames")
    for text in calibration.provenance["remarks"]:
        remark(text)
    if output is not None:
        save(calibration, output)
    if report is not None:
        write_report(calibration, report)
    if as_json:
        print_json(to_json(calibration))
    else:
        _print(calibration, output, report)
    return 0 if not lack and not (strict and calibration.flags) else FLAGGED


def _require_camera(device: Path) -> None:
    from chartless.images import is_video

    if not is_video(device):
        msg = f"{device} is neither a video nor a camera such as /dev/video0: name one"
        raise ParameterError(msg)


@dataclass(frozen=True, slots=True)
class _Estimate:
    """What is known so far."""

    calibration: "Calibration | None" = None
    unfit: str = ""
    """Why there is no calibration."""
    is_enough: bool = False

    @property
    def text(self) -> str:
        """The verdict, or why there is none."""
        from chartless.result.verdict import verdict

        return self.unfit if self.calibration is None else str(verdict(self.calibration.channels))


_Show = Callable[[_Estimate], None]


def _estimates(
    video: "Iterable[TimedFrame]", sha256: str, live: "LiveEvidence", until: float
) -> Iterator[_Estimate]:
    """What is known after each frame, up to the one when that is enough.

    Estimates are made less often as evidence grows, by counts and not by a clock: one video gives
    one result.
    """
    estimate, due = _Estimate(), 0
    for _, frame in video:
        outcome = live.add(replace(frame, sha256=sha256))
        if not live.n_kept or (outcome.is_used and live.n_used >= due):
            estimate = _estimated(live, until)
            due = live.n_used + max(1, live.n_kept // 5)
        yield estimate
        if estimate.is_enough:
            return


def _estimated(live: "LiveEvidence", until: float) -> _Estimate:
    from chartless.live import is_enough, live_calibration

    try:
        calibration = live_calibration(live)
    except UnfitFramesError as error:
        return _Estimate(unfit=str(error))
    return _Estimate(calibration, is_enough=is_enough(live, calibration, until))


@contextmanager
def _shown(device: Path, live: "LiveEvidence", until: float) -> Iterator[_Show]:
    """Show estimates on standard error: drawn in place on a terminal, in lines elsewhere."""
    start = time.monotonic()
    if not sys.stderr.isatty():

        def print_line(estimate: _Estimate) -> None:
            seconds = time.monotonic() - start
            remark(f"{seconds:.0f} s: {live.account}; {estimate.text}")

        yield _at_most_every(_REPRINTED, print_line)
        return
    from rich.console import Console
    from rich.live import Live

    console = Console(stderr=True, highlight=False)
    latest = _Estimate()
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as screen:

        def draw(estimate: _Estimate) -> None:
            lines = _lines(estimate, live, until)
            head = f"chartless watch {device}  {time.monotonic() - start:.0f} s"
            screen.update(_picture(console, estimate, head, lines), refresh=True)

        draw_sometimes = _at_most_every(_REDRAWN, draw)

        def show(estimate: _Estimate) -> None:
            nonlocal latest
            latest = estimate
            draw_sometimes(estimate)

        try:
            yield show
        finally:
            # The curve stays; what is said of it follows in full.
            screen.update(_picture(console, latest, f"chartless watch {device}", []), refresh=True)


def _at_most_every(seconds: float, act: _Show) -> _Show:
    """Do nothing until so long after the start, or after it was done the last time."""
    due = time.monotonic() + seconds

    def act_if_due(estimate: _Estimate) -> None:
        nonlocal due
        if time.monotonic() >= due:
            act(estimate)
            due = time.monotonic() + seconds

    return act_if_due


def _lines(estimate: _Estimate, live: "LiveEvidence", until: float) -> list[str]:
    """What stands below the drawing."""
    from chartless.result.summary import error_text

    channels = estimate.calibration.channels if estimate.calibration else ()
    rows = [
        f"{each.name:7}  {'{} to {}'.format(*each.observed_levels):11}  "
        f"{error_text(each.inverse_lut_std)}"
        for each in channels
    ]
    wanted = f"Stops at ± {until:g}, or at Ctrl-C." if until else "Stops at Ctrl-C."
    header = ["channel  levels seen  error"] if rows else []
    return [*header, *rows, live.account, estimate.text, wanted]


def _picture(
    console: "Console", estimate: _Estimate, head: str, lines: list[str]
) -> "RenderableType":
    """Drawing and lines, no larger than the terminal."""
    from rich.console import Group
    from rich.text import Text

    from chartless.cli._drawing import drawn_curves

    channels = estimate.calibration.channels if estimate.calibration else ()
    drawing = drawn_curves(
        channels,
        min(console.width, _WIDEST),
        max(_LEAST_HIGH, min(console.height - _OTHER_LINES - len(channels), _HIGHEST)),
        ascii_only=console.options.ascii_only,
    )
    return Group(Text(head, no_wrap=True, overflow="ellipsis"), drawing, *map(Text, lines))


def _print(calibration: "Calibration", output: Path | None, report: Path | None) -> None:
    from chartless.result.summary import n_frames

    print_summary(calibration)
    if output is not None or report is not None:
        print()
    if output is not None:
        print(f"calibration of {n_frames(calibration)} frames written to {output}")
    if report is not None:
        print(f"report written to {report}")
