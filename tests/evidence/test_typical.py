"""One picture: the typical curve of digital cameras, and how far it may be off."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless import Calibration, calibrate, load_calibration, named_curve, plan
from chartless.curves.populations import Population, population_prior
from chartless.curves.prior import irradiance_at_edges
from chartless.errors import ParameterError, UnfitFramesError
from chartless.flags import Flag
from chartless.inference.posterior import at_levels
from chartless.methods import LikelihoodSearch
from chartless.result.response import Status
from chartless.result.verdict import Grade, verdict
from chartless.types import Floats, Levels


@pytest.fixture(scope="module")
def picture() -> Levels:
    rng = np.random.default_rng(4)
    levels: Levels = rng.integers(20, 230, (40, 60, 3), dtype=np.uint8)
    levels[0] = 0
    levels[:5, :, 2] = 255
    return levels


@pytest.fixture(scope="module")
def found(picture: Levels) -> Calibration:
    return calibrate([picture])


def test_the_curve_is_that_of_the_mean_log_slopes(found: Calibration) -> None:
    mean = population_prior(Population.DIGITAL, 256).mean
    typical = at_levels(irradiance_at_edges(mean)[1:-1])

    for response in found.channels:
        np.testing.assert_allclose(response.inverse_lut, typical, atol=1e-9)


def test_it_is_said_to_be_assumed(found: Calibration) -> None:
    for response in found.channels:
        assert response.status is Status.ASSUMED
        assert response.flags == (Flag.NO_EVIDENCE,)
        assert response.log_evidence == pytest.approx(0.0, abs=1e-6)
    judged = verdict(found.channels)
    assert judged.grade is Grade.CARE
    assert judged.reasons[0].startswith("The curve is assumed, not measured")


def test_the_levels_of_the_picture_are_counted(found: Calibration) -> None:
    red, green, blue = found.channels

    assert (red.observed_levels, blue.observed_levels) == ((0, 229), (20, 255))
    assert green.n_pairs == 40 * 60
    assert red.account("typical")["black"] == pytest.approx(1 / 40)
    assert red.account("typical")["white"] == 0
    assert blue.account("typical")["white"] == pytest.approx(5 / 40)


def test_a_mask_chooses_pixels(picture: Levels) -> None:
    mask = np.zeros(picture.shape[:2], dtype=bool)
    mask[10:, :30] = True

    red, _, _ = calibrate([picture], mask=mask).channels

    assert red.n_pairs == 30 * 30
    assert red.account("typical")["black"] == 0


def test_pictures_of_several_scenes_are_counted_together(picture: Levels) -> None:
    other = picture[::-1] // 2

    (grey,) = calibrate([picture, other], evidence="typical", channels="luma").channels

    assert grey.n_pairs == 2 * picture.shape[0] * picture.shape[1]
    assert grey.status is Status.ASSUMED


def test_a_prior_of_ones_own_is_used(picture: Levels) -> None:
    own = population_prior(Population.DORF)

    (grey,) = calibrate([picture[..., 0]], method=LikelihoodSearch(prior=own)).channels

    dorf = at_levels(irradiance_at_edges(own.mean)[1:-1])
    np.testing.assert_allclose(grey.inverse_lut, dorf, atol=1e-9)


def test_draws_of_the_prior_lie_in_the_band(found: Calibration) -> None:
    """The band of shape holds curves of the prior: two deviations, 95 in a hundred."""
    response = found.channels[0]
    assert response.shape_std is not None
    prior = population_prior(Population.DIGITAL)
    drawn = np.random.default_rng(0).multivariate_normal(prior.mean, prior.covariance, 300)
    held = []
    for row in drawn:
        light = at_levels(irradiance_at_edges(row)[1:-1])
        scale = float(response.inverse_lut @ light / (light @ light))
        off = np.abs(scale * light - response.inverse_lut)[1:]
        held.append(np.mean(off < 2 * response.shape_std[1:] + 1e-9))

    assert 0.9 < np.mean(held) < 0.99


@pytest.mark.parametrize("name", ["srgb", "rec709"])
def test_the_curves_of_standards_lie_in_the_band(name: str, found: Calibration) -> None:
    response = found.channels[1]
    assert response.shape_std is not None
    light = _inverse_of(name)
    scale = float(response.inverse_lut @ light / (light @ light))
    off = np.abs(scale * light - response.inverse_lut)

    assert np.mean(off[1:] < 3 * response.shape_std[1:]) > 0.95


def _inverse_of(name: str) -> Floats:
    brightness = np.arange(256) / 255
    if name == "srgb":
        return np.asarray(named_curve("srgb").inverse(brightness))
    return np.where(
        brightness < 0.081, brightness / 4.5, ((brightness + 0.099) / 1.099) ** (1 / 0.45)
    )


def test_the_name_typical_is_the_same_calibration(found: Calibration) -> None:
    (named,) = load_calibration("typical").channels
    picture = found.channels[0]

    assert (named.status, named.n_pairs) == (Status.ASSUMED, 0)
    np.testing.assert_allclose(named.inverse_lut, picture.inverse_lut, atol=1e-12)
    assert named.inverse_lut_std is not None
    assert picture.inverse_lut_std is not None
    np.testing.assert_allclose(named.inverse_lut_std, picture.inverse_lut_std, atol=1e-9)
    with pytest.raises(ParameterError, match="nothing after its name"):
        load_calibration("typical:2")


# When it is not the answer


Arguments = dict[str, Any]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"model": "gumbel3"}, ParameterError, "`model` has no effect on the typical curve"),
        ({"time_error": 0.1}, ParameterError, "`time_error` has no effect on the typical curve"),
        ({"weight": 0.5}, ParameterError, "`weight` has no effect on the typical curve"),
        ({"method": "debevec"}, ParameterError, "debevec uses bracket only"),
        ({"times": "unknown"}, UnfitFramesError, "noise needs two or more frames"),
        ({"evidence": "typical,noise"}, ParameterError, "ask for it alone"),
    ],
)
def test_what_has_no_effect_is_refused(
    arguments: Arguments, error: type[Exception], words: str, picture: Levels
) -> None:
    with pytest.raises(error, match=words):
        calibrate([picture], **arguments)


def test_frames_that_show_more_are_used(picture: Levels) -> None:
    assert plan([picture, picture + 1]).kinds == {"noise"}
    assert plan([picture]).kinds == {"typical"}


def test_a_table_of_points_shows_more(picture: Levels, tmp_path: Path) -> None:
    table = tmp_path / "patches.csv"
    table.write_text("0.1,0.3\n0.2,0.45\n0.4,0.65\n0.8,0.9\n")

    with pytest.raises(UnfitFramesError, match="noise needs two or more frames"):
        calibrate([picture], points=table)


def test_pictures_of_two_cameras_are_refused(picture: Levels) -> None:
    with pytest.raises(UnfitFramesError, match="channels"):
        calibrate([picture, picture[..., 0]], evidence="typical")


def test_a_raw_file_needs_no_curve(data_path: Path) -> None:
    file = data_path / "rawjpeg_powershot" / "S40_CRW_0101.CRW"
    if not file.is_file():
        pytest.skip(f"no {file}")

    found = plan([file, file.with_name("S40_CRW_0105.CRW")])
    (declined,) = (each for each in found.declined if each.kind == "typical")

    assert "is a raw file, which records light as it is" in declined.reason


# Cameras that were measured


def test_measured_cameras_lie_in_the_band(data_path: Path, found: Calibration) -> None:
    """Curves that were drawn by hand for makes of cameras, and are not in the prior."""
    file = data_path / "modern_curves" / "responses_1024.npz"
    if not file.is_file():
        pytest.skip(f"no {file}")
    with np.load(file) as stored:
        light, names, curves = stored["E"].astype(float), stored["names"], stored["f"].astype(float)
    response = found.channels[0]
    assert response.shape_std is not None
    srgb = named_curve("srgb").inverse(np.arange(256) / 255)
    own, of_srgb, held = [], [], []
    for name, curve in zip(names, curves, strict=True):
        if "like" not in str(name):
            continue
        truth = np.interp(np.arange(256) / 255, curve + 1e-9 * np.arange(curve.size), light)
        errors = [_off(guess, truth) for guess in (response.inverse_lut, srgb)]
        own.append(np.sqrt(np.mean(errors[0] ** 2)))
        of_srgb.append(np.sqrt(np.mean(errors[1] ** 2)))
        held.append(np.mean(np.abs(errors[0][1:]) < 2 * response.shape_std[1:]))

    assert len(own) > 10
    assert np.median(own) < 0.5 * np.median(of_srgb)
    assert np.mean(held) > 0.9


def _off(guess: Floats, truth: Floats) -> Floats:
    return np.asarray(guess * (guess @ truth) / (guess @ guess) - truth)
