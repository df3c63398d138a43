"""Bands of an estimated curve, and how they widen by what a likelihood leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from chartless.curves import named_curve
from chartless.inference.estimate import CurveEstimate

LEVELS = np.arange(256) / 255


def estimate() -> CurveEstimate:
    curve = named_curve("srgb")
    return CurveEstimate(
        curve=curve,
        inverse_lut=curve.inverse(LEVELS),
        std=np.full(256, 0.004),
        shape_std=np.full(256, 0.003),
        white_std=0.01,
        parameter_covariance=np.diag([1.0, 4.0]),
    )


def test_an_unknown_exponent_widens_levels_by_how_it_bends_the_curve() -> None:
    before, step = estimate(), 1e-6
    bent = (before.inverse_lut ** (1 + step) - before.inverse_lut) / step

    widened = before.with_exponent_error(0.2)

    assert widened.shape_std is not None
    np.testing.assert_allclose(widened.std, np.hypot(0.004, 0.2 * bent), rtol=1e-4)
    np.testing.assert_allclose(widened.shape_std, np.hypot(0.003, 0.2 * bent), rtol=1e-4)
    np.testing.assert_array_equal(widened.inverse_lut, before.inverse_lut)


def test_an_unknown_exponent_widens_white_by_how_it_scales_the_curve() -> None:
    before, step = estimate(), 1e-6
    light = before.inverse_lut
    bent = light ** (1 + step)
    log_scale = np.log((bent @ light) / (light @ light)) / step

    widened = before.with_exponent_error(0.2)

    assert widened.white_std == pytest.approx(np.hypot(0.01, 0.2 * log_scale))
    assert replace(before, white_std=None).with_exponent_error(0.2).white_std is None


def test_an_unknown_white_widens_all_levels_but_white() -> None:
    before = estimate()

    widened = before.with_white_error(0.1)

    assert widened.white_std == pytest.approx(np.hypot(0.01, 0.1))
    assert widened.std[200] == pytest.approx(np.hypot(0.004, 0.1 * before.inverse_lut[200]))
    assert widened.std[-1] == 0.004
    assert widened.shape_std is before.shape_std
    assert before.with_white_error(0.0) is before
    undivided = replace(before, white_std=None)
    assert undivided.with_white_error(0.1) is undivided


def test_errors_of_levels_widen_the_shape_too() -> None:
    error = np.linspace(0, 0.01, 256)

    widened = estimate().with_level_errors(error)

    assert widened.shape_std is not None
    np.testing.assert_allclose(widened.std, np.hypot(0.004, error))
    np.testing.assert_allclose(widened.shape_std, np.hypot(0.003, error))
    assert widened.white_std == 0.01
    assert replace(estimate(), shape_std=None).with_level_errors(error).shape_std is None


def test_a_misfit_widens_everything() -> None:
    widened = estimate().scaled(3)

    assert widened.shape_std is not None
    assert widened.parameter_covariance is not None
    np.testing.assert_allclose(widened.std, 0.012)
    np.testing.assert_allclose(widened.shape_std, 0.009)
    assert widened.white_std == pytest.approx(0.03)
    np.testing.assert_allclose(widened.parameter_covariance, np.diag([9.0, 36.0]))
    bare = replace(estimate(), shape_std=None, white_std=None, parameter_covariance=None)
    assert bare.scaled(3).white_std is None
