"""``chartless demo``: the main job on a photograph that is always there, truth known."""

from pathlib import Path
from typing import Annotated

import typer

from chartless.cli._options import AsJson
from chartless.cli._terminal import print_json, print_summary, progress_bar

_RESPONSE = "srgb"
_ELECTRONS, _READ = 1_500, 5  # at white, and the noise of reading: high ISO
_SEED = 1


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to create.")] = Path(
        "chartless-demo"
    ),
    as_json: AsJson = False,
) -> None:
    """Calibrate a simulated camera and compare with the truth.

    Takes a photograph for a scene, makes two noisy frames of it with a camera whose response
    is known, calibrates from these two frames alone, and linearises the first.

    \b
    Example:
        chartless demo -o out
    """
    import numpy as np
    from skimage.data import astronaut  # ships with scikit-image, nothing is downloaded

    from chartless.curves import named_curve
    from chartless.formats.calibration_file import save, to_json
    from chartless.images import read_frame, write_image
    from chartless.noise import AffineNoise
    from chartless.plotting import save_figure
    from chartless.report import overview
    from chartless.result.response import rmse
    from chartless.simulate.file import write_simulation
    from chartless.workflow import calibrate

    truth = named_curve(_RESPONSE)
    noise = AffineNoise.of_sensor(_ELECTRONS, _READ)
    scene = named_curve("srgb").inverse(np.asarray(astronaut()) / 255)
    *frames, _ = write_simulation(
        output,
        scene,
        truth,
        noise,
        n_frames=2,
        bit_depth=8,
        seed=_SEED,
        settings={"scene": "skimage.data.astronaut", "response": _RESPONSE},
    )
    with progress_bar() as progress:
        calibration = calibrate(frames, progress=progress)
    save(calibration, output / "camera.json")
    write_image(output / "linear.exr", calibration.linearize(read_frame(frames[0]).levels))
    save_figure(overview(calibration, truth=truth), output / "report.png")

    errors = [rmse(response.curve, truth) for response in calibration.channels]
    sensor = {"electrons": _ELECTRONS, "read": _READ}
    uncalibrated = rmse(named_curve("linear"), truth)
    if as_json:
        comparison = {"rmse": errors, "rmse_linear": uncalibrated, **sensor}
        print_json({**to_json(calibration), "truth": comparison})
        return
    print(
        f"truth: response {_RESPONSE}, sensor of {_ELECTRONS} electrons read with {_READ}; "
        "two frames of 512 × 512\n"
    )
    print_summary(calibration, errors)
    print(f"\nRMSE without calibration (linear camera): {uncalibrated:.4f}")
    print(f"{output}: frame_1.png frame_2.png camera.json linear.exr report.png truth.json")
