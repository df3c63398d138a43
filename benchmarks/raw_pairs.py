"""Inverse responses estimated from raw files beside their JPEGs, against measured and known truth.

    python benchmarks/raw_pairs.py [--data FOLDER] [--cases real,simulated] [--n 24] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names.

real        nine cameras, a chart at four exposures, 27 camera-channels (folders middlebury and
            middlebury_response): the raw crops, of 8 bits and white-balanced, beside the JPEGs.
            Truth and error are those of `brackets.py`
offset      the same against exposures and light with a black level fitted
simulated   photographs, sRGB undone, by a matrix and curves of the Database of Response Functions,
            the prior made without the camera; a Bayer sensor of 12 bits with the noise of ISO 200,
            falloff, sharpening and JPEG of quality 75 to 97 with halved chroma. One shot each

Errors are root mean squares of f(s x) − y with the best scale s, in units of full range; `own
gains` takes those that the fit found for each shot into account. `within 2 std` is the share of the
truth that lies within two deviations of the estimate: patches, or levels seen; `shape std` is the
deviation claimed for the shape, `held` the share within two of these where g is brought closest by
one factor.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import io
import json
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from brackets import CHANNELS, Truth, error, held, real_brackets
from PIL import Image
from priors import digital_prior, mixture
from scipy.ndimage import uniform_filter

from chartless.curves import AbstractCurve, SampledCurve, SrgbCurve
from chartless.datasets.dorf import load_dorf
from chartless.evidence.raw.gather import raw_evidence
from chartless.experiments.noise import curve_prior
from chartless.frames.frame import Frame, Origin, RawPicture
from chartless.images import read_frame, read_values
from chartless.methods import LikelihoodSearch
from chartless.result.response import Response
from chartless.types import Floats

EXPOSURES = "1234"
SATURATED = 235  # of the raw crops
MATRIX = np.array([[1.7, -0.6, -0.1], [-0.2, 1.5, -0.3], [0.05, -0.5, 1.45]])
BALANCE, FALLOFF, SHARPENING = np.array([2.0, 1.0, 1.5]), 0.2, 0.5
NOISE = (1e-4, 1e-7)  # u and v
BLACK, WHITE = 256, 4095
GAINS, QUALITIES = (1.0, 2.0), (75, 98)


@dataclass(frozen=True, slots=True)
class Row:
    """What came out for one channel."""

    name: str
    error: float
    own_gains: float
    within: float
    std: float
    held: float
    shape_std: float


def summary(rows: Sequence[Row]) -> dict[str, float]:
    """Medians and worst."""
    errors = [row.error for row in rows]
    return {
        "channels": len(rows),
        "median": statistics.median(errors),
        "mean": statistics.fmean(errors),
        "worst": max(errors),
        "own gains": statistics.median(row.own_gains for row in rows),
        "within 2 std": statistics.fmean(row.within for row in rows),
        "std": statistics.median(row.std for row in rows),
        "held": statistics.fmean(row.held for row in rows),
        "shape std": statistics.median(row.shape_std for row in rows),
    }


def judged(name: str, response: Response, truth: Truth, gains: Floats) -> Row:
    """Compare an estimate with points (light, brightness) of the truth."""
    assert response.inverse_lut_std is not None
    assert response.shape_std is not None
    lut, std, shape_std = response.inverse_lut, response.inverse_lut_std, response.shape_std
    own = Truth(truth.x * gains[truth.frame], truth.y, truth.frame)
    grid = np.linspace(0.0, 1.0, lut.size)
    found, doubt = np.interp(own.y, grid, lut), np.interp(own.y, grid, std)
    weight = 1 / np.maximum(doubt, 1e-6) ** 2
    scale = np.sum(weight * found * own.x) / np.sum(weight * own.x**2)
    return Row(
        name=name,
        error=error(lut, truth),
        own_gains=error(lut, own),
        within=float(np.mean(np.abs(found - scale * own.x) < 2 * doubt)),
        std=float(np.sqrt(np.mean(std**2))),
        held=held(lut, shape_std, own),
        shape_std=float(np.sqrt(np.mean(shape_std**2))),
    )


def crops(data: Path, camera: str) -> Iterator[tuple[RawPicture, Frame]]:
    """Raw crops as cells of 2 × 2 pixels, with their JPEGs."""
    for exposure in EXPOSURES:
        stem = data / "middlebury" / camera / f"wb1i1e{exposure}"
        raw = read_frame(f"{stem}-raw.png").levels
        height, width = raw.shape[0] // 2, raw.shape[1] // 2
        cells = raw[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 3)
        picture = RawPicture(
            path=Path(f"{stem}-raw.png"),
            light=(cells.mean(axis=(1, 3)) / 255).astype(np.float32),
            saturated=np.asarray(np.any(cells >= SATURATED, axis=(1, 3, 4))),
            cell=(2, 2),
            white_balance=np.ones(3),
            error=12**-0.5 / 255,
        )
        yield picture, read_frame(f"{stem}-jpg.png")


def real(data: Path, *, offset: bool = False) -> list[Row]:
    """Nine cameras."""
    rows = []
    for bracket in real_brackets(data, offset=offset):
        evidence = raw_evidence(crops(data, bracket.name))
        prior = mixture(Origin.CAMERA, digital=digital_prior(data, bracket.name))
        calibrator = LikelihoodSearch(prior=prior)
        for channel, truth in zip(CHANNELS, bracket.truth, strict=True):
            response = calibrator.calibrate(evidence.channel(channel), channel=channel)
            gains = np.array(response.account("raw")["gains"])
            rows.append(judged(f"{bracket.name} {channel}", response, truth, gains))
    return rows


def shot(
    light: Floats, curve: AbstractCurve, gain: float, quality: int, rng: np.random.Generator
) -> tuple[RawPicture, Frame]:
    """A raw file and its JPEG of light as it should be shown, shape (2 M, 2 N, 3)."""
    height, width = light.shape[:2]
    down, right = np.linspace(-1, 1, height), np.linspace(-1, 1, width)
    square = (down[:, np.newaxis] * height) ** 2 + (right * width) ** 2
    falloff = np.exp(-FALLOFF * square / (height**2 + width**2))[..., np.newaxis]
    seen = falloff * np.maximum(light @ np.linalg.inv(MATRIX).T, 0) / gain / BALANCE
    seen += rng.standard_normal(seen.shape) * np.sqrt(NOISE[0] * seen + NOISE[1])
    levels = np.rint(BLACK + (WHITE - BLACK) * seen).clip(0, WHITE)
    sensor = (levels - BLACK) / (WHITE - BLACK)
    shown = (gain * (sensor * BALANCE / falloff) @ MATRIX.T).clip(0, 1)
    shown = curve.response(shown)
    shown += SHARPENING * (shown - uniform_filter(shown, (5, 5, 0)))
    stream = io.BytesIO()
    finished = Image.fromarray(np.rint(255 * shown.clip(0, 1)).astype(np.uint8))
    finished.save(stream, "JPEG", quality=quality, subsampling=2)
    green = (sensor[::2, 1::2, 1] + sensor[1::2, ::2, 1]) / 2
    cells = np.stack([sensor[::2, ::2, 0], green, sensor[1::2, 1::2, 2]], axis=-1)
    picture = RawPicture(
        path=Path("simulated.dng"),
        light=cells.astype(np.float32),
        saturated=np.asarray(np.any(cells >= 0.95, axis=-1)),  # noqa: PLR2004 - as files are read
        cell=(2, 2),
        white_balance=BALANCE,
        error=12**-0.5 / (WHITE - BLACK),
    )
    return picture, Frame(Path("simulated.jpg"), np.asarray(Image.open(stream)).copy())


def simulated(data: Path, n_cases: int) -> list[Row]:
    """Photographs by curves of measured cameras."""
    dorf = load_dorf()
    scenes = sorted((data / "scenery_1600x900").glob("*.jpg"))
    rng = np.random.default_rng(0)
    rows = []
    for case in range(n_cases):
        row = int(rng.choice(dorf.distinct))
        curve = SampledCurve(tuple(dorf.irradiance.tolist()), tuple(dorf.curves[row].tolist()))
        values = read_values(scenes[case % len(scenes)]).values.astype(np.float64)
        light = SrgbCurve().inverse(values)
        height, width = (2 * (length // 2) for length in light.shape[:2])
        quality = int(rng.integers(*QUALITIES))
        pair = shot(light[:height, :width], curve, float(rng.uniform(*GAINS)), quality, rng)
        evidence = raw_evidence([pair])
        prior = mixture(Origin.CAMERA, dorf=curve_prior(dorf, row))
        calibrator = LikelihoodSearch(prior=prior)
        for channel in CHANNELS:
            blocks = evidence.blocks[channel]
            response = calibrator.calibrate(evidence.channel(channel), channel=channel)
            low, high = np.quantile(blocks.level, [0.001, 0.999])
            y = np.linspace(low, high, 500) / 255
            x = curve.inverse(y)
            truth = Truth(x, y, np.zeros(y.size, dtype=np.intp))
            rows.append(judged(f"{case} {channel}", response, truth, np.ones(1)))
    return rows


def main() -> None:
    """Run what was asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=os.environ.get("CHARTLESS_DATA"))
    parser.add_argument("--cases", default="real,offset,simulated")
    parser.add_argument("--n", type=int, default=24, help="simulated shots")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    if given.data is None:
        parser.error("name the folder of the data with --data or CHARTLESS_DATA")
    run = {
        "real": lambda: real(given.data),
        "offset": lambda: real(given.data, offset=True),
        "simulated": lambda: simulated(given.data, given.n),
    }
    result = {}
    for case in given.cases.split(","):
        rows = run[case]()
        result[case] = summary(rows)
        if not given.json:
            for row in rows:
                print(f"{case:10s} {row.name:22s} {row.error:.4f} {row.own_gains:.4f}")
            print(case, {key: round(value, 4) for key, value in result[case].items()})
    if given.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
