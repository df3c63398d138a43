"""Options of the kinds of evidence, described once for all interfaces.

The library takes options by name, the command line as flags, the page as check boxes;
results keep those that differ from the defaults. The command line reads them before it
loads NumPy, so nothing heavy is imported here.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from chartless.evidence import FOLDERS


class Option(NamedTuple):
    """Description of an option for the command line and the page."""

    form: Literal["file", "files", "flag", "count"]
    help: str
    """Help text on the command line."""
    flag: str = ""
    """Name on the command line, if it differs from that of the field."""
    page: str = ""
    """Label of the check box on the page; empty if the page does not offer it."""


@dataclass(frozen=True, slots=True)
class Asked:
    """An option with its kind and its default."""

    kind: str
    name: str
    default: Any
    option: Option

    @property
    def flag(self) -> str:
        """Name on the command line, without leading dashes."""
        return self.option.flag or self.name.replace("_", "-")


def option(default: object, asked: Option) -> Any:  # noqa: ANN401 - a field of any type
    """Return a field of a dataclass of options."""
    return field(default=default, metadata={"option": asked})


def options_of(kind: str) -> type[Any]:
    """Return the dataclass of the options of a kind."""
    found: type[Any] = import_module(f"chartless.evidence.{kind}.options").Options
    return found


def all_options() -> Mapping[str, Asked]:
    """Return the options of all kinds by name."""
    return MappingProxyType(
        {
            each.name: Asked(kind, each.name, each.default, each.metadata["option"])
            for kind in FOLDERS
            for each in fields(options_of(kind))
        }
    )
