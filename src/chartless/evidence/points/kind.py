"""Measured points of the curve, from a table."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, final

from typing_extensions import override

from chartless._files.given import read_text
from chartless.errors import ParameterError
from chartless.evidence.kind import AbstractKind, Declined, Figure, Inputs, Proposal
from chartless.evidence.points.account import NAME, SeenPoints
from chartless.evidence.points.channel import MeasuredPoints
from chartless.evidence.points.gather import PointsEvidence, read_points
from chartless.evidence.points.options import Options
from chartless.evidence.points.screening import screen_points
from chartless.evidence.reader import Reader, digest_of
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.result.response import Response
from chartless.types import JsonObject


@final
class Points(AbstractKind[Options, PointsEvidence]):
    """Measured brightness of known irradiance."""

    name: ClassVar[str] = NAME
    title: ClassVar[str] = "measured points of the curve"
    options = Options
    holds = MeasuredPoints

    @override
    def proposed(self, inputs: Inputs, options: Options) -> Proposal | Declined:
        if options.points is None:
            if options.points_absolute:
                msg = "`points_absolute` describes `points`: give these as well"
                raise ParameterError(msg)
            return Declined(self.name, "no measured points were given", "give them as `points`")
        if not isinstance(options.points, str | os.PathLike):
            msg = f"`points` must be the name of a table, not {type(options.points).__name__}"
            raise ParameterError(msg)
        if not Path(options.points).is_file():
            read_text(options.points)  # raises with the reason
        unit = "" if options.points_absolute else ", up to a factor of irradiance"
        return Proposal(self.name, f"points of {Path(options.points).name}{unit}", ())

    @override
    def gathered(
        self, inputs: Inputs, proposal: Proposal, options: Options, reader: Reader
    ) -> PointsEvidence:
        assert options.points is not None
        path = Path(options.points)
        points = read_points(path)
        source = FrameSource(path, digest_of(path), ())
        return PointsEvidence(points, (source,), reader.levels, options.points_absolute)

    @override
    def screened(self, evidence: PointsEvidence, *, alone: bool) -> Mapping[str, tuple[Flag, ...]]:
        return screen_points(evidence, alone=alone)

    @override
    def example(self, evidence: PointsEvidence) -> None:
        return None

    @override
    def restored(self, content: JsonObject, n_levels: int) -> SeenPoints:
        return SeenPoints.from_json(content)

    @override
    def figures(self, channels: Sequence[Response]) -> Sequence[Figure]:
        from chartless.evidence.points.figures import figures

        return figures(channels)


KIND = Points()
