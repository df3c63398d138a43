"""Names of many pictures in one: ``shots/*.png``, ``frame_%04d.png``.

A shell expands the first before a program sees it, unless it is quoted; on Windows none does.
"""

import glob
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from chartless._files.given import NOT_A_FILE, address_in
from chartless.errors import ImageError

_NUMBER = re.compile(r"%(?:0(\d+))?d")
_DIGITS = re.compile(r"([0-9]+)")

T = TypeVar("T")


def expanded(names: Iterable[Path]) -> list[Path]:
    """Files that names and patterns stand for.

    Parameters
    ----------
    names : iterable of Path
        Files; patterns of the shell (``*``, ``?``, ``[0-9]``, and ``**`` for folders of any
        depth); or names with one number in their last part: ``%d`` of any digits, ``%04d`` of
        four or more.

    Returns
    -------
    list of Path
        In the order given, those of a pattern in that of their numbers: 2 before 10. A name that
        is no pattern, or that a file has, stands for itself.

    Raises
    ------
    ImageError
        If no file matches a pattern, or ``%04d`` would leave out numbers of fewer digits.
    """
    return [path for name in names for path in _matches(name)]


def _matches(name: Path) -> list[Path]:
    address = address_in(name)
    if address is not None:
        raise ImageError(address, NOT_A_FILE)
    number = _NUMBER.search(name.name)
    if name.exists() or not (number or glob.has_magic(str(name))):
        return [name]
    if number:
        found = _numbered(name, number)
    else:
        found = [Path(each) for each in glob.glob(str(name), recursive=True)]  # noqa: PTH207 - ** and absolute patterns alike
    files = naturally_sorted(each for each in found if each.is_file())
    if not files:
        msg = "no file matches this pattern: check it"
        raise ImageError(str(name), msg)
    return files


def _numbered(name: Path, number: re.Match[str]) -> list[Path]:
    """Files whose names have a number of at least so many digits there."""
    width = int(number[1] or 1)
    before, after = name.name[: number.start()], name.name[number.end() :]
    same = re.compile(f"{re.escape(before)}([0-9]+){re.escape(after)}")
    if not name.parent.is_dir():
        return []
    digits = {
        each: len(match[1])
        for each in name.parent.iterdir()
        if (match := same.fullmatch(each.name))
    }
    short = [each for each in digits if digits[each] < width]
    if short:
        msg = (
            f"leaves out {naturally_sorted(short)[0].name}, whose number has fewer digits: write "
            f"{before}%d{after} for numbers of any digits"
        )
        raise ImageError(str(name), msg)
    return list(digits)


def naturally_sorted(items: Iterable[T], key: Callable[[T], str] = str) -> list[T]:
    """Sort by names, numbers in them by their value: 2 before 10."""

    def natural(item: T) -> list[str | int]:
        parts = _DIGITS.split(key(item))  # every second one is a number
        return [int(part) if place % 2 else part for place, part in enumerate(parts)]

    return sorted(items, key=natural)
