"""What every format of response curves provides, and the list of all of them."""

import hashlib
from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from chartless._files.given import why_unreadable
from chartless._registry import Registry
from chartless.errors import CalibrationFileError, ParameterError
from chartless.result.calibration import Calibration
from chartless.types import Floats32, JsonObject

MOST_BYTES = 1 << 24
"""The longest look-up tables have some 10 MB as text."""
HEAD = 4096
"""Bytes that formats are recognised by, as text."""


@dataclass(frozen=True, slots=True)
class Keeps:
    """Parts of a calibration that a format holds; each in a few words, empty if nothing."""

    channels: str
    """"each" or what becomes of three curves."""
    scale: str
    """What irradiance is 1, or what the largest is called."""
    range: str = ""
    """How the range of the levels seen is held."""
    band: str = ""
    """How the band of the error is held."""
    verdict: str = ""
    """How the verdict is held, which says how far to trust the calibration."""
    curves: str = ""
    """What becomes of a curve that the format has no way to hold; empty if it holds any."""


@dataclass(frozen=True, slots=True)
class ExportSettings:
    """What users may choose about an export; each format uses what concerns it."""

    n_levels: int | None = None
    """Entries of the table; None for what suits the format."""
    size: tuple[int, int] | None = None
    """Width and height of the camera's pictures."""
    project: Path | None = None
    """File of the other program to put the response into."""
    suffix: str = ""
    """Extension of the file to write, for formats that exist in several languages."""

    def levels_or(self, usual: int) -> int:
        """Entries of the table: those chosen, or what is usual in the format."""
        return usual if self.n_levels is None else self.n_levels


@dataclass(frozen=True, slots=True)
class Encoded:
    """A calibration in the bytes of a format."""

    content: bytes
    lost: tuple[str, ...] = ()
    """What this calibration lost beyond what the format always loses, in a few words each."""
    pictures: Mapping[str, Floats32] = field(default_factory=dict)
    """Pictures that the other program wants beside the file, by name: 16 bits, values 0 … 1."""


@dataclass(frozen=True, slots=True)
class Source:
    """A file to import."""

    path: Path
    content: bytes

    @classmethod
    def read(cls, path: Path) -> "Source":
        """Read a file; raises CalibrationFileError if it cannot be read or is too large."""
        try:
            with path.open("rb") as file:
                content = file.read(MOST_BYTES + 1)
        except OSError as error:
            raise CalibrationFileError(why_unreadable(path, error)) from error
        if len(content) > MOST_BYTES:
            msg = f"{path}: is larger than any response curve: give the file that holds it alone"
            raise CalibrationFileError(msg)
        return cls(path, content)

    @property
    def text(self) -> str:
        """Content as text with Unix line ends; raises ValueError if it is none."""
        try:
            return self.content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        except UnicodeDecodeError as error:
            msg = "is not text"
            raise ValueError(msg) from error

    @property
    def head(self) -> str:
        """First characters as text, whatever the content: to recognise a format by."""
        return self.content[:HEAD].decode("utf-8-sig", errors="replace").replace("\r\n", "\n")

    def provenance(self, method: str) -> JsonObject:
        """Where a calibration that another program made came from."""
        digest = hashlib.sha256(self.content).hexdigest()
        return {
            "inputs": [{"file": str(self.path), "sha256": digest}],
            "settings": {"method": method},
        }


@dataclass(frozen=True, slots=True)
class AbstractFormat(ABC):
    """A file format of response curves: a writer, a reader or both."""

    name: ClassVar[str]
    """What users call it on the command line."""
    title: ClassVar[str]
    """What people call it."""
    suffix: ClassVar[str]
    """Suffix of files written, with its dot."""
    programs: ClassVar[str]
    """Who reads it."""
    tested_with: ClassVar[str]
    """Reader that the tests read our files with: a program, or "reference parser"."""
    precision: ClassVar[float]
    """Largest error of irradiance, 0 … 1, of a curve that was written and read again: of any, or
    of those that the format holds, see `Keeps.curves`."""
    keeps: ClassVar[Keeps]
    takes: ClassVar[frozenset[str]] = frozenset({"n_levels"})
    """Settings of `ExportSettings` that change the file, besides the suffix."""

    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:  # noqa: ARG002
        """Content of a file; raises ParameterError if it cannot hold this calibration."""
        msg = f"{self.title} can be read but not written: choose another format"
        raise ParameterError(msg)

    def recognises(self, source: Source) -> bool:  # noqa: ARG002
        """Whether the file is of this format, by its content first; False if none is read."""
        return False

    def decode(self, source: Source) -> Calibration:
        """Calibration in a file of the format.

        Raises
        ------
        ValueError, TypeError, LookupError, ArithmeticError
            If the file is damaged; the text says what is wrong with it.
        """
        msg = f"{source.path}: {self.title} is only written, not read"
        raise ParameterError(msg)

    @property
    def is_written(self) -> bool:
        """Whether there is a writer."""
        return type(self).encode is not AbstractFormat.encode

    @property
    def is_read(self) -> bool:
        """Whether there is a reader."""
        return type(self).decode is not AbstractFormat.decode


FORMATS: Registry[AbstractFormat] = Registry("format")
"""Formats by the name that users give them."""


def register_format(each: AbstractFormat) -> None:
    """Add a format."""
    FORMATS.register(each.name, each)
