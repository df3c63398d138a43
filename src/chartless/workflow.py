"""From frames to a calibration in one call: what the command line and scripts use."""

import itertools
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial, reduce
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from chartless._numeric.threads import in_order, one_blas_thread
from chartless.errors import ParameterError, UnfitFramesError, UnknownNameError
from chartless.evidence.bracket.gather import MOST_LEVELS, BracketEvidence, bracket_evidence
from chartless.evidence.bracket.screening import exposure_rows, screen_bracket
from chartless.evidence.noise.gather import NoiseEvidence, dark_histograms, joined, noise_evidence
from chartless.evidence.noise.screening import screen
from chartless.evidence.noise.still import ENOUGH, still_evidence
from chartless.evidence.plan import Plan, Times, planned
from chartless.evidence.raw.gather import RawEvidence, raw_evidence
from chartless.evidence.raw.screening import screen_raw
from chartless.flags import Flag
from chartless.frames.frame import CameraSettings, Frame, FrameSource, RawPicture
from chartless.frames.levels import require_levels
from chartless.frames.pictures import array_frame, listed
from chartless.methods import CALIBRATORS, AbstractCalibrator, LikelihoodSearch
from chartless.methods.shared_exposures import with_shared_exposures
from chartless.models import MODELS
from chartless.result.calibration import Calibration
from chartless.result.provenance import provenance
from chartless.result.response import Response
from chartless.types import JsonObject, Levels

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of it that is finished, 0 … 1."""

_LEVELS = 256  # to which frames are reduced unless asked
DEFAULT_METHOD, RAW_METHOD = "likelihood", "raw"


def calibrate(
    frames: Sequence[str | os.PathLike[str] | Levels],
    *,
    model: str | None = None,
    method: str | AbstractCalibrator | None = None,
    channels: str = "auto",
    n_levels: int | None = None,
    mask: str | os.PathLike[str] | npt.NDArray[np.bool_] | None = None,
    dark: Sequence[str | os.PathLike[str] | Levels] = (),
    raw: Sequence[str | os.PathLike[str]] = (),
    shared_noise: bool = False,
    evidence: str = "auto",
    times: Times = None,
    time_error: float | None = None,
    aligned: bool = True,
    bloom_radius: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    **settings: Any,  # noqa: ANN401 - each method names and checks its own
) -> Calibration:
    """Calibrate a camera from frames of one still scene, of one exposure or of several.

    Frames of one exposure are compared for their noise, exposures for their levels; where an
    exposure of several is repeated, both tell. EXIF or `times` decide which it is. With `raw`,
    frames are compared with the raw files of the same shots, and scenes may differ.

    Parameters
    ----------
    frames : sequence of paths or of ndarray of uint8 or uint16
        Two or more pictures, as files or as arrays of shape (M, N) or (M, N, 3). Files are
        read in order; two are in memory at a time, and two more that are decoded ahead.
        Or one video, ``["clip.mp4"]``, of which the longest still part is used (see
        `chartless.evidence.noise.still`). An array of shape (K, M, N) or (K, M, N, 3) is a sequence
        of K frames.
    model : str, optional
        Family of curves, a name in `chartless.MODELS`. Without, what the method takes: any
        curve at all (likelihood, nlf, raw) or ameegc2-exact (ism-bin, ism-sampled).
    method : str or AbstractCalibrator, optional
        A name in `chartless.CALIBRATORS`, or a calibrator that has its model and settings already.
        Without, likelihood, or raw with raw files.
    channels : str
        "auto" (those of the frames, luma of a video), "rgb" or "luma".
    n_levels : int, optional
        Levels are reduced to this many before they are counted. Without, 256 or as many as there
        are, 220 in most videos.
    mask : path or ndarray of bool, shape (M, N), optional
        Pixels to use: True, or not black in the picture.
    dark : sequence of paths or of ndarray
        Frames of the same camera with the same settings and the lens covered. They tell the
        noise at black and the curve there, of use where the scene has no dark parts.
    raw : sequence of paths, optional
        The raw file of each frame, of the same name but for the folder and the suffix.
    shared_noise : bool
        Whether all channels have one ratio of the noise parameters, as those of a sensor have
        before white balance; method likelihood only.
    evidence : str
        "auto" (what there is), "noise", "bracket" or "both".
    times : sequence of float or of str or "unknown", optional
        Relative exposure of each frame, instead of what EXIF says. Where ratios are unknown, a
        name for each exposure, such as ``list("abbc")``; "unknown" if all exposures differ.
    time_error : float, optional
        Relative error of the exposures; without, 0 for `times`, 2 % for EXIF.
    aligned : bool
        Whether a pixel sees the same spot in all exposures; if not, their histograms are matched.
    bloom_radius : int
        Pixels around saturated ones that are left out of an exposure.
    jobs : int
        Processes that read files. The result does not depend on it.
    scheduler : str, optional
        Address of a Dask scheduler on whose workers files are read instead, such as
        ``tcp://host:8786``; they must see the files under the same names.
    progress : callable, optional
    **settings
        Settings of the method, such as ``rounds=30``.

    Returns
    -------
    Calibration
        With a flag for each doubt about frames or result.

    Raises
    ------
    ImageError
        If a picture cannot be read.
    UnfitFramesError
        If no response can be read out of these frames.
    UnknownNameError, ParameterError
        If a name or a setting is no good, or the scheduler does not answer.
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
    frames, dark, raw = listed("frames", frames), listed("dark", dark), listed("raw", raw)
    if method is None:
        method = RAW_METHOD if raw else DEFAULT_METHOD
    calibrator = _calibrator(method, model, settings)
    joint = _joint(calibrator) if shared_noise else None
    _require_raw(calibrator, raw=bool(raw), compared=evidence != "auto" or times is not None)
    common = {"channels": channels, "n_levels": n_levels, "mask": _read_mask(mask)}
    if n_levels is None and (raw or not any(map(_is_video, frames))):
        common["n_levels"] = _LEVELS
    given = {
        "jobs": jobs > 1,
        "scheduler": scheduler is not None,
        "dark": bool(dark),
        "time_error": time_error is not None,
        "aligned=False": not aligned,
        "bloom_radius": bloom_radius > 0,
        "noise_prior": "noise_prior" in settings,
    }
    if raw:
        _refuse_unused(given, {"raw"}, "pictures are compared with their raw files")
        read = _read_raw(frames, raw, progress, common)
    else:
        plan = _plan(frames, calibrator, times=times, time_error=time_error, kind=evidence)
        _refuse_unused(given, plan.kinds, f"this is {plan.reason}")
        _require_noise(plan, shared=shared_noise)
        read = _read(
            frames,
            plan,
            progress,
            jobs,
            scheduler,
            common=common,
            bracket={"aligned": aligned, "bloom_radius": bloom_radius},
        )
    noise, bracket, names, n_levels = read.noise, read.bracket, list(read.flags), read.n_levels
    dark_levels = dark_histograms(
        _dark_frames(dark, channels), names, channels, n_levels if noise is None else noise.n_levels
    )

    def estimate(compared: BracketEvidence | None, place: int, name: str) -> Response:
        def channel_progress(share: float) -> None:
            if progress is not None:
                progress("estimating", (place + share) / len(names))

        return calibrator.calibrate(
            None if noise is None else noise.tables[name],
            exposures=None if compared is None else compared.counts(name),
            raw=None if read.raw is None else read.raw.blocks[name],
            channel=name,
            n_frames=2 if noise is None else noise.n_frames,
            dark=dark_levels.get(name),
            progress=channel_progress,
        )

    def estimates(compared: BracketEvidence | None) -> tuple[Response, ...]:
        each = (partial(estimate, compared, place, name) for place, name in enumerate(names))
        return tuple(in_order(each)) if noise is None else tuple(one() for one in each)

    # One after the other: NumPy's steps on tables of noise are so short that threads get in each
    # other's way, and the whole takes longer. Those on comparagrams are longer.
    with one_blas_thread():
        if joint is not None and noise is not None and bracket is None:
            responses = joint.calibrate_together(
                noise.tables,
                n_frames=noise.n_frames,
                dark=dark_levels,
                progress=None if progress is None else partial(progress, "estimating"),
            )
        else:
            responses = with_shared_exposures(estimates, bracket)
    if noise is None and n_levels > MOST_LEVELS:
        responses = tuple(each.at_levels(n_levels) for each in responses)
    responses = tuple(each.with_flags(*read.flags[each.name]) for each in responses)
    return Calibration(
        channels=responses,
        bit_depth=read.bit_depth,
        provenance=provenance(
            read.sources,
            {
                "method": calibrator.method,
                "model": calibrator.family,
                "evidence": read.reason,
                "channels": channels,
                "levels": n_levels,
                "dark": [str(item) if not _is_array(item) else "array" for item in dark],
                "shared_noise": shared_noise,
                "mask": None if mask is None else "array" if _is_array(mask) else str(mask),
                **calibrator.settings,
            },
            responses,
            exposures=None if bracket is None else exposure_rows(bracket),
            remarks=[*_repeats_left_out(read), *_raw_noise(read)],
        ),
    )


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


