from dataclasses import replace

import numpy as np
import pytest

from chartless.curves import named_curve
from chartless.errors import ParameterError
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers, account_of_bracket
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.flags import Flag
from chartless.noise import AffineNoise
from chartless.result.account import Account
from chartless.result.response import Response, Status, rmse


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


def bracket(response: Response, *transfers: SeenTransfer) -> Account:
    seen = SeenTransfers(256, transfers)
    return account_of_bracket("Y", response.curve, exposures=(1.0, 4.0), transfers=seen)


def test_other_numbers_of_levels_keep_their_brightness(response: Response):
    account = bracket(response, SeenTransfer(2.0, (51.0, 255.0), (25.5, 102.0)))
    seen = replace(response, observed_levels=(51, 255), accounts=(account,))

    finer = seen.at_levels(1021)

    assert finer.observed_levels == (204, 1020)
    (scaled,) = finer.accounts
    assert scaled.record == SeenTransfers(
        1021, (SeenTransfer(2.0, (204.0, 1020.0), (102.0, 408.0)),)
    )
    assert scaled.values == account.values
    np.testing.assert_allclose(finer.inverse_lut[::4], response.inverse_lut, atol=1e-12)


def test_counts_of_levels_are_those_of_their_number_of_levels(response: Response):
    account = account_of_pairs(Cooccurrence.zeros(256), deviance=1.2, outliers=0.01)

    (scaled,) = replace(response, accounts=(account,)).at_levels(1021).accounts

    assert scaled.record is None
    assert scaled.values == {"outliers": 0.01, "deviance": 1.2}


def test_accounts_are_found_by_their_kind(response: Response):
    pairs, exposures = account_of_pairs(None, deviance=1.2), bracket(response)
    both = replace(response, accounts=(exposures, pairs))

    assert both.kinds == ("bracket", "noise")
    assert both.account("noise") is pairs
    assert both.account("bracket") is exposures
    assert both.fits == pairs.fits


def test_an_account_that_is_not_there_is_named_with_those_that_are(response: Response):
    told = replace(response, accounts=(account_of_pairs(None), bracket(response)))

    with pytest.raises(LookupError, match="no account of raw in noise, bracket"):
        told.account("raw")
    with pytest.raises(LookupError, match="no account of raw in this response"):
        response.account("raw")
    assert (response.kinds, response.fits) == ((), ())


def test_rmse_is_the_distance_of_two_curves():
    root, square = named_curve("gamma:0.5"), named_curve("gamma:2")

    # ∫ (√x − x²)² dx = 1/2 − 4/7 + 1/5 = 9/70
    assert rmse(root, square) == pytest.approx(np.sqrt(9 / 70), rel=1e-3)
    assert rmse(root, square) == rmse(square, root)
    assert rmse(root, root) == 0


def test_in_a_terminal_it_is_one_line(response: Response):
    flagged = replace(response, status=Status.CONVERGED).with_flags(Flag.CLIPPED)

    assert (
        repr(flagged)
        == f"<Response {response.name}: {response.method}, 256 levels, converged, clipped>"
    )


def test_mismatch_of_exposures_is_how_far_their_light_is_from_their_ratio(response: Response):
    """By the square root a quarter of the light is half of the level."""
    exact = SeenTransfer(4.0, (100.0, 200.0), (50.0, 100.0))
    off = SeenTransfer(4.0 * np.exp(0.1), (100.0, 200.0, 220.0), (50.0, 100.0, 110.0))
    unseen = SeenTransfer(16.0, (), ())

    def mismatch(*transfers: SeenTransfer) -> float | None:
        account = bracket(response, *transfers)
        assert account.record is not None
        return account.values.get("mismatch")

    assert mismatch(exact, unseen) == pytest.approx(0)
    assert mismatch(off, unseen) == pytest.approx(0.1)
    assert mismatch(exact, off) == pytest.approx(0.1)
    assert mismatch(unseen) is None
    assert mismatch() is None


def test_rmse_takes_responses_as_well_as_curves(response: Response):
    srgb = named_curve("srgb")
    expected = rmse(response.curve, srgb)

    assert expected > 0.01
    assert rmse(response, srgb) == rmse(srgb, response) == expected
    assert rmse(response, response) == 0.0


@pytest.mark.parametrize("wrong", ["srgb", None, np.linspace(0, 1, 256)])
def test_rmse_says_what_it_takes(wrong: object, response: Response):
    with pytest.raises(ParameterError, match=r"^truth must be a curve or a Response, such as"):
        rmse(response, wrong)
    with pytest.raises(ParameterError, match=r"^curve must be a curve or a Response"):
        rmse(wrong, response)
