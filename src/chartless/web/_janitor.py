"""Removes a folder when the program that started this one has ended, however it ended.

    python -m chartless.web._janitor FOLDER

Its standard input is a pipe from that program: it ends when the program does, even if that was
killed.
"""

import os
import shutil
import sys
import time

_TRIES, _PAUSE = 20, 0.1  # seconds; others may still be writing there


def main(folder: str) -> None:
    """Wait for the end of standard input, then remove the folder."""
    sys.stdin.read()
    for _ in range(_TRIES):
        shutil.rmtree(folder, ignore_errors=True)
        if not os.path.lexists(folder):
            return
        time.sleep(_PAUSE)


if __name__ == "__main__":
    main(sys.argv[1])
