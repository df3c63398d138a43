from dataclasses import replace

import numpy as np
import pytest

from chartless.curves import named_curve
from chartless.flags import Flag
from chartless.noise import AffineNoise
from chartless.response import ExposureEstimate, Response, SeenTransfer, Status, rmse


@pytest.fixture
def response() -> Response:
    return Response(
        name="Y",
        curve=named_curve("gamma:0.5"),
        noise=AffineNoise.from_8bit(0.03, 15),
        n_levels=256,
        observed_levels=(3, 250),
        n_pairs=1000,
        method="ism-bin",
        status=Status.CONVERGED,
    )


def test_inverse_table_has_the_irradiance_of_every_level(response: Response):
    np.testing.assert_allclose(response.inverse_lut, (np.arange(256) / 255) ** 2, atol=1e-12)


def test_response_table_has_1024_brightnesses(response: Response):
    np.testing.assert_allclose(response.response_lut, np.sqrt(np.linspace(0, 1, 1024)), atol=1e-12)


def test_flags_are_held_once_in_a_fixed_order(response: Response):
    flags = list(Flag)

    flagged = response.with_flags(flags[3], flags[0]).with_flags(flags[3], flags[1])

    assert flagged.flags == (flags[0], flags[1], flags[3])
    assert response.flags == ()


def test_other_numbers_of_levels_keep_their_brightness(response: Response):
    transfer = SeenTransfer(2.0, (51.0, 255.0), (25.5, 102.0))
    exposures = ExposureEstimate((1.0, 2.0), 0.0, 0.02, (transfer,))

    finer = replace(response, observed_levels=(51, 255), exposures=exposures).at_levels(1021)

    assert finer.observed_levels == (204, 1020)
    assert finer.exposures == replace(
        exposures, transfers=(SeenTransfer(2.0, (204.0, 1020.0), (102.0, 408.0)),)
    )
    np.testing.assert_allclose(finer.inverse_lut[::4], response.inverse_lut, atol=1e-12)


def test_rmse_is_the_distance_of_two_curves():
    root, square = named_curve("gamma:0.5"), named_curve("gamma:2")

    # ∫ (√x − x²)² dx = 1/2 − 4/7 + 1/5 = 9/70
    assert rmse(root, square) == pytest.approx(np.sqrt(9 / 70), rel=1e-3)
    assert rmse(root, square) == rmse(square, root)
    assert rmse(root, root) == 0
