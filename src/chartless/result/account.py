"""What a kind of evidence says of itself, in values that explain themselves.

Files, reports and terminals show these without knowing the kind: names, limits and words travel
with the numbers.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

from typing_extensions import override

from chartless.errors import ParameterError
from chartless.types import JsonObject

Value: TypeAlias = float | str | tuple[float, ...]

_FORM = re.compile(r"|(\.\d)?[fg%]|file")
_FEW = 3  # numbers of a fact; of more, only the least and the largest are written


def require_form(form: str) -> str:
    """Return a form if it is one.

    Raises
    ------
    ParameterError
        If it is none of "", "file" and ``.Nf``, ``.Ng`` and ``.N%`` with one digit N.
    """
    if _FORM.fullmatch(form) is None:
        msg = f"form must be such as '.2f', '.4g' or '.1%', not {form!r}"
        raise ParameterError(msg)
    return form


def written(value: Value | None, form: str) -> str:
    """A value as people read it.

    Parameters
    ----------
    value : float, str, tuple of float or None
        None is unknown.
    form : str
        Format of a number, such as ``.1%``; ``.4g`` never becomes 1.023e+04. Of a path, "file".
    """
    if value is None:
        return ""
    if isinstance(value, tuple):
        if len(value) <= _FEW:
            return " ".join(written(each, form) for each in value)
        ends = dict.fromkeys(written(each, form) for each in (min(value), max(value)))
        return " to ".join(ends)  # or one, where all are alike
    if form == "file":
        return PurePath(str(value)).name
    if isinstance(value, str):
        return value
    text = format(value, form)
    return f"{float(text):g}" if form.endswith("g") else text


class Fact(NamedTuple):
    """A quantity that evidence determines besides the curve."""

    code: str
    """Name for programs, unique within an account."""
    label: str
    """Name for people."""
    value: Value
    form: str = ""
    """How numbers are written, see `written`."""

    @property
    def text(self) -> str:
        """The value for people."""
        return written(self.value, self.form)


class Fit(NamedTuple):
    """How well a curve explains the evidence, with limits that were measured for it."""

    code: str
    label: str
    value: float
    form: str = ".2f"
    good: float | None = None
    """Highest value that is good; None if no limit is known."""
    bad: float | None = None
    """Value above which the band does not hold where a misfit is flagged; None if unknown."""
    remark: str = ""
    """Sentence for a value above `good`, where no flag says it."""

    @property
    def text(self) -> str:
        """The value with its name."""
        return f"{self.code.replace('-', ' ')} {written(self.value, self.form)}"


class Column(NamedTuple):
    """A column of a table."""

    code: str
    label: str
    form: str = ""


class Table(NamedTuple):
    """What was measured of the frames, a row each."""

    code: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Value | None, ...], ...]
    """Values in the order of the columns; None where there is none."""

    @property
    def shown(self) -> tuple[tuple[Column, list[str]], ...]:
        """Columns that hold something, with their cells for people."""
        cells = [
            (column, [written(row[place], column.form) for row in self.rows])
            for place, column in enumerate(self.columns)
        ]
        return tuple((column, texts) for column, texts in cells if any(texts))


class AbstractRecord(ABC):
    """Evidence that is kept with a result, for figures and for estimating again."""

    @abstractmethod
    def to_json(self) -> JsonObject | None:
        """JSON types for the file; None if it would be too large."""

    def at_levels(self, n_levels: int) -> "AbstractRecord | None":
        """Return the same for frames of another number of levels; None if there is no such."""
        del n_levels
        return None


@dataclass(frozen=True, slots=True)
class UnknownRecord(AbstractRecord):
    """Record of a kind that is not registered here, kept as it was read."""

    content: JsonObject

    @override
    def to_json(self) -> JsonObject:
        return self.content


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Account:
    """What one kind of evidence says of one channel besides the curve."""

    kind: str
    """Name of the kind, as users write it."""
    facts: tuple[Fact, ...] = ()
    fits: tuple[Fit, ...] = ()
    """None where the method does not test how well the curve explains this evidence."""
    details: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """What a flag means here, by its code: a sentence without a full stop."""
    share: float | None = None
    """Share in the information of all kinds on the curve, 0 … 1; None if it was not measured."""
    record: AbstractRecord | None = None

    @property
    def values(self) -> dict[str, Value]:
        """Values of facts and fits by code."""
        facts = {fact.code: fact.value for fact in self.facts}
        return {**facts, **{fit.code: fit.value for fit in self.fits}}

    @property
    def is_unexplained(self) -> bool:
        """Whether a curve explains the evidence so badly that its band does not hold."""
        return any(fit.bad is not None and fit.value > fit.bad for fit in self.fits)

    def __getitem__(self, code: str) -> Any:  # noqa: ANN401 - a Value, which callers would narrow
        """Value of a fact or a fit; LookupError if there is none."""
        values = self.values
        if code not in values:
            msg = f"no {code!r} of {self.kind}; known: {', '.join(values) or 'nothing'}"
            raise LookupError(msg)
        return values[code]

    def __contains__(self, code: str) -> bool:
        """Whether there is a fact or a fit of this name."""
        return code in self.values

    def at_levels(self, n_levels: int) -> "Account":
        """Return the same for frames of another number of levels."""
        record = None if self.record is None else self.record.at_levels(n_levels)
        return replace(self, record=record)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Reading:
    """What was read of one kind of evidence for all channels."""

    kind: str
    title: str
    """The kind in a few words."""
    sentence: str
    """What was read, without a full stop."""
    inputs: tuple[int, ...] = ()
    """Numbers of the files in the provenance, from 0."""
    tables: tuple[Table, ...] = ()
    example: int | None = None
    """Number of the file that shows most of the scene; None if there is no picture."""
