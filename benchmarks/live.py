"""How soon the curve of a running camera is known, what gain does to it, and what a frame costs.

    python benchmarks/live.py [--data FOLDER]

Ten response curves and ten photographs (folders dorf and scenery_1600x900 of FOLDER, or of the
one that CHARTLESS_DATA names), frames of 800 × 450 pixels, noise U and V drawn about the usual
ones. The prior of curves is made without the camera under test. Errors are the RMSE of f, bands the
deviation of g. Two minutes.
"""

import argparse
import os
import time
from pathlib import Path
from unittest import mock

import numpy as np

from chartless import AffineNoise, SampledCurve, named_curve, rmse, simulate_frames
from chartless import live as engine
from chartless.curves import AbstractCurve
from chartless.datasets import load_dorf
from chartless.experiments.noise import curve_prior
from chartless.frames.frame import Frame
from chartless.images import read_frame
from chartless.live import LiveEvidence, live_calibration
from chartless.methods import NoiseLevelSearch
from chartless.noise import CAMERAS_OF_2008, TYPICAL_8BIT, TYPICAL_SPREAD
from chartless.result.verdict import band
from chartless.types import Floats

CAMERAS, SEED = 10, 11
AFTER = (2, 5, 10, 30, 100)
CAMERA = Path("camera")


def main() -> None:
    """Print three tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("CHARTLESS_DATA"))
    folder = Path(parser.parse_args().data)
    dorf = load_dorf(folder / "dorf" / "dorf_named.npz")
    srgb = named_curve("srgb")
    pictures = sorted((folder / "scenery_1600x900").glob("*.jpg"))
    scenes = [srgb.inverse(read_frame(path).levels[..., 1] / 255) for path in pictures]
    rng = np.random.default_rng(SEED)
    rows = rng.choice(np.array(dorf.distinct), CAMERAS, replace=False)
    converged, mixed = [], []
    for place, row in enumerate(map(int, rows)):
        slope, floor = TYPICAL_8BIT * np.exp(TYPICAL_SPREAD * rng.standard_normal(2))
        noise = AffineNoise.from_8bit(slope, floor)
        rising = np.maximum.accumulate(dorf.curves[row])
        curve = SampledCurve(tuple(map(float, dorf.irradiance)), tuple(map(float, rising)))
        scene = scenes[2 * place % len(scenes)][::2, ::2, np.newaxis]
        search = NoiseLevelSearch(prior=curve_prior(dorf, row), noise_prior=CAMERAS_OF_2008)
        with mock.patch.object(engine, "NoiseLevelSearch", lambda search=search: search):
            converged.append(convergence(scene, curve, noise))
            mixed.append(gains(scene, curve, noise))
    print_table("after frames", AFTER, np.array(converged))
    print_table("gains 1, then 2", ("told apart", "mixed"), np.array(mixed))
    print_costs(scenes[0])


def convergence(scene: Floats, curve: AbstractCurve, noise: AffineNoise) -> list[list[float]]:
    """Error, band, and share of the levels within two deviations, after so many frames."""
    live, found = LiveEvidence(), []
    for levels in simulate_frames(scene, curve, noise, n_frames=max(AFTER), seed=SEED):
        live.add(Frame(CAMERA, levels))
        if live.n_frames in AFTER:
            found.append(judged(live, curve))
    return found


def gains(scene: Floats, curve: AbstractCurve, noise: AffineNoise) -> list[list[float]]:
    """The same of ten frames of half the light and ten of twice the gain, told apart and not."""
    frames = [
        Frame(CAMERA, levels)
        for gain in (1, 2)
        for levels in simulate_frames(
            gain / 2 * scene,
            curve,
            AffineNoise(gain * noise.slope, gain**2 * noise.floor),
            n_frames=10,
            seed=gain,
        )
    ]
    found = []
    for limit in (engine._OTHER_GAIN, np.inf):  # noqa: SLF001 - what it is there for
        live = LiveEvidence()
        with mock.patch.object(engine, "_OTHER_GAIN", limit):
            for frame in frames:
                live.add(frame)
        found.append(judged(live, curve))
    return found


def judged(live: LiveEvidence, curve: AbstractCurve) -> list[float]:
    """Error, band, share of the levels within two deviations of the truth."""
    channels = live_calibration(live).channels
    (response,) = channels
    std = response.inverse_lut_std
    assert std is not None
    truth = curve.inverse(np.linspace(0, 1, response.n_levels))
    within = float(np.mean(np.abs(response.inverse_lut - truth) <= 2 * std + 1e-12))
    return [rmse(response.curve, curve), band(channels) or np.nan, within]


def print_table(name: str, rows: tuple[object, ...], found: Floats) -> None:
    """Print medians and worst over the cameras, `found` of shape (cameras, rows, 3)."""
    print(f"{name:16}  error: median, worst   band: median, worst   levels within two: least")
    for place, row in enumerate(rows):
        errors, bands, within = found[:, place].T
        print(
            f"{row!s:16}{np.median(errors):13.4f}{errors.max():8.4f}{np.median(bands):14.4f}"
            f"{bands.max():8.4f}{within.min():20.0%}"
        )
    print()


def print_costs(scene: Floats) -> None:
    """Print milliseconds of a frame of 1920 × 1080 pixels and of an estimate."""
    large = np.pad(scene, ((0, 1080 - scene.shape[0]), (0, 1920 - scene.shape[1])), mode="reflect")
    noise = AffineNoise.from_8bit(*TYPICAL_8BIT)
    for name, shape in (("grey", (1,)), ("colour", (3,))):
        light = np.broadcast_to(large[..., np.newaxis], (*large.shape, *shape))
        shots = [*simulate_frames(light, named_curve("srgb"), noise, n_frames=12)]
        live, seconds = LiveEvidence(), []
        for levels in shots:
            start = time.perf_counter()
            live.add(Frame(CAMERA, levels))
            seconds.append(time.perf_counter() - start)
        estimates = []
        for _ in range(10):
            start = time.perf_counter()
            live_calibration(live)
            estimates.append(time.perf_counter() - start)
        print(
            f"{name}, 1920 × 1080: a frame {1e3 * np.median(seconds[1:]):.0f} ms, an estimate "
            f"{1e3 * np.median(estimates[1:]):.0f} ms"
        )


if __name__ == "__main__":
    main()
