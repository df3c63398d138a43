"""Debevec, Mitsunaga and Robertson: curves come back from brackets without noise."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from chartless.curves import named_curve
from chartless.errors import ParameterError
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.likelihood import Comparagram, ExposureCounts
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.flags import Flag
from chartless.methods import CALIBRATORS, AbstractCalibrator
from chartless.methods.debevec import DebevecCalibrator
from chartless.methods.mitsunaga import MitsunagaCalibrator, _fitted, _neighbours
from chartless.methods.robertson import RobertsonCalibrator
from chartless.result.response import Response, Status, rmse
from chartless.types import Floats

METHODS = ("debevec", "mitsunaga", "robertson")
EXPOSURES = (1.0, 2.0, 4.0, 8.0)


def shown(response: str, light: Floats, n_levels: int = 256) -> Floats:
    brightness = named_curve(response).response(light.clip(0, 1))
    return np.asarray(np.rint((n_levels - 1) * brightness).astype(np.intp))


@cache
def bracket(
    response: str,
    n_pixels: int = 40_000,
    *,
    n_levels: int = 256,
    brightest: float = 8.0,
    said: tuple[float, ...] = EXPOSURES,
    exposure_error: float = 0.0,
) -> ExposureCounts:
    """Neighbours compared, of a scene with as much of one exposure value as of another."""
    rng = np.random.default_rng(11)
    light = np.exp(rng.uniform(np.log(1e-4), 0, n_pixels)) * brightest
    levels = [shown(response, light * each / EXPOSURES[-1], n_levels) for each in EXPOSURES]
    tables = []
    for shorter in range(len(EXPOSURES) - 1):
        index = levels[shorter + 1] * n_levels + levels[shorter]
        counts = np.bincount(index, minlength=n_levels**2).reshape(n_levels, n_levels)
        histogram = np.bincount(levels[shorter + 1], minlength=n_levels) * 1.0
        ones = np.ones(n_levels)
        tables.append(Comparagram(shorter, shorter + 1, counts * 1.0, ones, histogram))
    return ExposureCounts(tuple(tables), np.log(said), exposure_error)


@cache
def found(method: str, response: str, **how: Any) -> Response:
    return CALIBRATORS[method]().calibrate(ExposurePairs(bracket(response, **how)))


LARGEST_ERROR = {"debevec": 0.003, "mitsunaga": 0.004, "robertson": 0.015}
"""RMSE of f. Robertson's comes to its end early: it moves by less than the tolerance."""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("response", ["srgb", "gamma:0.45", "gamma:0.7"])
@pytest.mark.parametrize("brightest", [1.0, 8.0])
def test_the_curve_comes_back(method: str, response: str, brightest: float) -> None:
    """Also where a third of the pixels of the longer exposures are saturated."""
    given = found(method, response, brightest=brightest)

    assert rmse(given.curve, named_curve(response)) < LARGEST_ERROR[method]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "response", ["srgb", "linear", "gamma:0.3", "ameegc2-exact:0.48,-2.26,0.37"]
)
def test_a_found_curve_is_one(method: str, response: str) -> None:
    given = found(method, response)

    for table in (given.inverse_lut, given.response_lut):
        assert np.isfinite(table).all()
        assert (table[0], table[-1]) == (0, 1)
        assert np.all(np.diff(table) >= 0)
    assert given.noise is None
    assert given.inverse_lut_std is None
    assert given.method == method
    assert given.n_pairs == 3 * 40_000
    assert given.observed_levels[0] <= 16
    assert given.observed_levels[1] == 254


