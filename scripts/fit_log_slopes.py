"""Compute the prior of log slopes from DoRF and write src/chartless/curves/dorf.npz.

    python scripts/fit_log_slopes.py [DORF]

DORF is a file that `chartless.datasets.load_dorf` reads; without, it is found or fetched as
for `chartless data fetch dorf`. The 190 distinct curves count once each. They are not part of this
project; the mean and the principal components of the logarithms of their slopes are.
"""

import argparse
from pathlib import Path

import numpy as np

from chartless.curves.prior import N_BINS, log_slope_basis
from chartless.datasets import load_dorf

N_COMPONENTS = 60


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dorf", type=Path, nargs="?", help="file with the DoRF curves")
    options = parser.parse_args()
    dorf = load_dorf(options.dorf)
    curves = dorf.curves[list(dorf.distinct)]
    whole = log_slope_basis(dorf.irradiance, curves, len(curves))
    kept = log_slope_basis(dorf.irradiance, curves, N_COMPONENTS)
    share = np.sum(kept.components**2) / np.sum(whole.components**2)
    provenance = {
        "script": "scripts/fit_log_slopes.py",
        "data": "Database of Response Functions (Grossberg & Nayar, Columbia University)",
        "curves": len(curves),
        "what": f"mean and {N_COMPONENTS} principal components, times their deviations, of the log "
        f"slope of g in each of {N_BINS} levels",
    }
    path = kept.save("dorf", provenance)
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, {share:.4%} of the variance")


if __name__ == "__main__":
    main()
