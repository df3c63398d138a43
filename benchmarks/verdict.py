"""Whether the verdict on a calibration tells good ones from bad: cameras with planted faults.

    python benchmarks/verdict.py [--scenes N] [--data FOLDER]

Two frames of each of N photographs (folder scenery_1600x900 of FOLDER, or of the one that
CHARTLESS_DATA names), of a sensor of 1,500 electrons read with 5, by sRGB and another curve; then
the same with one fault of the frames after the other. The error is the RMSE of f, the band the
deviation of g that the calibration gives. Some minutes for each photograph.
"""

import argparse
import io
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter, median_filter, shift

from chartless import AffineNoise, ModelCurve, calibrate, named_curve, rmse, simulate_frames
from chartless.curves import AbstractCurve
from chartless.errors import UnfitFramesError
from chartless.images import read_frame
from chartless.result.verdict import Grade, deviation, verdict
from chartless.types import Floats, Levels

NOISE, QUIET = AffineNoise.of_sensor(1_500, 5), AffineNoise.of_sensor(50_000, 20)
OTHERS = (ModelCurve("ameegc2-exact", (-0.9, 0.5, -0.3)), ModelCurve("gamma", (0.6,)))


def main() -> None:
    """Print a line for each calibration, and a table of the grades."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=3)
    parser.add_argument("--data", type=Path, default=os.environ.get("CHARTLESS_DATA"))
    given = parser.parse_args()
    srgb = named_curve("srgb")
    found: dict[Grade, list[tuple[float, float]]] = {grade: [] for grade in Grade}
    pictures = sorted((Path(given.data) / "scenery_1600x900").glob("*.jpg"))[: given.scenes]
    for place, path in enumerate(pictures):
        scene = srgb.inverse(read_frame(path).levels[..., 1] / 255)
        for name, curve in (("srgb", srgb), ("other", OTHERS[place % 2])):
            for fault, frames in with_faults(scene, curve):
                head = f"{path.stem[:12]:12}  {name:5}  {fault:12}"
                try:
                    channels = calibrate(frames).channels
                except UnfitFramesError:
                    print(f"{head}  refused", flush=True)
                    continue
                judged = verdict(channels)
                std = channels[0].inverse_lut_std
                assert std is not None
                error, band = rmse(channels[0].curve, curve), deviation(std)
                found[judged.grade].append((error, band))
                print(f"{head}  {error:.4f} ± {band:.4f}  {judged.grade.value}", flush=True)
    print(f"\n{'verdict':18}{'cases':>6}{'median':>9}{'worst':>9}{'error/band':>12}{'worst':>7}")
    for grade, cases in found.items():
        if cases:
            errors, bands = np.array(cases).T
            shares = errors / bands
            print(
                f"{grade.value:18}{len(cases):6}{np.median(errors):9.4f}{errors.max():9.4f}"
                f"{np.median(shares):12.2f}{shares.max():7.1f}"
            )


def with_faults(scene: Floats, curve: AbstractCurve) -> Iterator[tuple[str, list[Levels]]]:
    """Two frames without a fault, and with each."""

    def taken(light: Floats = scene, noise: AffineNoise = NOISE, seed: int = 3) -> list[Levels]:
        return list(simulate_frames(light.clip(0, 1), curve, noise, seed=seed))

    (first, second), (other, _) = taken(), taken(seed=4)
    yield "none", [first, second]
    for quality in (95, 85, 70):
        yield f"JPEG {quality}", [compressed(each, quality) for each in (first, second)]
    exact = [each.astype(np.float64) for each in (first, second)]
    yield "blurred", [rounded(gaussian_filter(each, 0.5)) for each in exact]
    yield "median", [median_filter(each, 3) for each in (first, second)]
    for pixels in (0.1, 0.3):
        moved = shift(scene, (0, pixels), order=1, mode="nearest")
        yield f"moved {pixels}", [first, taken(moved, seed=4)[0]]
    patches = gaussian_filter(np.random.default_rng(0).standard_normal(scene.shape), 15)
    for share in (0.01, 0.05):
        elsewhere = patches > np.quantile(patches, 1 - share)
        yield f"movers {share:.0%}", [first, np.where(elsewhere, np.roll(other, 50, 1), other)]
    yield "drift 5%", [first, taken(0.95 * scene, seed=4)[0]]
    yield "stretched", [rounded(1.15 * (each - 10)) for each in exact]
    yield "narrow", taken(0.25 + 0.4 * scene)
    yield "overexposed", taken(3 * scene)
    yield "quiet", taken(noise=QUIET)


def rounded(values: Floats) -> Levels:
    """Levels of 8 bits."""
    return np.rint(values).clip(0, 255).astype(np.uint8)


def compressed(levels: Levels, quality: int) -> Levels:
    """What JPEG makes of levels."""
    file = io.BytesIO()
    Image.fromarray(levels).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


if __name__ == "__main__":
    main()