def _joint(calibrator: AbstractCalibrator) -> LikelihoodSearch:
    if not isinstance(calibrator, LikelihoodSearch):
        msg = "only the method likelihood estimates channels together: omit `shared_noise`"
        raise ParameterError(msg)
    return calibrator


_USED_BY = {
    "jobs": "noise",
    "scheduler": "noise",
    "dark": "noise",
    "noise_prior": "noise",
    "time_error": "bracket",
    "aligned=False": "bracket",
    "bloom_radius": "bracket",
}
"""Kind of evidence that an argument is for."""


def _refuse_unused(given: Mapping[str, bool], kinds: Collection[str], what: str) -> None:
    """Refuse arguments that would change nothing."""
    unused = [f"`{name}`" for name, used in given.items() if used and _USED_BY[name] not in kinds]
    if unused:
        msg = f"{what}, where {' and '.join(unused)} would change nothing: omit that"
        raise ParameterError(msg)


def _require_noise(plan: Plan, *, shared: bool) -> None:
    if shared and plan.bracket:
        msg = (
            f"channels share noise where frames are of one exposure, and this is {plan.reason}: "
            "omit `shared_noise`"
        )
        raise ParameterError(msg)


def _require_raw(calibrator: AbstractCalibrator, *, raw: bool, compared: bool) -> None:
    """Refuse raw files for a method that takes none or in a comparison; one that does, without."""
    if raw and compared:
        msg = "raw files are compared shot by shot: omit `evidence` and `times`"
        raise ParameterError(msg)
    if raw and "raw" not in calibrator.takes:
        msg = f"{calibrator.method} takes no raw files: omit `method` or `raw`"
        raise ParameterError(msg)
    if not raw and "raw" in calibrator.takes:
        msg = f"{calibrator.method} compares pictures with their raw files: give these as `raw`"
        raise ParameterError(msg)


