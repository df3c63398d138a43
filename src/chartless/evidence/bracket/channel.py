"""Different exposures as evidence in one channel."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self, final

import numpy as np
from typing_extensions import override

from chartless.curves.prior import CurvePrior
from chartless.evidence.base import AbstractCurveEvidence, Guess, Judgement
from chartless.evidence.bracket.account import NAME
from chartless.evidence.bracket.judgement import (
    are_off,
    exposures_found,
    judged,
    least_exponent_error,
)
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.evidence.bracket.term import (
    EXPOSURES,
    ExposureTerm,
    noise_between_name,
    scatter_name,
)
from chartless.evidence.bracket.transfer import transfer_curve
from chartless.flags import Flag
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.noise_block import noise_name
from chartless.inference.term import AbstractTerm
from chartless.noise import AffineNoise
from chartless.types import Floats

LOSSY_ERROR = 0.05
"""Error of ln t below which exposures given for lossy files are kept as given."""
_QUIET_8BIT = (0.01, 0.5)  # noise at the start: brackets are taken at low ISO
_FIRST_SCATTER = 0.05  # wider than most, so that no row is out of reach at the start


@final
@dataclass(frozen=True, slots=True, eq=False)
class ExposurePairs(AbstractCurveEvidence):
    """Level pairs of different exposures.

    Lossy files determine exposures worse than a shutter does: ratios are 1 to 3 % off,
    with much smaller estimated errors (benchmarks/files.py, row exif). Exposures that
    are given are kept; their errors widen the band, and a disagreement with the files
    raises a flag (docs/design/0011-jpeg.md). Where level pairs of one exposure were
    needed to determine the exposures, these are kept as found, as such pairs give a
    wrong light at white.
    """

    kind: ClassVar[str] = NAME
    shows_shoulder: ClassVar[bool] = True

    counts: ExposureCounts
    exponent_error: float = 0.0
    """Deviation of ln γ from exposures that a first search settled."""
    noted: tuple[Flag, ...] = ()
    """Flags of that search about the exposures."""

    @property
    @override
    def n_levels(self) -> int:
        return self.counts.n_levels

    @property
    @override
    def observed_levels(self) -> tuple[int, int]:
        return self.counts.observed_levels

    @property
    @override
    def n_pixels(self) -> int:
        return self.counts.n_pixels

    @property
    @override
    def determines_exponent(self) -> bool:
        """Whether exposures are known; else the curve f is known up to a power f^γ."""
        return not self.counts.unknown

    @property
    @override
    def is_settled(self) -> bool:
        return self.counts.settled

    @override
    def guess(self, prior: CurvePrior) -> Guess:
        found = transfer_curve(self.counts, prior)
        return Guess(found.edges, {EXPOSURES: found.log_exposure_changes})

    @override
    def term(self, channel: str, *, noise_known: bool) -> ExposureTerm:
        return ExposureTerm(replace(self.counts, own_noise=noise_known), channel)

    @override
    def start(self, channel: str, edges: Floats) -> Values:
        quiet = AffineNoise.from_8bit(*_QUIET_8BIT)
        log_noise = np.log([quiet.slope, quiet.floor])
        return {
            noise_name(channel): log_noise,
            noise_between_name(channel): log_noise,
            scatter_name(channel): np.log([_FIRST_SCATTER]),
        }

    @override
    def settled_by(self, found: ChannelMode, *, noise_known: bool) -> Self:
        counts = self.counts
        if counts.settled:
            return self
        log_exposures, error = exposures_found(counts, found)
        noted = (Flag.EXPOSURES_OFF,) if are_off(counts, log_exposures) else ()
        if counts.lossy and counts.exposure_error < LOSSY_ERROR:
            return replace(self, counts=replace(counts, held=True), noted=noted)
        error = float(np.hypot(error, least_exponent_error(counts, noise_known=noise_known)))
        return replace(
            self, counts=counts.held_at(log_exposures), exponent_error=error, noted=noted
        )

    @override
    def judged(self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm) -> Judgement:
        assert isinstance(term, ExposureTerm)
        error = self.exponent_error
        judgement = judged(estimate, found, term.counts, exponent_error=error, noted=self.noted)
        return judgement._replace(estimate=judgement.estimate.with_exponent_error(error))
