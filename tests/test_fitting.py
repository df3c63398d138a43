import numpy as np
import pytest

from chartless.curves import named_curve
from chartless.fitting import fit
from chartless.models import MODELS

IRRADIANCE = np.linspace(0, 1, 256)
# One member of each family whose parameters a curve determines; signs as fits return them.
MEMBERS = {
    "gamma": [0.45],
    "ameegc0": [-0.7],
    "ameegc1": [-0.4, 2.0],
    "ameegc2": [-0.3, 2.1, 2.6],
    "ameegc2-exact": [-0.3, 1.8, -0.1],
    "eegc0": [-0.7],
    "eegc1": [-0.5, 0.6],
    "eegc2": [-0.5, 0.6, -0.4],
    "eegc3": [-0.5, 0.6, -0.4, 0.2],
    "eegc4": [-0.5, 0.6, -0.4, 0.2, 0.1],
    "eegc5": [-0.5, 0.6, -0.4, 0.2, 0.1, -0.1],
    "eegc6": [-0.5, 0.6, -0.4, 0.2, 0.1, -0.1, 0.1],
}


def test_every_family_is_fitted_here():
    assert set(MEMBERS) == set(MODELS)


@pytest.mark.parametrize("name", MEMBERS)
def test_a_member_of_the_family_is_found_again(name: str):
    model = MODELS[name]
    brightness = model.response(IRRADIANCE, MEMBERS[name])

    found = fit(model, IRRADIANCE, brightness)

    assert found.rmse < 1e-8
    parameters = found.parameters if name == "gamma" else np.abs(found.parameters)
    np.testing.assert_allclose(parameters, np.abs(MEMBERS[name]), rtol=1e-3, atol=1e-4)


def test_rmse_is_that_of_the_parameters():
    brightness = named_curve("srgb").response(IRRADIANCE)
    model = MODELS["gamma"]

    found = fit(model, IRRADIANCE, brightness)

    residual = model.response(IRRADIANCE, found.parameters) - brightness
    assert found.rmse == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)


def test_no_member_nearby_is_nearer():
    brightness = named_curve("srgb").response(IRRADIANCE)
    model = MODELS["ameegc2-exact"]
    found = fit(model, IRRADIANCE, brightness)

    rng = np.random.default_rng(2)
    for step in rng.normal(scale=0.01, size=(50, 3)):
        moved = model.response(IRRADIANCE, found.parameters + step) - brightness
        assert np.sqrt(np.mean(moved**2)) > found.rmse


def test_each_order_comes_nearer_than_the_one_before():
    brightness = named_curve("srgb").response(IRRADIANCE)

    errors = [fit(MODELS[f"eegc{n}"], IRRADIANCE, brightness).rmse for n in range(5)]

    assert np.all(np.diff(errors) < 0)
    assert fit(MODELS["ameegc2-exact"], IRRADIANCE, brightness).rmse < 0.003


def test_noisy_samples_give_the_parameters_within_their_errors():
    model, truth = MODELS["ameegc2-exact"], np.array([-0.3, 1.8, -0.1])
    deviation = 0.002
    rng = np.random.default_rng(3)
    brightness = model.response(IRRADIANCE, truth) + rng.normal(scale=deviation, size=256)

    found = fit(model, IRRADIANCE, brightness)

    gradient = model.gradient(IRRADIANCE, truth)
    information = gradient.T @ gradient / deviation**2
    pull = found.parameters - truth
    assert pull @ information @ pull < 16.3  # chi², three degrees of freedom: one in a thousand
