"""Noise as evidence in one channel."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

from typing_extensions import override

from chartless.evidence.base import AbstractChannelEvidence
from chartless.evidence.noise.account import NAME
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.doubt import table_errors
from chartless.evidence.noise.outliers import Cleaned, without_outliers
from chartless.evidence.trust import counts_as
from chartless.types import Counts


@final
@dataclass(frozen=True, eq=False)
class LevelPairs(AbstractChannelEvidence):
    """Level pairs of frames of one exposure."""

    kind: ClassVar[str] = NAME

    table: Cooccurrence
    n_frames: int = 2
    """Number of frames that were counted, each compared with the next."""
    dark: Counts | None = None
    """Counts of each level in frames taken with the lens covered, shape (L,)."""
    frame_errors: tuple[float, ...] = ()
    """Relative errors of the noise variance by what is wrong with the frames, see
    `chartless.evidence.noise.doubt.frame_errors`."""

    @cached_property
    def still(self) -> Cleaned:
        """Table without outliers."""
        return without_outliers(self.table)

    @cached_property
    def counts_as(self) -> float:
        """Largest number of independent pairs that they count as."""
        of_table = table_errors(self.still.table, processed=bool(self.frame_errors))
        return counts_as((*self.frame_errors, *of_table))

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
    """Information in a pair of consecutive frames relative to an independent pair.

    The mean square of M − 1 successive differences of M values has the variance
    (3M − 4)/(M − 1)² σ⁴, not 2/(M − 1) σ⁴ (von Neumann et al. 1941, doi:10.1214/aoms/1177731746):
    1 for two frames, two thirds for many.
    """
    return 2 * (n_frames - 1) / (3 * n_frames - 4)
