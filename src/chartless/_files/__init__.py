"""Files that appear whole or not at all."""

import csv
import io
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from chartless._files.given import address_in
from chartless.errors import ChartlessError, OutputError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary name beside `path`; what is written there becomes `path` at the end.

    Readers see the old file or the new one, never half of one. If the body raises, the
    temporary file is removed and `path` stays as it was.

    Parameters
    ----------
    path : path-like
        The file to write. A symbolic link is followed, not replaced.

    Yields
    ------
    Path
        A name in the same folder with the same suffix; no file has it yet.

    Raises
    ------
    OutputError
        If the folder is missing, is not a folder or is not writable, if `path` exists and is
        no ordinary file, or if writing fails. The body should therefore only write.

    Examples
    --------
    >>> with atomic_path("notes.txt") as temporary:  # doctest: +SKIP
    ...     temporary.write_text("all or nothing")
    """
    require_writable(path)
    target = Path(os.path.realpath(path))
    temporary = target.parent / f".chartless-{secrets.token_hex(6)}{target.suffix}"
    try:
        yield temporary
        temporary.replace(target)
    except ChartlessError:
        raise
    except OSError as error:
        msg = f"cannot be written ({error.strerror or error})"
        raise OutputError(os.fspath(path), msg) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; raises as `atomic_path` does."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="")


def write_csv(
    path: str | os.PathLike[str], header: Sequence[str], rows: Iterable[Sequence[object]]
) -> None:
    """Write a table of comma-separated values, whole or not at all."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_text(path, text.getvalue())


def make_folder(path: Path) -> None:
    """Make a folder if it does not exist.

    Raises
    ------
    OutputError
        If that is impossible, or nothing may be written into the folder.
    """
    _refuse_address(path)
    try:
        path.mkdir(exist_ok=True)
    except FileNotFoundError as error:
        msg = f"its parent folder {path.parent} does not exist: create it first"
        raise OutputError(str(path), msg) from error
    except OSError as error:
        what = "is a file" if path.exists() else f"cannot be made ({error.strerror or error})"
        msg = f"{what}: choose another output folder"
        raise OutputError(str(path), msg) from error
    if not os.access(path, os.W_OK | os.X_OK):
        msg = "is not writable: choose another output folder"
        raise OutputError(str(path), msg)


def require_writable(path: str | os.PathLike[str]) -> None:
    """Raise `OutputError` if `path` could not be written, before work goes into its content."""
    _refuse_address(path)
    target = Path(os.path.realpath(path))
    folder = target.parent
    if not folder.exists():
        msg = f"output folder {folder} does not exist: create it first"
    elif not folder.is_dir():
        msg = f"{folder} is a file, not a folder: choose another output"
    elif not os.access(folder, os.W_OK | os.X_OK):
        msg = f"output folder {folder} is not writable: choose another one"
    elif target.is_dir():
        msg = "is a folder: name a file in it"
    elif target.exists() and not target.is_file():
        msg = "is not an ordinary file: choose another output"
    else:
        return
    raise OutputError(os.fspath(path), msg)


def _refuse_address(path: str | os.PathLike[str]) -> None:
    address = address_in(path)
    if address is not None:
        msg = "is an address, not a file: write to a folder of this computer"
        raise OutputError(address, msg)
