"""Short texts about a calibration."""

from typing import Any

import pytest

from chartless import AffineNoise, Calibration, Response, named_curve
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.misfit import Pattern
from chartless.evidence.raw.account import account_of_raw
from chartless.flags import Flag
from chartless.noise import NoiseError
from chartless.result.account import Account, Fact, Fit
from chartless.result.response import Status
from chartless.result.summary import account_lines, doubts, fit_text, noise_text, of_each


def response_of(name: str = "Y", **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name, "curve": named_curve("srgb"), "noise": None, "n_levels": 256,
        "observed_levels": (0, 255), "n_pairs": 1, "method": "likelihood",
        "status": Status.CONVERGED,
    }  # fmt: skip
    return Response(**{**values, **changes})


@pytest.mark.parametrize(
    ("value", "relative", "said"),
    [
        (0.25, 0.2, "0.250 ± 0.050"),
        (1234.5, 0.5, "1234 ± 617"),
        (9.0, 0.1, "9.00 ± 0.90"),
        (0.00046, 0.7, "0.00046 ± 0.00032"),
        (0.0000613, 0.2, "0.00006 ± 0.00001"),
        (0.000001, 0.5, "< 0.00001"),
        (0.1, 0.0, "0.10000 ± 0.00000"),
        (0.1, None, "0.1000"),
    ],
)
def test_noise_has_two_digits_of_its_deviation(
    value: float, relative: float | None, said: str
) -> None:
    noise = AffineNoise.from_8bit(value, 1.0)
    error = None if relative is None else NoiseError(relative, 1.0, 0.0)

    assert noise_text("slope", response_of(noise=noise, noise_error=error), 3) == said


# What kinds of evidence say


def misfit(name: str, pattern: Pattern | None) -> Response:
    account = account_of_pairs(None, deviance=3.0, pattern=pattern)
    return response_of(name, flags=(Flag.MISFIT,), accounts=(account,))


def details(*channels: Response) -> tuple[str, ...]:
    (doubt,) = doubts(Calibration(channels=channels, bit_depth=8))
    assert doubt.code == "misfit"
    return doubt.details


def test_the_pattern_of_a_misfit_is_a_detail_of_the_flag() -> None:
    peaked = f"the pattern is peaked: {Pattern.PEAKED.advice}"

    assert details(misfit("Y", Pattern.PEAKED)) == (peaked,)
    assert details(misfit("Y", None)) == ()


def test_what_all_channels_say_is_said_once() -> None:
    peaked = f"the pattern is peaked: {Pattern.PEAKED.advice}"

    assert details(*(misfit(name, Pattern.PEAKED) for name in "RGB")) == (peaked,)


def test_what_all_flagged_channels_say_is_said_once() -> None:
    peaked = f"the pattern is peaked: {Pattern.PEAKED.advice}"
    red, green = (misfit(name, Pattern.PEAKED) for name in "RG")

    assert details(red, green, response_of("B")) == (peaked,)


def test_channels_that_differ_are_named() -> None:
    peaked = f"the pattern is peaked: {Pattern.PEAKED.advice}"
    tails = f"the pattern is far-tails: {Pattern.FAR_TAILS.advice}"
    patterns = (Pattern.PEAKED, Pattern.FAR_TAILS, Pattern.PEAKED)
    channels = (misfit(name, each) for name, each in zip("RGB", patterns, strict=True))

    assert details(*channels) == (f"R, B: {peaked}", f"G: {tails}")


def test_details_of_flags_that_are_not_there_are_not_said() -> None:
    account = Account(kind="wedge", details={"motion": "the wedge moved"})
    response = response_of(flags=(Flag.CLIPPED,), accounts=(account,))

    (doubt,) = doubts(Calibration(channels=(response,), bit_depth=8))

    assert (doubt.code, doubt.channels, doubt.details) == ("clipped", ("Y",), ())


def test_details_of_all_kinds_are_said() -> None:
    accounts = tuple(
        Account(kind=kind, details={"motion": f"the {kind} moved"}) for kind in ("wedge", "noise")
    )
    response = response_of(flags=(Flag.MOTION,), accounts=accounts)

    (doubt,) = doubts(Calibration(channels=(response,), bit_depth=8))

    assert doubt.details == ("the wedge moved", "the noise moved")


def test_facts_and_fits_are_a_line_each() -> None:
    account = Account(
        kind="wedge",
        facts=(Fact("patches", "Patches", (1.0, 2.0), ".1f"), Fact("maker", "Maker", "Stouffer")),
        fits=(Fit("gap", "Gap", 0.125, ".1%"),),
        share=0.256,
    )

    lines = account_lines([response_of(accounts=(account,))])

    assert lines == [
        ("Patches", ("1.0 2.0",)),
        ("Maker", ("Stouffer",)),
        ("Gap", ("12.5%",)),
        ("Share of the information from wedge", ("26%",)),
    ]


def test_lines_have_a_value_for_each_channel() -> None:
    red = account_of_pairs(None, deviance=1.0)
    blue = account_of_pairs(None, deviance=2.0, outliers=0.01)
    channels = [
        response_of("R", accounts=(red,)),
        response_of("G"),
        response_of("B", accounts=(blue,)),
    ]

    lines = {line.name: line.values for line in account_lines(channels)}

    assert lines["Excluded pairs"] == ("-", "-", "1.00%")
    assert lines["Deviance of the level pairs, relative to chance"] == ("1.00", "-", "2.00")


def test_quantities_of_one_name_are_those_of_their_kind() -> None:
    kinds = ("wedge", "raw")
    accounts = tuple(Account(kind=kind, facts=(Fact("gap", kind, kind),)) for kind in kinds)

    assert account_lines([response_of(accounts=accounts)]) == [
        ("wedge", ("wedge",)),
        ("raw", ("raw",)),
    ]


def test_goodness_of_fit_is_that_of_all_kinds() -> None:
    raw = account_of_raw(matrix=(0.2, 0.7, 0.1), gains=(1.0,), corner_gain=1.2, scatter=0.0123)
    pairs = account_of_pairs(None, deviance=1.234)

    assert fit_text(response_of(accounts=(raw, pairs))) == "scatter 1.2%, deviance 1.23"
    assert fit_text(response_of(accounts=(account_of_pairs(None, similarity=0.98765),))) == (
        "similarity 0.988"
    )
    assert fit_text(response_of(accounts=(account_of_pairs(None),))) == "-"
    assert fit_text(response_of()) == "-"


def test_lines_break_between_channels_only() -> None:
    def text(response: Response) -> str:
        return f"{response.n_levels} levels"

    assert of_each([response_of("Y")], text) == "256\xa0levels"
    assert of_each([response_of(name) for name in "RG"], text) == (
        "R\xa0256\xa0levels, G\xa0256\xa0levels"
    )