def _is_array(item: object) -> bool:
    return isinstance(item, np.ndarray)


def _repeats_left_out(read: "_Read") -> list[str]:
    """Remark that frames were given and not read."""
    n_unread = sum(source.n_used == 0 for source in read.sources)
    if not n_unread:
        return []
    one = n_unread == 1
    text = (
        f"{n_unread} frame{'s' * (not one)} repeat{'s' * one} an exposure and "
        f"{'was' if one else 'were'} not used: only their noise would tell more"
    )
    return [text]


def _raw_noise(read: "_Read") -> list[str]:
    """Remark that sensors are not what is taken for usual in noise."""
    files = [source.path for source in read.sources if source.path.suffix]  # arrays have none
    if read.noise is None or read.bracket is not None or not files:
        return []
    from chartless.images import is_raw

    if not any(map(is_raw, files)):
        return []
    text = (
        "noise tells to about 0.02 whether raw files are linear: exposures of one scene tell it "
        "to 0.003"
    )
    return [text]


def _plan(
    items: Sequence[str | os.PathLike[str] | Levels],
    calibrator: AbstractCalibrator,
    **asked: Any,  # noqa: ANN401
) -> Plan:
    """What to read from the frames, of that what the method takes."""
    _require_different(items)
    _require_alone(items)
    names = [
        Path(f"frame {number}") if isinstance(item, np.ndarray) else Path(item)
        for number, item in enumerate(items, start=1)
    ]
    plan = planned(names, [_settings(item) for item in items], **asked)
    taken = calibrator.takes
    if plan.bracket and plan.noise and "noise" not in taken:
        plan = plan.without_noise()
    plan = replace(plan, noise=plan.noise and "noise" in taken)
    if plan.bracket and "exposures" not in taken:
        msg = (
            f"this is {plan.reason}, and {calibrator.method} reads noise alone: choose the method "
            "likelihood, or `evidence='noise'` for frames of one exposure"
        )
        raise ParameterError(msg)
    if not plan.bracket and "noise" not in taken:
        msg = f"{calibrator.method} compares exposures, and this is {plan.reason}: give `times`"
        raise ParameterError(msg)
    return plan


