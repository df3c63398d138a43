"""``chartless merge``: exposures of one scene → one picture of its radiance."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, overload

import typer
from typing_extensions import override

from chartless.cli._options import CALIBRATION_HELP, AsJson, parse_times
from chartless.cli._terminal import print_json, progress_bar, remark, remark_verdict
from chartless.errors import ParameterError, UnfitFramesError, with_options

if TYPE_CHECKING:
    from chartless.evidence.exposures import Exposures
    from chartless.frames.frame import CameraSettings, Frame
    from chartless.images import Metadata
    from chartless.merge import RadianceMap


def merge(
    frames: Annotated[
        list[Path],
        typer.Argument(
            help="Two or more exposures of one still scene, or a pattern such as 'shots/*.jpg'; "
            "one may be repeated.",
            show_default=False,
        ),
    ],
    calibration: Annotated[
        Path,
        typer.Option(
            "--calibration",
            "-c",
            help=CALIBRATION_HELP,
            show_default=False,
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help=".exr, .tif or .hdr file.", show_default=False)
    ],
    times: Annotated[
        str | None,
        typer.Option(
            help="Exposure of each frame, such as 1/30,1/8,1/2, in place of EXIF.",
            show_default=False,
        ),
    ] = None,
    bloom_radius: Annotated[
        int,
        typer.Option(
            min=0,
            help="Exclude pixels this close to saturated ones, unless no other exposure shows "
            "them.",
        ),
    ] = 0,
    white: Annotated[
        int | None,
        typer.Option(
            help="Level from which on a channel is saturated [the highest].", show_default=False
        ),
    ] = None,
    unbalanced: Annotated[
        bool,
        typer.Option(
            "--unbalanced", help="Leave each channel in units of its own saturation irradiance."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Merge exposures of a still scene into one HDR picture.

    Every pixel is the mean of the exposures that show it unclipped, weighted by their noise. Values
    are radiance, irradiance over exposure, so that 1 is white at exposure 1: time · ISO/N² by EXIF
    or what --times says. EXR and TIFF files get 32-bit floating point, HDR files 8 bits and an
    exponent.

    \b
    Example:
        chartless merge a.jpg b.jpg c.jpg -c camera.json -o scene.exr
        chartless merge a.png b.png c.png -c crf.yml --times 1,1/4,1/16 -o scene.hdr
        chartless merge a.jpg b.jpg c.jpg -c srgb -o scene.exr
    """
    from chartless._files import require_writable
    from chartless.formats import load_calibration
    from chartless.frames.sequence import expanded
    from chartless.images import read_settings, stored_type, write_image
    from chartless.merge import merge_frames
    from chartless.result.verdict import verdict

    frames = expanded(frames)
    stored_type(output, "float")
    require_writable(output)
    _require_different(frames, output, calibration)
    camera = load_calibration(calibration, pictures=frames)
    settings = [read_settings(frame) for frame in frames]
    given = None if times is None else _known_times(times)
    bracket = _bracket(frames, settings, given)
    exposures, unit = _exposures(settings, given)
    files = _Files(frames)
    with progress_bar() as progress:

        def on_frame(done: int, total: int) -> None:
            if progress is not None:
                progress("merging", done / total)

        merged = merge_frames(
            files,
            exposures,
            camera,
            white=white,
            bloom_radius=bloom_radius,
            balanced=not unbalanced,
            on_frame=on_frame,
        )
    write_image(
        output,
        merged.values,
        orientation=merged.orientation,
        metadata=_metadata(exposures, unit, settings),
    )
    for text in (*camera.provenance.get("remarks", ()), *files.remarks, *merged.remarks):
        remark(text)
    remark_verdict(calibration, camera)
    height, width, _ = merged.values.shape
    stops = merged.dynamic_range_stops
    if as_json:
        print_json(
            {
                "output": str(output),
                "size": [width, height],
                "exposures": list(exposures),
                "unit": unit,
                "saturated": float(merged.saturated.mean()),
                "black": float(merged.black.mean()),
                "dynamic_range_stops": stops,
                "verdict": verdict(camera.channels).to_json(),
            }
        )
        return
    print(f"{output}: {width} × {height}, {with_options(str(bracket))}")
    print(f"radiance  {_range(merged)} in {unit}")
    print(f"clipped   {_clipped(merged)}")


def _range(merged: "RadianceMap") -> str:
    stops = merged.dynamic_range_stops
    return "unknown," if stops is None else f"over {stops:.1f} stops,"


