"""Kinds of evidence alone and together, on the same simulated cameras.

    python benchmarks/together.py [--data FOLDER] [--n CASES] [--json]

Cases are those of `files.py`: scenes before digital cameras and cameras of DoRF in turn, the camera
under test left out of the prior, 10,000 electrons read with 6.

bracket    five exposures two stops apart as JPEG 95, exposures given
unknown    the same, exposures unknown
raw        two shots two stops apart: the light of each cell of 2 × 2 pixels with its noise, beside
           the JPEG 95 of the same exposure
noise      two frames of the middle exposure as JPEG 95
points     twelve grey patches from 3 to 90 % of the light at white: brightness to 0.002, light up
           to a factor and to 1 %, as lighting and printed reflectances are

Of each sum the table has the medians of `files.py` over all channels, and `ratio`: the median error
of the shape over that of the better of its parts. It is above 1.1 where the sum is worse than what
a user would get from one part alone.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before NumPy starts

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
from brackets import print_table
from files import NOISE, TIMES, Case, Measured, cases, measured, written

from chartless.evidence.base import AbstractEvidence, by_channel
from chartless.evidence.bracket.gather import bracket_evidence
from chartless.evidence.exposures import UNKNOWN_ERROR
from chartless.evidence.noise.gather import noise_evidence
from chartless.evidence.points.gather import Point, PointsEvidence
from chartless.evidence.raw.gather import raw_evidence
from chartless.frames.frame import FrameSource, RawPicture
from chartless.images import read_frame
from chartless.methods import LikelihoodSearch
from chartless.types import Floats

SUMS = (
    ("bracket",),
    ("unknown",),
    ("raw",),
    ("noise",),
    ("points",),
    ("points", "bracket"),
    ("points", "raw"),
    ("points", "noise"),
    ("raw", "bracket"),
    ("raw", "unknown"),
    ("raw", "noise"),
    ("bracket", "noise"),
    ("raw", "bracket", "noise"),
)
FORM = "jpeg95"
SHOTS = (2, 3)
"""Numbers of the exposures that have raw files."""
BITS = 14
PATCHES = np.geomspace(0.03, 0.9, 12)
"""Light of the patches of a chart, in that at white."""
LIGHT_ERROR, BRIGHTNESS_ERROR = 0.01, 0.002
COLUMNS = ("shape", "light", "white", "white_band", "cover", "at_best", "claimed", "held")


def evidence_of(case: Case, folder: Path) -> dict[str, AbstractEvidence]:
    """All kinds of evidence of one camera."""
    paths = [
        written(folder, f"{case.seed}-{place}", case.levels(exposure, NOISE, place), FORM)
        for place, exposure in enumerate(TIMES)
    ]
    again = written(folder, f"{case.seed}-again", case.levels(TIMES[2], NOISE, 20), FORM)
    shots = [(raw_picture(case, TIMES[place], place), read_frame(paths[place])) for place in SHOTS]
    return {
        "bracket": bracket_evidence(map(read_frame, paths), np.log(TIMES)),
        "unknown": bracket_evidence(map(read_frame, paths), None, exposure_error=UNKNOWN_ERROR),
        "raw": raw_evidence(shots),
        "noise": noise_evidence(map(read_frame, [paths[2], again])),
        "points": patches(case),
    }


def patches(case: Case) -> PointsEvidence:
    """Grey patches of a chart, each a little off what is printed beside it."""
    generator = np.random.default_rng([case.seed, 200])
    light = PATCHES * np.exp(LIGHT_ERROR * generator.standard_normal(PATCHES.size))
    points = []
    for name, curve in zip("RGB", case.curves, strict=True):
        shown = curve.response(light) + BRIGHTNESS_ERROR * generator.standard_normal(light.size)
        values = zip(PATCHES.tolist(), shown.clip(0, 1).tolist(), strict=True)
        points += [Point(each, b, BRIGHTNESS_ERROR, name) for each, b in values]
    source = FrameSource(Path("patches.csv"), "", ())
    return PointsEvidence(tuple(points), (source,), n_levels=256)


def raw_picture(case: Case, exposure: float, seed: int) -> RawPicture:
    """Light of each cell of 2 × 2 pixels, as a sensor of its own noise reads it."""
    generator = np.random.default_rng([case.seed, 100 + seed])
    light = np.maximum(case.scene * exposure, 0.0)
    light = light + generator.standard_normal(light.shape) * NOISE.std(light)
    read = np.rint(light.clip(0, 1) * (1 << BITS)) / (1 << BITS)
    rows, columns, _ = read.shape
    cells = read.reshape(rows // 2, 2, columns // 2, 2, 3)
    return RawPicture(
        path=Path(f"{seed}.dng"),
        light=cells.mean(axis=(1, 3)).astype(np.float32),
        saturated=np.asarray(np.any(cells >= 1, axis=(1, 3, 4))),
        cell=(2, 2),
        white_balance=np.ones(3),
        error=1e-4,
    )


def judged(data: Path, n: int) -> Iterator[tuple[str, float, Measured]]:
    """Name of a sum, seconds for its three channels, and what became of one of them."""
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(data, n):
            there = evidence_of(case, Path(folder))
            method = LikelihoodSearch(prior=case.prior)
            for parts in SUMS:
                given = by_channel([there[name] for name in parts])
                start = time.perf_counter()
                found = method.calibrate_channels({c: each.parts for c, each in given.items()})
                seconds = time.perf_counter() - start
                for place, response in enumerate(found):
                    yield "+".join(parts), seconds, measured(case, place, response)


def main() -> None:
    """Run all sums and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    parser.add_argument("--n", type=int, default=20)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    rows: dict[str, list[tuple[float, Measured]]] = {}
    for name, seconds, found in judged(options.data, options.n):
        rows.setdefault(name, []).append((seconds, found))
    shapes = {
        name: np.array([each.shape for _, each in own], np.float64) for name, own in rows.items()
    }
    table = {
        name: {
            **{key: _middle([asdict(each)[key] for _, each in own], key) for key in COLUMNS},
            "worst": float(shapes[name].max()),
            "ratio": _ratio(shapes, name),
            "seconds": statistics.median(seconds for seconds, _ in own),
        }
        for name, own in rows.items()
    }
    if options.json:
        print(json.dumps(table))
        return
    header = ["evidence", *COLUMNS, "worst", "ratio", "seconds"]
    rows_of_text = [
        [name, *(f"{row[key]:.4f}" for key in header[1:])] for name, row in table.items()
    ]
    print_table([header, *rows_of_text])


def _middle(values: list[float], key: str) -> float:
    """Median, and of what is held or covered the mean."""
    return statistics.mean(values) if key in ("held", "cover") else statistics.median(values)


def _ratio(shapes: dict[str, Floats], name: str) -> float:
    """Median error over that of the better part."""
    best = min(float(np.median(shapes[part])) for part in name.split("+"))
    return float(np.median(shapes[name])) / best


if __name__ == "__main__":
    main()
