"""Fit every family to responses of digital cameras, from the levels of a colour chart.

    python scripts/fit_chart.py DATA/middlebury_response/patch_levels.csv

The file holds a line for each patch of a chart in each exposure of nine cameras: its mean level
in the JPEG and its irradiance from the raw file (derived from the Middlebury data set of
Chakrabarti, Scharstein and Zickler, *An empirical camera model for internet color vision*, 2009).
Grey patches under the first illuminant are used, levels 2 to 249. Raw saturation is not the JPEG's:
the irradiance of white is what `gumbel3` fits best, the same for all families.
"""

import argparse
import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from chartless.curves.comparison import is_valid
from chartless.curves.fitting import fit
from chartless.models import MODELS
from chartless.types import Floats

ORDERS = range(5)
DARKEST, BRIGHTEST, FEWEST = 1, 250, 10


def measured(path: Path) -> list[tuple[Floats, Floats]]:
    """Irradiance, in units of any size, and brightness of each camera and channel."""
    samples = defaultdict(list)
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            level = float(row["jpg_mean"])
            wanted = row["is_gray"] == "1" and row["illuminant"] == "1"
            if wanted and row["exposure_x_irradiance"] and DARKEST < level < BRIGHTEST:
                light = float(row["exposure_x_irradiance"])
                samples[row["camera"], row["channel"]].append((light, level / 255))
    curves = []
    for rows in samples.values():
        irradiance, brightness = np.array(sorted(rows)).T
        distinct = np.append(True, np.diff(irradiance) > 0)
        curves.append((irradiance[distinct], brightness[distinct]))
    return [curve for curve in curves if curve[0].size >= FEWEST]


def normalised(irradiance: Floats, brightness: Floats) -> tuple[Floats, Floats]:
    """Curve with the irradiance of white, up to 3.3 times the greatest, at 1."""
    greatest = np.log(irradiance.max() * 1.0001)
    white = minimize_scalar(
        lambda log: fit("gumbel3", irradiance / np.exp(log), brightness).rmse,
        bounds=(greatest, greatest + 1.2),
        method="bounded",
        options={"xatol": 0.01},
    ).x
    return irradiance / np.exp(white), brightness


def main() -> None:
    """Fit and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("levels", type=Path, help="patch_levels.csv")
    curves = [normalised(*curve) for curve in measured(parser.parse_args().levels)]
    print(f"{len(curves)} curves\nfamily            median     mean      max  valid responses")
    for name, model in MODELS.items():
        if model.order in ORDERS or name == "table":
            fits = [fit(name, *curve) for curve in curves]
            rmse = np.array([each.rmse for each in fits])
            print(
                f"{name:16}{np.median(rmse):8.5f} {rmse.mean():8.5f} {rmse.max():8.5f}"
                f"  {sum(map(is_valid, fits))}"
            )


if __name__ == "__main__":
    main()
