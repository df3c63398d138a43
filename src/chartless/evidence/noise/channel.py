"""What noise tells of one channel."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

from typing_extensions import override

from chartless.evidence.base import AbstractChannelEvidence
from chartless.evidence.noise.account import NAME
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.outliers import Cleaned, without_outliers
from chartless.types import Counts


@final
@dataclass(frozen=True, eq=False)
class LevelPairs(AbstractChannelEvidence):
    """Level pairs of frames of one exposure."""

    kind: ClassVar[str] = NAME

    table: Cooccurrence
    n_frames: int = 2
    """Frames that the table was counted from, each compared with the next."""
    dark: Counts | None = None
    """How often each level occurs in frames taken with the lens covered, shape (L,)."""

    @cached_property
    def still(self) -> Cleaned:
        """The table without what moved."""
        return without_outliers(self.table)

    @property
    @override
    def n_levels(self) -> int:
        return self.table.n_levels

    @property
    @override
    def observed_levels(self) -> tuple[int, int]:
        return self.table.observed_levels

    @property
    @override
    def n_pixels(self) -> int:
        return self.table.n_pairs


def independent_share(n_frames: int) -> float:
    """How much a pair of consecutive frames tells, as a share of an independent pair.

    The mean square of M − 1 successive differences of M values has the variance
    (3M − 4)/(M − 1)² σ⁴, not 2/(M − 1) σ⁴ (von Neumann et al. 1941, doi:10.1214/aoms/1177731746):
    1 for two frames, two thirds for many.
    """
    return 2 * (n_frames - 1) / (3 * n_frames - 4)
