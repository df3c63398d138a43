"""The noise experiment with digital cameras, beside the curves of DoRF.

Scenes, noise and seeds are those of `chartless.experiments.noise`; the responses are those
of digital cameras in turn. Only our methods are run: the paper's are compared on DoRF. No
camera under test is in the prior of digital cameras: for one that is in that of the package,
a prior is made anew, from the other measured ones of the same data.
"""

from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from chartless._files import make_folder, write_csv
from chartless._version import __version__
from chartless.curves.populations import Population, population_basis
from chartless.curves.prior import CurvePrior, digital_basis, log_slopes_of_response
from chartless.datasets import MEASURED, DigitalCameras, Dorf
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.origins import weights_of
from chartless.experiments._cases import OnCase, fingerprint_of, run_cases
from chartless.experiments.noise import (
    NoiseCase,
    Outcome,
    draw_cases,
    estimate,
    read_scene,
    scene_files,
    scenes_of,
    true_curve,
)
from chartless.methods import AbstractCalibrator, LikelihoodSearch, NoiseLevelSearch
from chartless.noise import CAMERAS_OF_2008
from chartless.simulate import simulate_frames
from chartless.types import JsonObject

METHODS = ("nlf/default", "likelihood/default", "likelihood/dorf")
"""Methods by name; the last one has the prior of DoRF alone."""


@dataclass(frozen=True, slots=True)
class DigitalResult:
    """Outcomes on one case."""

    case: NoiseCase
    """Its row is that of the digital camera."""
    camera: str
    outcomes: dict[str, Outcome]


def run(
    cameras: DigitalCameras,
    dorf: Dorf,
    scenes: Path,
    output: Path,
    *,
    n_cases: int = 200,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    on_case: OnCase | None = None,
) -> list[DigitalResult]:
    """Run our methods on digital cameras and write digital.csv.

    Parameters
    ----------
    cameras : DigitalCameras
    dorf, scenes, output, n_cases, seed, jobs, scheduler, on_case
        As for `chartless.experiments.noise.run`.
    """
    make_folder(output)
    files = scene_files(scenes)
    cases = [
        _with_row(case, case.number % len(cameras.names))
        for case in draw_cases(files, dorf, n_cases, seed)
    ]
    recorded = run_cases(
        {
            f"digital-{case.number:04d}": partial(
                _case, case, files[0].parent / case.scene, cameras
            )
            for case in cases
        },
        output / "cases",
        fingerprint=fingerprint_of(
            cameras.irradiance, cameras.curves, cameras.names, seed, scenes_of(files), METHODS,
            __version__,
        ),
        jobs=jobs,
        scheduler=scheduler,
        on_case=on_case,
    )  # fmt: skip
    results = [
        DigitalResult(
            case,
            cameras.names[case.row],
            {name: Outcome.from_json(content) for name, content in found.items()},
        )
        for case, found in zip(cases, recorded.values(), strict=True)
    ]
    _write(output / "digital.csv", results)
    return results


def prior_without(cameras: DigitalCameras, row: int) -> CurvePrior:
    """Mixture of populations that does not contain a camera.

    That of the package if it does not; else its digital cameras are the seven other
    measured ones.
    """
    if cameras.names[row] not in MEASURED:
        return weights_of(()).prior()
    kept = [
        log_slopes_of_response(cameras.irradiance, curve)[np.newaxis]
        for name, curve in zip(cameras.names, cameras.curves, strict=True)
        if name in MEASURED and name != cameras.names[row]
    ]
    digital = digital_basis(kept, population_basis(Population.DORF)).prior()
    return weights_of(()).prior(replaced={Population.DIGITAL: digital})


def summarize(results: list[DigitalResult]) -> JsonObject:
    """Statistics by method, under ``digital``."""
    return {"digital": {method: _statistics(method, results) for method in METHODS}}


def _with_row(case: NoiseCase, row: int) -> NoiseCase:
    return NoiseCase(**{**asdict(case), "row": row})


def _case(case: NoiseCase, path: Path, cameras: DigitalCameras) -> JsonObject:
    truth = true_curve(cameras.irradiance, cameras.curves[case.row])
    first, second = simulate_frames(read_scene(path), truth, case.noise, seed=case.seed)
    table = Cooccurrence.of_pair(first, second)
    prior = prior_without(cameras, case.row)
    calibrators: dict[str, AbstractCalibrator] = {
        "nlf/default": NoiseLevelSearch(noise_prior=CAMERAS_OF_2008),
        "likelihood/default": LikelihoodSearch(prior=prior, noise_prior=CAMERAS_OF_2008),
        "likelihood/dorf": LikelihoodSearch(
            prior=population_basis(Population.DORF).prior(), noise_prior=CAMERAS_OF_2008
        ),
    }
    return {
        name: asdict(estimate(calibrator, table, truth)) for name, calibrator in calibrators.items()
    }


def _statistics(method: str, results: list[DigitalResult]) -> JsonObject:
    outcomes = [result.outcomes[method] for result in results]
    rmse = np.array([outcome.rmse for outcome in outcomes])
    within = np.array([outcome.covered for outcome in outcomes], dtype=np.float64)
    return {
        "cases": len(results),
        "median": float(np.median(rmse)),
        "mean": float(rmse.mean()),
        "p90": float(np.quantile(rmse, 0.9)),
        "within_1": float(within[:, 0].mean()),
        "within_2": float(within[:, 1].mean()),
    }


def _write(path: Path, results: list[DigitalResult]) -> None:
    write_csv(
        path,
        ("case", "scene", "U", "V", "camera", "method", "rmse", "within_1", "within_2", "seconds"),
        (
            (
                result.case.number,
                result.case.scene,
                f"{result.case.slope_8bit:.6f}",
                f"{result.case.floor_8bit:.4f}",
                result.camera,
                method,
                f"{outcome.rmse:.8f}",
                *(f"{share:.4f}" for share in outcome.covered or ()),
                f"{outcome.seconds:.3f}",
            )
            for result in results
            for method, outcome in result.outcomes.items()
        ),
    )
