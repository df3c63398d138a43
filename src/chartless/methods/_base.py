"""Interface of all methods of calibration, and the registry of methods."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar, final

from typing_extensions import override

from chartless._registry import Registry
from chartless.curves.populations import PopulationWeights
from chartless.errors import ParameterError
from chartless.evidence.base import AbstractChannelEvidence, ChannelEvidence
from chartless.evidence.noise.channel import LevelPairs
from chartless.frames.frame import Origin
from chartless.noise import NoisePrior
from chartless.result.response import Response
from chartless.types import JsonObject

ChannelProgress = Callable[[float], None]
"""Function called now and then with the share of the work done, 0 … 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AbstractCalibrator(ABC):
    """Method of calibration: settings to the constructor, evidence to `calibrate`."""

    takes: ClassVar[tuple[type[AbstractChannelEvidence], ...]] = (LevelPairs,)
    """Kinds of evidence that the method reads; it needs at least one."""
    uses_dark: ClassVar[bool] = False
    """Whether the method uses frames taken with the lens covered."""

    @property
    def settings(self) -> JsonObject:
        """Settings that users may choose, as JSON types, to reproduce a result."""
        named = {each.name: getattr(self, each.name) for each in fields(self)}
        return {
            name: _as_json(value)
            for name, value in named.items()
            if name not in ("model", "objective", "prior")
        }

    @property
    def family(self) -> str | None:
        """Name of the family of curves; None for a free curve."""
        model = getattr(self, "model", None)
        return None if model is None else str(model.name)

    @property
    @abstractmethod
    def method(self) -> str:
        """Name in `CALIBRATORS`."""

    def idle(self, kinds: Collection[str]) -> list[str]:
        """Settings other than the defaults that have no effect on these kinds."""
        usual = type(self)()
        return [
            name
            for name in sorted(self.idle_settings(kinds))
            if getattr(self, name) != getattr(usual, name)
        ]

    def for_files(self, origins: Iterable[Origin]) -> "AbstractCalibrator":
        """Return the method with what the files themselves show of the camera.

        Parameters
        ----------
        origins : iterable of Origin
        """
        del origins
        return self

    def idle_settings(self, kinds: Collection[str]) -> frozenset[str]:
        """Names of settings without effect on these kinds of evidence."""
        del kinds
        return frozenset()

    def calibrate(
        self,
        *evidence: AbstractChannelEvidence,
        channel: str = "Y",
        progress: ChannelProgress | None = None,
    ) -> Response:
        """Estimate the response of one channel.

        Parameters
        ----------
        *evidence : AbstractChannelEvidence
            Evidence such as `chartless.evidence.noise.channel.LevelPairs`, at most one
            of each kind.
        channel : str
            Name of the channel in the result.
        progress : callable, optional
            Called with the share of the work done.

        Returns
        -------
        Response
            Response with flags for doubts. Screening should have refused useless
            evidence.

        Raises
        ------
        ParameterError
            As for `calibrate_channels`.
        """
        (response,) = self.calibrate_channels({channel: evidence}, progress=progress)
        return response

    def calibrate_channels(
        self,
        channels: Mapping[str, Sequence[AbstractChannelEvidence]],
        *,
        progress: ChannelProgress | None = None,
    ) -> tuple[Response, ...]:
        """Estimate the responses of all channels of a camera.

        Parameters
        ----------
        channels : mapping from names to sequences of AbstractChannelEvidence
            Evidence of each channel, of the same kinds in all.
        progress : callable, optional
            Called with the share of the work done.

        Returns
        -------
        tuple of Response
            Responses in the order of the channels.

        Raises
        ------
        ParameterError
            If the method does not use dark frames but is given some, or if it is given
            no evidence that it takes, or some that it does not take.
        """
        evidence = [ChannelEvidence(name, tuple(parts)) for name, parts in channels.items()]
        for each in evidence:
            self._require_fit(each)
        return self._estimate_all(evidence, progress)

    def _require_fit(self, evidence: ChannelEvidence) -> None:
        given = {part.kind for part in evidence.parts}
        if not given or not all(isinstance(part, self.takes) for part in evidence.parts):
            named = [getattr(each, "kind", "any other kind") for each in self.takes]
            wanted, got = " or ".join(named), " and ".join(sorted(given)) or "nothing"
            msg = f"{self.method} uses {wanted} only, and was given {got}: choose another method"
            raise ParameterError(msg)
        if len(given) < len(evidence.parts) or len({each.n_levels for each in evidence.parts}) > 1:
            msg = "evidence of a channel must be one part of each kind, all of one number of levels"
            raise ParameterError(msg)
        pairs = evidence.get(LevelPairs)
        if pairs is not None and pairs.dark is not None and not self.uses_dark:
            msg = f"{self.method} does not use dark frames: choose the method likelihood"
            raise ParameterError(msg)

    @abstractmethod
    def _estimate_all(
        self, channels: Sequence[ChannelEvidence], progress: ChannelProgress | None
    ) -> tuple[Response, ...]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class AbstractChannelCalibrator(AbstractCalibrator):
    """Method that estimates each channel by itself."""

    @final
    @override
    def _estimate_all(
        self, channels: Sequence[ChannelEvidence], progress: ChannelProgress | None
    ) -> tuple[Response, ...]:
        return tuple(
            self._estimate(each, share_of(progress, place, len(channels)))
            for place, each in enumerate(channels)
        )

    @abstractmethod
    def _estimate(
        self, evidence: ChannelEvidence, progress: ChannelProgress | None
    ) -> Response: ...


def share_of(progress: ChannelProgress | None, place: int, n_parts: int) -> ChannelProgress | None:
    """Progress callback for one of several equal parts of the work."""
    if progress is None:
        return None
    return lambda share: progress((place + share) / n_parts)


def _as_json(setting: object) -> Any:  # noqa: ANN401 - whatever JSON holds
    if isinstance(setting, NoisePrior | PopulationWeights):
        return {name: _as_json(value) for name, value in asdict(setting).items()}
    return list(setting) if isinstance(setting, tuple) else setting


CALIBRATORS: Registry[Callable[..., AbstractCalibrator]] = Registry("method")
"""Methods by name; each makes a calibrator from keyword settings."""
