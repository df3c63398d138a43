"""Data sets that users fetch: what they are, where they may lie, and how they get there."""

import logging
import os
from dataclasses import dataclass
from pathlib import Path

from chartless._registry import Registry
from chartless.errors import ChartlessError


class DatasetError(ChartlessError, OSError):
    """A data set that cannot be fetched, or a file that does not hold it."""


@dataclass(frozen=True, slots=True)
class Archive:
    """A file that can be fetched, pinned by its checksum.

    Attributes
    ----------
    name : str
        What users call the data set; also the folder it lies in.
    what : str
        What it is, in a few words.
    licence : str
        What is known about the right to use it.
    url : str
        Where it is published.
    file_name : str
        Name of the file as it is published.
    sha256 : str
        SHA-256 of that file, 64 hexadecimal digits.
    other_forms : tuple of str
        Patterns of other files that hold the same data, such as the unpacked archive.
    """

    name: str
    what: str
    licence: str
    url: str
    file_name: str
    sha256: str
    other_forms: tuple[str, ...] = ()

    def find_in(self, folder: Path) -> Path | None:
        """File in `folder` that holds the data set, the published one first; None without one."""
        for pattern in (self.file_name, *self.other_forms):
            for path in sorted(folder.glob(pattern)):
                if path.is_file():
                    return path
        return None


DATASETS: Registry[Archive] = Registry("data set")
"""Data sets by the names that users type."""


def locate(name: str) -> Path | None:
    """Find a data set on this computer.

    Looks into the folder `name` inside the folder that the environment variable
    CHARTLESS_DATA names, then into the cache of this user.

    Parameters
    ----------
    name : str
        Name in `DATASETS`.

    Returns
    -------
    Path or None
        The file that holds the data set, unchecked; None if there is none.

    Raises
    ------
    UnknownNameError
        If there is no such data set.
    """
    archive = DATASETS[name]
    own = os.environ.get("CHARTLESS_DATA")
    folders = [Path(own) / name] if own else []
    for folder in (*folders, _cache(name)):
        found = archive.find_in(folder)
        if found is not None:
            return found
    return None


def fetch(name: str) -> Path:
    """Find a data set, and download it into the cache of this user if it is not there.

    Parameters
    ----------
    name : str
        Name in `DATASETS`.

    Returns
    -------
    Path
        The file that holds the data set. One that was downloaded has the pinned checksum.

    Raises
    ------
    UnknownNameError
        If there is no such data set.
    DatasetError
        If it cannot be downloaded; the message says how to get it by hand. No part of a file
        is left behind.
    """
    found = locate(name)
    if found is not None:
        return found
    import pooch

    archive = DATASETS[name]
    target = _cache(name) / archive.file_name
    logger = pooch.get_logger()
    level = logger.level
    logger.setLevel(logging.WARNING)  # what it does is said by us, or is an error
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        pooch.retrieve(archive.url, f"sha256:{archive.sha256}", archive.file_name, target.parent)
    except (OSError, ValueError) as error:
        msg = (
            f"{name} cannot be fetched: {_reason(error, target.parent)}; download {archive.url} "
            f"by hand and save it as {target}, or set CHARTLESS_DATA to a folder that has it as "
            f"{name}/{archive.file_name}"
        )
        raise DatasetError(msg) from error
    finally:
        logger.setLevel(level)
    return target


def _cache(name: str) -> Path:
    import pooch

    return Path(pooch.os_cache("chartless")) / name


def _reason(error: OSError | ValueError, folder: Path) -> str:
    """What went wrong in a few words; errors of requests say it at great length."""
    response = getattr(error, "response", None)
    if response is not None:
        response.close()  # nobody else does when its status is an error
        return f"the server answered {response.status_code} {response.reason}".rstrip()
    if isinstance(error, PermissionError):
        return f"the folder {folder} cannot be written"
    if not isinstance(error, OSError):  # so pooch says that the checksum is another
        return "the server sent a different file: its SHA-256 differs"
    if error.strerror:
        return f"{error.strerror}: {error.filename or folder}"
    return "there is no connection to the server, or it broke off"
