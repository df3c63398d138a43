"""Named transfer functions against the values that standards and makers print."""

import pickle

import mpmath
import numpy as np
import pytest

from chartless.curves import AbstractCurve, named_curve
from chartless.curves.transfer import TRANSFER_FUNCTIONS, PublishedCurve, find_transfer_function
from chartless.errors import ParameterError, UnknownNameError

CURVES = {
    **{name: each.curve for name, each in TRANSFER_FUNCTIONS.items()},
    **{f"{name}:limited": each.limited for name, each in TRANSFER_FUNCTIONS.items()},
}
NAMES = [name for name, curve in CURVES.items() if curve is not None]

# Tables of code values of 10 bits for a reflectance of 0, 18 % and 90 %; None where none is given.
CODES = {
    "slog2": (90, 347, 582),
    "slog3": (95, 420, 598),
    "vlog": (128, 433, 602),
    "flog": (95, 470, 705),
    "flog2": (95, 400, 570),
    "canonlog2": (95, 407, None),
    "canonlog3": (128, 351, None),
    "nlog": (None, 372, None),
    "logc3": (95, 400, None),
    "logc4": (95, 285, None),
    "log3g10": (None, 341, None),
}
# Percent of the video range for the same, in the tables of those who print it.
PERCENT = {
    "slog2": (3, 32, 59),
    "slog3": (4, 41, 61),
    "vlog": (7, 42, 61),
    "flog": (3.5, 46.3, 73.2),
    "flog2": (3.5, 38.4, 57.8),
    "canonlog2": (None, 39.2, None),
    "canonlog3": (None, 32.8, None),
}


def reflected(curve: AbstractCurve | None, reflectance: float) -> float:
    """Brightness of a reflectance: the formulas of cameras have it for light."""
    assert isinstance(curve, PublishedCurve)
    return float(curve.response(reflectance / curve.white))


@pytest.mark.parametrize("name", CODES)
def test_codes_are_those_of_the_makers_table(name: str):
    for reflectance, code in zip((0, 0.18, 0.9), CODES[name], strict=True):
        if code is not None:
            assert round(1023 * reflected(named_curve(name), reflectance)) == code


@pytest.mark.parametrize("name", PERCENT)
def test_after_expansion_of_the_range_they_are_percent_of_the_makers_table(name: str):
    for reflectance, percent in zip((0, 0.18, 0.9), PERCENT[name], strict=True):
        if percent is not None:
            digits = 1 if isinstance(percent, float) else None
            found = 100 * reflected(named_curve(f"{name}:limited"), reflectance)
            assert round(found, digits) == percent


@pytest.mark.parametrize(
    ("name", "grey"),
    [
        ("logc3", 0.391),  # ARRI: 400/1023
        ("logc4", 0.2784),
        ("bmdfilm5", 0.3836),
        ("log3g10", 1 / 3),  # the name: a third at 18 %, and ten stops above
        ("applelog", 0.4883),
        ("dlog", 0.3988),
    ],
)
def test_grey_of_18_percent(name: str, grey: float):
    assert reflected(named_curve(name), 0.18) == pytest.approx(grey, abs=6e-5)


def test_red_has_ten_stops_above_grey():
    curve = named_curve("log3g10")

    assert isinstance(curve, PublishedCurve)
    assert curve.white == pytest.approx(0.18 * 2**10, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        ("rec709", lambda x: 4.5 * x if x < 0.018 else 1.099 * mpmath.mpf(x) ** 0.45 - 0.099),
        ("adobergb", lambda x: mpmath.mpf(x) ** (256 / mpmath.mpf(563))),
        (
            "srgb",
            lambda x: 12.92 * x if x <= 0.0031308 else 1.055 * mpmath.mpf(x) ** (5 / 12) - 0.055,
        ),
        (
            "hlg",
            lambda x: (
                mpmath.sqrt(3 * x)
                if x <= 1 / 12
                else 0.17883277 * mpmath.log(12 * x - 0.28466892) + 0.55991073
            ),
        ),
    ],
)
def test_standards_are_their_formulas(name: str, formula):
    irradiance = [0.0, 0.001, 0.003, 0.01, 0.0179, 0.02, 0.08, 0.09, 0.3, 0.77, 1.0]

    wanted = [float(formula(x)) for x in irradiance]
    assert named_curve(name).response(irradiance) == pytest.approx(wanted, abs=1e-7)


