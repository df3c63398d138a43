"""How far to trust a calibration: one rule."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless import AffineNoise, ModelCurve, Response
from chartless.evidence.bracket.account import (
    GOOD_MISMATCH,
    SeenTransfer,
    SeenTransfers,
    account_of_bracket,
)
from chartless.evidence.noise.account import WORST_DEVIANCE, account_of_pairs
from chartless.flags import Flag
from chartless.result.account import Account, Fit
from chartless.result.response import Status
from chartless.result.verdict import GOOD_BAND, GRAVE, WORST_BAND, Grade, typical, verdict


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


def with_deviance(deviance: float | None, name: str = "Y", **changes: Any) -> Response:
    return response_of(name, accounts=(account_of_pairs(None, deviance=deviance),), **changes)


def with_fits(*fits: Fit, name: str = "Y", **changes: Any) -> Response:
    """Evidence of a kind that the rule does not know."""
    return response_of(name, accounts=(Account(kind="wedge", fits=fits),), **changes)


def test_a_curve_known_well_of_which_nothing_is_doubtful_is_good() -> None:
    judged = verdict([response_of(band=0.012)])

    assert judged.grade is Grade.GOOD
    assert judged.reasons == ("The curve is known to ± 0.012 of the light at white.",)
    assert str(judged) == "good: The curve is known to ± 0.012 of the light at white."


def test_an_assumed_curve_is_usable_with_care_and_never_good() -> None:
    for band in (0.001, 2 * WORST_BAND):
        judged = verdict([response_of(band=band, status=Status.ASSUMED, flags=(Flag.NO_EVIDENCE,))])

        assert judged.grade is Grade.CARE
        assert judged.chief[0].startswith("The curve is assumed")
        assert f"± {band:.3f}" in judged.brief


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
        account = account_of_bracket(
            name,
            ModelCurve("gamma", (0.5,)),
            exposures=(1.0, 4.0),
            transfers=SeenTransfers(256, (seen,)),
        )
        channels.append(response_of(name, accounts=(account,)))

    judged = verdict(channels)

    assert judged.grade is grade
    assert ("from their ratio by 6.0%" in str(judged)) == (grade is Grade.CARE)
    assert ("good brackets 5% or less" in str(judged)) == (grade is Grade.CARE)


def test_the_verdict_names_the_channel_whose_exposures_are_judged() -> None:
    fits = [
        Fit("mismatch", "", misfit, good=GOOD_MISMATCH, remark=f"Channel {name} is off.")
        for name, misfit in (("R", 0.09), ("G", 0.04), ("B", 0.06))
    ]
    channels = [with_fits(fit, name=name) for name, fit in zip("RGB", fits, strict=True)]

    assert verdict(channels).reasons[-1] == "Channel B is off."


@pytest.mark.parametrize(
    ("values", "middle"),
    [
        ({"Y": 0.3}, "Y"),
        ({"R": 0.1, "G": 0.3, "B": 0.2}, "B"),
        ({"R": 0.1, "G": None, "B": 0.2}, "B"),
        ({"R": None, "G": None, "B": 0.2}, "B"),
    ],
)
def test_the_typical_channel_is_the_middle_one_and_of_two_the_worse(
    values: dict[str, float | None], middle: str
) -> None:
    channels = [
        with_fits(*([] if value is None else [Fit("gap", "", value)]), name=name)
        for name, value in values.items()
    ]

    found = typical(channels, "wedge", "gap")

    assert found is not None
    assert found.name == middle
    assert typical(channels, "wedge", "deviance") is None
    assert typical(channels, "raw", "gap") is None


@pytest.mark.parametrize(
    ("fit", "said"),
    [
        (Fit("gap", "", 0.5, good=0.4, remark="The wedge has a gap."), True),
        (Fit("gap", "", 0.4, good=0.4, remark="The wedge has a gap."), False),
        (Fit("gap", "", 0.5, good=None, remark="The wedge has a gap."), False),
        (Fit("gap", "", 0.5, good=0.4), False),
        (Fit("gap", "", 0.5, bad=0.4), False),
    ],
)
def test_a_fit_that_is_not_good_is_remarked_in_its_words(fit: Fit, said: bool) -> None:
    judged = verdict([with_fits(fit)])

    assert judged.grade is (Grade.CARE if said else Grade.GOOD)
    assert ("The wedge has a gap." in judged.reasons) == said


def test_kinds_may_name_their_fits_alike() -> None:
    fit = Fit("gap", "", 0.5, good=0.4, remark="There is a gap.")
    accounts = (Account(kind="wedge", fits=(fit,)), Account(kind="raw", fits=(fit,)))

    assert "There is a gap." in verdict([response_of(accounts=accounts)]).reasons


def test_evidence_without_a_fit_is_untested() -> None:
    judged = verdict([with_deviance(1.0, "R"), with_deviance(None, "G")])

    assert judged.grade is Grade.CARE
    assert "Whether curve and noise explain the pictures was not tested." in judged.reasons


def test_a_fit_of_one_kind_does_not_test_another() -> None:
    tested, untested = account_of_pairs(None, deviance=1.0), Account(kind="wedge")

    assert verdict([response_of(accounts=(tested,))]).grade is Grade.GOOD
    assert verdict([response_of(accounts=(tested, untested))]).grade is Grade.CARE


def test_a_misfit_says_that_a_fit_was_tested() -> None:
    judged = verdict([with_deviance(None, flags=(Flag.MISFIT,))])

    assert "not tested" not in str(judged)


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
    assert verdict([with_deviance(deviance, flags=(Flag.MISFIT,))]).grade is grade


@pytest.mark.parametrize(
    ("fits", "grade"),
    [
        ((Fit("a", "", 1.0, bad=2.0), Fit("b", "", 1.0, bad=2.0)), Grade.CARE),
        ((Fit("a", "", 1.0, bad=2.0), Fit("b", "", 3.0, bad=2.0)), Grade.DISTRUST),
        ((Fit("a", "", 1.0, bad=2.0), Fit("b", "", 3.0)), Grade.CARE),
        ((Fit("a", "", 1.0),), Grade.DISTRUST),
    ],
)
def test_a_misfit_is_slight_where_all_fits_are_within_their_limits(
    fits: tuple[Fit, ...], grade: Grade
) -> None:
    assert verdict([with_fits(*fits, flags=(Flag.MISFIT,))]).grade is grade


def test_a_slight_misfit_excuses_nothing_else() -> None:
    both = with_deviance(1.6, flags=(Flag.CORRELATED_NOISE, Flag.MISFIT))

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
    judged = verdict([with_deviance(9.0, flags=(Flag.MISFIT,))])

    assert "several times the given ± 0.010" in judged.reasons[1]


def test_without_an_error_a_curve_wants_care() -> None:
    judged = verdict([response_of("R"), response_of("G", band=None)])

    assert judged.grade is Grade.CARE
    assert "The error of this curve is unknown." in judged.reasons
