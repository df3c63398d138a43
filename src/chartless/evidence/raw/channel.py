"""What raw files tell of one channel."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.evidence._base import AbstractCurveEvidence, Judgement
from chartless.evidence.raw.blocks import RawBlocks
from chartless.evidence.raw.findings import RawEstimate
from chartless.evidence.raw.term import RawModel, RawTerm, raw_name
from chartless.flags import Flag
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.term import AbstractTerm
from chartless.types import Floats

_MUCH_SCATTER = 0.06  # relative, of greys


@final
@dataclass(frozen=True, slots=True, eq=False)
class RawPairs(AbstractCurveEvidence):
    """Light of raw files beside the levels of their JPEGs."""

    kind: ClassVar[str] = "raw"

    blocks: RawBlocks

    @property
    @override
    def n_levels(self) -> int:
        return self.blocks.n_levels

    @property
    @override
    def observed_levels(self) -> tuple[int, int]:
        return self.blocks.observed_levels

    @property
    @override
    def n_pixels(self) -> int:
        return self.blocks.level.size

    @override
    def term(self, channel: str, *, noise_known: bool) -> RawTerm:
        del noise_known
        return RawTerm(RawModel(self.blocks), channel)

    @override
    def start(self, channel: str, edges: Floats) -> Values:
        return {raw_name(channel): RawModel(self.blocks).start(edges)}

    @override
    def judged(
        self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm, *, alone: bool
    ) -> Judgement:
        del alone
        assert isinstance(term, RawTerm)
        own, model = found.mode.values[raw_name(found.channel)], term.model
        red, green, blue = model.matrix(own)
        log_gains = own[model.gains]
        told = RawEstimate(
            matrix=(float(red), float(green), float(blue)),
            gains=tuple(map(float, np.exp(log_gains - log_gains[0]))),
            corner_gain=float(np.exp(own[model.falloff].sum())),
            scatter=term.scatter,
        )
        flags = (Flag.UNEVEN_TONES,) if term.scatter > _MUCH_SCATTER else ()
        return Judgement(estimate, flags, {"raw": told})
