"""The noise experiment on small means: what is drawn, what is run, what is summed up."""

import csv
import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distributed import LocalCluster
from PIL import Image

from chartless.datasets import Dorf
from chartless.errors import ImageError, ParameterError
from chartless.experiments import noise, noise_figures, noise_sweeps
from chartless.experiments.noise import CaseResult, NoiseCase, Outcome
from chartless.models import MODELS

FEW = ("ism-bin/ameegc2-exact", "ism-bin/emor2", "ism-bin/emor2-left-out", "likelihood/default")


def photograph(path: Path, size: tuple[int, int] = (90, 160), seed: int = 0) -> Path:
    levels = np.random.default_rng(seed).integers(0, 256, (*size, 3), dtype=np.uint8)
    Image.fromarray(levels).save(path)
    return path


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small photographs, few methods, short searches."""
    monkeypatch.setattr(noise, "LEAST_SIZE", (90, 160))
    monkeypatch.setattr(noise, "METHODS", FEW)
    monkeypatch.setattr(noise, "ROUNDS", 2)
    monkeypatch.setattr(noise_sweeps, "ROUNDS", 2)


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    folder = tmp_path / "scenes"
    folder.mkdir()
    for number in range(3):
        photograph(folder / f"{number}.png", seed=number)
    return folder


@pytest.fixture(scope="module")
def dorf() -> Dorf:
    irradiance = np.linspace(0, 1, 256)
    rng = np.random.default_rng(5)
    steps = rng.normal(size=(12, 3)) * [0.4, 0.3, 0.1]
    curves = MODELS["gumbel2"].response(irradiance, MODELS["gumbel2"].identity + steps)
    names = tuple(f"Film-{n}{c}" for n in range(4) for c in ("Red", "Green", "Blue"))
    return Dorf(irradiance, curves, names, ("graph-log-log-neg",) * 12)


def outcome(rmse: float, **changes: Any) -> Outcome:
    values = {"variation": 1.0, "slope_8bit": 0.03, "floor_8bit": 16.0, **changes}
    return Outcome(rmse=rmse, values=(0.1, 0.9), evaluations=10, seconds=1.0, **values)


# Drawing


def test_cases_are_drawn_within_the_ranges_of_the_paper(scenes: Path, dorf: Dorf) -> None:
    cases = noise.draw_cases(noise.scene_files(scenes), dorf, 500, seed=1)

    slopes, floors = ([getattr(c, what) for c in cases] for what in ("slope_8bit", "floor_8bit"))
    assert 0.01 <= min(slopes) < 0.012
    assert 0.058 < max(slopes) <= 0.06
    assert 9 <= min(floors) < 9.5
    assert 24.5 < max(floors) <= 25
    assert {case.row for case in cases} == set(range(12))
    assert [case.scene for case in cases[:4]] == ["0.png", "1.png", "2.png", "0.png"]
    assert len({case.seed for case in cases}) == 500


def test_a_case_does_not_depend_on_how_many_there_are(scenes: Path, dorf: Dorf) -> None:
    files = noise.scene_files(scenes)

    assert noise.draw_cases(files, dorf, 3, 7) == noise.draw_cases(files, dorf, 9, 7)[:3]
    assert noise.draw_cases(files, dorf, 3, 7) != noise.draw_cases(files, dorf, 3, 8)


# Scenes


def test_a_scene_is_the_green_channel_made_linear(tmp_path: Path) -> None:
    levels = np.zeros((90, 160, 3), dtype=np.uint8)
    levels[..., 0], levels[..., 1] = 255, 188
    Image.fromarray(levels).save(tmp_path / "a.png")

    scene = noise.read_scene(tmp_path / "a.png")

    expected = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert scene.shape == (90, 160)
    assert np.allclose(scene, expected, atol=1e-6)


def test_a_small_scene_is_refused(tmp_path: Path) -> None:
    path = photograph(tmp_path / "a.png", (90, 100))

    with pytest.raises(ImageError, match=r"a\.png: a scene has .* or more, not 100 × 90"):
        noise.check_scenes([path])


def test_a_grey_scene_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((90, 160), dtype=np.uint8)).save(tmp_path / "a.png")

    with pytest.raises(ImageError, match=r"an RGB photograph, this one has 1 channel"):
        noise.read_scene(tmp_path / "a.png")


def test_a_folder_without_photographs_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="no photographs"):
        noise.scene_files(tmp_path)


def test_an_unfit_scene_is_refused_before_the_first_case(
    scenes: Path, dorf: Dorf, tmp_path: Path
) -> None:
    photograph(scenes / "z.png", (10, 10))

    with pytest.raises(ImageError, match=r"z\.png"):
        noise.run(dorf, scenes, tmp_path / "out", n_cases=4)

    assert not list((tmp_path / "out").glob("cases/*"))


# Running


@pytest.mark.slow
def test_every_method_sees_the_same_pairs_and_the_table_has_a_row_for_each(
    scenes: Path, dorf: Dorf, tmp_path: Path
) -> None:
    results = noise.run(dorf, scenes, tmp_path / "out", n_cases=3)

    assert [list(result.outcomes) for result in results] == [list(FEW)] * 3
    with (tmp_path / "out" / "cases.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert all(0 < result.bound < 0.5 for result in results)
    assert {row["method"] for row in rows} == set(FEW)
    assert all(float(row["rmse"]) < 0.5 for row in rows)


@pytest.mark.slow
def test_one_process_two_and_a_cluster_give_the_same_summary(
    scenes: Path, dorf: Dorf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(noise, "ROUNDS", 15)  # other processes know of no other number

    def summary(name: str, **where: Any) -> str:
        results = noise.run(dorf, scenes, tmp_path / name, n_cases=2, **where)
        return json.dumps(noise.summarize(results))

    alone = summary("alone")
    assert summary("two", jobs=2) == alone
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
    ) as cluster:
        assert summary("cluster", scheduler=cluster.scheduler_address) == alone


def test_the_left_out_basis_knows_no_curve_of_the_camera(dorf: Dorf) -> None:
    methods = dict(noise.methods_for(dorf, 4, FEW))
    changed = Dorf(dorf.irradiance, dorf.curves.copy(), dorf.names, dorf.scales)
    changed.curves[3:6] = dorf.curves[3:6] ** 1.5

    again = dict(noise.methods_for(changed, 4, FEW))

    grid = np.linspace(0, 1, 50)
    left_out = "ism-bin/emor2-left-out"
    before, after = (each[left_out].model.response(grid, [0.1, 0, 0]) for each in (methods, again))
    assert np.array_equal(before, after)
    assert not np.array_equal(before, methods["ism-bin/emor2"].model.response(grid, [0.1, 0, 0]))


def test_the_prior_of_any_curve_knows_none_of_the_camera(dorf: Dorf) -> None:
    changed = Dorf(dorf.irradiance, dorf.curves.copy(), dorf.names, dorf.scales)
    changed.curves[3:6] = dorf.curves[3:6] ** 1.5

    before, after = (noise.curve_prior(each, 4) for each in (dorf, changed))

    assert np.array_equal(before.mean, after.mean)
    assert np.array_equal(before.covariance, after.covariance)
    assert not np.array_equal(before.mean, noise.curve_prior(dorf, 7).mean)


# Summing up


def test_statistics_are_those_of_the_outcomes() -> None:
    case = NoiseCase(0, "a.png", 0.02, 10.0, 0, 0)
    results = [
        CaseResult(case, dict.fromkeys(FEW, outcome(rmse, variation=variation)), 0.001)
        for rmse, variation in ((0.01, 1.0), (0.02, 1.0005), (0.03, 1.0), (0.1, 1.2))
    ]

    numbers = noise.summarize(results)["noise"][FEW[0]]

    assert numbers["cases"] == 4
    assert numbers["median"] == pytest.approx(0.025)
    assert numbers["mean"] == pytest.approx(0.04)
    assert numbers["p90"] == pytest.approx(0.079)
    assert numbers["infeasible"] == 1  # a variation of 1.0005 is a trifle
    assert numbers["slope_ratio"] == pytest.approx(1.5)
    assert numbers["floor_ratio"] == pytest.approx(1.6)
    assert noise.timing(results) == {"seconds": dict.fromkeys(FEW, 1.0)}


def test_a_summary_has_no_times_in_it() -> None:
    case = NoiseCase(0, "a.png", 0.02, 10.0, 0, 0)

    summary = noise.summarize([CaseResult(case, dict.fromkeys(FEW, outcome(0.1)), 0.001)])

    assert all(numbers["seconds"] is None for numbers in summary["noise"].values())


# Dependence on the frames


@pytest.mark.slow
def test_every_factor_is_varied_around_one_camera(
    scenes: Path, dorf: Dorf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    factors = {"frames": ("frames", (2, 4)), "quality": ("JPEG quality", (50, None))}
    monkeypatch.setattr(noise_sweeps, "FACTORS", factors)

    points = noise_sweeps.run(dorf, scenes, tmp_path, n_cases=2)

    assert [(point.factor, point.value) for point in points] == [
        ("frames", 2), ("frames", 4), ("quality", 50), ("quality", None),
    ]  # fmt: skip
    two, four, _, uncompressed = points
    summary = noise_sweeps.summarize(points)["sweeps"]
    for method in noise_sweeps.METHODS:
        assert np.array_equal(two.rmse[method], uncompressed.rmse[method])  # the reference
        assert np.all(four.bound[method] < two.bound[method])  # more pairs, more knowledge
        assert summary["frames"]["4"][method]["median"] == np.median(four.rmse[method])


@pytest.mark.parametrize("field", noise_sweeps.FACTORS)
def test_every_factor_is_a_property_of_the_camera(field: str) -> None:
    assert field in noise_sweeps.Camera.__dataclass_fields__


@pytest.mark.slow
def test_figures_are_drawn_from_results(scenes: Path) -> None:
    case = NoiseCase(0, "a.png", 0.02, 10.0, 0, 0)
    searches = dict.fromkeys(noise.SEARCHES, outcome(0.01))
    estimates = dict.fromkeys(noise.LIKELIHOODS, outcome(0.02, covered=(0.7, 0.95)))
    results = [CaseResult(case, searches | estimates, bound) for bound in (0.001, 0.002)]
    numbers = dict.fromkeys(noise_sweeps.METHODS, np.array([0.01, 0.02]))
    points = [
        noise_sweeps.SweepPoint(factor, value, numbers, numbers)
        for factor, (_, values) in noise_sweeps.FACTORS.items()
        for value in values
    ]

    assert len(noise_figures.scenes_figure(noise.scene_files(scenes)).axes) == 5
    assert len(noise_figures.search_figure(results).axes) == 4
    assert len(noise_figures.errors_figure(results).axes) == 8
    assert len(noise_figures.likelihood_figure(results).axes) == 2
    assert len(noise_figures.sweeps_figure(points).axes) == len(noise_sweeps.FACTORS)
