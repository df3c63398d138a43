"""Measured points as evidence in one channel."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.evidence.base import AbstractCurveEvidence, Judgement
from chartless.evidence.points.account import NAME
from chartless.evidence.points.judgement import judged
from chartless.evidence.points.likelihood import PointModel
from chartless.evidence.points.term import USUAL_SCATTER, PointTerm, points_name
from chartless.inference.block import Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.term import AbstractTerm
from chartless.types import Bools, Floats


@final
@dataclass(frozen=True, eq=False)
class MeasuredPoints(AbstractCurveEvidence):
    """Measured brightness at N points of known irradiance.

    Parameters
    ----------
    irradiance, brightness, std : ndarray, shape (N,)
        As in `chartless.evidence.points.gather.Point`.
    levels : int
        Number of levels L of the curve.
    absolute : bool
        Whether an irradiance of 1 is that of white.
    """

    kind: ClassVar[str] = NAME

    irradiance: Floats
    brightness: Floats
    std: Floats
    levels: int
    absolute: bool = False

    @cached_property
    def is_used(self) -> Bools:
        """Whether points are neither black nor white, so that they count, (N,)."""
        step = 1 / (self.levels - 1)
        lit = (self.irradiance > 0) & (self.brightness > step / 2)
        return np.asarray(lit & (self.brightness < 1 - step))

    @cached_property
    def unit(self) -> float:
        """Irradiance that the search takes as 1, so that its factor is near 1."""
        return 1.0 if self.absolute else float(np.median(self.irradiance[self.is_used]))

    @cached_property
    def _model(self) -> PointModel:
        used = self.is_used
        light = self.irradiance[used] / self.unit
        return PointModel(light, self.brightness[used], self.std[used], self.levels)

    @property
    @override
    def n_levels(self) -> int:
        return self.levels

    @property
    @override
    def observed_levels(self) -> tuple[int, int]:
        levels = np.rint(self.brightness[self.is_used] * (self.levels - 1))
        return int(levels.min()), int(levels.max())

    @property
    @override
    def n_pixels(self) -> int:
        return int(np.count_nonzero(self.is_used))

    @override
    def term(self, channel: str, *, noise_known: bool) -> PointTerm:
        del noise_known
        return PointTerm(self._model, channel, absolute=self.absolute)

    @override
    def start(self, channel: str, edges: Floats) -> Values:
        scale = 0.0 if self.absolute else self._model.start(edges)
        return {points_name(channel): np.array([scale, np.log(USUAL_SCATTER)])}

    @override
    def judged(self, estimate: CurveEstimate, found: ChannelMode, term: AbstractTerm) -> Judgement:
        assert isinstance(term, PointTerm)
        return judged(estimate, found, term, unit=self.unit)
