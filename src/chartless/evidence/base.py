"""What every kind of evidence promises: of all channels as it is read, and of one as it is fitted.

A kind of evidence is a folder. Frames are read into an `AbstractEvidence`, which hands out what it
has of each channel, an `AbstractChannelEvidence`. That gives a term of the likelihood and, after
the search, says what the search means for it.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self, TypeVar

from chartless.curves.prior import CurvePrior
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.term import AbstractTerm
from chartless.result.account import Account
from chartless.types import Floats


class Guess(NamedTuple):
    """A first curve."""

    edges: Floats
    """Shape (L − 1,)."""
    values: Values
    """Own unknowns that go with it, by block."""


class Judgement(NamedTuple):
    """What a search means for one kind of evidence in one channel."""

    estimate: CurveEstimate
    """With bands that hold what this kind is known to leave out."""
    flags: tuple[Flag, ...]
    accounts: tuple[Account, ...]
    """What each kind says besides the curve, at most one of each."""


class AbstractChannelEvidence(ABC):
    """Evidence of one kind in one channel, counted."""

    kind: ClassVar[str]
    """Name of the kind, as users write it."""

    @property
    @abstractmethod
    def n_levels(self) -> int:
        """L."""

    @property
    @abstractmethod
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level seen."""

    @property
    @abstractmethod
    def n_pixels(self) -> int:
        """Pixels, pairs of them or blocks that were compared."""


class AbstractCurveEvidence(AbstractChannelEvidence):
    """Evidence that determines the curve without knowledge of the noise of frames."""

    compares_families: ClassVar[bool] = True
    """Whether its likelihood is the same for all families, not weighted by how one of them fits."""
    shows_shoulder: ClassVar[bool] = False
    """Whether it shows all levels but the last, so that the prior may let shoulders be hard."""

    @property
    def tells_exponent(self) -> bool:
        """Whether it distinguishes a curve f from its powers f^γ."""
        return True

    @property
    def is_settled(self) -> bool:
        """Whether no first search is needed to settle what channels share."""
        return True

    def guess(self, prior: CurvePrior) -> Guess | None:
        """Return a first curve that is better than the mean of the prior; None if there is none."""
        del prior
        return None

    @abstractmethod
    def term(self, channel: str, *, noise_known: bool) -> AbstractTerm:
        """Term of the likelihood.

        Parameters
        ----------
        channel : str
        noise_known : bool
            Whether the same search has level pairs of one exposure, which determine the noise.
        """

    @abstractmethod
    def start(self, channel: str, edges: Floats) -> Values:
        """Own unknowns at which a search begins, by block, for a first curve."""

    def settled_by(self, found: ChannelMode, *, noise_known: bool) -> Self:
        """Return the evidence as a first search of all channels asks for; itself if it is the same.

        Parameters
        ----------
        found : ChannelMode
        noise_known : bool
            As for `term`.
        """
        del found, noise_known
        return self

    @abstractmethod
    def judged(self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm) -> Judgement:
        """Say what the search found.

        Parameters
        ----------
        estimate : CurveEstimate
        found : ChannelMode
        term : AbstractTerm
            That of this evidence, as the search used it.
        """


E = TypeVar("E", bound=AbstractChannelEvidence)


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEvidence:
    """All that there is of one channel, at most one part of each kind."""

    channel: str
    parts: tuple[AbstractChannelEvidence, ...]

    def get(self, kind: type[E]) -> E | None:
        """Part of a kind; None if there is none."""
        return next((part for part in self.parts if isinstance(part, kind)), None)

    def __getitem__(self, kind: type[E]) -> E:
        """Part of a kind that is known to be there."""
        found = self.get(kind)
        if found is None:
            msg = f"no {kind.__name__} of channel {self.channel}"
            raise LookupError(msg)
        return found

    @property
    def of_curve(self) -> tuple[AbstractCurveEvidence, ...]:
        """Parts that determine the curve without knowledge of the noise."""
        return tuple(part for part in self.parts if isinstance(part, AbstractCurveEvidence))


class AbstractEvidence(ABC):
    """Evidence of one kind in all channels, as it was read."""

    sources: tuple[FrameSource, ...]
    """Files and arrays that it is from."""
    bit_depth: int
    """Of the frames as read."""

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""

    @abstractmethod
    def channel(self, name: str) -> AbstractChannelEvidence:
        """Evidence of one channel."""


def by_channel(evidence: Sequence[AbstractEvidence]) -> dict[str, ChannelEvidence]:
    """What all kinds have of each channel."""
    return {
        name: ChannelEvidence(name, tuple(each.channel(name) for each in evidence))
        for name in evidence[0].channels
    }
