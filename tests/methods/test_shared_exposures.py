"""Exposures that channels share, and the band that knows what they do not tell."""

from dataclasses import replace

import numpy as np
import pytest

from chartless import Response, named_curve
from chartless.flags import Flag
from chartless.methods.shared_exposures import shared_exposures
from chartless.result.response import ExposureEstimate, Status


def channel(name: str, relative: tuple[float, ...], error: float = 0.01) -> Response:
    return Response(
        name=name,
        curve=named_curve("srgb"),
        noise=None,
        n_levels=256,
        observed_levels=(0, 255),
        n_pairs=1000,
        method="likelihood",
        status=Status.CONVERGED,
        inverse_lut_std=np.full(256, 0.004),
        shape_std=np.full(256, 0.003),
        white_std=0.01,
        exposures=ExposureEstimate(relative, error, 0.02),
    )


def test_the_median_of_channels_is_shared() -> None:
    channels = [
        channel("R", (1.0, 4.0, 16.0)),
        channel("G", (1.0, 4.1, 17.0)),
        channel("B", (1.0, 5.0, 30.0)),
    ]
    shared = shared_exposures(channels)
    assert np.exp(shared.log_exposures) == pytest.approx([1.0, 4.1, 17.0])
    assert shared.exponent_error > 0.05  # blue is far from the others


def test_channels_that_agree_are_as_sure_as_one() -> None:
    channels = [channel(name, (1.0, 4.0, 16.0)) for name in "RGB"]
    assert shared_exposures(channels).exponent_error == pytest.approx(0.01)


@pytest.mark.parametrize(
    "channels",
    [
        [channel("Y", (1.0, 4.0))],
        [channel(name, (1.0, 4.0), error=0.0) for name in "RGB"],
        [replace(channel(name, (1.0, 4.0)), exposures=None) for name in "RGB"],
    ],
)
def test_one_channel_or_exact_exposures_share_nothing(channels: list[Response]) -> None:
    assert shared_exposures(channels) is None


def test_what_is_unknown_of_exposures_stays_in_band_and_flags() -> None:
    alone = [
        channel(name, exposures).with_flags(Flag.EXPOSURES_OFF, Flag.SCATTER)
        for name, exposures in zip("RGB", [(1.0, 4.0), (1.0, 4.2), (1.0, 4.4)], strict=True)
    ]
    shared = shared_exposures(alone)
    again = channel("R", (1.0, 4.2), error=0.0)
    taken = shared.taken_by(again, alone[0])
    assert taken.exposures.exponent_error == shared.exponent_error
    assert taken.flags == (Flag.EXPOSURES_OFF,)
    light = taken.inverse_lut[1:-1]
    wanted = np.hypot(0.003, shared.exponent_error * light * np.log(light))
    assert taken.shape_std[1:-1] == pytest.approx(wanted)


def test_an_unknown_exponent_widens_white_by_how_it_scales_the_curve() -> None:
    response = channel("Y", (1.0, 4.0))
    light, step = response.inverse_lut, 1e-6
    bent = light ** (1 + step)
    log_scale = np.log((bent @ light) / (light @ light)) / step
    widened = response.with_exponent_error(0.2)
    assert widened.white_std == pytest.approx(np.hypot(response.white_std, 0.2 * log_scale))
    assert replace(response, white_std=None).with_exponent_error(0.2).white_std is None


def test_an_unknown_white_widens_all_levels_but_white() -> None:
    response = channel("Y", (1.0, 4.0)).with_white_error(0.1)
    assert response.white_std == pytest.approx(np.hypot(0.01, 0.1))
    assert response.inverse_lut_std[200] == pytest.approx(
        np.hypot(0.004, 0.1 * response.inverse_lut[200])
    )
    assert response.inverse_lut_std[-1] == 0.004
    assert response.shape_std[200] == 0.003