def _clipped(merged: "RadianceMap") -> str:
    saturated, black = (100 * float(each.mean()) for each in (merged.saturated, merged.black))
    return f"{saturated:.2f} % of the pixels white and {black:.2f} % black in all exposures"


def _require_different(frames: list[Path], output: Path, calibration: Path) -> None:
    target = output.resolve()
    seen: dict[Path, Path] = {}
    for frame in frames:
        first = seen.setdefault(frame.resolve(), frame)
        if first is not frame:
            msg = f"{frame} and {first} are the same file: give each frame once"
            raise UnfitFramesError(msg)
    if target in seen:
        msg = f"{output} is one of the frames and would be overwritten: choose another output"
        raise ParameterError(msg)
    if target == calibration.resolve():
        msg = f"{output} is the calibration and would be overwritten: choose another output"
        raise ParameterError(msg)


def _known_times(text: str) -> list[float]:
    times = [each for each in parse_times(text) if isinstance(each, float)]
    if not times:
        msg = f"--times {text}: merging needs the exposures; give numbers such as 1/30,1/8,1/2"
        raise ParameterError(msg)
    return times


def _bracket(
    frames: list[Path], settings: "Sequence[CameraSettings]", times: list[float] | None
) -> "Exposures":
    """Exposures of a bracket, with words that suit this command where there is none."""
    from chartless.evidence.exposures import exposures_of, noted_exposures

    if len(frames) < 2:  # noqa: PLR2004 - exposures
        msg = f"{frames[0]} alone is not a bracket: give two or more exposures of one scene"
        raise UnfitFramesError(msg)
    if times is None and noted_exposures(settings) is None:
        silent = next(
            (name for name, each in zip(frames, settings, strict=True) if each.exposure is None),
            frames[0],
        )
        msg = f"{silent} records no exposure: give --times, one for each frame"
        raise UnfitFramesError(msg)
    found = exposures_of(frames, settings, times=times, checked=False)
    if found is None or len(found.groups) == 1:
        msg = (
            f"all {len(frames)} frames have the same exposure: give different exposures of one "
            "scene"
        )
        raise UnfitFramesError(msg)
    return found


def _exposures(
    settings: "Sequence[CameraSettings]", times: list[float] | None
) -> tuple[tuple[float, ...], str]:
    """Exposure of each frame, and the unit of radiance: one over that of the exposures."""
    from chartless.evidence.exposures import noted_exposures

    if times is not None:
        return tuple(times), "1/time, as --times gives it"
    exposures = noted_exposures(settings) or []
    complete = all(each.exposure is not None for each in settings)
    return tuple(exposures), "N^2/(ISO s), by EXIF" if complete else "1/s, by EXIF"


def _metadata(
    exposures: Sequence[float], unit: str, settings: "Sequence[CameraSettings]"
) -> "Metadata":
    """Attributes of the file: unit, exposures, and EXIF of the frame of middle exposure."""
    from chartless._version import __version__

    middle = sorted(range(len(exposures)), key=exposures.__getitem__)[len(exposures) // 2]
    reference = settings[middle]
    known: dict[str, str | float | None] = {
        "ExposureTime": reference.exposure_time,
        "FNumber": reference.f_number,
        "Exif:PhotographicSensitivity": None if reference.iso is None else round(reference.iso),
        "Model": reference.camera,
    }
    listed = ", ".join(f"{each:.6g}" for each in exposures)
    return {
        "Software": f"chartless {__version__}",
        "ImageDescription": f"radiance, 1 is white at exposure 1: {unit}; exposures {listed}",
        "chartless:radianceUnit": unit,
        "chartless:exposures": tuple(exposures),
        "chartless:referenceExposure": exposures[middle],
        **{name: value for name, value in known.items() if value is not None},
    }


class _Files(Sequence["Frame"]):
    """Frames that are read whenever they are asked for."""

    def __init__(self, paths: list[Path]) -> None:
        self._paths = paths
        self._remarks: dict[str, None] = {}

    @property
    def remarks(self) -> list[str]:
        """Remarks made when frames were read, each once."""
        return list(self._remarks)

    @override
    def __len__(self) -> int:
        return len(self._paths)

    @overload
    def __getitem__(self, place: int) -> "Frame": ...
    @overload
    def __getitem__(self, place: slice) -> "Sequence[Frame]": ...
    @override
    def __getitem__(self, place: int | slice) -> "Frame | Sequence[Frame]":
        from chartless.images import read_frame

        if isinstance(place, slice):
            return _Files(self._paths[place])
        frame = read_frame(self._paths[place])
        self._remarks |= dict.fromkeys(f"{frame.path}: {text}" for text in frame.remarks)
        return frame
