"""From frames to a calibration in one call, for the command line and for scripts."""

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from chartless._numeric.threads import one_blas_thread
from chartless.errors import ParameterError, UnfitFramesError, UnknownNameError
from chartless.evidence.base import AbstractEvidence, by_channel
from chartless.evidence.exposures import Times, exposures_of
from chartless.evidence.kind import Inputs
from chartless.evidence.plan import Plan, asked_kinds, planned
from chartless.evidence.reader import LEVELS, Item, Progress, Reader, is_video, settings_of
from chartless.evidence.registry import KINDS
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.frames.levels import require_levels
from chartless.frames.pictures import listed
from chartless.methods import CALIBRATORS, AbstractCalibrator
from chartless.models import MODELS
from chartless.result.account import Reading
from chartless.result.calibration import Calibration
from chartless.result.provenance import provenance
from chartless.result.response import Response
from chartless.types import JsonObject, Levels

_MOST_TOGETHER = 256  # levels at which kinds of evidence are combined
DEFAULT_METHOD = "likelihood"


def calibrate(
    frames: Sequence[str | os.PathLike[str] | Levels] = (),
    *,
    model: str | None = None,
    method: str | AbstractCalibrator | None = None,
    channels: str = "auto",
    n_levels: int | None = None,
    mask: str | os.PathLike[str] | npt.NDArray[np.bool_] | None = None,
    evidence: str | Sequence[str] = "auto",
    times: Times = None,
    time_error: float | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    **options: Any,  # noqa: ANN401 - each kind of evidence and each method checks its own
) -> Calibration:
    """Calibrate a camera from frames of one still scene, at one exposure or several.

    Frames of one exposure are compared for their noise, frames of different exposures
    for their levels; where one of several exposures is repeated, both are used. EXIF or
    `times` decide. With `raw`, frames are compared with the raw files of the same
    shots, and scenes may differ.

    Parameters
    ----------
    frames : sequence of paths or of ndarray of uint8 or uint16
        Two or more pictures, as files or as arrays of shape (M, N) or (M, N, 3). Files
        are read in order; two are in memory at a time, and two more that are decoded
        ahead. Or one video, ``["clip.mp4"]``, whose longest still part is used (see
        `chartless.evidence.noise.still`). An array of shape (K, M, N) or (K, M, N, 3)
        is a sequence of K frames. Not needed if `points` are given.
    model : str, optional
        Family of curves, a name in `chartless.MODELS`. The default depends on the
        method: a free curve (likelihood, nlf) or ameegc2-exact (ism-bin, ism-sampled).
    method : str or AbstractCalibrator, optional
        A name in `chartless.CALIBRATORS`, or a calibrator with its model and settings.
        By default likelihood.
    channels : str
        "auto" (those of the frames, luma of a video), "rgb" or "luma".
    n_levels : int, optional
        Number of levels after reduction, before counting. By default 256 or as many as
        there are, 220 in most videos.
    mask : path or ndarray of bool, shape (M, N), optional
        Pixels to use: True, or not black in the picture.
    evidence : str or sequence of str
        "auto" (whatever the frames hold), or kinds of evidence by name, such as
        "noise", "bracket" or "raw,bracket"; "both" is short for "noise,bracket".
        `chartless.plan` lists what the frames hold.
    times : sequence of float or of str or "unknown", optional
        Relative exposure of each frame, instead of EXIF. Where ratios are unknown, a
        name for each exposure, such as ``list("abbc")``; "unknown" if all exposures
        differ.
    time_error : float, optional
        Relative error of the exposures; by default 0 for `times`, 2 % for EXIF.
    jobs : int
        Number of processes that read files. It does not affect the result.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``, whose workers read the
        files instead; they must see them under the same names.
    progress : callable, optional
    **options
        Options of kinds of evidence: ``dark`` (noise: frames with the lens covered),
        ``aligned`` and ``bloom_radius`` (bracket), ``raw`` (raw: the raw file of each
        frame), ``points`` (a table of measured points); see the module ``options`` of
        each kind. Also settings of the method, such as ``rounds=30`` or, for
        likelihood, ``shared_noise=True``.

    Returns
    -------
    Calibration
        Calibration with a flag for each doubt about frames or result.

    Raises
    ------
    ImageError
        If a picture cannot be read.
    UnfitFramesError
        If no response can be estimated from these frames.
    UnknownNameError, ParameterError
        If a name or a setting is invalid, or the scheduler does not answer.
    WorkerError
        If a process that read files was killed.

    Examples
    --------
    >>> import numpy as np
    >>> from chartless import AffineNoise, calibrate, named_curve, simulate_frames
    >>> scene = np.random.default_rng(1).uniform(size=(300, 400))
    >>> noise = AffineNoise.of_sensor(1_500, 5)
    >>> calibration = calibrate(list(simulate_frames(scene, named_curve("srgb"), noise)))
    >>> abs(calibration.channel("Y").curve.response(0.18) - 0.46) < 0.08
    np.True_
    """
    task = _Task.of(
        frames,
        method=method,
        model=model,
        evidence=evidence,
        times=times,
        time_error=time_error,
        options=options,
    )
    if not isinstance(jobs, int) or jobs < 1:
        msg = f"jobs must be a whole number, 1 or above, not {jobs!r}"
        raise ParameterError(msg)
    task.refuse_unused(
        times=times is not None,
        time_error=time_error is not None,
        jobs=jobs > 1,
        scheduler=scheduler is not None,
        mask=mask is not None,
        channels=channels != "auto",
        model=task.calibrator.family is not None,
    )
    if n_levels is None and not any(map(is_video, task.inputs.items)):
        n_levels = LEVELS
    together = len(task.plan.taken) > 1
    reader = Reader(
        channels=channels,
        n_levels=min(n_levels, _MOST_TOGETHER) if together and n_levels is not None else n_levels,
        mask=_read_mask(mask),
        jobs=jobs,
        scheduler=scheduler,
        progress=progress,
    )
    read = task.read(reader)
    if n_levels is not None:
        require_levels((1 << read.evidence[0].bit_depth) - 1, n_levels)
    calibrator = task.calibrator.for_files(source.origin for source in read.sources)
    with one_blas_thread():
        responses = calibrator.calibrate_channels(
            {name: each.parts for name, each in by_channel(read.evidence).items()},
            progress=None if progress is None else partial(progress, "estimating"),
        )
    if n_levels is not None and responses[0].n_levels != n_levels and _is_scalable(responses[0]):
        responses = tuple(each.at_levels(n_levels) for each in responses)
    responses = tuple(each.with_flags(*read.flags[each.name]) for each in responses)
    return Calibration(
        channels=responses,
        bit_depth=read.evidence[0].bit_depth,
        evidence=task.readings(read, responses),
        provenance=provenance(
            read.sources,
            {
                "method": calibrator.method,
                "model": calibrator.family,
                "evidence": task.plan.reason,
                "channels": channels,
                "levels": responses[0].n_levels,
                "mask": None if mask is None else _as_text(mask),
                **{name: _as_text(value) for name, value in task.given.items()},
                **_in_use(calibrator, task.plan.kinds),
            },
            responses,
            remarks=[*_left_out(read.sources), *read.remarks],
        ),
    )