def _settings(item: str | os.PathLike[str] | Levels) -> CameraSettings:
    if isinstance(item, np.ndarray) or _is_video(item):
        return CameraSettings()
    from chartless.images import read_settings

    return read_settings(item, raw=True)


@dataclass(frozen=True, slots=True, eq=False)
class _Read:
    """What was read from the frames."""

    reason: str
    """What was read, in one sentence."""
    flags: dict[str, tuple[Flag, ...]]
    """Doubts about each channel, by its name."""
    sources: tuple[FrameSource, ...]
    bit_depth: int
    n_levels: int
    """As asked for, or as many as a video has."""
    noise: NoiseEvidence | None = None
    bracket: BracketEvidence | None = None
    raw: RawEvidence | None = None


def _read(
    items: Sequence[str | os.PathLike[str] | Levels],
    plan: Plan,
    progress: Progress | None,
    jobs: int,
    scheduler: str | None,
    *,
    common: dict[str, Any],
    bracket: dict[str, Any],
) -> _Read:
    """Read the evidence that was planned, and screen it."""
    if not plan.bracket:
        noise = _noise(items, progress, jobs, scheduler, common)
        own = dict(screen(noise.tables, noise.checks, lossy=_any_lossy(noise)))
        return _Read(plan.reason, own, noise.sources, noise.bit_depth, noise.n_levels, noise=noise)
    places = itertools.count(1)

    def on_frame(_: Frame) -> None:
        if progress is not None:
            progress("reading exposures", next(places) / len(plan.groups))

    exposures = bracket_evidence(
        _frames([items[group[0]] for group in plan.groups]),
        plan.log_exposures,
        exposure_error=plan.exposure_error,
        on_frame=on_frame,
        **common,
        **bracket,
    )
    require_levels((1 << exposures.bit_depth) - 1, common["n_levels"])
    _require_rest(exposures, bracket["bloom_radius"])
    flags, n_levels = screen_bracket(exposures), common["n_levels"]
    if not plan.noise:
        unread = [_unread(items[place], place) for group in plan.groups for place in group[1:]]
        sources = (*exposures.sources, *unread)
        return _Read(plan.reason, flags, sources, exposures.bit_depth, n_levels, bracket=exposures)
    common = {**common, "n_levels": min(n_levels, MOST_LEVELS)}
    repeated = [group for group in plan.groups if len(group) > 1]
    parts = [
        _noise([items[place] for place in group], progress, jobs, scheduler, common)
        for group in repeated
    ]
    noise = reduce(partial(joined, continued=False), parts)
    # Levels that repeats do not cover are covered by other exposures.
    both = {
        name: (*flags[name], *(flag for flag in own if flag is not Flag.LEVELS_UNSEEN))
        for name, own in screen(
            noise.tables, noise.checks, covering=False, lossy=_any_lossy(noise)
        ).items()
    }
    repeats = [source for part in parts for source in part.sources[1:]]
    sources = (*exposures.sources, *repeats)
    return _Read(
        plan.reason, both, sources, exposures.bit_depth, n_levels, noise=noise, bracket=exposures
    )


def _any_lossy(noise: NoiseEvidence) -> bool:
    return any(source.lossy for source in noise.sources)


def _unread(item: str | os.PathLike[str] | Levels, place: int) -> FrameSource:
    """A frame that was given and repeats an exposure of which another frame is used."""
    if isinstance(item, np.ndarray):
        return replace(array_frame(item, place + 1).source, n_used=0)
    from chartless.images import digest

    return FrameSource(Path(item), digest(Path(item)), (), n_used=0)


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


def _read_raw(
    items: Sequence[str | os.PathLike[str] | Levels],
    raw: Sequence[str | os.PathLike[str]],
    progress: Progress | None,
    common: dict[str, Any],
) -> _Read:
    """Read pictures and their raw files, and screen them."""
    pairs = _paired(items, raw)

    def shots() -> Iterator[tuple[RawPicture, Frame]]:
        from chartless.images import read_frame, read_raw

        for place, (picture, own) in enumerate(pairs, start=1):
            yield read_raw(own), read_frame(picture)
            if progress is not None:
                progress("reading raw files", place / len(pairs))

    n_levels = common["n_levels"]
    evidence = raw_evidence(shots(), **{**common, "n_levels": min(n_levels, MOST_LEVELS)})
    require_levels((1 << evidence.bit_depth) - 1, n_levels)
    reason = "a raw file beside its picture"
    if len(pairs) > 1:
        reason = f"{len(pairs)} raw files beside their pictures"
    flags = dict(screen_raw(evidence))
    return _Read(reason, flags, evidence.sources, evidence.bit_depth, n_levels, raw=evidence)


