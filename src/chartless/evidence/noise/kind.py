"""Noise: frames of one still scene and one exposure."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce
from pathlib import Path
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError
from chartless.evidence.kind import AbstractKind, Declined, Figure, Inputs, Proposal
from chartless.evidence.noise.account import NAME, account_of_pairs
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.gather import NoiseEvidence, dark_histograms, joined, noise_evidence
from chartless.evidence.noise.misfit import Pattern
from chartless.evidence.noise.options import Options
from chartless.evidence.noise.screening import screen
from chartless.evidence.noise.still import ENOUGH, still_evidence
from chartless.evidence.reader import Item, Reader, digest_of, is_video
from chartless.flags import Flag
from chartless.result.account import Account
from chartless.result.response import Response
from chartless.types import JsonObject

_READING = "reading frames"
_LARGEST_ERROR = 1e6  # of irradiance: any larger is damage


@final
class Noise(AbstractKind[Options, NoiseEvidence]):
    """Noise of frames, each compared with the next."""

    name: ClassVar[str] = NAME
    title: ClassVar[str] = "noise of repeated frames"
    options = Options
    holds = LevelPairs
    uses: ClassVar[frozenset[str]] = frozenset({"times", "jobs", "scheduler"})

    @override
    def proposed(self, inputs: Inputs, options: Options) -> Proposal | Declined:
        everything = (tuple(range(len(inputs.items))),)
        if len(inputs.items) < 2 and not any(map(is_video, inputs.items)):  # noqa: PLR2004 - a pair
            given = f"only {inputs.names[0]}" if inputs.items else "none"
            reason = f"noise needs two or more frames of one still scene, {given} was given"
            return Declined(self.name, reason, "photograph it again with the same settings")
        if inputs.asked and "bracket" not in inputs.asked and self.name in inputs.asked:
            if inputs.times_given:
                msg = (
                    "noise is measured between frames of one exposure: omit `times` or "
                    "`evidence='noise'`"
                )
                raise ParameterError(msg)
            return Proposal(self.name, "noise, as requested", everything)
        exposures = inputs.exposures
        if exposures is None:
            reason = "noise (the files record no exposure settings)"
            return Proposal(self.name, reason, everything, sure=False)
        if len(exposures.groups) == 1:
            reason = f"noise (all frames have one exposure by {exposures.source})"
            return Proposal(self.name, reason, everything, sure=False)
        repeated = exposures.repeated
        if not repeated:
            reason = "no exposure is repeated, so there is no noise to measure"
            return Declined(self.name, reason, "repeat one, or use `evidence='bracket'`")
        n_repeated = len(repeated)
        sentence = f"noise of {n_repeated} repeated exposure{'s' * (n_repeated != 1)}"
        return Proposal(self.name, sentence, repeated, sure=inputs.sure_of("bracket"))

    @override
    def gathered(
        self, inputs: Inputs, proposal: Proposal, options: Options, reader: Reader
    ) -> NoiseEvidence:
        parts = [_noise(inputs.items, group, reader) for group in proposal.groups]
        evidence = reduce(partial(joined, continued=False), parts)
        if not options.dark:
            return evidence
        histograms = dark_histograms(
            reader.still_frames(options.dark, ENOUGH),
            evidence.channels,
            reader.channels,
            evidence.n_levels,
        )
        return replace(evidence, dark=histograms)

    @override
    def screened(self, evidence: NoiseEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        flags = screen(evidence.tables, evidence.checks, covering=alone, lossy=evidence.lossy)
        if alone:
            return flags
        # Levels that repeats do not cover are covered by other evidence.
        return {
            name: tuple(flag for flag in own if flag is not Flag.LEVELS_UNSEEN)
            for name, own in flags.items()
        }

    @override
    def remarks(self, evidence: NoiseEvidence, *, alone: bool) -> list[str]:
        """Remark on the limited accuracy of noise for raw files."""
        files = [source.path for source in evidence.sources if source.path.suffix]
        if not alone or not files:  # arrays have no suffix
            return []
        from chartless.images import is_raw

        if not any(map(is_raw, files)):
            return []
        text = (
            "noise determines to about 0.02 whether raw files are linear, exposures of one "
            "scene to 0.003"
        )
        return [text]

    @override
    def restored(self, content: JsonObject, n_levels: int) -> Cooccurrence:
        return Cooccurrence.from_json(content, n_levels)

    @override
    def figures(self, channels: Sequence[Response]) -> Sequence[Figure]:
        from chartless.evidence.noise.figures import figures

        return figures(channels)

    @override
    def from_version_1(
        self, entry: JsonObject, channel: str, curve: AbstractCurve, n_levels: int
    ) -> Account | None:
        deviance, similarity, outliers, pattern, table = (
            entry.get(key)
            for key in ("deviance", "similarity", "outliers", "pattern", "cooccurrence")
        )
        if all(each is None for each in (deviance, similarity, outliers, table)):
            return None
        return account_of_pairs(
            None if table is None else Cooccurrence.from_json(table, n_levels),
            deviance=None if deviance is None else float(deviance),
            similarity=None if similarity is None else float(similarity),
            outliers=None if outliers is None else float(outliers),
            pattern=None if pattern is None else Pattern.from_code(pattern),
            errors_by_dark=_errors_by_dark(entry, n_levels),
        )


def _errors_by_dark(entry: JsonObject, n_levels: int) -> tuple[float, float] | None:
    """Errors without and with dark frames in file version 1, which has each level's."""
    stds = [entry.get(name) for name in ("inverse_lut_std", "inverse_lut_std_with_dark")]
    if None in stds:
        return None
    values = np.array(stds, dtype=np.float64)
    if values.shape != (2, n_levels) or not np.all((values >= 0) & (values <= _LARGEST_ERROR)):
        msg = f"inverse_lut_std_with_dark should be {n_levels} errors of irradiance, 0 and above"
        raise ValueError(msg)
    now, then = np.sqrt(np.mean(values**2, axis=1))
    return float(now), float(then)


def _noise(given: Sequence[Item], places: Sequence[int], reader: Reader) -> NoiseEvidence:
    """Count the level pairs of files and arrays, in this process or in several."""
    items = [given[place] for place in places]
    several = reader.jobs > 1 or reader.scheduler is not None
    if is_video(items[0]):
        path = Path(items[0])
        if several:
            msg = f"{path} is a video, which only one process can read: omit `jobs` and `scheduler`"
            raise ParameterError(msg)
        with reader.video(path) as video:
            return still_evidence(
                video,
                n_levels=reader.n_levels,
                sha256=digest_of(path),
                on_frame=reader.counting(_READING, ENOUGH),
                channels=reader.channels,
                mask=reader.mask,
            )
    if not several:
        on_frame = reader.counting(_READING, len(items))
        frames = reader.frames(items, [place + 1 for place in places])
        return noise_evidence(
            frames,
            n_levels=reader.levels,
            on_frame=on_frame,
            channels=reader.channels,
            mask=reader.mask,
        )
    paths = [item for item in items if not isinstance(item, np.ndarray)]
    if len(paths) < len(items):
        msg = "only files can be read by several processes: use jobs=1 for arrays"
        raise ParameterError(msg)
    from chartless.evidence.noise.accumulate import noise_evidence_of_files

    return noise_evidence_of_files(
        paths,
        n_levels=reader.levels,
        jobs=reader.jobs,
        scheduler=reader.scheduler,
        on_chunk=lambda done, total: reader.report(_READING, done / total),
        channels=reader.channels,
        mask=reader.mask,
    )


KIND = Noise()
