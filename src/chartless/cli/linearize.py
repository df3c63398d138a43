"""``chartless linearize``: pictures → light, or back."""

from pathlib import Path
from typing import Annotated

import typer

from chartless.cli._options import load_calibration
from chartless.cli._terminal import progress_bar, remark
from chartless.errors import ParameterError


def linearize(
    calibration: Annotated[
        Path,
        typer.Argument(
            help="File that calibrate wrote, or a response of another program.", show_default=False
        ),
    ],
    images: Annotated[
        list[Path], typer.Argument(help="Pictures of this camera.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help="File, or an existing folder for several pictures.",
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

    EXR and TIFF files get floating point, PNG files 16 bits.

    \b
    Example:
        chartless linearize camera.json a.jpg -o linear.exr
        chartless linearize camera.json *.jpg -o linear/ --format tif
    """
    from chartless.frame import Frame
    from chartless.images import read_frame, read_values, write_image

    loaded = load_calibration(calibration)
    targets = _targets(images, output, suffix.lstrip("."))
    with progress_bar() as progress:
        for number, (image, target) in enumerate(zip(images, targets, strict=True)):
            if progress is not None:
                progress(f"{image.name}", number / len(images))
            picture = read_values(image) if inverse else read_frame(image)
            try:
                if isinstance(picture, Frame):
                    values = loaded.linearize(picture.levels)
                else:
                    values = loaded.delinearize(picture.values)
            except ParameterError as error:
                msg = f"{image}: {error}"
                raise ParameterError(msg) from error
            write_image(target, values, orientation=picture.orientation, linear=not inverse)
            for text in picture.remarks:
                remark(f"{image}: {text}")
    for target in targets:
        print(target)


def _targets(images: list[Path], output: Path, suffix: str) -> list[Path]:
    if not output.is_dir():
        if len(images) > 1:
            msg = f"{output} is no folder, and {len(images)} pictures need one: create it first"
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
