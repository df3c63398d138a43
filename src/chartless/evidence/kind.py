"""Interface of a kind of evidence: it proposes, gathers and screens evidence.

Code that plans, reads, saves or displays uses only the registry
`chartless.evidence.registry.KINDS` and names no kind. See `chartless.evidence` for how
to add one.
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
    """Information about the frames before a pixel is read."""

    items: tuple[Item, ...]
    """Files and arrays, in the order given."""
    names: tuple[Path, ...]
    """Names of the frames, for messages."""
    exposures: Exposures | None
    """Exposures; None if neither the user nor the files give them."""
    times_given: bool = False
    """Whether the user gave the exposures."""
    asked: frozenset[str] = frozenset()
    """Kinds requested by name; empty to use those available."""
    others: tuple["Proposal", ...] = ()
    """Proposals of the kinds considered before, in the order of the registry."""

    def sure_of(self, kind: str) -> bool:
        """Whether a kind considered before has a sure proposal."""
        return any(each.kind == kind and each.sure for each in self.others)


class Proposal(NamedTuple):
    """Evidence of one kind that frames hold."""

    kind: str
    sentence: str
    """Description of what would be read, without a full stop."""
    groups: Groups
    """Numbers of the frames that would be read, grouped as the kind needs them."""
    sure: bool = True
    """Whether it is used unless other kinds are requested. Proposals that are not sure
    are used only if none is."""

    @property
    def n_frames(self) -> int:
        """Number of frames that would be read."""
        return sum(map(len, self.groups))


class Declined(NamedTuple):
    """Reason why frames hold no evidence of a kind, and advice to change that."""

    kind: str
    reason: str
    advice: str

    def __str__(self) -> str:
        return f"{self.reason}: {self.advice}"


class Figure(NamedTuple):
    """A figure to be drawn, with its description."""

    name: str
    """Identifier, unique within a report."""
    title: str
    draw: Callable[[Any], None]
    """Function that draws on Matplotlib Axes."""
    words: str
    """Description of what it shows, with numbers."""


O = TypeVar("O")  # noqa: E741 - options
E = TypeVar("E", bound=AbstractEvidence)


class AbstractKind(ABC, Generic[O, E]):
    """One kind of evidence, with options of the type O."""

    name: ClassVar[str]
    """Name of the kind, as users write it."""
    title: ClassVar[str]
    """Short title, for tables."""
    holds: type[AbstractChannelEvidence]
    """Class of the evidence of one channel."""
    options: type[O]
    """Dataclass of the options; `chartless.calibrate` takes its fields by name."""
    uses: ClassVar[frozenset[str]] = frozenset()
    """Optional arguments of `chartless.calibrate` that the kind uses: any of "times",
    "time_error", "jobs" and "scheduler"."""

    @property
    def usual(self) -> dict[str, object]:
        """Default values of the options by name; () for options that take a list."""
        return {each.name: each.default for each in fields(self.options)}  # type: ignore[arg-type]

    @abstractmethod
    def proposed(self, inputs: Inputs, options: O) -> Proposal | Declined:
        """Return what these frames hold, judged only by their settings and names.

        Raises
        ------
        ParameterError
            If an option is invalid.
        """

    @abstractmethod
    def gathered(self, inputs: Inputs, proposal: Proposal, options: O, reader: Reader) -> E:
        """Read the proposed evidence.

        Raises
        ------
        ImageError, UnfitFramesError, ParameterError
            If files cannot be read, or do not hold the proposed evidence.
        """

    @abstractmethod
    def screened(self, evidence: E, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        """Refuse evidence from which no curve can be estimated; flag what is doubtful.

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
            If no curve can be estimated; the message says why and what to do.
        """

    def unread(self, inputs: Inputs, proposal: Proposal) -> Sequence[FrameSource]:
        """Return frames that are given but not read, if no other kind reads them."""
        del inputs, proposal
        return ()

    def remarks(self, evidence: E, *, alone: bool) -> list[str]:
        """Return remarks for the user that are not doubts, without a full stop."""
        del evidence, alone
        return []

    def tables(self, evidence: E, accounts: Mapping[str, Account]) -> tuple[Table, ...]:
        """Return tables of what is worth inspecting in each frame.

        Parameters
        ----------
        evidence : AbstractEvidence
        accounts : mapping from channels to Account
            Results; empty where the method gives no account of this kind.
        """
        del evidence, accounts
        return ()

    def example(self, evidence: E) -> FrameSource | None:
        """Return the frame that shows most of the scene, or None without frames."""
        return evidence.sources[0]

    def restored(self, content: JsonObject, n_levels: int) -> AbstractRecord:
        """Return the record of an account from the output of its `to_json`.

        Raises
        ------
        TypeError, ValueError, LookupError
            If the content is damaged.
        """
        del content, n_levels
        msg = f"{self.name} keeps no records"
        raise ValueError(msg)

    def figures(self, channels: Sequence[Response]) -> Sequence[Figure]:
        """Return figures of the evidence.

        Parameters
        ----------
        channels : sequence of Response
            Channels, all with an account of this kind.
        """
        del channels
        return ()

    def from_version_1(
        self, entry: JsonObject, channel: str, curve: AbstractCurve, n_levels: int
    ) -> Account | None:
        """Return the account in a channel entry of file version 1, or None.

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
        """Return the tables in the provenance of file version 1.

        Raises
        ------
        TypeError, ValueError, LookupError
            If the content is damaged.
        """
        del provenance, channels
        return ()