def test_hybrid_log_gamma_has_reference_white_where_the_standard_says():
    # ITU-R BT.2100-2, table 5: the pieces meet at E = 1/12, E' = 1/2; 1 is 1.
    assert named_curve("hlg").inverse([0.5, 1.0]) == pytest.approx([1 / 12, 1])


@pytest.mark.parametrize("name", NAMES)
def test_all_are_responses(name: str):
    curve = named_curve(name)
    brightness = np.linspace(0, 1, 1 << 16)

    light = curve.inverse(brightness)
    shown = curve.response(np.linspace(0, 1, 1 << 14) ** 3)

    assert light[0] == 0
    assert light[-1] == 1
    assert np.all(np.diff(light) >= 0)
    above_black = brightness[:: 1 << 6][1:] > float(curve.response(0)) + 1e-3
    assert np.all(np.diff(light[:: 1 << 6])[above_black] > 0)  # steps of a code of 10 bits
    assert np.all(np.diff(shown) >= 0)
    assert float(curve.response(1)) == 1


@pytest.mark.parametrize("name", NAMES)
def test_there_and_back_is_the_same_light(name: str):
    curve, irradiance = named_curve(name), np.linspace(0, 1, 5000) ** 3

    back = curve.inverse(curve.response(irradiance))

    # The two pieces of N-Log miss each other by 0.6 codes, those of F-Log by a thousandth of one.
    assert back == pytest.approx(irradiance, abs=6e-5 if name.startswith("nlog") else 3e-6)


@pytest.mark.parametrize("name", NAMES)
def test_levels_below_black_are_dark(name: str):
    curve = named_curve(name)
    black = float(curve.response(0))

    assert np.all(curve.inverse(np.linspace(0, black, 50)[:-1]) == 0)
    assert curve.inverse(min(black + 0.01, 1)) > 0


@pytest.mark.parametrize("name", NAMES)
def test_light_outside_is_clipped(name: str):
    curve = named_curve(name)

    assert curve.response([-1.0, 2.0]) == pytest.approx([float(curve.response(0)), 1.0])
    with pytest.raises(ParameterError, match="brightness"):
        curve.inverse(1.1)


@pytest.mark.parametrize("name", NAMES)
def test_workers_get_the_same_curve(name: str):
    assert pickle.loads(pickle.dumps(named_curve(name))) == named_curve(name)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("sRGB", "srgb"),
        ("S-Log3", "slog3"),
        ("Rec.709", "rec709"),
        ("BT.2020", "rec709"),
        ("Display P3", "srgb"),
        ("V-Log", "vlog"),
        ("Canon Log 3", "canonlog3"),
    ],
)
def test_spelling_does_not_matter(text: str, name: str):
    assert find_transfer_function(text) is TRANSFER_FUNCTIONS[name]
    assert named_curve(text) == TRANSFER_FUNCTIONS[name].curve


def test_no_two_have_one_name():
    names = [name for each in TRANSFER_FUNCTIONS.values() for name in (each.name, *each.aliases)]

    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("srgb:limited", "srgb takes no parameters, not 'limited'"),
        ("logc3:limited", "logc3 takes no parameters, not 'limited'"),
        ("slog3:full", "slog3 takes 'limited' alone as a parameter, not 'full'"),
        ("slog3:", "slog3 takes 'limited' alone as a parameter, not ''"),
    ],
)
def test_other_ranges_are_refused(text: str, told: str):
    with pytest.raises(ParameterError) as caught:
        named_curve(text)
    assert str(caught.value) == told


@pytest.mark.parametrize("text", ["", ":limited", "-", "slog", "s/rgb", "./srgb", "srgb/"])
def test_what_is_no_name_is_refused(text: str):
    with pytest.raises(UnknownNameError, match="unknown response"):
        named_curve(text)
