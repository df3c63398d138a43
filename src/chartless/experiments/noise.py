"""Does a compact monotone family make noise-based calibration surer? Section V of the paper.

Photographs are taken for scenes; simulated cameras with responses from the Database of Response
Functions take two noisy frames of each; every method estimates the response from the same
co-occurrence table and is compared with the truth.
"""

import os
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from chartless._files import make_folder, write_csv
from chartless._version import __version__
from chartless.curves import SampledCurve, SrgbCurve
from chartless.curves.populations import Population
from chartless.curves.prior import CurvePrior, bin_edges, log_slope_basis
from chartless.datasets import Dorf
from chartless.errors import ImageError, ParameterError
from chartless.evidence.noise.bound import free_bound
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.origins import weights_of
from chartless.experiments._cases import OnCase, fingerprint_of, run_cases
from chartless.images import read_values
from chartless.methods import (
    AbstractCalibrator,
    LikelihoodSearch,
    NoiseLevelSearch,
    SimilaritySearch,
)
from chartless.models import MODELS, UNIFORM_IRRADIANCE, AbstractModel, Basis, Emor, principal_basis
from chartless.noise import CAMERAS_OF_2008, AffineNoise
from chartless.result.response import rmse
from chartless.simulate import simulate_frames
from chartless.types import Counts, Floats, JsonObject

SLOPES_8BIT, FLOORS_8BIT = (0.01, 0.06), (9.0, 25.0)
"""Ranges of U and V in the paper."""
LEAST_SIZE = (900, 1600)
"""Rows and columns of the paper's photographs."""
INFEASIBLE = 1.001
"""Total variation of an estimated curve above which it counts as infeasible; 1 is monotone."""
LEFT_OUT = "-left-out"
"""Ends the names of methods whose EMoR basis is made without the camera under test."""
OBJECTIVES = ("ism-bin", "ism-sampled")
MODEL_NAMES = ("ameegc2", "ameegc2-exact", "emor2", "emor4", "emor2-left-out", "emor4-left-out")
SEARCHES = tuple(f"{objective}/{model}" for objective in OBJECTIVES for model in MODEL_NAMES)
"""Methods of the paper."""
LIKELIHOODS = ("nlf/default", "likelihood/default", "likelihood/dark", "likelihood/ameegc2-exact")
"""Ours; dark has two frames with the lens covered besides. Their prior of any curve is made
without the camera under test."""
METHODS = SEARCHES + LIKELIHOODS
N_DARK, DARK_SIZE = 2, (450, 800)
"""Dark frames, and rows and columns of them: a quarter of a frame has enough pixels."""
ROUNDS, ITERATIONS = 15, 10
"""As in the paper: rounds of a search over the noise and one over the curve, iterations of each."""
_GREEN = 1
_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr")


@dataclass(frozen=True, slots=True)
class NoiseCase:
    """One simulated camera in front of one scene."""

    number: int
    scene: str
    """File name."""
    slope_8bit: float
    floor_8bit: float
    row: int
    """Row of the response in DoRF."""
    seed: int

    @property
    def noise(self) -> AffineNoise:
        """Noise of the camera."""
        return AffineNoise.from_8bit(self.slope_8bit, self.floor_8bit)


def default_scenes() -> Path:
    """Folder of photographs that the environment variable CHARTLESS_DATA leads to.

    Raises
    ------
    ParameterError
        If there is none.
    """
    root = os.environ.get("CHARTLESS_DATA")
    folder = Path(root or ".", "scenery_1600x900")
    if root is None or not folder.is_dir():
        msg = (
            "no scenes: give a folder of RGB photographs of 1600 × 900 pixels or more as "
            "`scenes`, or set CHARTLESS_DATA to a folder that has them as scenery_1600x900"
        )
        raise ParameterError(msg)
    return folder


def scene_files(folder: Path) -> list[Path]:
    """Photographs in a folder, by name, with absolute paths.

    Raises
    ------
    ParameterError
        If there is none.
    """
    if not folder.is_dir():
        msg = f"{folder}: there is no such folder of photographs for scenes"
        raise ParameterError(msg)
    found = sorted(
        path
        for path in folder.absolute().glob("*")
        if path.suffix.lower() in _SUFFIXES and path.is_file()
    )
    if not found:
        msg = f"{folder}: no photographs ({', '.join(_SUFFIXES)}) for scenes"
        raise ParameterError(msg)
    return found


