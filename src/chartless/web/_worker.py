"""A process that opens what browsers send: its memory and crashes of decoders are its own.

    python -m chartless.web._worker MOST_BYTES PROCESSES

It reads lines of JSON, each a task of `_tasks`, and answers with lines of JSON: how far it is, and
at last ``{"done": …}`` or ``{"failed": "one sentence"}``, with ``"broken"`` if it should not go on.
It ends when its standard input does, so that none is left when the program that started it has
ended, however that was.
"""

import contextlib
import json
import os
import sys
import threading
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from chartless.errors import ChartlessError, with_options

if TYPE_CHECKING:
    from chartless.types import JsonObject
    from chartless.web._tasks import Send

_LONGEST = 1000  # characters of what failed


def main(most_bytes: int, n_processes: int) -> None:
    """Do the tasks that standard input says."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what libraries print is no answer

    def send(answer: "JsonObject") -> None:
        answers.write(json.dumps(answer) + "\n")

    _limit_memory(most_bytes, n_processes)
    lines: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_listen, args=(lines,), daemon=True).start()
    import chartless.web._tasks  # noqa: F401 - before there is one

    while True:
        send(_answer(json.loads(lines.get()), send))


def _listen(lines: "SimpleQueue[str]") -> None:
    for line in sys.stdin:
        lines.put(line)
    os._exit(0)


def _answer(task: "JsonObject", send: "Send") -> "JsonObject":
    from chartless.web._tasks import TASKS

    try:
        with contextlib.chdir(task["folder"]):
            return {"done": TASKS[task["task"]](task, send)}
    except ChartlessError as error:
        return {"failed": _line(with_options(str(error)))}
    except MemoryError:
        text = "that needs more memory than there is: give smaller or fewer frames"
        return {"failed": text, "broken": True}
    except OSError as error:  # its own text has a path of this computer
        text = f"the computer cannot do it now ({error.strerror or error}): try again"
        return {"failed": text, "broken": True}
    except Exception as error:  # noqa: BLE001 - the page says it, in one line
        text = _line(f"internal error: {type(error).__name__}: {error}")
        return {"failed": f"{text}; please report it", "broken": True}


def _line(text: str) -> str:
    return " ".join(text.split())[:_LONGEST]


def _limit_memory(most_bytes: int, n_processes: int) -> None:
    """Bound the address space, where the system can, and to a share of the memory there is."""
    try:
        import resource
    except ImportError:  # Windows
        return
    limits: Any = resource
    share = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // n_processes
    _, most = limits.getrlimit(limits.RLIMIT_AS)
    allowed = min(most_bytes, share, *([] if most == limits.RLIM_INFINITY else [most]))
    limits.setrlimit(limits.RLIMIT_AS, (allowed, most))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
