"""Interfaces of evidence: all channels as read, and one channel as fitted.

Each kind of evidence is a folder. Frames are read into an `AbstractEvidence`, which
provides an `AbstractChannelEvidence` for each channel. That supplies a term of the
likelihood and, after the search, judges the result.
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
    """Own unknowns for this curve, by block."""


class Judgement(NamedTuple):
    """Result of a search for one kind of evidence in one channel."""

    estimate: CurveEstimate
    """Estimate, with bands that include the known unmodelled errors of this kind."""
    flags: tuple[Flag, ...]
    accounts: tuple[Account, ...]
    """Results of each kind besides the curve, at most one account of each."""


class AbstractChannelEvidence(ABC):
    """Counted evidence of one kind in one channel."""

    kind: ClassVar[str]
    """Name of the kind, as users write it."""
    constrains: ClassVar[bool] = True
    """Whether it constrains the curve; if not, the curve is that of the prior."""

    @property
    @abstractmethod
    def n_levels(self) -> int:
        """Number of levels L."""

    @property
    @abstractmethod
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level observed."""

    @property
    @abstractmethod
    def n_pixels(self) -> int:
        """Number of pixels, pixel pairs or blocks compared."""


class AbstractCurveEvidence(AbstractChannelEvidence):
    """Evidence that determines the curve without knowledge of the noise of frames."""

    compares_families: ClassVar[bool] = True
    """Whether the likelihood is the same for all families, whatever the fit of any
    one."""
    shows_shoulder: ClassVar[bool] = False
    """Whether all levels but the last are observed, so that the prior may allow hard
    shoulders."""

    @property
    def determines_exponent(self) -> bool:
        """Whether the evidence distinguishes a curve f from its powers f^γ."""
        return True

    @property
    def is_settled(self) -> bool:
        """Whether unknowns shared by channels need no first search."""
        return True

    def guess(self, prior: CurvePrior) -> Guess | None:
        """Return a first curve better than the mean of the prior, or None."""
        del prior
        return None

    @abstractmethod
    def term(self, channel: str, *, noise_known: bool) -> AbstractTerm:
        """Return the term of the likelihood.

        Parameters
        ----------
        channel : str
        noise_known : bool
            Whether the same search includes level pairs of one exposure, which
            determine the noise.
        """

    @abstractmethod
    def start(self, channel: str, edges: Floats) -> Values:
        """Return the own unknowns from which to start at a first curve, by block."""

    def settled_by(self, found: ChannelMode, *, noise_known: bool) -> Self:
        """Return the evidence updated by a first search of all channels, or itself.

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
        """Judge the result of a search.

        Parameters
        ----------
        estimate : CurveEstimate
        found : ChannelMode
        term : AbstractTerm
            Term of this evidence, as the search used it.
        """


E = TypeVar("E", bound=AbstractChannelEvidence)


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEvidence:
    """All evidence of one channel, at most one part of each kind."""

    channel: str
    parts: tuple[AbstractChannelEvidence, ...]

    def get(self, kind: type[E]) -> E | None:
        """Return the part of a kind, or None if there is none."""
        return next((part for part in self.parts if isinstance(part, kind)), None)

    def __getitem__(self, kind: type[E]) -> E:
        """Return the part of a kind that is known to exist."""
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
    """Evidence of one kind in all channels, as read."""

    sources: tuple[FrameSource, ...]
    """Files and arrays that were read."""
    bit_depth: int
    """Bit depth of the frames as read."""

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""

    @abstractmethod
    def channel(self, name: str) -> AbstractChannelEvidence:
        """Return the evidence of one channel."""


def by_channel(evidence: Sequence[AbstractEvidence]) -> dict[str, ChannelEvidence]:
    """Group the evidence of all kinds by channel."""
    return {
        name: ChannelEvidence(name, tuple(each.channel(name) for each in evidence))
        for name in evidence[0].channels
    }
