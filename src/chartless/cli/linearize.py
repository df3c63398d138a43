"""``chartless linearize``: pictures → light, or back."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._terminal import naming, progress_bar, remark
from chartless.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chartless.calibration import Calibration
    from chartless.frame import Frame, Picture
    from chartless.types import Floats32


def linearize(
    calibration: Annotated[
        Path,
        typer.Argument(
            help="File that calibrate wrote, or a response of another program.", show_default=False
        ),
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
        str, typer.Option("--format", help="Format of files in a folder: exr, tif or png.")
    ] = "exr",
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
    """
    from chartless._files import make_folder
    from chartless.images import is_video, write_image
    from chartless.luts import load_calibration
    from chartless.sequence import expanded

    images = expanded(images)
    if not output.suffix and not output.exists():
        make_folder(output)
    loaded = load_calibration(calibration)
    targets = _targets(images, output, suffix.lstrip("."))
    with progress_bar() as progress:
        for number, (image, target) in enumerate(zip(images, targets, strict=True)):
            remarks: dict[str, None] = {}
            for place, picture in enumerate(_pictures(image, inverse), start=1):
                if progress is not None:
                    progress(f"{image.name} {place}", number / len(images))
                write_image(
                    _numbered(target, f"{place:06d}") if is_video(image) else target,
                    _applied(loaded, image, picture),
                    orientation=picture.orientation,
                    linear=not inverse,
                )
                remarks |= dict.fromkeys(picture.remarks)
            for text in remarks:
                remark(f"{image}: {text}")
    for image, target in zip(images, targets, strict=True):
        print(_numbered(target, "%06d") if is_video(image) else target)


def _pictures(image: Path, inverse: bool) -> "Iterator[Frame | Picture]":
    """Frames of a video, one by one, or the picture."""
    from chartless.images import is_video, read_frame, read_values, read_video

    if not is_video(image):
        yield read_values(image) if inverse else read_frame(image)
        return
    if inverse or not image.is_file():
        msg = f"{image}: only recorded videos are linearised, and none is made nonlinear"
        raise ParameterError(msg)
    yield from (frame for _, frame in read_video(image, colour=True))


def _applied(calibration: "Calibration", image: Path, picture: "Frame | Picture") -> "Floats32":
    from chartless.frame import Frame

    with naming(image):
        if isinstance(picture, Frame):
            return calibration.linearize(picture.levels, white=picture.white)
        return calibration.delinearize(picture.values)


def _numbered(target: Path, number: str) -> Path:
    return target.with_stem(f"{target.stem}_{number}")


def _targets(images: list[Path], output: Path, suffix: str) -> list[Path]:
    from chartless.images import is_video

    if not output.is_dir():
        several = f"{len(images)} pictures need" if len(images) > 1 else "a video needs"
        if len(images) > 1 or is_video(images[0]):
            msg = f"{output} is no folder, and {several} one: create it first"
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
    return targets
