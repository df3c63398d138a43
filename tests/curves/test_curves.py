import numpy as np
import pytest

from chartless.curves import ModelCurve, SampledCurve, SrgbCurve, named_curve
from chartless.errors import ParameterError, UnknownNameError
from chartless.models import MODELS

STEPPED = SampledCurve((0.0, 0.2, 0.5, 0.7, 1.0), (0.0, 0.4, 0.4, 0.9, 1.0))


@pytest.mark.parametrize(
    ("irradiance", "brightness"),
    # IEC 61966-2-1: both branches of the formula by mpmath, 20 digits
    [(0.0, 0.0), (0.002, 0.02584), (0.18, 0.46135612950044164), (0.5, 0.73535698305244952)],
)
def test_srgb_agrees_with_the_standard(irradiance: float, brightness: float):
    assert SrgbCurve().response(irradiance) == pytest.approx(brightness, rel=1e-14)
    assert SrgbCurve().inverse(brightness) == pytest.approx(irradiance, rel=1e-13)


def test_srgb_joins_its_branches_to_the_digits_of_the_standard():
    around = SrgbCurve().response([0.0031308 * (1 - 1e-12), 0.0031308 * (1 + 1e-12)])

    assert abs(np.diff(around).item()) < 1e-7


@pytest.mark.parametrize(
    "curve",
    [SrgbCurve(), ModelCurve("gamma", (0.45,)), ModelCurve("ameegc2-exact", (-0.8, 1.8, -0.1))],
    ids=["srgb", "gamma", "exact"],
)
def test_curves_increase_from_end_to_end_and_invert(curve):
    irradiance = np.linspace(0, 1, 1001)

    brightness = curve.response(irradiance)

    assert (brightness[0], brightness[-1]) == (0.0, pytest.approx(1.0, abs=1e-15))
    assert np.all(np.diff(brightness) > 0)
    np.testing.assert_allclose(curve.inverse(brightness.clip(0, 1)), irradiance, atol=1e-7)


@pytest.mark.parametrize("curve", [SrgbCurve(), ModelCurve("gamma", (0.45,)), STEPPED], ids=repr)
def test_light_beyond_the_ends_is_clipped(curve):
    assert curve.response([-1.0, 2.0]) == pytest.approx([0.0, 1.0], abs=1e-15)


@pytest.mark.parametrize("curve", [SrgbCurve(), ModelCurve("gamma", (0.45,)), STEPPED], ids=repr)
@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 3)])
def test_shapes_are_kept(curve, shape: tuple[int, ...]):
    values = np.full(shape, 0.5)

    assert curve.response(values).shape == shape
    assert curve.inverse(values).shape == shape


@pytest.mark.parametrize("curve", [SrgbCurve(), ModelCurve("gamma", (0.45,)), STEPPED], ids=repr)
@pytest.mark.parametrize("brightness", [-1e-9, 1 + 1e-9, np.nan])
def test_brightness_outside_the_range_is_refused(curve, brightness: float):
    with pytest.raises(ParameterError, match=r"brightness must lie in \[0, 1\]"):
        curve.inverse([0.5, brightness])


def test_a_curve_of_an_inverse_table_gives_the_table_back():
    lut = SrgbCurve().inverse(np.arange(256) / 255)

    curve = SampledCurve.from_inverse(lut)

    np.testing.assert_allclose(curve.inverse(np.arange(256) / 255), lut, atol=1e-15)


def test_of_levels_with_one_irradiance_the_highest_is_kept():
    curve = SampledCurve.from_inverse([0.0, 0.0, 0.3, 0.3, 1.0, 1.0])

    assert curve.irradiance == (0.0, 0.3, 1.0)
    assert curve.brightness == pytest.approx((0.0, 0.6, 1.0))


def test_a_model_curve_is_the_member_of_its_family():
    parameters = (-0.3, 1.5, 0.2)
    curve = ModelCurve("ameegc2-exact", parameters)

    brightness = MODELS["ameegc2-exact"].response([0.1, 0.7], parameters)

    assert np.array_equal(curve.response([0.1, 0.7]), brightness)


@pytest.mark.parametrize("parameters", [(), (0.5, 0.5), (-1.0,), (np.nan,)])
def test_a_model_curve_refuses_parameters_at_once(parameters: tuple[float, ...]):
    with pytest.raises(ParameterError):
        ModelCurve("gamma", parameters)


def test_a_sampled_curve_joins_its_samples_by_lines():
    assert STEPPED.response([0.1, 0.2, 0.6]) == pytest.approx([0.2, 0.4, 0.65])


def test_a_sampled_curve_comes_back_from_every_brightness_even_past_a_flat_stretch():
    brightness = np.linspace(0, 1, 1001)

    irradiance = STEPPED.inverse(brightness)

    np.testing.assert_allclose(STEPPED.response(irradiance), brightness, atol=1e-12)
    assert STEPPED.inverse([0.2, 0.65, 0.9]) == pytest.approx([0.1, 0.6, 0.7])


def test_of_a_flat_stretch_the_inverse_is_the_first_point():
    assert STEPPED.inverse(0.4) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("irradiance", "brightness", "why"),
    [
        ((0.0,), (0.0,), "two rows"),
        ((0.0, 1.0), (0.0, 0.5, 1.0), "two columns"),
        ((0.0, 0.5, 0.5, 1.0), (0.0, 0.2, 0.3, 1.0), "must increase"),
        ((0.0, 0.5, 1.0), (0.0, 1.1, 1.0), "must increase"),
        ((0.0, np.nan, 1.0), (0.0, 0.5, 1.0), "must increase"),
        ((0.0, 0.5, 1.0), (0.0, np.nan, 1.0), "must increase"),
        ((0.1, 1.0), (0.0, 1.0), r"\(0.1, 0\)"),
        ((0.0, 1.0), (0.0, 0.9), r"\(1, 0.9\)"),
    ],
)
def test_samples_that_are_no_response_curve_are_refused(irradiance, brightness, why: str):
    with pytest.raises(ParameterError, match=why):
        SampledCurve(irradiance, brightness)


@pytest.mark.parametrize(
    ("text", "curve"),
    [
        ("srgb", SrgbCurve()),
        ("linear", ModelCurve("gamma", (1.0,))),
        ("gamma:0.45", ModelCurve("gamma", (0.45,))),
        ("ameegc1:-0.5, 1.2", ModelCurve("ameegc1", (-0.5, 1.2))),
    ],
)
def test_curves_are_found_by_name(text: str, curve):
    assert named_curve(text) == curve


def test_the_linear_curve_is_linear():
    irradiance = np.linspace(0, 1, 11)

    assert named_curve("linear").response(irradiance) == pytest.approx(irradiance)


@pytest.mark.parametrize(
    ("text", "suggestion"), [("srbg", "srgb"), ("gama:0.5", "gamma"), ("S-Log4", "slog3")]
)
def test_an_unknown_name_suggests_the_closest(text: str, suggestion: str):
    with pytest.raises(UnknownNameError, match=f"Did you mean '{suggestion}'"):
        named_curve(text)


@pytest.mark.parametrize("text", ["srgb:1", "gamma:a", "gamma", "gamma:0.5,0.6", "gamma:-1"])
def test_useless_parameters_in_a_name_are_refused(text: str):
    with pytest.raises(ParameterError):
        named_curve(text)
