"""What the exact likelihood costs: one channel from its table of level pairs, on one core.

    python benchmarks/likelihood.py [--json] [--repeats 5]

A pair of simulated 8-bit frames of 1600 × 900 pixels, 256 levels, any curve.

start      noise level, its curve and a first scene: all that nlf does but its error bars
ridge      the most probable curve at each ratio of the noise parameters, by Fisher scoring
integrate  posterior mean and deviations
expand     log-likelihood, gradient and information once: what scoring mostly does
limit      the matrix products in it at the rate this machine multiplies large matrices; L levels
           and K nodes cost seven products of 2 L² K operations, and the information on the
           scene 2 l² k K, l levels and k nodes being those that a node shares

Times are medians.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"  # before NumPy starts

import argparse
import json
import statistics
import time
from collections.abc import Callable

import numpy as np

from chartless.curves import SrgbCurve
from chartless.curves.populations import measured_prior
from chartless.curves.space import free_curve
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.likelihood import PairCounts, PairModel
from chartless.evidence.noise.start import noise_level_start
from chartless.evidence.noise.term import PAIR_WEIGHT, PairTerm, ridge_share, scene_name
from chartless.inference.block import curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.noise_block import NoiseBlock, noise_name
from chartless.inference.posterior import integrated
from chartless.inference.ridge import at_ratio, ridge
from chartless.methods import LikelihoodSearch, NoiseLevelSearch
from chartless.noise import SENSORS, AffineNoise
from chartless.result.response import rmse
from chartless.simulate import simulate_frames

SIZE = (900, 1600)
NOISE = AffineNoise.of_sensor(1_500, 5)
NO_PART = 1e-9
TARGETS = {"likelihood": 1.0, "nlf": 0.030}
"""Seconds."""


def seconds(run: Callable[[], object], repeats: int) -> float:
    """Median time of a call."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def measure(repeats: int) -> dict[str, dict[str, float]]:
    """Times in seconds, operations, and how near the curve comes."""
    scene = np.random.default_rng(0).beta(1.0, 2.0, SIZE)
    table = Cooccurrence.of_pair(*simulate_frames(scene, SrgbCurve(), NOISE))
    counts = PairCounts.of(table, weight=PAIR_WEIGHT)
    prior, space = measured_prior(table.n_levels), free_curve(measured_prior(table.n_levels))
    usual = SENSORS.centre
    fit, light = noise_level_start(counts, prior, usual)
    noise = NoiseBlock("Y", SENSORS, holds_ratio=True)
    term, share = PairTerm(counts, light.nodes.size, noise), ridge_share(counts, space)
    begin = {
        curve_name("Y"): space.nearest(fit.edges),
        noise_name("Y"): at_ratio(usual.ratio, fit.log_floor),
        scene_name("Y"): light.log_weights,
    }

    def along_ridge() -> list[ChannelMode]:
        return ridge([term], "Y", space, begin, share)

    modes = along_ridge()
    best = max((found.mode for found in modes), key=lambda mode: mode.log_evidence)
    likelihood, nlf, pairs = LikelihoodSearch(), NoiseLevelSearch(), LevelPairs(table)
    response = likelihood.calibrate(pairs)

    def model() -> PairModel:
        return term.fit(best.edges, best.values).model

    def expand() -> object:
        fresh = model()
        return fresh.expand(counts, fresh.deviation[np.newaxis] ** 2)

    square = np.random.default_rng(0).normal(size=(1024, 1024))
    rate = 2 * 1024**3 / seconds(lambda: square @ square, repeats)
    shares = model().shares
    seen = (shares > NO_PART).astype(np.float64)
    shown = seen.sum(axis=0)  # levels of each node
    shared = seen.T @ seen > 0
    n_levels, n_nodes = shares.shape
    of_pairs = 7 * 2 * n_levels**2 * n_nodes
    of_scene = float(np.sum(2 * shown**2 * np.triu(shared).sum(axis=1)))
    return {
        "seconds": {
            "likelihood": seconds(lambda: likelihood.calibrate(pairs), repeats),
            "start": seconds(lambda: noise_level_start(counts, prior, usual), repeats),
            "ridge": seconds(along_ridge, repeats),
            "integrate": seconds(lambda: integrated(modes, space, share), repeats),
            "nlf": seconds(lambda: nlf.calibrate(pairs), repeats),
            "expand": seconds(expand, repeats),
            "log_likelihood": seconds(lambda: model().log_likelihood(counts), repeats),
        },
        "work": {
            "modes": len(modes),
            "steps": sum(found.mode.steps for found in modes),
            "nodes": n_nodes,
            "operations of expand": of_pairs + of_scene,
            "operations per second": rate,
            "limit of expand": (of_pairs + of_scene) / rate,
        },
        "error": {
            "likelihood": rmse(response.curve, SrgbCurve()),
            "nlf": rmse(nlf.calibrate(pairs).curve, SrgbCurve()),
        },
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    results = measure(options.repeats)
    if options.json:
        print(json.dumps({**results, "targets": TARGETS}))
        return
    for part, numbers in results.items():
        print(part)
        for name, value in numbers.items():
            wanted = part == "seconds" and name in TARGETS
            target = f"   target {TARGETS[name]:g}" if wanted else ""
            print(f"  {name:24} {value:12.4g}{target}")


if __name__ == "__main__":
    main()
