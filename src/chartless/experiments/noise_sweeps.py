"""How the error of calibration depends on the frames: what the paper does not show.

One factor at a time is moved away from a reference camera, with the paper's method (exact
AMEEGC, binned similarity) and with the likelihood of any curve. Beside each stands the
Cramér–Rao bound of the same pairs: for the member of the family nearest to the true response,
and for any curve.
"""

from collections.abc import Iterator
from dataclasses import astuple, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from chartless._version import __version__
from chartless.curves.fitting import fit
from chartless.curves.prior import N_BINS, bin_edges
from chartless.datasets import Dorf
from chartless.evidence.noise.bound import free_bound, pair_bound
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.experiments._cases import OnCase, fingerprint_of, run_cases
from chartless.experiments.noise import (
    ITERATIONS,
    ROUNDS,
    NoiseCase,
    curve_prior,
    draw_cases,
    estimate,
    mixture_without,
    read_scene,
    scene_files,
    scenes_of,
    search,
    true_curve,
)
from chartless.frames.levels import level_table
from chartless.images import through_jpeg
from chartless.methods import LikelihoodSearch, SimilaritySearch
from chartless.models import AmeegcExact
from chartless.noise import CAMERAS_OF_2008, AffineNoise
from chartless.simulate import simulate_frames
from chartless.types import Floats, JsonObject, Levels

METHODS = ("ism-bin/ameegc2-exact", "likelihood/default")


@dataclass(frozen=True, slots=True)
class Camera:
    """Everything that is varied, at the reference."""

    stride: int = 1
    """Every so many rows and columns of the scene are used."""
    frames: int = 2
    slope_8bit: float = 0.03
    floor_8bit: float = 16.0
    bits: int = 8
    quality: int | None = None
    """Quality of JPEG compression; None without."""


FACTORS: dict[str, tuple[str, tuple[float | None, ...]]] = {
    "stride": ("pixels", (8, 4, 2, 1)),
    "frames": ("frames", (2, 4, 8, 16)),
    "slope_8bit": ("U, noise slope (8-bit levels)", (0.01, 0.02, 0.04, 0.06, 0.12)),
    "floor_8bit": ("V, noise floor (8-bit levels²)", (4.0, 9.0, 16.0, 25.0, 49.0)),
    "bits": ("bits (counted at 256 levels)", (8, 10, 12)),
    "quality": ("JPEG quality (bound: without JPEG)", (85, 95, 100, None)),
}
"""For each field of `Camera`, its name on an axis and the values it takes."""


@dataclass(frozen=True, slots=True, eq=False)
class SweepPoint:
    """One value of one factor."""

    factor: str
    value: float | None
    rmse: dict[str, Floats]
    """RMSE of each case, shape (B,), by method."""
    bound: dict[str, Floats]
    """Cramér–Rao bound of each case, shape (B,), by method."""


def run(
    dorf: Dorf,
    scenes: Path,
    output: Path,
    *,
    n_cases: int,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    on_case: OnCase | None = None,
) -> list[SweepPoint]:
    """Run every value of every factor on the same cases.

    Parameters and errors are those of `chartless.experiments.noise.run`.
    """
    files = scene_files(scenes)
    drawn = draw_cases(files, dorf, n_cases, seed)
    named = list(_points())
    results = run_cases(
        {
            _name(camera, case): partial(
                _case,
                case,
                camera,
                files[0].parent / case.scene,
                dorf,
            )
            for _, _, camera in named  # the reference, in every factor, runs once
            for case in drawn
        },
        output / "sweeps",
        fingerprint=fingerprint_of(
            dorf.irradiance, dorf.curves, seed, scenes_of(files), __version__
        ),
        jobs=jobs,
        scheduler=scheduler,
        on_case=on_case,
    )
    points = []
    for factor, value, camera in named:
        own = [results[_name(camera, case)] for case in drawn]
        rmse, bound = (
            {method: np.array([each[what][method] for each in own]) for method in METHODS}
            for what in ("rmse", "bound")
        )
        points.append(SweepPoint(factor, value, rmse, bound))
    return points


def summarize(points: list[SweepPoint]) -> JsonObject:
    """Medians by factor and value."""
    content: JsonObject = {}
    for point in points:
        content.setdefault(point.factor, {})[str(point.value)] = {
            method: {
                "cases": len(point.rmse[method]),
                "median": float(np.median(point.rmse[method])),
                "q25": float(np.quantile(point.rmse[method], 0.25)),
                "q75": float(np.quantile(point.rmse[method], 0.75)),
                "bound": float(np.median(point.bound[method])),
            }
            for method in METHODS
        }
    return {"sweeps": content}


def _name(camera: Camera, case: NoiseCase) -> str:
    return "-".join(map(str, (*astuple(camera), f"{case.number:04d}")))


def _points() -> Iterator[tuple[str, float | None, Camera]]:
    for factor, (_, values) in FACTORS.items():
        for value in values:
            yield factor, value, replace(Camera(), **{factor: value})  # type: ignore[arg-type]


def _case(case: NoiseCase, camera: Camera, path: Path, dorf: Dorf) -> JsonObject:
    irradiance, brightness = dorf.irradiance, dorf.curves[case.row]
    truth = true_curve(irradiance, brightness)
    noise = AffineNoise.from_8bit(camera.slope_8bit, camera.floor_8bit)
    scene = read_scene(path)[:: camera.stride, :: camera.stride]
    frames = simulate_frames(
        scene, truth, noise, n_frames=camera.frames, bit_depth=camera.bits, seed=case.seed
    )
    table = Cooccurrence.zeros()
    for first, second in pairwise(_stored(each, camera) for each in frames):
        table += Cooccurrence.of_pair(first, second)
    prior = curve_prior(dorf, case.row)
    similarity = SimilaritySearch(rounds=ROUNDS, iterations=ITERATIONS, tolerance=0.0)
    likelihood = LikelihoodSearch(
        prior=mixture_without(dorf, case.row), noise_prior=CAMERAS_OF_2008
    )
    nearest = fit(AmeegcExact(), irradiance, brightness)
    of_family = pair_bound(AmeegcExact(), nearest.parameters, noise, scene, table.n_pairs)
    edges = truth.inverse(bin_edges(table.n_levels)[1:-1])
    of_any = free_bound(edges, noise, scene, table.n_pairs, prior)
    found = estimate(likelihood, table, truth, n_frames=camera.frames)
    rmse = (search(similarity, table, truth).rmse, found.rmse)
    return {
        "rmse": dict(zip(METHODS, rmse, strict=True)),
        "bound": dict(zip(METHODS, (of_family.rmse, of_any), strict=True)),
    }


def _stored(levels: Levels, camera: Camera) -> Levels:
    """Levels as they come back from a file, reduced to 256, as `chartless.calibrate` does."""
    if camera.quality is not None:
        levels = through_jpeg(levels.astype(np.uint8), camera.quality)
    return level_table((1 << camera.bits) - 1, N_BINS)[levels]
