"""What users may choose about a kind of evidence, described once for all who ask them.

The library takes options by name, the command line as flags, the page as ticks; results keep those
that are not as usual. The command line reads them before it loads NumPy, so nothing heavy is
imported here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from chartless.evidence import FOLDERS


class Option(NamedTuple):
    """How a field of the options of a kind is asked for."""

    form: Literal["file", "files", "flag", "count"]
    help: str
    """Sentence for the command line."""
    flag: str = ""
    """Name on the command line, if it is not that of the field."""
    page: str = ""
    """Text of a tick on the page; empty if the page does not ask."""


@dataclass(frozen=True, slots=True)
class Asked:
    """An option with its kind and its default."""

    kind: str
    name: str
    default: Any
    option: Option

    @property
    def flag(self) -> str:
        """Name on the command line, without dashes before it."""
        return self.option.flag or self.name.replace("_", "-")


def option(default: object, asked: Option) -> Any:  # noqa: ANN401 - a field of any type
    """Field of a dataclass of options."""
    return field(default=default, metadata={"option": asked})


def options_of(kind: str) -> type[Any]:
    """Dataclass of the options of a kind."""
    found: type[Any] = import_module(f"chartless.evidence.{kind}.options").Options
    return found


def all_options() -> Mapping[str, Asked]:
    """Options of all kinds by name."""
    return MappingProxyType(
        {
            each.name: Asked(kind, each.name, each.default, each.metadata["option"])
            for kind in FOLDERS
            for each in fields(options_of(kind))
        }
    )
