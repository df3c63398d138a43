"""What every method of calibration promises, and the registry of methods."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar, NamedTuple

from chartless._registry import Registry
from chartless.errors import ParameterError
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.raw.gather import RawBlocks
from chartless.noise import NoisePrior
from chartless.result.response import Response
from chartless.types import Counts, JsonObject

ChannelProgress = Callable[[float], None]
"""Called now and then with the share of the work done, 0 … 1."""


class ChannelEvidence(NamedTuple):
    """What a method is given of one channel; see `AbstractCalibrator.calibrate`."""

    channel: str
    pairs: Cooccurrence | None
    n_frames: int
    dark: Counts | None
    bracket: ExposureCounts | None
    raw: RawBlocks | None

    @property
    def table(self) -> Cooccurrence:
        """Level pairs of one exposure, for methods that take noise."""
        assert self.pairs is not None
        return self.pairs

    @property
    def exposures(self) -> ExposureCounts:
        """Level pairs of different exposures, for methods that take them."""
        assert self.bracket is not None
        return self.bracket

    @property
    def blocks(self) -> RawBlocks:
        """Light and level of the same blocks of pixels, for methods that take raw files."""
        assert self.raw is not None
        return self.raw


@dataclass(frozen=True, slots=True, kw_only=True)
class AbstractCalibrator(ABC):
    """Settings in the constructor, evidence to `calibrate`, a `Response` out."""

    takes: ClassVar[frozenset[str]] = frozenset({"noise"})
    """Kinds of evidence that the method reads, of which it needs one: "noise", "exposures" or
    "raw"."""
    uses_dark: ClassVar[bool] = False
    """Whether frames taken with the lens covered tell this method anything."""

    @property
    def settings(self) -> JsonObject:
        """Settings a user may choose, as JSON types: what makes a result reproducible."""
        named = {each.name: getattr(self, each.name) for each in fields(self)}
        return {
            name: _as_json(value)
            for name, value in named.items()
            if name not in ("model", "objective", "prior")
        }

    @property
    def family(self) -> str | None:
        """Name of the family of curves; None if any curve may come out."""
        model = getattr(self, "model", None)
        return None if model is None else str(model.name)

    @property
    @abstractmethod
    def method(self) -> str:
        """Name in `CALIBRATORS`."""

    def calibrate(
        self,
        table: Cooccurrence | None = None,
        *,
        exposures: ExposureCounts | None = None,
        raw: RawBlocks | None = None,
        channel: str = "Y",
        n_frames: int = 2,
        dark: Counts | None = None,
        progress: ChannelProgress | None = None,
    ) -> Response:
        """Estimate the response of one channel.

        Parameters
        ----------
        table : Cooccurrence, optional
            Level pairs of frames of one exposure: what noise tells.
        exposures : ExposureCounts, optional
            Level pairs of different exposures.
        raw : RawBlocks, optional
            Light by raw files, and levels of their JPEGs.
        channel : str
            Name to carry in the result.
        n_frames : int
            Frames that the table was counted from, each compared with the next.
        dark : ndarray of int64, shape (L,), optional
            How often each level occurs in frames taken with the lens covered.
        progress : callable, optional
            Told the share of the work done.

        Returns
        -------
        Response
            With flags for what is doubtful. Screening has refused hopeless evidence before.

        Raises
        ------
        ParameterError
            If the method makes no use of dark frames and is given some, or if it is given no
            evidence that it takes, or some that it does not.
        """
        given = {"noise"} if table is not None else set()
        given |= {"exposures"} if exposures is not None else set()
        given |= {"raw"} if raw is not None else set()
        if not given or not given <= self.takes:
            wanted, got = " or ".join(sorted(self.takes)), " and ".join(sorted(given)) or "nothing"
            msg = f"{self.method} estimates from {wanted}, not from {got}: choose another method"
            raise ParameterError(msg)
        if dark is not None and not self.uses_dark:
            msg = f"{self.method} makes no use of dark frames: choose the method likelihood"
            raise ParameterError(msg)
        evidence = ChannelEvidence(channel, table, n_frames, dark, exposures, raw)
        return self._estimate(evidence, progress)

    @abstractmethod
    def _estimate(
        self, evidence: ChannelEvidence, progress: ChannelProgress | None
    ) -> Response: ...


def _as_json(setting: object) -> Any:  # noqa: ANN401 - whatever JSON holds
    if isinstance(setting, NoisePrior):
        return {name: _as_json(value) for name, value in asdict(setting).items()}
    return list(setting) if isinstance(setting, tuple) else setting


CALIBRATORS: Registry[Callable[..., AbstractCalibrator]] = Registry("method")
"""Methods by name; each makes a calibrator from keyword settings."""