def read_scene(path: Path) -> Floats:
    """Green channel of a photograph, sRGB undone, as irradiance: shape (M, N), 0 … 1.

    Raises
    ------
    ImageError
        If the file cannot be read or is no colour picture.
    """
    values = read_values(path).values
    channels = values.shape[2]
    if channels != 3:  # noqa: PLR2004 - red, green, blue
        msg = f"a scene is an RGB photograph, this one has {channels} channel(s)"
        raise ImageError(str(path), msg)
    return SrgbCurve().inverse(values[..., _GREEN].clip(0, 1))


def check_scenes(paths: Iterable[Path]) -> None:
    """Refuse photographs that cannot be read or are too small, before hours of work.

    Raises
    ------
    ImageError
        As for `read_scene`, and if one is smaller than 1600 × 900.
    """
    for path in paths:
        rows, columns = read_scene(path).shape
        if rows < LEAST_SIZE[0] or columns < LEAST_SIZE[1]:
            least = f"{LEAST_SIZE[1]} × {LEAST_SIZE[0]}"
            msg = f"a scene has {least} pixels or more, not {columns} × {rows}"
            raise ImageError(str(path), msg)


def scenes_of(files: Iterable[Path]) -> list[tuple[str, int]]:
    """Name and size of photographs, which distinguish the records of one folder from another's."""
    return [(path.name, path.stat().st_size) for path in files]


def draw_cases(scenes: list[Path], dorf: Dorf, n_cases: int, seed: int) -> list[NoiseCase]:
    """Draw cameras: scenes in turn, U, V and the response at random.

    Case k is the same whatever the number of cases.
    """
    cases = []
    for number in range(n_cases):
        rng = np.random.default_rng([seed, number])
        cases.append(
            NoiseCase(
                number=number,
                scene=scenes[number % len(scenes)].name,
                slope_8bit=float(rng.uniform(*SLOPES_8BIT)),
                floor_8bit=float(rng.uniform(*FLOORS_8BIT)),
                row=int(rng.integers(len(dorf.curves))),
                seed=int(rng.integers(2**63)),
            )
        )
    return cases


