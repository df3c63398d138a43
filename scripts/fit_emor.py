"""Compute the EMoR bases from DoRF and write src/chartless/models/emor.npz.

    python scripts/fit_emor.py [DORF] [--compare FOLDER]

DORF is a file that `chartless.datasets.load_dorf` reads; without, it is found or fetched as
for `chartless data fetch dorf`. All 201 curves count, as in Grossberg and Nayar, *Modeling the
space of camera response functions* (2004), eleven of them repeated. The curves are not part
of this project; their mean and principal components are.

With --compare, emor.txt and invemor.txt of Columbia University in FOLDER are read, and the
largest angle between the subspaces of K components and the variance that each explains are
printed.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.linalg import subspace_angles

from chartless.datasets import load_dorf
from chartless.models import N_COMPONENTS, Basis, principal_basis
from chartless.types import Floats, JsonObject

TARGET = Path(__file__).parents[1] / "src" / "chartless" / "models" / "emor.npz"


def bases(irradiance: Floats, curves: Floats) -> dict[str, tuple[Basis, Floats]]:
    """Basis of f, of g and of ln f, each with the samples that it was made from."""
    grid = np.linspace(0, 1, irradiance.size)
    inverses = np.array([np.interp(grid, curve, irradiance) for curve in curves])
    samples = {"response": curves, "inverse": inverses, "log_response": np.log(curves[:, 1:])}
    return {kind: (principal_basis(rows), rows) for kind, rows in samples.items()}


def published(path: Path) -> Basis:
    """Basis from emor.txt or invemor.txt: blocks of a title and 1024 numbers."""
    blocks: list[list[float]] = []
    for line in path.read_text(encoding="ascii").splitlines():
        if "=" in line:
            blocks.append([])
        elif line.strip():
            blocks[-1].extend(map(float, line.split()))
    rows = np.array(blocks)
    return Basis(rows[1], rows[2:], np.full(len(rows) - 2, np.nan))


def explained(basis: Basis, samples: Floats, n_components: int) -> float:
    """Share of the variance of samples about their mean that components explain."""
    away = samples - samples.mean(axis=0)
    rest = samples - basis.mean
    components = basis.components[:n_components]
    rest = rest - rest @ components.T @ components
    return float(1 - np.sum(rest**2) / np.sum(away**2))


def main() -> None:
    """Compute, write, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dorf", type=Path, nargs="?", help="file with the DoRF curves")
    parser.add_argument("--compare", type=Path, help="folder of emor.txt and invemor.txt")
    options = parser.parse_args()
    dorf = load_dorf(options.dorf)
    computed = bases(dorf.irradiance, dorf.curves)
    arrays: dict[str, npt.NDArray[np.generic]] = {}
    for kind, (basis, _) in computed.items():
        rows = np.vstack([basis.mean, basis.components]).astype(np.float32)
        if kind != "log_response":
            rows[:, [0, -1]] = np.array([0, 1]) * (np.arange(len(rows)) == 0)[:, np.newaxis]
        else:
            rows[:, -1] = 0  # ln 1
        arrays[kind] = rows
        arrays[f"{kind}_deviations"] = basis.deviations.astype(np.float32)
    provenance: JsonObject = {
        "script": "scripts/fit_emor.py",
        "data": "Database of Response Functions (Grossberg & Nayar, Columbia University)",
        "curves": len(dorf.curves),
        "what": f"mean and {N_COMPONENTS} principal components of f, of g and of ln f",
    }
    arrays["provenance"] = np.array(json.dumps(provenance))
    np.savez_compressed(TARGET, allow_pickle=False, **arrays)
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1000:.0f} kB")
    if options.compare is not None:
        for name, kind in (("emor.txt", "response"), ("invemor.txt", "inverse")):
            theirs, (ours, samples) = published(options.compare / name), computed[kind]
            print(f"{name}: mean differs by {np.abs(theirs.mean - ours.mean).max():.1e} at most")
            for n in (1, 3, 5, 11, 25):
                angle = subspace_angles(theirs.components[:n].T, ours.components[:n].T).max()
                shares = [explained(basis, samples, n) for basis in (theirs, ours)]
                print(
                    f"  {n:2} components: largest angle {np.degrees(angle):7.4f} degrees, "
                    f"variance explained {shares[0]:.6f} (theirs) {shares[1]:.6f} (ours)"
                )


if __name__ == "__main__":
    main()
