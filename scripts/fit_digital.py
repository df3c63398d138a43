"""Compute the prior of digital cameras and write src/chartless/curves/digital.npz.

    python scripts/fit_digital.py [--data FOLDER]

FOLDER, or the one that CHARTLESS_DATA names, holds two sets of cameras, which are not part
of this project:

middlebury      nine cameras, a chart at four exposures. Their curves are those that
                `chartless.calibrate` finds from these brackets, three channels each
modern_curves   seven cameras that users of darktable measured from raw files and JPEGs, and
                the PowerShot S40, fitted to raw files beside their JPEGs

The prior is the interquartile mean of the log slopes of these seventeen cameras, the
principal components of their deviations, and a quarter of those of DoRF. Only these are kept.
"""

import argparse
import csv
import os
from pathlib import Path

import numpy as np

from chartless import calibrate
from chartless.curves.populations import Population, PopulationWeights, population_basis
from chartless.curves.prior import (
    N_BINS,
    bin_edges,
    digital_basis,
    log_slopes_of,
    log_slopes_of_response,
)
from chartless.datasets.digital import FILE, MEASURED
from chartless.methods import LikelihoodSearch
from chartless.types import Floats


def of_brackets(data: Path) -> dict[str, Floats]:
    """Log slopes of the cameras of the Middlebury data, shape (3, 256) each."""
    with (data / "middlebury_response" / "patch_levels.csv").open(newline="") as stream:
        exposures = {
            (row["camera"], row["exposure"]): float(row["rel_exposure_measured"])
            for row in csv.DictReader(stream)
            if row["illuminant"] == "1"
        }
    method = LikelihoodSearch(populations=PopulationWeights(dorf=1.0))  # not what is sought
    edges = bin_edges(N_BINS)
    found = {}
    for camera in sorted({name for name, _ in exposures}):
        times = {number: t for (name, number), t in sorted(exposures.items()) if name == camera}
        frames = [data / "middlebury" / camera / f"wb1i1e{number}-jpg.png" for number in times]
        calibration = calibrate(
            frames, times=list(times.values()), evidence="bracket", method=method
        )
        curves = [channel.curve.inverse(edges) for channel in calibration.channels]
        found[camera] = np.array([log_slopes_of(curve) for curve in curves])
    return found


def of_others(data: Path) -> dict[str, Floats]:
    """Log slopes of the cameras of `MEASURED`, shape (1, 256) each."""
    with np.load(data / FILE) as stored:  # with the black that they have
        light, names, curves = stored["E"].astype(float), stored["names"], stored["f"].astype(float)
    rows = dict(zip(map(str, names), curves, strict=True))
    return {name: log_slopes_of_response(light, rows[name])[np.newaxis] for name in MEASURED}


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("CHARTLESS_DATA", "data")))
    data = parser.parse_args().data
    cameras = {**of_brackets(data), **of_others(data)}
    basis = digital_basis(list(cameras.values()), population_basis(Population.DORF))
    provenance = {
        "script": "scripts/fit_digital.py",
        "data": "Middlebury color data (Chakrabarti, Scharstein & Zickler), brackets of nine "
        "cameras; base curves of darktable, seven cameras; raw files of a PowerShot S40 "
        "(digicam_corpus, CC0)",
        "cameras": list(cameras),
        "what": f"interquartile mean and {len(basis.components)} principal components, times "
        f"their deviations, of the log slope of g in each of {N_BINS} levels",
    }
    path = basis.save("digital", provenance)
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, {len(cameras)} cameras")


if __name__ == "__main__":
    main()
