"""``chartless simulate``: noisy frames of a scene through a known response."""

from pathlib import Path
from typing import Annotated

import typer

from chartless.cli._options import parse_curve, parse_pair
from chartless.cli._terminal import progress_bar
from chartless.errors import ParameterError


def simulate(
    scene: Annotated[
        Path,
        typer.Argument(help="Picture whose values are taken as irradiance.", show_default=False),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder to create.", show_default=False)
    ],
    response: Annotated[
        str,
        typer.Option(
            help="Response: srgb, slog3 …, MODEL:params such as gamma:0.45, or a CSV file."
        ),
    ] = "srgb",
    noise: Annotated[str, typer.Option(help="Noise U,V in 8-bit units.")] = "0.17,0.7",
    frames: Annotated[int, typer.Option(min=1, help="How many frames.")] = 2,
    bits: Annotated[int, typer.Option(help="Bit depth of the frames: 8 or 16.")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal frames.")] = 0,
    undo: Annotated[
        str,
        typer.Option(
            help="Response the scene was taken with, to be undone first; most JPEGs: srgb."
        ),
    ] = "linear",
) -> None:
    """Take noisy frames of SCENE with a camera of known response.

    Writes frame_1.png, frame_2.png … (of ten or more frame_01.png …) and truth.json, which
    `show --truth` reads.

    \b
    Example:
        chartless simulate photo.jpg --undo srgb --response gamma:0.45 --noise 0.17,0.7 -o sim
        chartless calibrate sim/frame_*.png -o sim/camera.json
        chartless show sim/camera.json --truth sim/truth.json
    """
    from chartless.images import read_values
    from chartless.noise import AffineNoise
    from chartless.simulate.file import write_simulation

    curve, taken_with, sensor_noise = (
        parse_curve(response),
        parse_curve(undo),
        AffineNoise.from_8bit(*parse_pair(noise)),
    )
    if scene.resolve().parent == output.resolve():
        msg = f"{scene} lies in the output folder {output}: choose another folder"
        raise ParameterError(msg)
    picture = read_values(scene)
    light = picture.values if undo == "linear" else taken_with.inverse(picture.values.clip(0, 1))
    with progress_bar() as progress:

        def on_frame(number: int) -> None:
            if progress is not None:
                progress("simulating", number / frames)

        *written, truth = write_simulation(
            output,
            light,
            curve,
            sensor_noise,
            n_frames=frames,
            bit_depth=bits,
            seed=seed,
            settings={"scene": str(scene), "response": response, "undo": undo},
            on_frame=on_frame,
        )
    print(f"{len(written)} frames and {truth.name} written to {output}")