def true_curve(irradiance: Floats, brightness: Floats) -> SampledCurve:
    """Return a measured response as a curve."""
    return SampledCurve(tuple(irradiance.tolist()), tuple(brightness.tolist()))


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one method made of one case."""

    rmse: float
    """RMSE of the response over 1024 irradiances."""
    variation: float
    """Total variation of the estimated response; 1 if it is monotone."""
    slope_8bit: float
    floor_8bit: float
    """Recovered U and V."""
    values: tuple[float, ...]
    """Objective at the start and after each round; none without rounds."""
    evaluations: int | None
    """Evaluations of the objective, where there is a search for its maximum."""
    seconds: float
    covered: tuple[float, float] | None = None
    """Share of the levels whose true irradiance lies within one and two deviations of the
    estimated, where the method estimates deviations."""

    @classmethod
    def from_json(cls, content: Mapping[str, object]) -> "Outcome":
        """Outcome from its record."""
        outcome = cls(**content)  # type: ignore[arg-type]
        covered = None if outcome.covered is None else (outcome.covered[0], outcome.covered[1])
        return replace(outcome, values=tuple(outcome.values), covered=covered)

    @property
    def infeasible(self) -> bool:
        """Whether the estimated response decreases by more than a trifle."""
        return self.variation > INFEASIBLE


@dataclass(frozen=True, slots=True)
class CaseResult:
    """Outcomes of all methods on one case."""

    case: NoiseCase
    outcomes: dict[str, Outcome]
    """Outcomes by method."""
    bound: float
    """Least RMSE that an estimate of any curve can have on these pairs: see
    `chartless.evidence.noise.bound.free_bound`."""


def run(
    dorf: Dorf,
    scenes: Path,
    output: Path,
    *,
    n_cases: int = 200,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    on_case: OnCase | None = None,
) -> list[CaseResult]:
    """Run all methods on all cases and write cases.csv.

    Parameters
    ----------
    dorf : Dorf
    scenes : Path
        Folder of RGB photographs of 1600 × 900 pixels or more, as shown on a display (sRGB).
    output : Path
        Folder for the table and the records of finished cases; made if missing.
    n_cases : int
    seed : int
        Decides cameras and noise.
    jobs : int
        Processes.
    scheduler : str, optional
        Address of a Dask scheduler to run on instead, such as ``tcp://host:8786``.
    on_case : OnCase, optional

    Returns
    -------
    list of CaseResult

    Raises
    ------
    ParameterError, ImageError, OutputError
        If the scenes are missing or unfit, or the folder cannot be written.
    """
    make_folder(output)
    files = scene_files(scenes)
    check_scenes(files[:n_cases])
    cases = draw_cases(files, dorf, n_cases, seed)
    recorded = run_cases(
        {
            f"case-{case.number:04d}": partial(
                _case, case, files[0].parent / case.scene, dorf, METHODS
            )
            for case in cases
        },
        output / "cases",
        fingerprint=fingerprint_of(
            dorf.irradiance, dorf.curves, dorf.cameras, seed, scenes_of(files), METHODS, __version__
        ),
        jobs=jobs,
        scheduler=scheduler,
        on_case=on_case,
    )
    results = [
        CaseResult(
            case,
            {name: Outcome.from_json(content) for name, content in result["outcomes"].items()},
            result["bound"],
        )
        for case, result in zip(cases, recorded.values(), strict=True)
    ]
    _write_cases(output / "cases.csv", dorf, results)
    return results


def summarize(results: list[CaseResult]) -> JsonObject:
    """Statistics by method.

    ``seconds`` is null: no two runs take the same time, and equal runs are to give equal
    summaries. See `timing`.
    """
    return {
        "noise": {method: _statistics(method, results) for method in METHODS},
        "bound": float(np.median([result.bound for result in results])),
    }


def timing(results: list[CaseResult]) -> JsonObject:
    """Median seconds of a search by method."""
    return {
        "seconds": {
            method: float(np.median([result.outcomes[method].seconds for result in results]))
            for method in METHODS
        }
    }


def curve_prior(dorf: Dorf, row: int) -> CurvePrior:
    """Prior of any curve, of the distinct measured ones but those of the camera of `row`."""
    kept = dorf.left_out(row)
    others = [other for other in dorf.distinct if kept[other]]
    return log_slope_basis(dorf.irradiance, dorf.curves[others], len(others)).prior()


def mixture_without(dorf: Dorf, row: int) -> CurvePrior:
    """Mixture of populations, with `curve_prior` for that of DoRF."""
    return weights_of(()).prior(replaced={Population.DORF: curve_prior(dorf, row)})


def methods_for(
    dorf: Dorf, row: int, methods: Iterable[str] = METHODS
) -> Iterator[tuple[str, AbstractCalibrator]]:
    """Name and calibrator of each method, where the response in `row` is under test."""
    basis = principal_basis(dorf.curves[dorf.left_out(row)])
    prior = mixture_without(dorf, row)
    for method in methods:
        kind, name = method.split("/")
        if kind == "nlf":
            of_dorf = curve_prior(dorf, row)
            yield method, NoiseLevelSearch(prior=of_dorf, noise_prior=CAMERAS_OF_2008)
        elif kind == "likelihood":
            family = None if name in ("default", "dark") else MODELS[name]
            yield method, LikelihoodSearch(model=family, prior=prior, noise_prior=CAMERAS_OF_2008)
        else:
            yield (
                method,
                SimilaritySearch(
                    model=_model(name, basis),
                    objective=kind.removeprefix("ism-"),
                    rounds=ROUNDS,
                    iterations=ITERATIONS,
                    tolerance=0.0,
                ),
            )


def search(calibrator: SimilaritySearch, table: Cooccurrence, truth: SampledCurve) -> Outcome:
    """Run one search and compare it with the truth."""
    begun = time.perf_counter()
    found = calibrator.search(table)
    seconds = time.perf_counter() - begun
    response = calibrator.model.response(UNIFORM_IRRADIANCE, found.parameters)
    return Outcome(
        rmse=float(np.sqrt(np.mean((response - truth.response(UNIFORM_IRRADIANCE)) ** 2))),
        variation=float(np.abs(np.diff(response)).sum()),
        slope_8bit=found.noise.slope_8bit,
        floor_8bit=found.noise.floor_8bit,
        values=found.history.values,
        evaluations=found.history.evaluations,
        seconds=seconds,
    )


def estimate(
    calibrator: AbstractCalibrator,
    table: Cooccurrence,
    truth: SampledCurve,
    *,
    n_frames: int = 2,
    dark: Counts | None = None,
) -> Outcome:
    """Run a method that estimates deviations and compare curve and deviations with the truth."""
    begun = time.perf_counter()
    response = calibrator.calibrate(LevelPairs(table, n_frames, dark))
    seconds = time.perf_counter() - begun
    inner = slice(1, -1)  # the ends are known
    brightness = np.arange(table.n_levels) / (table.n_levels - 1)
    away = np.abs(response.inverse_lut - truth.inverse(brightness))[inner]
    deviations = np.zeros(away.size)
    if response.inverse_lut_std is not None:
        deviations = response.inverse_lut_std[inner]
    assert response.noise is not None
    return Outcome(
        rmse=rmse(response.curve, truth),
        variation=float(np.abs(np.diff(response.response_lut)).sum()),
        slope_8bit=response.noise.slope_8bit,
        floor_8bit=response.noise.floor_8bit,
        values=(),
        evaluations=None,
        seconds=seconds,
        covered=(float(np.mean(away < deviations)), float(np.mean(away < 2 * deviations))),
    )


def _case(case: NoiseCase, path: Path, dorf: Dorf, methods: tuple[str, ...]) -> JsonObject:
    truth = true_curve(dorf.irradiance, dorf.curves[case.row])
    scene = read_scene(path)
    first, second = simulate_frames(scene, truth, case.noise, seed=case.seed)
    table = Cooccurrence.of_pair(first, second)
    black = np.zeros(DARK_SIZE)
    covered = simulate_frames(black, truth, case.noise, n_frames=N_DARK, seed=case.seed + 1)
    dark = np.sum([np.bincount(each.ravel(), minlength=256) for each in covered], axis=0)
    outcomes = {}
    for method, calibrator in methods_for(dorf, case.row, methods):
        if isinstance(calibrator, SimilaritySearch):
            outcome = search(calibrator, table, truth)
        else:
            outcome = estimate(
                calibrator, table, truth, dark=dark if method.endswith("/dark") else None
            )
        outcomes[method] = asdict(outcome)
    edges = truth.inverse(bin_edges(256)[1:-1])
    prior = curve_prior(dorf, case.row)
    bound = free_bound(edges, case.noise, scene, table.n_pairs, prior)
    return {"outcomes": outcomes, "bound": bound}


def _model(name: str, basis: Basis) -> AbstractModel:
    if name.endswith(LEFT_OUT):
        return Emor(MODELS[name.removesuffix(LEFT_OUT)].order, basis)
    return MODELS[name]


def _statistics(method: str, results: list[CaseResult]) -> JsonObject:
    outcomes = [result.outcomes[method] for result in results]
    rmse = np.array([outcome.rmse for outcome in outcomes])
    slopes = [
        outcome.slope_8bit / result.case.slope_8bit
        for outcome, result in zip(outcomes, results, strict=True)
    ]
    floors = [
        outcome.floor_8bit / result.case.floor_8bit
        for outcome, result in zip(outcomes, results, strict=True)
    ]
    return {
        "cases": len(results),
        "median": float(np.median(rmse)),
        "q25": float(np.quantile(rmse, 0.25)),
        "q75": float(np.quantile(rmse, 0.75)),
        "mean": float(rmse.mean()),
        "p90": float(np.quantile(rmse, 0.9)),
        "infeasible": sum(outcome.infeasible for outcome in outcomes),
        "evaluations": _mean([outcome.evaluations for outcome in outcomes]),
        "slope_ratio": float(np.median(slopes)),
        "floor_ratio": float(np.median(floors)),
        "within_1": _mean([outcome.covered and outcome.covered[0] for outcome in outcomes]),
        "within_2": _mean([outcome.covered and outcome.covered[1] for outcome in outcomes]),
        "seconds": None,
    }


def _mean(values: list[Any]) -> float | None:
    return None if None in values else float(np.mean(values))


def _write_cases(path: Path, dorf: Dorf, results: list[CaseResult]) -> None:
    header = (
        "case", "scene", "U", "V", "row", "response", "method", "rmse", "total_variation",
        "infeasible", "U_found", "V_found", "objective", "evaluations", "within_1", "within_2",
        "seconds",
    )  # fmt: skip
    write_csv(
        path,
        header,
        (
            (
                result.case.number,
                result.case.scene,
                f"{result.case.slope_8bit:.6f}",
                f"{result.case.floor_8bit:.4f}",
                result.case.row,
                dorf.names[result.case.row],
                method,
                f"{outcome.rmse:.8f}",
                f"{outcome.variation:.6f}",
                int(outcome.infeasible),
                f"{outcome.slope_8bit:.6f}",
                f"{outcome.floor_8bit:.4f}",
                f"{outcome.values[-1]:.8g}" if outcome.values else "",
                "" if outcome.evaluations is None else outcome.evaluations,
                *(
                    "" if outcome.covered is None else f"{share:.4f}"
                    for share in outcome.covered or (None, None)
                ),
                f"{outcome.seconds:.3f}",
            )
            for result in results
            for method, outcome in result.outcomes.items()
        ),
    )