@pytest.mark.parametrize("method", METHODS)
def test_levels_that_nobody_shows_are_interpolated(method: str) -> None:
    """A camera that leaves out every fifth level, and all above 200."""
    counts = bracket("srgb", brightest=4.0)
    tables = []
    for table in counts.tables:
        kept = table.counts.copy()
        kept[::5], kept[:, ::5] = 0, 0
        kept[200:], kept[:, 200:] = 0, 0
        tables.append(replace(table, counts=kept))

    gaps = ExposureCounts(tuple(tables), counts.log_exposures)
    lut = CALIBRATORS[method]().calibrate(ExposurePairs(gaps)).inverse_lut

    assert np.isfinite(lut).all()
    assert np.all(np.diff(lut[:200]) >= 0)
    truth = named_curve("srgb").inverse(np.arange(256) / 255)
    relative = lut[20:190] / truth[20:190]
    assert np.abs(relative / np.median(relative) - 1).max() < 0.15
    # What lies between two seen levels lies between their irradiances.
    inner = np.arange(25, 190, 5)
    assert np.all((lut[inner] >= lut[inner - 1]) & (lut[inner] <= lut[inner + 1]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n_levels", [64, 100])
def test_fewer_levels(method: str, n_levels: int) -> None:
    given = found(method, "srgb", n_levels=n_levels)

    assert given.inverse_lut.shape == (n_levels,)
    assert rmse(given.curve, named_curve("srgb")) < 0.03


@pytest.mark.parametrize("method", METHODS)
def test_a_factor_on_all_exposures_changes_nothing(method: str) -> None:
    plain, shifted = (
        found(method, "srgb", said=tuple(factor * t for t in EXPOSURES)) for factor in (1.0, 20.0)
    )

    np.testing.assert_allclose(shifted.inverse_lut, plain.inverse_lut, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_methods_of_exposures_take_nothing_else(method: str) -> None:
    table = Cooccurrence(np.eye(256, dtype=np.int64))
    pairs, exposures = LevelPairs(table), ExposurePairs(bracket("srgb"))
    calibrator = CALIBRATORS[method]()

    with pytest.raises(
        ParameterError, match=f"^{method} uses bracket only, and was given noise: choose another"
    ):
        calibrator.calibrate(pairs)
    with pytest.raises(ParameterError, match="given bracket and noise"):
        calibrator.calibrate(pairs, exposures)
    with pytest.raises(ParameterError, match="given nothing"):
        calibrator.calibrate()


@pytest.mark.parametrize("method", ["nlf", "ism-bin"])
def test_methods_of_noise_take_no_exposures(method: str) -> None:
    with pytest.raises(ParameterError, match=f"^{method} uses noise only, and was given bracket"):
        CALIBRATORS[method]().calibrate(ExposurePairs(bracket("srgb")))


@pytest.mark.parametrize("method", METHODS)
def test_a_fall_is_flagged_and_taken_out(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kind = type(CALIBRATORS[method]())
    lut = np.linspace(0.1, 1, 256)
    lut[100] = 0.2

    monkeypatch.setattr(kind, "inverse_lut", lambda *_: (lut, False))
    given = CALIBRATORS[method]().calibrate(ExposurePairs(bracket("srgb")))

    assert given.flags == (Flag.NOT_MONOTONE, Flag.SEARCH_UNFINISHED)
    assert given.status is Status.LIMIT_REACHED
    assert np.all(np.diff(given.inverse_lut) >= 0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DebevecCalibrator(smoothness=0), "smoothness must be a number above 0, not 0"),
        (lambda: DebevecCalibrator(smoothness=np.nan), "smoothness must be a number above 0"),
        (lambda: DebevecCalibrator(samples=-1), "samples must be a number above 0, not -1"),
        (lambda: DebevecCalibrator(samples=np.inf), "samples must be a number above 0, not inf"),
        (lambda: MitsunagaCalibrator(most_order=0), "most_order must lie between 1 and 20, not 0"),
        (lambda: MitsunagaCalibrator(most_order=21), "most_order must lie between 1 and 20"),
        (lambda: RobertsonCalibrator(rounds=0), "rounds must be 1 or more"),
        (lambda: RobertsonCalibrator(tolerance=0.0), "tolerance above 0"),
        (lambda: RobertsonCalibrator(tolerance=np.nan), "tolerance above 0"),
    ],
)
def test_settings_without_meaning(make: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make()


def test_settings_are_named() -> None:
    assert DebevecCalibrator().settings == {"smoothness": 100.0, "samples": 100.0}
    assert MitsunagaCalibrator().settings == {"most_order": 10}
    assert RobertsonCalibrator().settings == {"rounds": 300, "tolerance": 1e-3}
    methods: list[AbstractCalibrator] = [CALIBRATORS[method]() for method in METHODS]
    assert [each.method for each in methods] == list(METHODS)
    assert {each.family for each in methods} == {None}


# Debevec


@pytest.mark.parametrize("n_pixels", [1_000, 10_000, 200_000])
def test_the_end_of_the_curve_does_not_drift_with_the_number_of_pixels(n_pixels: int) -> None:
    """Of OpenCV's, g(255)/g(128) goes from 4 to 8 with 30 to 500 samples."""
    few = found("debevec", "srgb", n_pixels=n_pixels).inverse_lut

    truth = named_curve("srgb").inverse(128 / 255)
    assert few[128] / few[255] == pytest.approx(truth, rel=0.05)


def test_debevec_solves_the_equations_of_the_paper() -> None:
    """Every pixel with its own irradiance, as in the source: ln g_z − ln E_i − ln t_j = 0."""
    n_levels, rng = 16, np.random.default_rng(5)
    light = np.exp(rng.uniform(-4, 0, 60))
    levels = [shown("srgb", light * each, n_levels) for each in (0.4, 1.0)]
    kept = (levels[0] > 0) & (levels[1] < 15)
    a, b = (each[kept] for each in levels)
    hat = np.minimum(np.arange(16), 15 - np.arange(16)) * 2 / 15
    rows, targets = [], []
    unknown = 16 + a.size
    for pixel, (low, high) in enumerate(zip(a, b, strict=True)):
        for level, log_time in ((low, np.log(0.4)), (high, 0.0)):
            row = np.zeros(unknown)
            row[level], row[16 + pixel] = hat[level], -hat[level]
            rows.append(row * np.sqrt(100 / a.size))
            targets.append(hat[level] * log_time * np.sqrt(100 / a.size))
    for level in range(1, 15):
        row = np.zeros(unknown)
        row[level - 1 : level + 2] = np.array([1, -2, 1]) * hat[level] * 10
        rows.append(row)
        targets.append(0.0)
    expected = np.linalg.lstsq(np.array(rows), np.array(targets))[0][:16]
    counts = np.zeros((16, 16))
    np.add.at(counts, (b, a), 1.0)
    table = Comparagram(0, 1, counts, np.ones(16), np.ones(16))
    given = ExposureCounts((table,), np.log([0.4, 1.0]))

    lut, settled = DebevecCalibrator().inverse_lut(given)

    assert settled
    log_light = np.log(lut)
    np.testing.assert_allclose(
        (log_light - log_light[8])[1:-1], (expected - expected[8])[1:-1], atol=1e-5
    )


# Mitsunaga


@pytest.mark.parametrize("response", ["srgb", "gamma:0.45", "gamma:0.7"])
@pytest.mark.parametrize("place", [1, 2])
def test_mitsunaga_refines_a_time_that_is_ten_per_cent_wrong(response: str, place: int) -> None:
    said = tuple(1.1 * t if k == place else t for k, t in enumerate(EXPOSURES))

    refined, held = (
        found("mitsunaga", response, said=said, exposure_error=error) for error in (0.1, 0.0)
    )

    truth = named_curve(response)
    assert rmse(refined.curve, truth) < 0.004
    assert rmse(held.curve, truth) > 0.03
    assert refined.status is Status.CONVERGED


def test_mitsunaga_finds_the_coefficients_of_a_polynomial_camera() -> None:
    """G = 0.3 M + 0.7 M², which is one of its polynomials."""
    n_levels, ratio = 256, 2.0
    brightness = np.linspace(0, 1, 100_001)
    light = 0.3 * brightness + 0.7 * brightness**2

    def levels(exposure: float) -> Floats:
        return np.asarray(np.rint(255 * np.interp(light * exposure, light, brightness)).astype(int))

    counts = np.bincount(levels(1.0) * n_levels + levels(1 / ratio), minlength=n_levels**2).reshape(
        n_levels, n_levels
    )
    table = Comparagram(0, 1, counts * 1.0, np.ones(n_levels), np.ones(n_levels))
    given = ExposureCounts((table,), np.log([1.0, ratio]))

    coefficients, error, settled = _fitted(_neighbours(given), 2, refine=False)

    np.testing.assert_allclose(coefficients, [0, 0.3, 0.7], atol=5e-3)
    assert settled
    assert error < 1e-4
    assert coefficients.sum() == pytest.approx(1)
    lut, _ = MitsunagaCalibrator().inverse_lut(given)
    np.testing.assert_allclose(lut, np.interp(np.linspace(0, 1, 256), brightness, light), atol=0.01)


# Robertson


def test_robertson_is_stationary_at_the_truth_of_its_own_model() -> None:
    """The mean of t x over the pixels of a level is g there: the last round changes nothing."""
    counts = bracket("gamma:0.7")
    lut, settled = RobertsonCalibrator(tolerance=1e-5, rounds=5000).inverse_lut(counts)
    assert settled

    once, _ = RobertsonCalibrator(rounds=1).inverse_lut(counts)
    middle = np.interp(127.5, np.arange(256), lut)

    assert middle == pytest.approx(1)
    assert np.abs(once - lut).max() > 0.05
    few, unsettled = RobertsonCalibrator(rounds=2).inverse_lut(counts)
    assert not unsettled
    assert np.isfinite(few).all()