def _paired(
    items: Sequence[str | os.PathLike[str] | Levels], raw: Sequence[str | os.PathLike[str]]
) -> list[tuple[Path, Path]]:
    """Pictures with their raw files, by name; a single one of each belong together anyway."""
    paths = [Path(item) for item in items if not isinstance(item, np.ndarray)]
    if len(paths) < len(items) or any(map(_is_array, raw)):
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
            msg = f"{first} and {path} have one name, by which raw files are matched: rename one"
            raise UnfitFramesError(msg)
    return named


def _noise(
    items: Sequence[str | os.PathLike[str] | Levels],
    progress: Progress | None,
    jobs: int,
    scheduler: str | None,
    settings: dict[str, Any],
) -> NoiseEvidence:
    """Count the level pairs of files and arrays, in this process or in several."""

    def on_part(done: int, total: int) -> None:
        if progress is not None:
            progress("reading frames", done / total)

    places = itertools.count(1)
    if _is_video(items[0]):
        if jobs > 1 or scheduler is not None:
            msg = f"{items[0]} is a video, which one process reads: omit `jobs` and `scheduler`"
            raise ParameterError(msg)
        return _noise_of_video(
            Path(items[0]), lambda _: on_part(min(next(places), ENOUGH), ENOUGH), settings
        )
    if jobs == 1 and scheduler is None:
        return noise_evidence(
            _frames(items), on_frame=lambda _: on_part(next(places), len(items)), **settings
        )
    paths = [item for item in items if not isinstance(item, np.ndarray)]
    if len(paths) < len(items):
        msg = "only files are read by several processes: leave jobs at 1 for arrays"
        raise ParameterError(msg)
    from chartless.evidence.noise.accumulate import noise_evidence_of_files

    return noise_evidence_of_files(
        paths, jobs=jobs, scheduler=scheduler, on_chunk=on_part, **settings
    )


def _noise_of_video(
    path: Path, on_frame: Callable[[Frame], None], settings: dict[str, Any]
) -> NoiseEvidence:
    from chartless.images import digest, read_video

    sha256 = digest(path) if path.is_file() else ""  # a webcam has none
    with closing(read_video(path, colour=settings["channels"] == "rgb")) as video:
        return still_evidence(video, sha256=sha256, on_frame=on_frame, **settings)


def _is_video(item: str | os.PathLike[str] | Levels) -> TypeGuard[str | os.PathLike[str]]:
    if isinstance(item, np.ndarray):
        return False
    from chartless.images import is_video

    return is_video(item)


def _require_alone(items: Sequence[str | os.PathLike[str] | Levels]) -> None:
    for item in items:
        if _is_video(item) and len(items) > 1:
            msg = f"{item} is a video, whose frames are compared with each other: give it alone"
            raise ParameterError(msg)


def _require_different(items: Sequence[str | os.PathLike[str] | Levels]) -> None:
    seen: dict[Path, Path] = {}
    for item in items:
        if isinstance(item, np.ndarray):
            continue
        path = Path(item)
        first = seen.setdefault(path.resolve(), path)
        if first is not path:
            msg = (
                f"{path} and {first} are the same file, so there is no noise to read: give "
                "different shots of the scene"
            )
            raise UnfitFramesError(msg)


def _frames(items: Sequence[str | os.PathLike[str] | Levels]) -> Iterator[Frame]:
    """Frames of files and arrays, one by one; the next two are decoded meanwhile."""

    def frame(number: int, item: str | os.PathLike[str] | Levels) -> Frame:
        if isinstance(item, np.ndarray):
            return array_frame(item, number)
        from chartless.images import read_frame

        return read_frame(item, raw=True)

    return in_order(partial(frame, number, item) for number, item in enumerate(items, start=1))


def _dark_frames(
    items: Sequence[str | os.PathLike[str] | Levels], channels: str
) -> Iterator[Frame]:
    """Frames of pictures and videos, of these not more than are used of a still scene."""
    for are_videos, alike in itertools.groupby(items, _is_video):
        if not are_videos:
            yield from _frames(list(alike))
            continue
        from chartless.images import read_video

        for item in filter(_is_video, alike):
            with closing(read_video(item, colour=channels == "rgb")) as video:
                yield from (frame for _, frame in itertools.islice(video, ENOUGH))


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
