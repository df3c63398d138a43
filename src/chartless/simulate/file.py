"""Simulated frames on disk, with the truth beside them."""

import json
from collections.abc import Callable
from pathlib import Path

from chartless._files import make_folder, write_text
from chartless.curves import AbstractCurve
from chartless.errors import OutputError, ParameterError
from chartless.images import DataType, write_image
from chartless.models import UNIFORM_IRRADIANCE
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames
from chartless.types import Floats, Floats32, JsonObject

_FILE_BITS = (8, 16)


def write_simulation(
    folder: Path,
    scene: Floats | Floats32,
    curve: AbstractCurve,
    noise: AffineNoise,
    *,
    n_frames: int,
    bit_depth: int,
    seed: int,
    settings: JsonObject,
    on_frame: Callable[[int], None] | None = None,
) -> list[Path]:
    """Simulate frames and write them as PNG, with ``truth.json``.

    Parameters
    ----------
    folder : Path
        Made if it does not exist; its parent must.
    scene : ndarray of float, shape (M, N, 1 or 3)
        True irradiance, 1 is saturation.
    curve, noise, n_frames, bit_depth, seed
        As for `chartless.simulate.simulate_frames`.
    settings : dict
        What to record of where these came from.
    on_frame : callable, optional
        Called with the number of each frame that was written.

    Returns
    -------
    list of Path
        The frames, their numbers with as many digits as the last, then the truth.

    Raises
    ------
    OutputError
        If the folder cannot be made or written, or holds further frames.
    ParameterError
        If the bit depth is neither 8 nor 16, or as for `simulate_frames`.
    """
    if bit_depth not in _FILE_BITS:
        msg = f"picture files hold 8 or 16 bits, not {bit_depth}"
        raise ParameterError(msg)
    frames = simulate_frames(scene, curve, noise, n_frames=n_frames, bit_depth=bit_depth, seed=seed)
    make_folder(folder)
    width = len(str(n_frames))
    paths = [folder / f"frame_{number:0{width}d}.png" for number in range(1, n_frames + 1)]
    others = sorted(set(folder.glob("frame_*.png")) - set(paths))
    if others:
        msg = f"holds {others[0].name} of another simulation: choose a new folder or delete it"
        raise OutputError(str(folder), msg)
    data_type: DataType = "uint8" if bit_depth == 8 else "uint16"  # noqa: PLR2004
    top = (1 << bit_depth) - 1
    for number, (path, levels) in enumerate(zip(paths, frames, strict=True), start=1):
        write_image(path, levels / top, data_type=data_type, linear=False)
        if on_frame is not None:
            on_frame(number)
    truth = folder / "truth.json"
    content = {
        "format": "chartless-truth",
        "version": 1,
        "noise": {
            "u": noise.slope,
            "v": noise.floor,
            "U": noise.slope_8bit,
            "V": noise.floor_8bit,
        },
        "response_lut": curve.response(UNIFORM_IRRADIANCE).tolist(),
        "bit_depth": bit_depth,
        "settings": {**settings, "seed": seed},
    }
    write_text(truth, json.dumps(content) + "\n")
    return [*paths, truth]
