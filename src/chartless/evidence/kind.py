"""What a folder of evidence registers: it proposes itself, gathers, and screens what it gathered.

What plans, reads, saves and shows knows the registry `chartless.evidence.registry.KINDS` and no
kind. To add one takes a folder with a module ``kind`` and a line there.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

from chartless.curves import AbstractCurve
from chartless.evidence.base import AbstractChannelEvidence, AbstractEvidence
from chartless.evidence.exposures import Exposures, Groups
from chartless.evidence.reader import Item, Reader
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.result.account import AbstractRecord, Account, Table
from chartless.result.response import Response
from chartless.types import JsonObject


@dataclass(frozen=True, slots=True)
class Inputs:
    """What is known of the frames before a pixel is read."""

    items: tuple[Item, ...]
    """Files and arrays, in their order."""
    names: tuple[Path, ...]
    """Of the frames, for messages."""
    exposures: Exposures | None
    """None if neither the user nor the files tell them."""
    times_given: bool = False
    """Whether they are the user's."""
    asked: frozenset[str] = frozenset()
    """Kinds that the user asked for by name; empty if those are to be taken that there are."""
    others: tuple["Proposal", ...] = ()
    """Proposals of the kinds that were asked before, in the order of the registry."""

    def sure_of(self, kind: str) -> bool:
        """Whether a kind that was asked before is sure of these frames."""
        return any(each.kind == kind and each.sure for each in self.others)


class Proposal(NamedTuple):
    """Evidence of one kind that frames hold."""

    kind: str
    sentence: str
    """What would be read, without a full stop."""
    groups: Groups
    """Numbers of the frames that would be read, divided as the kind needs them."""
    sure: bool = True
    """Whether it is taken unless others were asked for. What is not sure is taken only where
    nothing is."""

    @property
    def n_frames(self) -> int:
        """Frames that would be read."""
        return sum(map(len, self.groups))


class Declined(NamedTuple):
    """Why frames hold no evidence of a kind, and what would change that."""

    kind: str
    reason: str
    advice: str

    def __str__(self) -> str:
        return f"{self.reason}: {self.advice}"


class Figure(NamedTuple):
    """A figure that is still to be drawn, with its text."""

    name: str
    """For programs, unique within a report."""
    title: str
    draw: Callable[[Any], None]
    """Draws on Axes of matplotlib."""
    words: str
    """What it shows, in numbers."""


O = TypeVar("O")  # noqa: E741 - options
E = TypeVar("E", bound=AbstractEvidence)


class AbstractKind(ABC, Generic[O, E]):
    """One kind of evidence, with options of the type O."""

    name: ClassVar[str]
    """As users write it."""
    title: ClassVar[str]
    """In a few words, for tables."""
    holds: type[AbstractChannelEvidence]
    """What it has of a channel."""
    options: type[O]
    """Dataclass of what users may choose; `chartless.calibrate` takes its fields by name."""
    uses: ClassVar[frozenset[str]] = frozenset()
    """Which of the arguments of `chartless.calibrate` that are for some kinds it makes use of:
    "times", "time_error", "jobs" and "scheduler"."""

    @property
    def usual(self) -> dict[str, object]:
        """Options by name, with what each is unless a user chooses; () if it takes a list."""
        return {each.name: each.default for each in fields(self.options)}  # type: ignore[arg-type]

    @abstractmethod
    def proposed(self, inputs: Inputs, options: O) -> Proposal | Declined:
        """Say what these frames hold, by their settings and names alone.

        Raises
        ------
        ParameterError
            If an option has no meaning.
        """

    @abstractmethod
    def gathered(self, inputs: Inputs, proposal: Proposal, options: O, reader: Reader) -> E:
        """Read what was proposed.

        Raises
        ------
        ImageError, UnfitFramesError, ParameterError
            If files cannot be read, or do not hold what they seemed to.
        """

    @abstractmethod
    def screened(self, evidence: E, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        """Refuse evidence from which no curve can be estimated; flag what is doubtful of the rest.

        Parameters
        ----------
        evidence : AbstractEvidence
        alone : bool
            Whether there is no other kind.

        Returns
        -------
        mapping from channel names to tuples of Flag

        Raises
        ------
        UnfitFramesError
            With one sentence that says why and what to do.
        """

    def unread(self, inputs: Inputs, proposal: Proposal) -> Sequence[FrameSource]:
        """Frames that were given and are not read, if no other kind reads them."""
        del inputs, proposal
        return ()

    def remarks(self, evidence: E, *, alone: bool) -> list[str]:
        """Sentences for the user, without a full stop, that are no doubts."""
        del evidence, alone
        return []

    def tables(self, evidence: E, accounts: Mapping[str, Account]) -> tuple[Table, ...]:
        """What is worth looking at of each frame.

        Parameters
        ----------
        evidence : AbstractEvidence
        accounts : mapping from channels to Account
            What came out; empty where the method gives no account of this kind.
        """
        del evidence, accounts
        return ()

    def example(self, evidence: E) -> FrameSource | None:
        """Frame that shows most of the scene; None if there are no frames."""
        return evidence.sources[0]

    def restored(self, content: JsonObject, n_levels: int) -> AbstractRecord:
        """Record of an account, from what its `to_json` wrote.

        Raises
        ------
        TypeError, ValueError, LookupError
            If the content is damaged.
        """
        del content, n_levels
        msg = f"{self.name} keeps no records"
        raise ValueError(msg)

    def figures(self, channels: Sequence[Response]) -> Sequence[Figure]:
        """What there is to see of the evidence.

        Parameters
        ----------
        channels : sequence of Response
            All have an account of this kind.
        """
        del channels
        return ()

    def from_version_1(
        self, entry: JsonObject, channel: str, curve: AbstractCurve, n_levels: int
    ) -> Account | None:
        """Account in an entry of a channel in version 1 of the file; None if there is none.

        Raises
        ------
        TypeError, ValueError, LookupError
            If the content is damaged.
        """
        del entry, channel, curve, n_levels
        return None

    def tables_from_version_1(
        self, provenance: JsonObject, channels: Sequence[Response]
    ) -> tuple[Table, ...]:
        """Tables in the provenance of version 1 of the file.

        Raises
        ------
        TypeError, ValueError, LookupError
            If the content is damaged.
        """
        del provenance, channels
        return ()
