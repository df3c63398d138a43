"""Addresses on the internet where a file is asked for."""

import os
import re
from pathlib import Path

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
