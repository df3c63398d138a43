"""The noise experiment with digital cameras, on small means."""

import csv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from chartless.curves.populations import Population, population_prior
from chartless.datasets import MEASURED, DigitalCameras, Dorf
from chartless.evidence.origins import weights_of
from chartless.experiments import noise, noise_digital
from chartless.models import MODELS

LIGHT = np.linspace(0, 1, 256)


@pytest.fixture(scope="module")
def cameras() -> DigitalCameras:
    """Four measured cameras, and one that somebody drew."""
    curves = np.array([LIGHT**exponent for exponent in (0.3, 0.35, 0.4, 0.45, 0.5)])
    return DigitalCameras(LIGHT, curves, (*MEASURED[:4], "drawn"))


@pytest.fixture(scope="module")
def dorf() -> Dorf:
    model = MODELS["gamma"]
    curves = model.response(LIGHT, np.array([[0.5], [0.6], [0.7]]))
    return Dorf(LIGHT, curves, ("aRed", "aGreen", "aBlue"), ("graph-log-log-neg",) * 3)


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    folder = tmp_path / "scenes"
    folder.mkdir()
    for seed in range(2):
        rng = np.random.default_rng(seed)
        levels = rng.integers(0, 256, (90, 160, 3), dtype=np.uint8)
        Image.fromarray(levels).save(folder / f"{seed}.png")
    return folder


def test_a_camera_that_was_measured_is_left_out_of_its_prior(cameras: DigitalCameras) -> None:
    first, second, drawn = (noise_digital.prior_without(cameras, row) for row in (0, 1, 4))

    (_, of_first), *others = first.parts
    assert not np.allclose(of_first.mean, second.parts[0][1].mean)
    # The mean of the exponents of the three others.
    steepness = np.mean([1 / exponent - 1 for exponent in (0.35, 0.4, 0.45)])
    rise = of_first.mean[100] - of_first.mean[50]
    assert rise == pytest.approx(steepness * np.log(LIGHT[100] / LIGHT[50]), rel=0.02)
    assert drawn is weights_of(()).prior()  # which it is not in
    for population, (_, part) in zip(list(Population)[1:], others, strict=True):
        np.testing.assert_array_equal(part.mean, population_prior(population).mean)


def test_cameras_take_turns_before_the_scenes_of_the_experiment(
    cameras: DigitalCameras, dorf: Dorf, scenes: Path, tmp_path: Path
) -> None:
    results = noise_digital.run(cameras, dorf, scenes, tmp_path / "out", n_cases=2)

    of_dorf = noise.draw_cases(noise.scene_files(scenes), dorf, 2, 0)
    for result, case, name in zip(results, of_dorf, MEASURED, strict=False):
        assert result.camera == name
        assert (result.case.scene, result.case.seed) == (case.scene, case.seed)
        assert set(result.outcomes) == set(noise_digital.METHODS)
        assert result.outcomes["likelihood/default"].rmse < 0.1
    with (tmp_path / "out" / "digital.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["camera"] for row in rows] == [name for name in MEASURED[:2] for _ in range(3)]
    summary = noise_digital.summarize(results)["digital"]["likelihood/default"]
    errors = [result.outcomes["likelihood/default"].rmse for result in results]
    assert summary["median"] == pytest.approx(np.median(errors))
    assert summary["cases"] == 2

    again = noise_digital.run(cameras, dorf, scenes, tmp_path / "out", n_cases=2)

    assert [each.outcomes for each in again] == [each.outcomes for each in results]  # on record
