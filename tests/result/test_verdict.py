"""How far to trust a calibration: one rule."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless import AffineNoise, ModelCurve, Response
from chartless.evidence.bracket.estimates import ExposureEstimate, SeenTransfer
from chartless.flags import Flag
from chartless.result.response import Status
from chartless.result.verdict import GOOD_BAND, GRAVE, WORST_BAND, WORST_DEVIANCE, Grade, verdict


def response_of(name: str = "Y", band: float | None = 0.01, **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name,
        "curve": ModelCurve("gamma", (0.5,)),
        "noise": AffineNoise.from_8bit(0.03, 16),
        "n_levels": 256,
        "observed_levels": (0, 255),
        "n_pairs": 1000,
        "method": "likelihood",
        "status": Status.CONVERGED,
        "inverse_lut_std": None if band is None else np.full(256, band),
    }
    return Response(**{**values, **changes})


def test_a_curve_known_well_of_which_nothing_is_doubtful_is_good() -> None:
    judged = verdict([response_of(band=0.012)])

    assert judged.grade is Grade.GOOD
    assert judged.reasons == ("The curve is known to ± 0.012 of the light at white.",)
    assert str(judged) == "good: The curve is known to ± 0.012 of the light at white."


@pytest.mark.parametrize("flag", Flag)
def test_no_flagged_curve_is_good(flag: Flag) -> None:
    judged = verdict([response_of(flags=(flag,))])

    assert judged.grade is (Grade.DISTRUST if flag in GRAVE else Grade.CARE)
    assert flag.code.replace("-", " ") in str(judged)


@given(band=st.floats(0, 0.2))
def test_the_wider_the_band_the_less_trust(band: float) -> None:
    grade = verdict([response_of(band=band)]).grade

    std = np.sqrt(np.mean(np.full(256, band) ** 2))
    expected = [Grade.GOOD, Grade.CARE, Grade.DISTRUST][
        int(std > GOOD_BAND) + int(std > WORST_BAND)
    ]
    assert grade is expected


@pytest.mark.parametrize(
    ("misfits", "grade"),
    [
        ((0.04, 0.04, 0.04), Grade.GOOD),
        ((0.06, 0.06, 0.06), Grade.CARE),
        ((0.04, 0.04, 0.09), Grade.GOOD),
        ((0.04, 0.06, 0.09), Grade.CARE),
    ],
)
def test_exposures_whose_light_is_not_their_ratio(misfits: tuple[float, ...], grade: Grade) -> None:
    """Of three channels the middle one decides."""
    channels = []
    for name, misfit in zip("RGB", misfits, strict=True):
        seen = SeenTransfer(4 * np.exp(misfit), (100.0, 200.0), (50.0, 100.0))
        exposures = ExposureEstimate((1.0, 4.0), 0.0, 0.0, (seen,))
        channels.append(response_of(name, exposures=exposures))

    judged = verdict(channels)

    assert judged.grade is grade
    assert ("6.0% from their ratio" in str(judged)) == (grade is Grade.CARE)


def test_the_band_is_the_root_mean_square_over_the_levels() -> None:
    std = np.zeros(256)
    std[:64] = 0.1  # 0.05 over all

    assert "± 0.050" in str(verdict([response_of(inverse_lut_std=std)]))


@pytest.mark.parametrize(
    ("deviance", "grade"),
    [
        (None, Grade.DISTRUST),
        (WORST_DEVIANCE, Grade.CARE),
        (WORST_DEVIANCE + 0.01, Grade.DISTRUST),
        (70.0, Grade.DISTRUST),
    ],
)
def test_a_slight_misfit_asks_for_care_alone(deviance: float | None, grade: Grade) -> None:
    assert verdict([response_of(flags=(Flag.MISFIT,), deviance=deviance)]).grade is grade


def test_a_slight_misfit_excuses_nothing_else() -> None:
    both = response_of(flags=(Flag.CORRELATED_NOISE, Flag.MISFIT), deviance=1.6)

    judged = verdict([both])

    assert judged.grade is Grade.DISTRUST
    assert judged.reasons[0].endswith(": correlated noise.")
    assert judged.reasons[-1] == "Doubtful: misfit."


def test_the_worst_channel_decides() -> None:
    good, wide = response_of("R"), response_of("G", band=0.03)
    bad = response_of("B", flags=(Flag.NOT_MONOTONE,))

    assert verdict([good, good]).grade is Grade.GOOD
    assert verdict([good, wide]).grade is Grade.CARE
    assert verdict([bad, good, wide]).grade is Grade.DISTRUST


def test_a_grave_flag_says_that_the_band_does_not_hold() -> None:
    judged = verdict([response_of(flags=(Flag.MISFIT,), deviance=9.0)])

    assert "several times the given ± 0.010" in judged.reasons[1]


def test_without_an_error_a_curve_wants_care() -> None:
    judged = verdict([response_of("R"), response_of("G", band=None)])

    assert judged.grade is Grade.CARE
    assert "No error is known for this curve." in judged.reasons
