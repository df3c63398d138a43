"""Raw files as evidence in one channel."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

from typing_extensions import override

from chartless.evidence.base import AbstractCurveEvidence, Judgement
from chartless.evidence.raw.account import NAME
from chartless.evidence.raw.blocks import RawBlocks
from chartless.evidence.raw.judgement import judged
from chartless.evidence.raw.likelihood import RawModel
from chartless.evidence.raw.term import RawTerm, raw_name
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.term import AbstractTerm
from chartless.types import Floats


@final
@dataclass(frozen=True, eq=False)
class RawPairs(AbstractCurveEvidence):
    """Light of raw files and levels of their JPEGs."""

    kind: ClassVar[str] = NAME
    compares_families: ClassVar[bool] = False

    blocks: RawBlocks

    @cached_property
    def _model(self) -> RawModel:
        return RawModel(self.blocks)

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
        return RawTerm(self._model, channel)

    @override
    def start(self, channel: str, edges: Floats) -> Values:
        return {raw_name(channel): self._model.start(edges)}

    @override
    def judged(self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm) -> Judgement:
        assert isinstance(term, RawTerm)
        return judged(estimate, found, term)
