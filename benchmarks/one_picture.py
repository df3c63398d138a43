"""The typical curve, which is the answer for one picture, against measured cameras.

    python benchmarks/one_picture.py [--data FOLDER] [--json]

Data are in FOLDER, or in the one that CHARTLESS_DATA names. The camera under test is left out of
the prior; cameras of `charts` are not in it, but for the PowerShot S40, which is left out there.

chart crops     nine cameras, one JPEG each as `chartless.calibrate` reads it, 27 camera-channels.
                Truth and error are those of `brackets.py`, over all four exposures
charts          one photograph of a chart by each of 27 cameras (folder charts_cameras). Truth are
                the reflectances of the six grey patches, which uneven light and flare make good to
                0.2 stops and no better. The error is the median of three channels
measured        eight cameras of modern_curves, 255 levels each
PowerShot S40   JPEG against the curve fitted to its raw files (folder rawjpeg_powershot), levels 16
                to 240

Errors are root mean squares of f(s x) − y with the best scale s, in units of full range. `sRGB` and
`DoRF` are the errors of its curve and of the mean of the Database of Response Functions. `ratio` is
the median of the error over that of sRGB, camera by camera. `held` is the share of the truth that
lies within two deviations of the shape where one factor brings g closest, `light` the share within
two deviations of g as it is, where the truth knows the light at white (nan elsewhere), `std` the
deviation claimed for the shape.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before NumPy starts

import argparse
import csv
import json
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from brackets import CHANNELS, HIGHEST, LOWEST, Truth, error, held, print_table, real_brackets
from priors import digital_cameras, digital_prior

from chartless import calibrate
from chartless.curves import SrgbCurve
from chartless.curves.populations import measured_prior
from chartless.curves.prior import CurvePrior, irradiance_at_edges
from chartless.inference.posterior import at_levels
from chartless.methods import LikelihoodSearch
from chartless.result.response import Response
from chartless.types import Levels

REFLECTANCES = np.array([0.8807, 0.5900, 0.3649, 0.1906, 0.0882, 0.0315])
"""Y of the grey patches of a ColorChecker made after November 2014, by its maker."""
GREY, LEAST_PATCHES = range(19, 25), 4
S40, S40_LEVELS = "raw_S40", (16, 240)
LEVELS = np.arange(256) / 255
HEADER = ["", "n", "median", "mean", "p90", "sRGB", "DoRF", "ratio", "held", "light", "std"]


@dataclass(frozen=True, slots=True)
class Row:
    """What came out for one camera or channel."""

    kind: str
    name: str
    error: float
    srgb: float
    dorf: float
    held: float
    light: float
    std: float


def answer(prior: CurvePrior, picture: Levels | Path) -> Response:
    """Response of the middle channel, as for a user who has only this picture."""
    method = LikelihoodSearch(prior=prior)
    found = calibrate([picture], method=method, evidence="typical")
    return found.channels[len(found.channels) // 2]


def compared(kind: str, name: str, response: Response, truths: list[Truth]) -> Row:
    """Errors of an answer, medians over channels."""
    assert response.shape_std is not None
    srgb = SrgbCurve().inverse(LEVELS)
    dorf = at_levels(irradiance_at_edges(measured_prior().mean)[1:-1])
    errors = [[error(lut, truth) for lut in (response.inverse_lut, srgb, dorf)] for truth in truths]
    inside = [held(response.inverse_lut, response.shape_std, truth) for truth in truths]
    std = float(np.sqrt(np.mean(response.shape_std**2)))
    light_held = float("nan")
    if len(truths) == 1 and truths[0].x[-1] == 1.0 == truths[0].y[-1]:  # white is known
        (truth,) = truths
        assert response.inverse_lut_std is not None
        off = np.abs(np.interp(truth.y, LEVELS, response.inverse_lut) - truth.x)
        light_held = float(np.mean(off <= 2 * np.interp(truth.y, LEVELS, response.inverse_lut_std)))
    own, of_srgb, of_dorf = np.median(errors, axis=0)
    return Row(kind, name, own, of_srgb, of_dorf, float(np.mean(inside)), light_held, std)


def of_crops(data: Path) -> Iterator[Row]:
    """Nine cameras, left out one by one."""
    for bracket in real_brackets(data):
        response = answer(digital_prior(data, bracket.name), bracket.frames[1])
        for channel, truth in zip(CHANNELS, bracket.truth, strict=True):
            yield compared("chart crops", f"{bracket.name} {channel}", response, [truth])


def of_charts(data: Path) -> Iterator[Row]:
    """One photograph of a chart by each camera."""
    folder = data / "charts_cameras"
    with (folder / "patches.csv").open(newline="") as stream:
        patches = {row["corpus_path"]: row for row in csv.DictReader(stream)}
    with (folder / "index.csv").open(newline="") as stream:
        pictures = list(csv.DictReader(stream))
    for picture in pictures:
        own, truths = patches[picture["corpus_path"]], []
        for channel in CHANNELS:
            levels = np.array([float(own[f"p{patch}_{channel}"]) for patch in GREY])
            seen = (levels >= LOWEST) & (levels <= HIGHEST)
            if np.count_nonzero(seen) >= LEAST_PATCHES:
                frame = np.zeros(np.count_nonzero(seen), dtype=np.intp)
                truths.append(Truth(REFLECTANCES[seen], levels[seen] / 255, frame))
        prior = digital_prior(data, *([S40] if "S40" in picture["camera"] else []))
        response = answer(prior, folder / picture["file"])
        yield compared("charts", picture["camera"], response, truths)


def of_measured(data: Path) -> Iterator[Row]:
    """Cameras with a curve that others measured, left out one by one."""
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    for name, rows in digital_cameras(data).items():
        if len(rows) > 1:  # from a bracket
            continue
        light = at_levels(irradiance_at_edges(rows[0])[1:-1])[1:]
        truth = Truth(light, LEVELS[1:], np.zeros(light.size, dtype=np.intp))
        response = answer(digital_prior(data, name), picture)
        yield compared("measured", name, response, [truth])


def of_s40(data: Path) -> Iterator[Row]:
    """PowerShot S40 by its raw files."""
    folder = data / "rawjpeg_powershot"
    table = np.loadtxt(folder / "truth_inverse_response.csv", delimiter=",", skiprows=1)
    kept = (table[:, 0] >= S40_LEVELS[0]) & (table[:, 0] <= S40_LEVELS[1])
    levels, light = table[kept, 0], table[kept, 1]
    truth = Truth(light, levels / 255, np.zeros(levels.size, dtype=np.intp))
    for path in sorted(folder.glob("S40_IMG_*.JPG")):
        response = answer(digital_prior(data, S40), path)
        yield compared("PowerShot S40", path.stem, response, [truth])


def summary(kind: str, rows: list[Row]) -> list[str]:
    """Row of the table, in the order of `HEADER`."""
    errors = np.array([row.error for row in rows])
    figures = [
        float(np.median(errors)),
        float(errors.mean()),
        float(np.percentile(errors, 90)),
        statistics.median(row.srgb for row in rows),
        statistics.median(row.dorf for row in rows),
    ]
    return [
        kind,
        str(len(rows)),
        *(f"{figure:.4f}" for figure in figures),
        f"{statistics.median(row.error / row.srgb for row in rows):.2f}",
        f"{statistics.fmean(row.held for row in rows):.2f}",
        f"{statistics.fmean(row.light for row in rows):.2f}",
        f"{statistics.median(row.std for row in rows):.3f}",
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    parser.add_argument("--json", action="store_true", help="print every row as JSON")
    options = parser.parse_args()
    data = options.data
    rows = [*of_crops(data), *of_charts(data), *of_measured(data), *of_s40(data)]
    if options.json:
        print(json.dumps([{name: getattr(row, name) for name in Row.__slots__} for row in rows]))
        return
    kinds = dict.fromkeys(row.kind for row in rows)
    own = [summary(kind, [row for row in rows if row.kind == kind]) for kind in kinds]
    print_table([HEADER, *own])


if __name__ == "__main__":
    main()
