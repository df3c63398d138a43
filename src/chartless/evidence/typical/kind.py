"""The typical curve of digital cameras, for pictures without evidence."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.evidence.kind import AbstractKind, Declined, Inputs, Proposal
from chartless.evidence.reader import Item, Reader, is_video
from chartless.evidence.typical.account import NAME
from chartless.evidence.typical.channel import LevelCounts
from chartless.evidence.typical.gather import TypicalEvidence, typical_evidence
from chartless.evidence.typical.options import Options
from chartless.flags import Flag


@final
class Typical(AbstractKind[Options, TypicalEvidence]):
    """One picture, or any pictures of one camera: what is known without evidence."""

    name: ClassVar[str] = NAME
    title: ClassVar[str] = "typical curve of digital cameras"
    options = Options
    holds = LevelCounts

    @override
    def proposed(self, inputs: Inputs, options: Options) -> Proposal | Declined:
        asked = self.name in inputs.asked
        if asked and len(inputs.asked) > 1:
            msg = f"{self.name} is what is known without evidence: ask for it alone"
            raise ParameterError(msg)
        reason = "the typical curve is for one picture without other evidence"
        advice = "ask for it with `evidence='typical'`"
        if not inputs.items:
            return Declined(self.name, "no picture was given", "give one")
        if any(map(is_video, inputs.items)):
            return Declined(self.name, "a video has evidence of its own", "omit `evidence`")
        if any(map(_is_raw, inputs.items)):
            reason = f"{inputs.names[0]} is a raw file, which records light as it is"
            return Declined(self.name, reason, "develop it, or give the picture beside it as well")
        if not asked and (len(inputs.items) > 1 or inputs.others or inputs.times_given):
            return Declined(self.name, reason, advice)
        everything = (tuple(range(len(inputs.items))),)
        number = "one picture" if len(inputs.items) == 1 else "pictures"
        return Proposal(self.name, f"the typical curve ({number}, no evidence)", everything)

    @override
    def gathered(
        self, inputs: Inputs, proposal: Proposal, options: Options, reader: Reader
    ) -> TypicalEvidence:
        return typical_evidence(
            reader.frames(inputs.items),
            n_levels=reader.levels,
            channels=reader.channels,
            mask=reader.mask,
            on_frame=reader.counting("reading pictures", len(inputs.items)),
        )

    @override
    def screened(self, evidence: TypicalEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        return dict.fromkeys(evidence.channels, ())


def _is_raw(item: Item) -> bool:
    if isinstance(item, np.ndarray):
        return False
    from chartless.images import is_raw

    return is_raw(Path(item))


KIND = Typical()