def plan(
    frames: Sequence[str | os.PathLike[str] | Levels] = (),
    *,
    method: str | AbstractCalibrator | None = None,
    evidence: str | Sequence[str] = "auto",
    times: Times = None,
    time_error: float | None = None,
    **options: Any,  # noqa: ANN401 - as for `calibrate`
) -> Plan:
    """Find the kinds of evidence in frames, and those that `calibrate` would use.

    No pixels are read: names, EXIF and the arguments decide.

    Parameters
    ----------
    frames, method, evidence, times, time_error, **options
        As for `calibrate`.

    Returns
    -------
    Plan

    Raises
    ------
    ImageError, UnfitFramesError, UnknownNameError, ParameterError
        As for `calibrate`, if it could not use these frames.
    """
    task = _Task.of(
        frames,
        method=method,
        model=None,
        evidence=evidence,
        times=times,
        time_error=time_error,
        options=options,
    )
    task.refuse_unused(times=times is not None, time_error=time_error is not None)
    return task.plan


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """Evidence read from the frames."""

    evidence: tuple[AbstractEvidence, ...]
    flags: Mapping[str, tuple[Flag, ...]]
    """Flags by channel name."""
    sources: tuple[FrameSource, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """Frames, the evidence to read from them and the method that uses it."""

    inputs: Inputs
    options: Mapping[str, Any]
    """Options by kind of evidence."""
    plan: Plan
    calibrator: AbstractCalibrator
    given: Mapping[str, object]
    """Options that differ from their defaults, by name."""

    @classmethod
    def of(
        cls,
        frames: Sequence[Item],
        *,
        method: str | AbstractCalibrator | None,
        model: str | None,
        evidence: str | Sequence[str],
        times: Times,
        time_error: float | None,
        options: Mapping[str, Any],
    ) -> "_Task":
        """Sort the arguments of a user, and plan."""
        items = tuple(listed("frames", frames))
        usual = {name: default for kind in KINDS.values() for name, default in kind.usual.items()}
        options = {
            name: listed(name, value) if usual.get(name) == () else value
            for name, value in options.items()
        }
        of_kinds = {
            name: kind.options(**{each: options[each] for each in kind.usual if each in options})
            for name, kind in KINDS.items()
        }
        settings = {name: value for name, value in options.items() if name not in usual}
        calibrator = _calibrator(DEFAULT_METHOD if method is None else method, model, settings)
        asked = asked_kinds(evidence)
        _require_different(items)
        _require_alone(items)
        names = tuple(
            Path(f"frame {number}") if isinstance(item, np.ndarray) else Path(item)
            for number, item in enumerate(items, start=1)
        )
        exposures = None
        if items and asked != {"noise"}:
            exposures = exposures_of(
                names,
                [settings_of(item) for item in items],
                times=times,
                time_error=time_error,
                checked=not asked,
            )
        inputs = Inputs(items, names, exposures, times_given=times is not None, asked=asked)
        taken_by = [
            name for name, kind in KINDS.items() if issubclass(kind.holds, calibrator.takes)
        ]
        chosen = planned(inputs, of_kinds, method=calibrator.method, taken_by=taken_by)
        if items and not any(proposal.groups for proposal in chosen.taken):
            raise UnfitFramesError(str(chosen.declined[-1]))  # frames would be left out
        given = {
            name: options[name]
            for name, default in usual.items()
            if name in options
            and (bool(options[name]) if default == () else options[name] != default)
        }
        return cls(inputs, of_kinds, chosen, calibrator, given)

    def refuse_unused(self, **arguments: bool) -> None:
        """Refuse arguments without effect."""
        kinds = {name: KINDS[name] for name in self.plan.kinds}
        used = {each for kind in kinds.values() for each in kind.usual}
        idle = [name for name in self.given if name not in used]
        idle += self.calibrator.idle(self.plan.kinds)
        uses = frozenset[str]().union(*(kind.uses for kind in kinds.values()))
        if any(proposal.groups for proposal in self.plan.taken):
            uses |= {"mask", "channels"}
        if any(kind.holds.constrains for kind in kinds.values()):
            uses |= {"model"}
        idle += [name for name, is_given in arguments.items() if is_given and name not in uses]
        if idle:
            names = " and ".join(
                f"`{name}=False`" if self.given.get(name) is False else f"`{name}`"
                for name in sorted(idle)
            )
            has = "has" if len(idle) == 1 else "have"
            omit = "it" if len(idle) == 1 else "them"
            msg = f"{names} {has} no effect on {self.plan.reason}: omit {omit}"
            raise ParameterError(msg)

    def read(self, reader: Reader) -> _Read:
        """Read the planned evidence, and screen it."""
        evidence: list[AbstractEvidence] = []
        flags: dict[str, tuple[Flag, ...]] = {}
        remarks: list[str] = []
        alone = len(self.plan.taken) == 1
        for proposal in self.plan.taken:
            kind, options = KINDS[proposal.kind], self.options[proposal.kind]
            found = kind.gathered(self.inputs, proposal, options, reader)
            if not evidence:  # later kinds get as many levels as the frames
                levels = found.channel(found.channels[0]).n_levels
                reader = replace(reader, n_levels=levels)
            for name, own in kind.screened(found, alone=alone).items():
                flags[name] = (*flags.get(name, ()), *own)
            remarks += kind.remarks(found, alone=alone)
            evidence.append(found)
        sources = {(each.path, each.sha256): each for part in evidence for each in part.sources}
        for proposal in self.plan.taken:
            for each in KINDS[proposal.kind].unread(self.inputs, proposal):
                sources.setdefault((each.path, each.sha256), each)
        return _Read(tuple(evidence), flags, tuple(sources.values()), tuple(remarks))

    def readings(self, read: _Read, responses: Sequence[Response]) -> tuple[Reading, ...]:
        """Account of the evidence read, by kind, for reports."""
        places = {(each.path, each.sha256): n for n, each in enumerate(read.sources)}

        def place(source: FrameSource) -> int:
            return places[source.path, source.sha256]

        readings = []
        for proposal, evidence in zip(self.plan.taken, read.evidence, strict=True):
            kind = KINDS[proposal.kind]
            accounts = {
                each.name: each.account(kind.name) for each in responses if kind.name in each.kinds
            }
            example = kind.example(evidence)
            readings.append(
                Reading(
                    kind=kind.name,
                    title=kind.title,
                    sentence=proposal.sentence,
                    inputs=tuple(map(place, evidence.sources)),
                    tables=kind.tables(evidence, accounts),
                    example=None if example is None else place(example),
                )
            )
        return tuple(readings)


def _in_use(calibrator: AbstractCalibrator, kinds: Collection[str]) -> JsonObject:
    """Settings of a method except those without effect."""
    idle = calibrator.idle_settings(kinds)
    return {name: value for name, value in calibrator.settings.items() if name not in idle}


def _is_scalable(response: Response) -> bool:
    """Whether all records of the evidence can be converted to other levels."""
    records = [each.record for each in response.accounts if each.record is not None]
    return all(record.at_levels(response.n_levels) is not None for record in records)


def _as_text(value: object) -> Any:  # noqa: ANN401 - JSON
    """Option as stored in the file; an array has no name."""
    if isinstance(value, np.ndarray):
        return "array"
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, list | tuple):
        return [_as_text(each) for each in value]
    return value


