"""One evaluation of the image-similarity objective, four ways, in one run on one core.

    python benchmarks/similarity.py [--json]

256 levels, linear response, noise U = 0.03 and V = 16 in 8-bit units, the level pairs that two
frames of 1600 × 900 pixels of evenly distributed light would give.

literal   the integral as published: 256 × 256 × 256 exponentials, vectorised
matrix    the same integral as a matrix product A Aᵀ over 256 nodes: the best that numerical
          integration can do
dense     the closed form for all 256 × 256 pairs
banded    the closed form for the pairs with counts, upper triangle: what chartless runs
binned    the default objective, integrated over bins, for the pairs with counts

Errors are the largest relative errors of S over the band of pairs with counts, against
mpmath at 30 digits, at 60 pairs including black and white.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import json
import time
from collections.abc import Callable

import mpmath
import numpy as np

from chartless.methods.ism.objectives import (
    BinnedPairs,
    SampledPairs,
    expected_table,
    half_levels,
    image_similarity,
    sampled_image_similarity,
)
from chartless.methods.ism.similarity import bounded_similarity, light_nodes, self_similarity
from chartless.noise import AffineNoise
from chartless.types import Counts, Floats

LEVELS, NODES, PIXELS = 256, 256, 1600 * 900
NOISE = AffineNoise.from_8bit(0.03, 16.0)
TARGETS = {"literal_over_banded": 100.0, "matrix_over_banded": 5.0}


def level_pairs() -> Counts:
    """Counts of two frames of evenly distributed light, as the model expects them."""
    expected = expected_table(half_levels(LEVELS), NOISE)
    counts = np.rint(expected * PIXELS / LEVELS).astype(np.int64)
    return counts + counts.T


def literal(levels: Floats) -> Floats:
    """S at all pairs of levels by one exponential for each pair and node."""
    nodes, weights = light_nodes(NOISE, NODES)
    variance = NOISE.variance(nodes)
    squares = (levels[:, np.newaxis] - nodes) ** 2
    exponent = (squares[:, np.newaxis] + squares) / (-2 * variance)
    similar: Floats = np.exp(exponent) @ (weights / (2 * np.pi * variance))
    return similar


def matrix(levels: Floats) -> Floats:
    """S at all pairs of levels by a matrix product."""
    nodes, weights = light_nodes(NOISE, NODES)
    variance = NOISE.variance(nodes)
    scale = np.sqrt(weights / (2 * np.pi * variance))
    root = np.exp((levels[:, np.newaxis] - nodes) ** 2 / (-2 * variance)) * scale
    similar: Floats = root @ root.T
    return similar


def exact(x: float, y: float) -> float:
    """S over light in [0, 1] by adaptive quadrature at 30 digits."""
    mpmath.mp.dps = 30
    u, v = mpmath.mpf(NOISE.slope), mpmath.mpf(NOISE.floor)
    deviation = mpmath.sqrt((u * (x + y) / 2 + v) / 2)
    inner = [(x + y) / 2 + k * deviation for k in range(-12, 13, 2)]
    points = [0, *(point for point in inner if 0 < point < 1), 1]

    def integrand(t: mpmath.mpf) -> mpmath.mpf:
        variance = u * t + v
        return mpmath.exp(-((x - t) ** 2 + (y - t) ** 2) / (2 * variance)) / (
            2 * mpmath.pi * variance
        )

    return float(mpmath.quad(integrand, points))


def best_milliseconds(run: Callable[[], float], repeats: int) -> float:
    """Shortest of several runs after a warm-up."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def measure() -> dict[str, dict[str, float]]:
    """Times, values and errors of every way, and the ratios of times."""
    counts = level_pairs()
    inverse = half_levels(LEVELS)
    levels = inverse[::2]
    sampled, binned = SampledPairs.from_counts(counts), BinnedPairs.from_counts(counts)
    widths = np.diff(inverse[1::2], prepend=0.0, append=1.0)
    shares = np.zeros((LEVELS, LEVELS))
    shares[sampled.rows, sampled.columns] = sampled.shares
    shares[sampled.columns, sampled.rows] += sampled.shares_back
    weights = shares * widths / (LEVELS - 1)

    z = float(np.sqrt(self_similarity(NOISE)))

    def objective(similar: Floats) -> float:
        return float(np.vdot(weights, similar)) / z

    def dense(levels: Floats) -> Floats:
        return bounded_similarity(levels[:, np.newaxis], levels, NOISE)

    runs: dict[str, tuple[Callable[[], float], int]] = {
        "literal": (lambda: objective(literal(levels)), 3),
        "matrix": (lambda: objective(matrix(levels)), 200),
        "dense": (lambda: objective(dense(levels)), 50),
        "banded": (lambda: sampled_image_similarity(sampled, inverse, NOISE), 500),
        "binned": (lambda: image_similarity(binned, inverse, NOISE), 200),
    }
    milliseconds = {name: best_milliseconds(*run) for name, run in runs.items()}

    chosen = np.linspace(0, sampled.rows.size - 1, 56).astype(int)
    pairs = [(sampled.rows[k], sampled.columns[k]) for k in chosen]
    pairs += [(0, 0), (0, 9), (255, 255), (243, 255)]
    truth = np.array([exact(levels[i], levels[j]) for i, j in pairs])
    rows, columns = map(list, zip(*pairs, strict=True))
    errors = {
        name: float(np.abs(way(levels)[rows, columns] / truth - 1).max())
        for name, way in (("literal", literal), ("matrix", matrix), ("dense", dense))
    }
    errors["banded"] = float(
        np.abs(bounded_similarity(levels[rows], levels[columns], NOISE) / truth - 1).max()
    )
    return {
        "milliseconds": milliseconds,
        "values": {name: run() for name, (run, _) in runs.items()},
        "errors": errors,
        "ratios": {
            "literal_over_banded": milliseconds["literal"] / milliseconds["banded"],
            "matrix_over_banded": milliseconds["matrix"] / milliseconds["banded"],
            "matrix_over_binned": milliseconds["matrix"] / milliseconds["binned"],
        },
        "targets": TARGETS,
        "cells": {"all": LEVELS**2, "banded": sampled.rows.size, "binned": binned.rows.size},
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    as_json = parser.parse_args().json
    result = measure()
    if as_json:
        print(json.dumps(result))
        return
    for name, value in result["milliseconds"].items():
        error = result["errors"].get(name)
        print(f"{name:8} {value:9.3f} ms" + (f"   error {error:.1e}" if error is not None else ""))
    for name, value in result["ratios"].items():
        target = f"   target {TARGETS[name]:g}" if name in TARGETS else ""
        print(f"{name:22} {value:7.1f}{target}")


if __name__ == "__main__":
    main()
