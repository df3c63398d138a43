"""Errors a user can repair, each one sentence: what is wrong, what was given, what would work.

Every leaf also inherits the builtin that fits it, so library code may catch
``ValueError`` or ``OSError`` as usual. Messages name arguments as Python writes them, in
backquotes: `` `times='unknown'` ``. The command line prints the message of a `ChartlessError` on
one line, arguments as its options, and exits with status 2; it never prints a traceback.
"""

import re
from collections.abc import Collection
from difflib import get_close_matches

_ARGUMENT = re.compile(r"`(?P<name>[a-z_]+)(?:=(?P<value>[^`]+))?`")
_OPTIONS = {"name": "from", "n_levels": "levels", "noise_prior": "set noise_prior"}
"""Options of arguments, where they have other names."""
_PLAIN = str.maketrans("", "", "'[] ")


class ChartlessError(Exception):
    """Base of every error that names something the user can repair."""


class UnknownNameError(ChartlessError, LookupError):
    """A model, method, response or file format that nobody registered.

    The structured arguments stay in ``args``, so the error survives pickling
    (worker processes) and callers need not parse the text.
    """

    def __init__(self, kind: str, name: str, known: Collection[str]) -> None:
        super().__init__(kind, str(name), tuple(known))

    def __str__(self) -> str:
        kind, name, known = self.args
        close = get_close_matches(name.lower(), known, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        return f"unknown {kind} {name!r}.{hint} Available: {', '.join(_abridged(known))}."


def with_options(text: str) -> str:
    """Text in which arguments are named as options of the command line.

    Examples
    --------
    >>> with_options("give `times`, or `times='unknown'`, and omit `shared_noise`")
    'give --times, or --times unknown, and omit --shared-noise'
    >>> with_options("omit `aligned=False`")
    'omit --unaligned'
    >>> with_options("give `times=[1, 2, 4]`")
    'give --times 1,2,4'
    """
    return _ARGUMENT.sub(_as_option, text)


def _as_option(found: re.Match[str]) -> str:
    name, value = found["name"], found["value"]
    if value == "False":
        return f"--un{name}"
    option = "--" + _OPTIONS.get(name, name.replace("_", "-"))
    return option if value is None else f"{option} {value.translate(_PLAIN)}"


def _abridged(names: Collection[str]) -> list[str]:
    """Names that differ by a number alone as one: eegc0, eegc1, eegc2 as ``eegc0…2``."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in names:
        groups.setdefault(tuple(re.split(r"\d+", name, maxsplit=1)), []).append(name)
    shown = []
    for parts, members in groups.items():
        numbers = [name[len(parts[0]) : len(name) - len(parts[-1])] for name in members]
        many = len(members) > 2  # noqa: PLR2004 - two are as short in full
        shown += [f"{parts[0]}{numbers[0]}…{numbers[-1]}{parts[-1]}"] if many else members
    return shown


class _FileError(ChartlessError, OSError):
    """Base of the errors about one file; ``args`` are its path and what to do about it."""

    def __str__(self) -> str:  # OSError would print the arguments as a tuple
        return ": ".join(str(argument) for argument in self.args)


class ImageError(_FileError):
    """A picture that cannot be read, or values that its format cannot hold."""


class OutputError(_FileError):
    """A place where no file can be written."""


class UnfitFramesError(ChartlessError, ValueError):
    """Frames were read, but no response can be read out of their noise."""


class CalibrationFileError(ChartlessError, ValueError):
    """A calibration file that is damaged, foreign or of another version."""


class ParameterError(ChartlessError, ValueError):
    """A value outside the range in which the request has a meaning."""


def how_to_install(extra: str) -> str:
    """What to do about a package that is missing, as the end of a sentence.

    Parameters
    ----------
    extra : str
        A name under ``[project.optional-dependencies]`` of pyproject.toml.

    Examples
    --------
    >>> how_to_install("video")
    "in the folder of chartless, run pip install '.[video]'"
    """
    return f"in the folder of chartless, run pip install '.[{extra}]'"