def _left_out(sources: Sequence[FrameSource]) -> list[str]:
    """Remark on frames that were given but not read, if any."""
    n_unread = sum(source.n_used == 0 for source in sources)
    if not n_unread:
        return []
    one = n_unread == 1
    text = (
        f"{n_unread} frame{'s' * (not one)} repeat{'s' * one} an exposure and "
        f"{'was' if one else 'were'} not used: {'it' if one else 'they'} would add information "
        "only through noise"
    )
    return [text]


def _calibrator(
    method: str | AbstractCalibrator, model: str | None, settings: JsonObject
) -> AbstractCalibrator:
    if isinstance(method, AbstractCalibrator):
        if model is not None or settings:
            given = ", ".join([*(["model"] if model is not None else []), *settings])
            msg = f"method is a calibrator that is already set up: set {given} on it, not here"
            raise ParameterError(msg)
        return method
    make = CALIBRATORS[method]
    known = make().settings
    for name in settings:
        if name not in known:
            kind = f"setting of {method}"
            raise UnknownNameError(kind, name, known)
    if model is None:
        return make(**settings)
    family = MODELS[model]
    if not hasattr(make(), "model"):
        msg = f"{method} fits a curve of its own and takes no model: omit `model`"
        raise ParameterError(msg)
    return make(model=family, **settings)


