"""Applying a calibration to pictures in memory."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from chartless import AffineNoise, Calibration, ModelCurve, Response
from chartless.errors import ParameterError
from chartless.flags import Flag
from chartless.result.response import Status

EXPONENTS = {"R": 0.4, "G": 0.5, "B": 0.6, "Y": 0.5}


def response_of(name: str, *flags: Flag) -> Response:
    return Response(
        name=name,
        curve=ModelCurve("gamma", (EXPONENTS[name],)),
        noise=AffineNoise.from_8bit(0.03, 16),
        n_levels=256,
        observed_levels=(0, 255),
        n_pairs=1,
        method="ism-bin",
        status=Status.CONVERGED,
        flags=flags,
    )


@pytest.fixture
def colour() -> Calibration:
    return Calibration(channels=tuple(map(response_of, "RGB")), bit_depth=8)


@pytest.fixture
def grey() -> Calibration:
    return Calibration(channels=(response_of("Y"),), bit_depth=8)


def levels_of(shape: tuple[int, ...], dtype: type = np.uint8) -> npt.NDArray[Any]:
    rng = np.random.default_rng(1)
    return rng.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_light_is_g_of_every_level(dtype: type, colour: Calibration) -> None:
    levels = levels_of((9, 7, 3), dtype)

    light = colour.linearize(levels)

    assert (light.dtype, light.shape) == (np.float32, levels.shape)
    brightness = levels / np.iinfo(dtype).max
    assert np.abs(light - brightness ** (1 / np.array([0.4, 0.5, 0.6]))).max() < 1e-6


@pytest.mark.parametrize("shape", [(0, 4, 3), (1, 1, 3), (64, 64, 3), (5, 3001, 3), (97, 101, 1)])
def test_pictures_of_any_size(shape: tuple[int, ...], colour: Calibration) -> None:
    """Pictures are looked up a part of some thousand pixels at a time."""
    camera = colour if shape[-1] == 3 else Calibration(channels=colour.channels[:1], bit_depth=8)
    levels = levels_of(shape)
    tables = [each.curve.inverse(np.arange(256) / 255) for each in camera.channels]

    light = camera.linearize(levels)

    assert light.shape == shape
    for place, table in enumerate(tables):
        assert np.array_equal(light[..., place], table.astype(np.float32)[levels[..., place]])
    turned = levels.swapaxes(0, 1)[:, ::-1]
    assert np.array_equal(camera.linearize(turned), light.swapaxes(0, 1)[:, ::-1])


@pytest.mark.parametrize(("dtype", "white"), [(np.uint8, 219), (np.uint16, 4095)])
def test_light_counts_levels_from_white(dtype: type, white: int, grey: Calibration) -> None:
    levels = np.arange(white + 1, dtype=dtype).reshape(-1, 4)

    light = grey.linearize(levels, white=white)

    assert np.abs(light - (levels / white) ** 2).max() < 1e-6


def test_levels_above_white_are_refused(grey: Calibration) -> None:
    with pytest.raises(ParameterError, match="level 255 is above white, which is 219"):
        grey.linearize(np.full((2, 2), 255, np.uint8), white=219)


@pytest.mark.parametrize("shape", [(9, 7), (9, 7, 1), (9, 7, 3)])
def test_one_curve_serves_every_channel(shape: tuple[int, ...], grey: Calibration) -> None:
    levels = levels_of(shape)

    light = grey.linearize(levels)

    assert light.shape == shape
    assert np.abs(light - (levels / 255) ** 2).max() < 1e-6


def test_a_part_of_a_larger_picture(colour: Calibration) -> None:
    levels = levels_of((20, 30, 3))
    part = levels[3:17:2, ::-3]

    assert np.array_equal(colour.linearize(part), colour.linearize(levels)[3:17:2, ::-3])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_delinearize_goes_back(dtype: type, colour: Calibration) -> None:
    levels = levels_of((50, 40, 3))

    brightness = colour.delinearize(colour.linearize(levels).astype(dtype))

    assert brightness.dtype == np.float32
    assert np.abs(255 * brightness - levels).max() < 0.01


def test_light_outside_the_range_is_clipped(grey: Calibration) -> None:
    light = np.array([[-1.0, 0.0, 0.25, 1.0, 9.0]])

    assert grey.delinearize(light).tolist() == [[0.0, 0.0, 0.5, 1.0, 1.0]]


@pytest.mark.parametrize("shape", [(9, 7), (9, 7, 1), (9, 3), (9, 7, 2), (9, 7, 4)])
def test_colours_do_not_fit_other_pictures(shape: tuple[int, ...], colour: Calibration) -> None:
    with pytest.raises(ParameterError, match="has the channels R, G, B, the picture has"):
        colour.linearize(levels_of(shape))
    with pytest.raises(ParameterError, match="has the channels R, G, B, the picture has"):
        colour.delinearize(np.zeros(shape))


def test_channels_are_found_by_name(colour: Calibration) -> None:
    assert colour.channel("G") is colour.channels[1]
    with pytest.raises(LookupError, match="no channel 'Y' in R, G, B"):
        colour.channel("Y")


def test_flags_name_their_channels() -> None:
    channels = (response_of("R", Flag.MISFIT, Flag.CLIPPED), response_of("G"))
    calibration = Calibration(channels=(*channels, response_of("B", Flag.MISFIT)), bit_depth=8)

    assert calibration.flags == {Flag.CLIPPED: ["R"], Flag.MISFIT: ["R", "B"]}


def test_flags_are_added_once_in_a_fixed_order() -> None:
    response = response_of("Y", Flag.MISFIT).with_flags(Flag.MOTION, Flag.MISFIT, Flag.CLIPPED)

    assert response.flags == (Flag.CLIPPED, Flag.MOTION, Flag.MISFIT)


@pytest.mark.parametrize("flag", Flag)
def test_every_flag_has_a_code_and_an_advice(flag: Flag) -> None:
    assert Flag.from_code(flag.code) is flag
    assert flag.code == flag.name.lower().replace("_", "-")
    assert len(flag.advice) > 20
    assert "\n" not in flag.advice
