"""Brackets: exposures of one still scene."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, final

from typing_extensions import override

from chartless.errors import UnfitFramesError
from chartless.evidence._kind import AbstractKind, Declined, Inputs, Proposal
from chartless.evidence.bracket.gather import BracketEvidence, bracket_evidence
from chartless.evidence.bracket.screening import exposure_rows, screen_bracket
from chartless.evidence.reader import Reader, unread_source
from chartless.flags import Flag
from chartless.frames.frame import FrameSource


@dataclass(frozen=True, slots=True)
class BracketOptions:
    """What users may choose.

    Parameters
    ----------
    aligned : bool
        Whether a pixel sees the same spot in all exposures; if not, their histograms are matched.
    bloom_radius : int
        Pixels around saturated ones that are left out of an exposure.
    """

    aligned: bool = True
    bloom_radius: int = 0


@final
class Bracket(AbstractKind[BracketOptions, BracketEvidence]):
    """Levels of different exposures, compared pixel by pixel."""

    name: ClassVar[str] = "bracket"
    title: ClassVar[str] = "exposures of one scene"
    options = BracketOptions
    uses: ClassVar[frozenset[str]] = frozenset({"times", "time_error"})

    @override
    def proposed(self, inputs: Inputs, options: BracketOptions) -> Proposal | Declined:
        exposures = inputs.exposures
        if exposures is None and not inputs.items:
            return Declined(self.name, "no frames were given", "give exposures of one still scene")
        if exposures is None:
            reason = "the files record no exposure settings"
            advice = "give `times`, such as `times=[1, 2, 4]`, or `times='unknown'`"
            return Declined(self.name, reason, advice)
        if len(exposures.groups) < 2:  # noqa: PLR2004 - a bracket
            reason = "a bracket needs two or more frames of one scene at different exposures"
            advice = "give them, or `evidence='noise'` for frames of one exposure"
            return Declined(self.name, reason, advice)
        # Pictures that have raw files may show different scenes.
        sure = inputs.times_given or not inputs.sure_of("raw")
        return Proposal(self.name, str(exposures), exposures.groups, sure=sure)

    @override
    def gathered(
        self, inputs: Inputs, proposal: Proposal, options: BracketOptions, reader: Reader
    ) -> BracketEvidence:
        assert inputs.exposures is not None
        places = [group[0] for group in proposal.groups]
        first = [inputs.items[place] for place in places]
        evidence = bracket_evidence(
            reader.frames(first, [place + 1 for place in places]),
            inputs.exposures.log_exposures,
            exposure_error=inputs.exposures.error,
            channels=reader.channels,
            n_levels=reader.levels,
            mask=reader.mask,
            bloom_radius=options.bloom_radius,
            aligned=options.aligned,
            on_frame=reader.counting("reading exposures", len(first)),
        )
        _require_rest(evidence, options.bloom_radius)
        return evidence

    @override
    def screened(self, evidence: BracketEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        return screen_bracket(evidence)

    @override
    def unread(self, inputs: Inputs, proposal: Proposal) -> Sequence[FrameSource]:
        repeats = [place for group in proposal.groups for place in group[1:]]
        return [unread_source(inputs.items[place], place) for place in repeats]

    @override
    def provenance(self, evidence: BracketEvidence) -> Mapping[str, Any]:
        return {"exposures": exposure_rows(evidence)}


def _require_rest(evidence: BracketEvidence, bloom_radius: int) -> None:
    """Refuse a radius of bloom that takes away all of an exposure."""
    counts = next(iter(evidence.histograms.values())).sum(axis=1)
    if bloom_radius and not counts.all():
        msg = (
            f"{evidence.sources[int(counts.argmin())].path}: all pixels are within bloom_radius, "
            f"{bloom_radius} pixels, of saturated ones: choose a smaller radius, or omit this "
            "exposure"
        )
        raise UnfitFramesError(msg)