def _require_alone(items: Sequence[Item]) -> None:
    for item in items:
        if is_video(item) and len(items) > 1:
            msg = f"{item} is a video, whose frames are compared with each other: give it alone"
            raise ParameterError(msg)


def _require_different(items: Sequence[Item]) -> None:
    seen: dict[Path, Path] = {}
    for item in items:
        if isinstance(item, np.ndarray):
            continue
        path = Path(item)
        first = seen.setdefault(path.resolve(), path)
        if first is not path:
            msg = f"{path} and {first} are the same file: give different shots of the scene"
            raise UnfitFramesError(msg)


def _read_mask(
    mask: str | os.PathLike[str] | npt.NDArray[np.bool_] | None,
) -> npt.NDArray[np.bool_] | None:
    if mask is None:
        return None
    if isinstance(mask, np.ndarray):
        if mask.ndim != 2:  # noqa: PLR2004 - (M, N)
            msg = f"a mask has the shape (M, N) of the frames, not {mask.shape}"
            raise ParameterError(msg)
        return mask.astype(bool)
    if not isinstance(mask, str | os.PathLike):
        msg = f"mask must be the name of a file or an array, not {type(mask).__name__}"
        raise ParameterError(msg)
    from chartless.images import read_frame

    kept: npt.NDArray[np.bool_] = np.any(read_frame(Path(mask)).levels, axis=-1)
    return kept
