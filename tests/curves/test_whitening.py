import importlib.util
from pathlib import Path

import numpy as np
import pytest

from chartless.curves.whitening import _file, whitening
from chartless.models import MODELS, Eegc

SCRIPT = Path(__file__).parents[2] / "scripts" / "fit_whitening.py"
FAMILIES = _file()["families"]


@pytest.fixture(params=list(FAMILIES))
def name(request: pytest.FixtureRequest) -> str:
    return request.param


def test_whiten_and_colour_are_inverse(name: str):
    numbers = whitening(MODELS[name])
    whitened = np.random.default_rng(6).normal(size=numbers.mean.size)

    back = numbers.whiten(numbers.colour(whitened))

    assert back == pytest.approx(whitened, abs=1e-11)
    assert numbers.colour(np.zeros_like(whitened)) == pytest.approx(numbers.mean)


def test_numbers_fit_the_family(name: str):
    numbers, n = whitening(MODELS[name]), MODELS[name].n_parameters

    assert numbers.mean.shape == (n,)
    assert numbers.matrix.shape == (n, n)
    assert MODELS[name].admits(numbers.mean)


def test_axes_are_principal_and_in_order(name: str):
    matrix = whitening(MODELS[name]).matrix

    squares = matrix.T @ matrix  # of eigenvectors times deviations: diagonal
    assert squares - np.diag(np.diag(squares)) == pytest.approx(0, abs=1e-9 * squares.max())
    assert np.all(np.diff(np.diag(squares)) <= 0)


def test_a_family_without_numbers_keeps_its_raw_parameters_around_the_linear_camera():
    model = Eegc(order=7)
    numbers = whitening(model)

    assert model.name not in FAMILIES
    assert np.array_equal(numbers.colour(np.zeros(8)), model.identity)
    assert numbers.colour(np.eye(8)[3]) - model.identity == pytest.approx(np.eye(8)[3])


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("fit_whitening", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_committed_numbers_come_out_of_the_script_again(script, data_path: Path):
    with np.load(data_path / "dorf" / "dorf_named.npz") as data:
        irradiance, curves = data["I"].astype(float), np.unique(data["B"].astype(float), axis=0)
    assert len(curves) == _file()["provenance"]["curves"]

    numbers = script.family_numbers(MODELS["ameegc2-exact"], irradiance, curves)

    committed = whitening(MODELS["ameegc2-exact"])
    np.testing.assert_allclose(committed.mean, numbers["mean"], atol=1e-4)
    np.testing.assert_allclose(committed.matrix, numbers["matrix"], atol=1e-4)
    # Over the 201 curves with repetitions 0.00395 was measured independently.
    assert numbers["rmse_median"] == pytest.approx(0.0040, abs=5e-5)


@pytest.mark.parametrize(
    ("family", "median"),
    # over 201 curves by an independent program; the script counts equal curves once
    [
        ("ameegc0", 0.02975),
        ("ameegc1", 0.00935),
        ("ameegc2", 0.00395),
        ("ameegc2-exact", 0.00395),
    ],
)
def test_families_come_as_near_to_cameras_as_measured_elsewhere(family: str, median: float):
    assert FAMILIES[family]["rmse_median"] == pytest.approx(median, rel=0.02)
