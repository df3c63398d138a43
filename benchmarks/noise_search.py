"""One search of the paper, with the integral in closed form and two ways by quadrature.

    python benchmarks/noise_search.py [--json] [--scene PHOTOGRAPH]

15 rounds of at most 10 + 10 iterations of Nelder–Mead on one pair of 1600 × 900 pixels, 8 bits,
the exact AMEEGC of order 2 and the sampled objective, as published, on one core.

closed    S in closed form for the pairs of levels with counts: what chartless runs
matrix    S as a matrix product A Aᵀ over 256 nodes: the best that numerical integration can do
literal   256 exponentials for each pair of levels. It makes a few evaluations along the way of the
          others, and is scaled to as many as they make

All three take the same steps, as the search sees the same numbers; the benchmark checks that they
end in the same curve, for the literal integral that it gives the same values.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import json
import time
from pathlib import Path
from unittest import mock

import numpy as np

from chartless.curves import SrgbCurve
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.experiments.noise import ITERATIONS, LEAST_SIZE, ROUNDS, read_scene
from chartless.methods.ism import objectives
from chartless.methods.ism.objectives import (
    Objective,
    SampledPairs,
    half_levels,
    sampled_image_similarity,
)
from chartless.methods.ism.search import FoundCurve, SimilaritySearch
from chartless.methods.ism.similarity import light_nodes, quadrature_similarity, self_similarity
from chartless.models import AmeegcExact
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames
from chartless.types import Floats

NODES = 256
NOISE = AffineNoise.from_8bit(0.03, 16.0)
LITERAL_EVALUATIONS = 8
TARGETS = {"literal_over_closed": 100.0, "matrix_over_closed": 4.0}


def by_matrix(pairs: SampledPairs, inverse: Floats, noise: AffineNoise) -> float:
    """Objective with all of S by a matrix product."""
    levels = inverse[::2]
    nodes, weights = light_nodes(noise, NODES)
    variance = noise.variance(nodes)
    scale = np.sqrt(weights / (2 * np.pi * variance))
    root = np.exp((levels[:, np.newaxis] - nodes) ** 2 / (-2 * variance)) * scale
    return _objective(pairs, inverse, noise, (root @ root.T)[pairs.rows, pairs.columns])


def by_literal(pairs: SampledPairs, inverse: Floats, noise: AffineNoise) -> float:
    """Objective with S integrated at each of the 256 × 256 pairs of levels."""
    levels = inverse[::2]
    similar = quadrature_similarity(levels[:, np.newaxis], levels, noise, nodes=NODES)
    return _objective(pairs, inverse, noise, similar[pairs.rows, pairs.columns])


def _objective(pairs: SampledPairs, inverse: Floats, noise: AffineNoise, similar: Floats) -> float:
    widths = np.diff(inverse[1::2], prepend=0.0, append=1.0)
    weights = pairs.shares * widths[pairs.columns] + pairs.shares_back * widths[pairs.rows]
    n_levels = (inverse.size + 1) // 2
    return float(weights @ similar) / (n_levels - 1) / float(np.sqrt(self_similarity(noise)))


def searched(table: Cooccurrence, objective: Objective) -> tuple[FoundCurve, float]:
    """What a search with an objective finds, and its seconds."""
    calibrator = SimilaritySearch(
        objective="sampled", rounds=ROUNDS, iterations=ITERATIONS, tolerance=0.0
    )
    with mock.patch.dict(objectives.OBJECTIVES, {"sampled": objective}):
        start = time.perf_counter()
        found = calibrator.search(table)
        return found, time.perf_counter() - start


def measure(scene: Floats) -> dict[str, object]:
    """Times, ratios and agreement of the three."""
    table = Cooccurrence.of_pair(*simulate_frames(scene, SrgbCurve(), NOISE))
    prepare = SampledPairs.from_counts
    closed, closed_seconds = searched(table, Objective(prepare, sampled_image_similarity))
    matrix, matrix_seconds = searched(table, Objective(prepare, by_matrix))

    model, pairs = AmeegcExact(), prepare(table.symmetric)
    grid = np.linspace(0, 1, 1024)
    difference = np.abs(
        model.response(grid, closed.parameters) - model.response(grid, matrix.parameters)
    ).max()
    shares = np.linspace(0, 1, LITERAL_EVALUATIONS)[:, np.newaxis]
    path = (1 - shares) * model.identity + shares * closed.parameters
    start = time.perf_counter()
    literal = [by_literal(pairs, model.inverse(half_levels(256), step), NOISE) for step in path]
    literal_seconds = (time.perf_counter() - start) / LITERAL_EVALUATIONS
    same = [
        sampled_image_similarity(pairs, model.inverse(half_levels(256), step), NOISE)
        for step in path
    ]
    evaluations = closed.history.evaluations
    return {
        "seconds": {
            "closed": closed_seconds,
            "matrix": matrix_seconds,
            "literal, scaled": literal_seconds * evaluations,
        },
        "evaluations": {"closed": evaluations, "matrix": matrix.history.evaluations},
        "largest_difference": {
            "curve, closed and matrix": float(difference),
            "objective, closed and literal": float(np.abs(np.divide(literal, same) - 1).max()),
        },
        "ratios": {
            "literal_over_closed": literal_seconds * evaluations / closed_seconds,
            "matrix_over_closed": matrix_seconds / closed_seconds,
        },
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--scene", type=Path, help="RGB photograph of 1600 × 900 or more")
    options = parser.parse_args()
    if options.scene is None:  # light of every strength, dark more often than bright
        scene = np.random.default_rng(0).beta(1.0, 2.0, LEAST_SIZE)
    else:
        scene = read_scene(options.scene)
    results = measure(scene)
    if options.json:
        print(json.dumps({**results, "targets": TARGETS}))
        return
    for part, numbers in results.items():
        print(part)
        for name, value in numbers.items():  # type: ignore[attr-defined]
            target = f"   target {TARGETS[name]:g}" if name in TARGETS else ""
            print(f"  {name:32} {value:12.4g}{target}")


if __name__ == "__main__":
    main()
