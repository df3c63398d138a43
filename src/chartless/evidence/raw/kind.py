"""Raw files beside the pictures that the camera made of the same shots."""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.curves import AbstractCurve
from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.kind import AbstractKind, Declined, Inputs, Proposal
from chartless.evidence.raw.account import NAME, account_of_raw
from chartless.evidence.raw.channel import RawPairs
from chartless.evidence.raw.gather import RawEvidence, raw_evidence
from chartless.evidence.raw.options import Options
from chartless.evidence.raw.screening import screen_raw
from chartless.evidence.reader import Item, Reader
from chartless.flags import Flag
from chartless.frames.frame import Frame, RawPicture
from chartless.result.account import Account
from chartless.types import JsonObject

_MOST_LEVELS = 256


@final
class Raw(AbstractKind[Options, RawEvidence]):
    """Levels of pictures, compared with the light of their raw files."""

    name: ClassVar[str] = NAME
    title: ClassVar[str] = "raw files beside their pictures"
    options = Options
    holds = RawPairs

    @override
    def proposed(self, inputs: Inputs, options: Options) -> Proposal | Declined:
        if not options.raw:
            reason = "no raw files were given"
            return Declined(self.name, reason, "give those of the pictures as `raw`")
        n_shots = len(_paired(inputs.items, options.raw))
        sentence = "a raw file beside its picture"
        if n_shots > 1:
            sentence = f"{n_shots} raw files beside their pictures"
        return Proposal(self.name, sentence, (tuple(range(n_shots)),))

    @override
    def gathered(
        self, inputs: Inputs, proposal: Proposal, options: Options, reader: Reader
    ) -> RawEvidence:
        pairs = _paired(inputs.items, options.raw)
        on_shot = reader.counting("reading raw files", len(pairs))

        def shots() -> Iterator[tuple[RawPicture, Frame]]:
            for picture, original in pairs:
                yield reader.raw_picture(original), reader.picture(picture)
                on_shot(picture)

        return raw_evidence(
            shots(),
            channels=reader.channels,
            n_levels=min(reader.levels, _MOST_LEVELS),
            mask=reader.mask,
        )

    @override
    def screened(self, evidence: RawEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        return screen_raw(evidence)

    @override
    def from_version_1(
        self, entry: JsonObject, channel: str, curve: AbstractCurve, n_levels: int
    ) -> Account | None:
        stored = entry.get("raw")
        if stored is None:
            return None
        red, green, blue = (float(weight) for weight in stored["matrix"])
        return account_of_raw(
            matrix=(red, green, blue),
            gains=tuple(float(gain) for gain in stored["gains"]),
            corner_gain=float(stored["corner_gain"]),
            scatter=float(stored["scatter"]),
        )


def _paired(
    items: Sequence[Item], raw: Sequence[str | os.PathLike[str]]
) -> list[tuple[Path, Path]]:
    """Match pictures with raw files by name; one of each always match."""
    paths = [Path(item) for item in items if not isinstance(item, np.ndarray)]
    if len(paths) < len(items) or any(isinstance(each, np.ndarray) for each in raw):
        msg = "pictures and raw files are matched by their names: give files, not arrays"
        raise ParameterError(msg)
    if len(paths) == len(raw) == 1:
        return [(paths[0], Path(raw[0]))]
    pictures, originals = _by_name(paths), _by_name([Path(each) for each in raw])
    for name, path in originals.items():
        if name not in pictures:
            msg = f"{path}: no picture has its name: give its JPEG, such as {path.stem}.JPG"
            raise UnfitFramesError(msg)
    for name, path in pictures.items():
        if name not in originals:
            msg = f"{path}: no raw file has its name: give it as `raw`, or omit the picture"
            raise UnfitFramesError(msg)
    return [(path, originals[name]) for name, path in pictures.items()]


def _by_name(paths: Sequence[Path]) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for path in paths:
        first = named.setdefault(path.stem.lower(), path)
        if first is not path:
            msg = (
                f"{first} and {path} have the same name, by which raw files are matched: rename one"
            )
            raise UnfitFramesError(msg)
    return named


KIND = Raw()
