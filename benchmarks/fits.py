"""Fits of all measured curves at once against a loop of `scipy.optimize.least_squares`.

    python benchmarks/fits.py [--json] [--repeats 5] [--data FOLDER]

201 curves of 1024 points (DoRF, from FOLDER or CHARTLESS_DATA; without it curves are made up,
and the first line says so), family ameegc2, the same starts and the same tolerance for all, one
core.

default      `fit_many` with the starts that the family proposes
batch        `fit_many(..., starts=...)`
trf, lm      a loop over curves and starts of SciPy's solver by that method, with the analytic
             Jacobian, every response and its Jacobian computed once
exponential  nothing but np.exp over as many numbers as the evaluations of the batch need, in
             pieces that stay in the cache: no solver with as many evaluations can be faster

That limit is far: the exponentials take a fortieth of the time. The rest is passes of memory over
residuals and Jacobians, their products, and what NumPy spends between a hundred array operations.

Times are the best of the repeats, which run all ways in turn; the ratio to the faster method of
SciPy is the median of those of neighbouring runs, and stands beside that of the best. The run
fails unless all ways reach the same RMSE to 1e-6 on every curve.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal
from unittest import mock

import numpy as np
from scipy import optimize

from chartless._numeric import least_squares as solver
from chartless.curves import fitting
from chartless.curves.fitting import fit_many
from chartless.datasets import DatasetError, load_dorf
from chartless.models import MODELS, AbstractModel
from chartless.types import Floats

FAMILY, TOLERANCE, SAME_RMSE = "ameegc2", 1e-12, 1e-6
TARGETS = {"scipy_over_batch": 4.0}
# The linear camera, a dark curve, a gamma of 0.45 and one that bends early.
STARTS = np.array([[0.0, 1.6, 2.3], [0.3, 1.6, 2.3], [-0.8, 1.6, 2.3], [-0.3, 2.1, 2.6]])
_PIECE = 2**15  # numbers: 256 kB


def measured_curves(folder: Path | None) -> tuple[Floats, Floats, str]:
    """Irradiance, curves, and what they are."""
    if folder is None and "CHARTLESS_DATA" in os.environ:
        folder = Path(os.environ["CHARTLESS_DATA"])
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = beside if folder is None else folder
    try:
        dorf = load_dorf(folder / "dorf")
    except DatasetError:
        rng = np.random.default_rng(1)
        irradiance = np.linspace(0, 1, 1024)
        members = rng.normal([-0.7, 0.5, -0.2], [0.4, 0.8, 0.8], size=(201, 3))
        smooth = MODELS["eegc2"].response(irradiance, members)
        ripple = 0.01 * np.sin(2 * np.pi * irradiance * rng.uniform(1, 3, size=(201, 1)))
        return irradiance, (smooth + ripple).clip(0, 1), "made-up curves: DoRF was not found"
    return dorf.irradiance, dorf.curves, "DoRF"


def scipy_loop(
    model: AbstractModel, x: Floats, curves: Floats, method: Literal["trf", "lm"]
) -> tuple[Floats, int]:
    """Least RMSE over the starts for each curve, and the number of evaluations."""
    rmse = np.full(len(curves), np.inf)
    evaluations = 0
    for row, curve in enumerate(curves):
        last: dict[bytes, Floats] = {}

        def residual(
            parameters: Floats, curve: Floats = curve, last: dict[bytes, Floats] = last
        ) -> Floats:
            response, gradient = model.evaluate(x, parameters)
            last.clear()
            last[parameters.tobytes()] = gradient
            return response - curve

        def jacobian(parameters: Floats, last: dict[bytes, Floats] = last) -> Floats:
            known = last.get(parameters.tobytes())
            return model.evaluate(x, parameters)[1] if known is None else known

        for start in STARTS:
            found = optimize.least_squares(
                residual, start, jac=jacobian, method=method,
                ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE,
            )  # fmt: skip
            evaluations += found.nfev
            rmse[row] = min(rmse[row], np.sqrt(2 * found.cost / x.size))
    return rmse, evaluations


def exponential_seconds(n_evaluations: int, n_samples: int) -> float:
    """Time of the exponentials alone: exp of ψ and exp of ln f at every sample."""
    piece = np.linspace(-1.0, 0.5, _PIECE)
    out = np.empty_like(piece)
    start = time.perf_counter()
    for _ in range(2 * n_evaluations * n_samples // _PIECE):
        np.exp(piece, out=out)
    return time.perf_counter() - start


def batch_evaluations(x: Floats, curves: Floats) -> int:
    """Evaluations of one curve that the batch needs in all, counted by its own solver."""
    counts: list[int] = []

    def counted(*arguments: object, **settings: object) -> solver.Solutions:
        solutions = solver.least_squares(*arguments, **settings)  # type: ignore[arg-type]
        counts.append(solutions.evaluations)
        return solutions

    with mock.patch.object(fitting, "least_squares", counted):
        fit_many(FAMILY, x, curves, starts=STARTS)
    return sum(counts)


def timed(way: Callable[[], Floats]) -> tuple[Floats, float]:
    """What a way finds, and the time it takes."""
    start = time.perf_counter()
    found = way()
    return found, time.perf_counter() - start


def measure(folder: Path | None, repeats: int) -> dict[str, dict[str, float] | str]:
    """Times, evaluations, agreement and ratios of all ways."""
    x, curves, what = measured_curves(folder)
    model = MODELS[FAMILY]
    evaluations = {"batch": batch_evaluations(x, curves)}
    rmse: dict[str, Floats] = {}

    def fits(starts: Floats | None) -> Floats:
        return np.array([each.rmse for each in fit_many(model, x, curves, starts=starts)])

    def loop(method: Literal["trf", "lm"]) -> Floats:
        found, evaluations[method] = scipy_loop(model, x, curves, method)
        return found

    ways: dict[str, Callable[[], Floats]] = {
        "default": lambda: fits(None),
        "batch": lambda: fits(STARTS),
        "trf": lambda: loop("trf"),
        "lm": lambda: loop("lm"),
    }
    seconds: dict[str, list[float]] = {name: [] for name in (*ways, "exponential")}
    fits(STARTS[:1])  # the first call warms the caches
    for _ in range(repeats):
        for name, way in ways.items():
            rmse[name], taken = timed(way)
            seconds[name].append(taken)
        seconds["exponential"].append(exponential_seconds(evaluations["batch"], x.size))
    differences = {name: float(np.abs(rmse["batch"] - rmse[name]).max()) for name in ways}
    if max(differences.values()) > SAME_RMSE:
        msg = f"the ways do not reach the same RMSE: {differences}"
        raise SystemExit(msg)
    best = {name: min(times) for name, times in seconds.items()}
    faster = min(("trf", "lm"), key=best.__getitem__)
    neighbours = zip(seconds[faster], seconds["batch"], strict=True)
    numbers = evaluations["batch"] * x.size * (model.n_parameters + 1)
    return {
        "curves": what,
        "seconds": best,
        "evaluations_per_search": {
            name: count / (len(curves) * len(STARTS)) for name, count in evaluations.items()
        },
        "difference_of_rmse": differences,
        "ratios": {
            "scipy_over_batch": statistics.median(a / b for a, b in neighbours),
            "best_scipy_over_best_batch": best[faster] / best["batch"],
            "batch_over_exponential": best["batch"] / best["exponential"],
        },
        "limit": {
            "microseconds_per_evaluation": 1e6 * best["batch"] / evaluations["batch"],
            "gigabytes_of_residuals_and_jacobians": 8e-9 * numbers,
            "gigabytes_per_second": 8e-9 * numbers / best["batch"],
        },
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--data", type=Path, help="folder with the folder dorf")
    arguments = parser.parse_args()
    result = measure(arguments.data, arguments.repeats)
    if arguments.json:
        print(json.dumps({**result, "targets": TARGETS}))
        return
    for what, figures in result.items():
        if isinstance(figures, str):
            print(f"{what}: {figures}")
            continue
        print(what)
        for key, value in figures.items():
            target = f"   target {TARGETS[key]:g}" if key in TARGETS else ""
            print(f"  {key:36} {value:10.3g}{target}")


if __name__ == "__main__":
    main()
