"""A process that makes one calibration: memory that it takes and crashes of decoders are its own.

It reads one line of JSON, what to do, and writes lines of JSON: how far it is, and at last
``{"done": …}`` or ``{"failed": "one sentence"}``. It ends when its standard input does, so that
none is left when the program that started it has ended, however that was.
"""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chartless.errors import ChartlessError

if TYPE_CHECKING:
    from chartless.calibration import Calibration
    from chartless.types import JsonObject

Say = Callable[["JsonObject"], None]

_INTERVAL = 0.1  # seconds between two reports of progress


def main() -> None:
    """Do what the first line of standard input says."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what libraries print is no answer

    def say(answer: "JsonObject") -> None:
        answers.write(json.dumps(answer) + "\n")

    # A task comes seconds later, if at all: what it will need is imported by then.
    import chartless.report
    import chartless.workflow  # noqa: F401

    line = sys.stdin.readline()
    if not line:
        return
    threading.Thread(target=_end_with_input, daemon=True).start()
    try:
        say({"done": _done(json.loads(line), say)})
    except ChartlessError as error:
        say({"failed": " ".join(str(error).split())})
    except MemoryError:
        say({"failed": "that takes more memory than there is: give smaller or fewer frames"})
    except Exception as error:  # noqa: BLE001 - the page says it, in one line
        text = " ".join(f"{type(error).__name__}: {error}".split())
        say({"failed": f"internal error: {text}; please report it"})


def _end_with_input() -> None:
    sys.stdin.read()
    os._exit(1)


def _done(task: "JsonObject", say: Say) -> "JsonObject":
    """Make a calibration, its file and its report; what the page needs to know of it."""
    from chartless.calibration_file import save
    from chartless.report import example_frame
    from chartless.report import save as save_report
    from chartless.verdict import verdict

    _limit_memory(task["worker_bytes"])
    os.chdir(task["folder"])  # names in the calibration are those that the user knows
    results = Path(task["results"])
    calibration = _calibration(task, say)
    save(calibration, results / "camera.json")
    say({"stage": "drawing the report", "share": 1.0})
    # A file that somebody gave may name any other: only of our own a frame is shown.
    frame = example_frame(calibration) if "arguments" in task else None
    save_report(calibration, results / "report.html", frame)
    judged = verdict(calibration.channels)
    return {
        "grade": judged.grade.name.lower(),
        "verdict": str(judged),
        "remarks": calibration.provenance.get("remarks", []),
    }


def _calibration(task: "JsonObject", say: Say) -> "Calibration":
    """Calibrate from frames, or read the file that somebody else did that for."""
    if "calibration" in task:
        from chartless.luts import load_calibration

        return load_calibration(Path(task["calibration"]))
    from chartless.workflow import calibrate

    return calibrate(progress=_Progress(say), **task["arguments"])


class _Progress:
    """Says how far a calibration is, but not too often."""

    def __init__(self, say: Say) -> None:
        self._say = say
        self._stage, self._said = "", 0.0

    def __call__(self, stage: str, share: float) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._said > _INTERVAL:
            self._stage, self._said = stage, now
            self._say({"stage": stage, "share": round(share, 3)})


def _limit_memory(n_bytes: int) -> None:
    """Bound the address space, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    limits: Any = resource
    _, most = limits.getrlimit(limits.RLIMIT_AS)
    allowed = n_bytes if most == limits.RLIM_INFINITY else min(n_bytes, most)
    limits.setrlimit(limits.RLIMIT_AS, (allowed, most))


if __name__ == "__main__":
    main()
