"""``chartless linearize``: pictures → light, or back."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from chartless.cli._options import CALIBRATION_HELP
from chartless.cli._terminal import naming, progress_bar, remark, remark_foreign, remark_verdict
from chartless.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from chartless.frames.frame import Frame, Picture
    from chartless.result.calibration import Calibration

    Done: TypeAlias = tuple[Path, tuple[str, ...]]
    """A picture or video, and the remarks of one picture of it."""


def linearize(
    calibration: Annotated[
        Path,
        typer.Argument(help=CALIBRATION_HELP, show_default=False),
    ],
    images: Annotated[
        list[Path],
        typer.Argument(
            help="Pictures of this camera, patterns such as 'shots/*.png', or videos.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help="File, or a folder for several pictures or a video.",
            show_default=False,
        ),
    ],
    suffix: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="Format of files in a folder: exr, tif or png [exr].",
            show_default=False,
        ),
    ] = None,
    inverse: Annotated[
        bool, typer.Option("--inverse", help="Apply the response to linear pictures instead.")
    ] = False,
) -> None:
    """Make IMAGES linear in light: apply the inverse response.

    EXR and TIFF files get floating point, PNG files 16 bits. The frames of a video are numbered
    files, of red, green and blue where it has colour.

    \b
    Example:
        chartless linearize camera.json a.jpg -o linear.exr
        chartless linearize camera.json *.jpg -o linear/ --format tif
        chartless linearize camera.json clip.mp4 -o linear/
        chartless linearize srgb a.jpg -o linear.exr
        chartless linearize icc a.jpg -o linear.exr
        chartless linearize slog3:limited clip.mp4 -o linear/
    """
    from chartless._files import make_folder
    from chartless._numeric.threads import in_order
    from chartless.formats import load_calibration
    from chartless.frames.sequence import expanded
    from chartless.images import is_video

    images = expanded(images)
    loaded = load_calibration(calibration, pictures=images)
    _require_recorded(images, inverse)
    is_folder = output.is_dir() or not (output.suffix or output.exists())
    if suffix is not None and not is_folder:
        msg = f"--format applies to files in a folder; the format of {output} follows from its name"
        raise ParameterError(msg)
    targets = _targets(images, output, (suffix or "exr").lstrip("."), is_folder)
    if is_folder:
        make_folder(output)
    remarks: dict[str, None] = {}
    places = {image: place for place, image in enumerate(images)}
    with progress_bar() as progress:
        done = in_order(_tasks(loaded, images, targets, inverse))
        for number, (image, texts) in enumerate(done, start=1):
            if progress is not None:
                progress(f"{image.name} {number}", places[image] / len(images))
            remarks |= dict.fromkeys(f"{image}: {each}" for each in texts)
    remark_foreign(loaded)
    remark_verdict(calibration, loaded)
    for each in remarks:
        remark(each)
    for image, target in zip(images, targets, strict=True):
        print(_numbered(target, "%06d") if is_video(image) else target)


def _tasks(
    calibration: "Calibration", images: list[Path], targets: list[Path], inverse: bool
) -> "Iterator[Callable[[], Done]]":
    """Write one picture each; a video is decoded while they are asked for."""
    from chartless.images import is_video, read_video

    for image, target in zip(images, targets, strict=True):
        if not is_video(image):
            yield partial(_convert, calibration, image, target, inverse)
            continue
        for number, (_, frame) in enumerate(read_video(image, colour=True), start=1):
            yield partial(_write, calibration, image, _numbered(target, f"{number:06d}"), frame)


def _convert(calibration: "Calibration", image: Path, target: Path, inverse: bool) -> "Done":
    from chartless.images import read_frame, read_values

    picture = read_values(image) if inverse else read_frame(image)
    return _write(calibration, image, target, picture)


def _write(
    calibration: "Calibration", image: Path, target: Path, picture: "Frame | Picture"
) -> "Done":
    from chartless.frames.frame import Frame
    from chartless.images import write_image

    with naming(image):
        if isinstance(picture, Frame):
            values = calibration.linearize(picture.levels, white=picture.white)
        else:
            values = calibration.delinearize(picture.values)
    write_image(target, values, orientation=picture.orientation, linear=isinstance(picture, Frame))
    return image, picture.remarks


def _numbered(target: Path, number: str) -> Path:
    return target.with_stem(f"{target.stem}_{number}")


def _require_recorded(images: list[Path], inverse: bool) -> None:
    from chartless.images import is_video

    for image in filter(is_video, images):
        if inverse or (image.exists() and not image.is_file()):
            msg = (
                f"{image}: only recorded videos can be linearised, and no video can be made "
                "nonlinear"
            )
            raise ParameterError(msg)


def _targets(images: list[Path], output: Path, suffix: str, is_folder: bool) -> list[Path]:
    from chartless.images import is_video, stored_type

    if not is_folder:
        several = f"{len(images)} pictures need" if len(images) > 1 else "a video needs"
        if len(images) > 1 or is_video(images[0]):
            msg = f"{output} is not a folder, and {several} one: create it first"
            raise ParameterError(msg)
        targets = [output]
    else:
        targets = [output / f"{image.stem}.{suffix}" for image in images]
    for index, (image, target) in enumerate(zip(images, targets, strict=True)):
        if target in targets[:index]:
            msg = f"{image} and another picture would both be written to {target}: rename one"
        elif target.resolve() == image.resolve():
            msg = f"{image} would be overwritten by its own result: choose another output"
        else:
            continue
        raise ParameterError(msg)
    stored_type(targets[0])
    return targets
