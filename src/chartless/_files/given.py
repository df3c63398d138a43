"""Files that users give: text in them, and addresses and folders instead of them."""

import os
import re
from pathlib import Path

from chartless.errors import ParameterError

_ADDRESS = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):/+")  # two letters: C:/ is a drive

NOT_A_FILE = "is an address, not a file: download it and give the name of the file"
"""What is said of one."""


def address_in(path: str | os.PathLike[str]) -> str | None:
    """The address that a name is, its slashes restored; None if it is that of a file.

    Examples
    --------
    >>> address_in(Path("https://example.org/a.jpg"))
    'https://example.org/a.jpg'
    >>> address_in("C:/a.jpg")
    """
    name = Path(path).as_posix()  # one slash: two are one in names of files
    found = _ADDRESS.match(name)
    if found is None or Path(path).exists():
        return None
    return f"{found[1]}://{name[found.end() :]}"


def read_text(path: str | os.PathLike[str]) -> str:
    """Text of a file that a user gives.

    Raises
    ------
    ParameterError
        If it cannot be read, or is not text.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ParameterError(why_unreadable(path, error, kind="text file")) from error
    except UnicodeDecodeError as error:
        msg = f"{os.fspath(path)}: cannot be read as a text file: {error}"
        raise ParameterError(msg) from error


def why_unreadable(path: str | os.PathLike[str], error: OSError, *, kind: str = "") -> str:
    """One line about a file that cannot be read, as a text file if that is its `kind`."""
    address = address_in(path)
    if address is not None:
        return f"{address}: {NOT_A_FILE}"
    remedy = ""
    if isinstance(error, IsADirectoryError):
        remedy = ": name a file in it"
    elif isinstance(error, FileNotFoundError):
        remedy = ": check the name"
    what = f" as a {kind}" if kind else ""
    return f"{os.fspath(path)}: cannot be read{what}: {error.strerror or error}{remedy}"
