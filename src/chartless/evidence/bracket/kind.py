"""Brackets: exposures of one still scene."""

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

from typing_extensions import override

from chartless.curves import AbstractCurve
from chartless.errors import UnfitFramesError
from chartless.evidence.bracket.account import (
    NAME,
    SeenTransfers,
    account_of_bracket,
    exposure_table,
)
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.gather import BracketEvidence, bracket_evidence
from chartless.evidence.bracket.options import Options
from chartless.evidence.bracket.screening import exposure_rows, screen_bracket
from chartless.evidence.kind import AbstractKind, Declined, Figure, Inputs, Proposal
from chartless.evidence.reader import Reader, unread_source
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.result.account import Account, Table
from chartless.result.response import Response
from chartless.types import JsonObject


@final
class Bracket(AbstractKind[Options, BracketEvidence]):
    """Levels of different exposures, compared pixel by pixel."""

    name: ClassVar[str] = NAME
    title: ClassVar[str] = "exposures of one scene"
    options = Options
    holds = ExposurePairs
    uses: ClassVar[frozenset[str]] = frozenset({"times", "time_error"})

    @override
    def proposed(self, inputs: Inputs, options: Options) -> Proposal | Declined:
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
        self, inputs: Inputs, proposal: Proposal, options: Options, reader: Reader
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
    def tables(
        self, evidence: BracketEvidence, accounts: Mapping[str, Account]
    ) -> tuple[Table, ...]:
        return exposure_table(exposure_rows(evidence), accounts)

    @override
    def example(self, evidence: BracketEvidence) -> FrameSource:
        return evidence.sources[int(evidence.clipped.sum(axis=1).argmin())]

    @override
    def restored(self, content: JsonObject, n_levels: int) -> SeenTransfers:
        return SeenTransfers.from_json(content, n_levels)

    @override
    def figures(self, channels: Sequence[Response]) -> Sequence[Figure]:
        from chartless.evidence.bracket.figures import figures

        return figures(channels)

    @override
    def from_version_1(
        self, entry: JsonObject, channel: str, curve: AbstractCurve, n_levels: int
    ) -> Account | None:
        stored = entry.get("exposures")
        if stored is None:
            return None
        return account_of_bracket(
            channel,
            curve,
            exposures=[float(value) for value in stored["relative"]],
            exponent_error=float(stored["exponent_error"]),
            scatter=float(stored["scatter"]),
            transfers=SeenTransfers.from_json(stored, n_levels),
        )

    @override
    def tables_from_version_1(
        self, provenance: JsonObject, channels: Sequence[Response]
    ) -> tuple[Table, ...]:
        accounts = {
            each.name: each.account(self.name) for each in channels if self.name in each.kinds
        }
        rows = provenance.get("exposures") or []
        for row in rows:
            _require_row(row)
        return exposure_table(rows, accounts)


def _require_row(row: JsonObject) -> None:
    """Raise ValueError if a row of exposures in version 1 of the file is damaged."""
    numbers = [row["relative"], row["black"], row["white"]]
    others = [row.get("overlap"), row.get("displacement")]
    numbers += [each for each in others if each is not None]
    if not isinstance(row["file"], str) or any(type(n) not in (int, float) for n in numbers):
        msg = "its exposures should each have file, relative, black, white"
        raise ValueError(msg)


def _require_rest(evidence: BracketEvidence, bloom_radius: int) -> None:
    """Refuse a bloom radius that leaves no pixel of an exposure."""
    counts = next(iter(evidence.histograms.values())).sum(axis=1)
    if bloom_radius and not counts.all():
        msg = (
            f"{evidence.sources[int(counts.argmin())].path}: all pixels are within bloom_radius, "
            f"{bloom_radius} pixels, of saturated ones: choose a smaller radius, or omit this "
            "exposure"
        )
        raise UnfitFramesError(msg)


KIND = Bracket()
