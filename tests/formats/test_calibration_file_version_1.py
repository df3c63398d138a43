"""Calibration files of version 1 are read, and saved as version 2."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from saved_cameras import (
    MISSING,
    VALUES,
    Place,
    about,
    changed,
    kept_or_refused,
    places_in,
    refused,
    refused_as_damaged,
    same,
    same_reading,
)
from slow_cases import slow_but

from chartless import Calibration, Cooccurrence, load, save
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers
from chartless.evidence.noise.misfit import Pattern
from chartless.formats.calibration_file import from_json, to_json
from chartless.result.account import Account, Column, Fact, Fit, Reading
from chartless.result.response import Response
from chartless.result.summary import doubts, fit_text
from chartless.result.verdict import Grade, verdict

CHANNEL = ("channels", 0)
BARE: dict[str, Any] = {
    "name": "Y",
    "parameters": None,
    "parameters_covariance": None,
    "inverse_lut": [(level / 15) ** 2 for level in range(16)],
    "inverse_lut_std": [0.0] * 8 + [0.016] * 8,
    "shape_std": None,
    "white_std": None,
    "inverse_lut_std_with_dark": None,
    "response_lut": [(step / 1023) ** 0.5 for step in range(1024)],
    "noise": {
        "u": 1e-4,
        "v": 1e-5,
        "U": 0.0255,
        "V": 0.65025,
        "std": {"log_slope": 0.1, "log_floor": 0.2, "correlation": -0.5},
    },
    "observed_levels": [1, 14],
    "pairs": 1234,
    "status": "converged",
    "outliers": None,
    "exposures": None,
    "raw": None,
    "similarity": None,
    "deviance": None,
    "pattern": None,
    "log_evidence": -1234.5,
    "flags": [],
    "search": None,
    "cooccurrence": None,
}
TABLE = {"first": [*range(15), 0], "counts": [*([[5, 1]] * 15), []]}
NOISE = {"deviance": 1.25, "outliers": 0.01, "cooccurrence": TABLE}
MISFIT = {**NOISE, "deviance": 3.5, "pattern": "peaked", "flags": ["misfit"]}
SIMILARITY = {
    "similarity": 0.98765,
    "cooccurrence": TABLE,
    "inverse_lut_std": None,
    "noise": {"u": 1e-4, "v": 1e-5, "U": 0.0255, "V": 0.65025, "std": None},
    "search": {"objective": "bin", "values": [0.1, 0.9], "evaluations": 77},
    "status": "limit-reached",
    "log_evidence": None,
}
# By the square root a quarter of the light is half of the level.
BRACKET = {
    "exposures": {
        "relative": [1.0, 4.0],
        "exponent_error": 0.0,
        "scatter": 0.0125,
        "transfers": [{"ratio": 4.0, "upper": [4, 8, 12], "lower": [2, 4, 6.0]}],
    },
    "shape_std": [0.0] * 8 + [0.012] * 8,
    "white_std": 0.01,
}
RAW = {
    "raw": {
        "matrix": [1.5, -0.3, -0.2],
        "gains": [1.0, 1.125],
        "corner_gain": 1.2345678901234567,
        "scatter": 0.0125,
    },
    "noise": None,
}
EXPOSURES = [
    {
        "file": "a.png",
        "relative": 1.0,
        "black": 0.008,
        "white": 0.0,
        "overlap": 0.99,
        "displacement": 0.25,
    },
    {
        "file": "b.png",
        "relative": 4.0,
        "black": 0.001,
        "white": 0.025,
        "overlap": None,
        "displacement": None,
    },
]
MOVED = {
    *("similarity", "deviance", "pattern", "outliers", "exposures", "raw", "cooccurrence"),
    "inverse_lut_std_with_dark",
}
"""Keys of a channel of which accounts are made."""
COLUMNS = ("file", "relative", "found", "black", "white", "overlap", "displacement")


def version_1(
    *changes: dict[str, Any], exposures: list[dict[str, Any]] | None = None
) -> dict[str, Any]:
    """A file of one channel, or of three, that differ from `BARE`."""
    names = ("Y",) if len(changes) == 1 else ("R", "G", "B")
    content = {
        "format": "chartless-calibration",
        "version": 1,
        "bit_depth": 8,
        "levels": 16,
        "method": "likelihood",
        "model": None,
        "verdict": {"grade": "good", "reasons": ["As it was judged then."]},
        "channels": [
            {**BARE, **each, "name": name} for name, each in zip(names, changes, strict=True)
        ],
        "provenance": {
            "chartless": "0.1.0",
            "created": "2026-01-31T21:51:47+00:00",
            "inputs": [{"file": "a.png", "sha256": "0"}, {"file": "b.png", "sha256": "1"}],
            "settings": {"method": "likelihood", "evidence": "what was read"},
            "exposures": exposures,
            "remarks": ["a.png: a remark"],
        },
    }
    return deepcopy(content)


KINDS: dict[str, dict[str, Any]] = {
    "noise": version_1(NOISE),
    "misfit": version_1(MISFIT),
    "similarity": version_1(SIMILARITY),
    "bracket": version_1(BRACKET, exposures=EXPOSURES),
    "raw": version_1(RAW),
    "both": version_1({**BRACKET, **NOISE}, exposures=EXPOSURES),
    "three": version_1(NOISE, MISFIT, BARE),
    "none": version_1(BARE),
}


WHOLE = version_1(
    {
        **BRACKET, **MISFIT, **RAW,
        "noise": BARE["noise"],
        "similarity": 0.98765,
        "inverse_lut_std_with_dark": [0.01] * 16,
        "flags": ["misfit", "dark-levels-unseen"],
    },
    exposures=EXPOSURES,
)  # fmt: skip
"""Everything that there is, though no method made all of it."""


def only(content: dict[str, Any]) -> tuple[Response, Account]:
    """The only channel and its only account."""
    (response,) = from_json(content).channels
    (account,) = response.accounts
    return response, account


def found(calibration: Calibration) -> list[Any]:
    """What the table of exposures says was found."""
    (table,) = calibration.evidence[0].tables
    place = [column.code for column in table.columns].index("found")
    return [row[place] for row in table.rows]


# What is read


def test_each_kind_has_an_account_and_a_reading() -> None:
    for name, kinds in {
        "noise": ("noise",),
        "misfit": ("noise",),
        "similarity": ("noise",),
        "bracket": ("bracket",),
        "raw": ("raw",),
        "both": ("bracket", "noise"),
        "none": (),
    }.items():
        with about(name):
            calibration = from_json(KINDS[name])

            assert calibration.channels[0].kinds == kinds
            assert tuple(each.kind for each in calibration.evidence) == kinds


def test_curve_and_noise_are_read() -> None:
    (response,) = from_json(KINDS["noise"]).channels

    assert response.inverse_lut.tolist() == pytest.approx(BARE["inverse_lut"])
    assert response.inverse_lut_std is not None
    assert response.inverse_lut_std.tolist() == BARE["inverse_lut_std"]
    assert response.noise is not None
    assert (response.noise.slope, response.noise.floor) == (1e-4, 1e-5)
    assert response.noise_error is not None
    assert response.noise_error.correlation == -0.5
    assert (response.observed_levels, response.n_pairs) == ((1, 14), 1234)
    assert response.log_evidence == -1234.5


def test_deviance_and_outliers_are_read() -> None:
    _, account = only(KINDS["noise"])

    assert account.facts == (Fact("outliers", "Excluded pairs", 0.01, ".2%"),)
    label = "Deviance of the level pairs, relative to chance"
    assert account.fits == (Fit("deviance", label, 1.25, ".2f", good=1.5, bad=2.0),)
    assert dict(account.details) == {}
    assert account.share is None


def test_level_pairs_are_read() -> None:
    _, account = only(KINDS["noise"])

    expected = np.diag([5] * 15 + [0]) + np.diag([1] * 15, 1)
    assert isinstance(account.record, Cooccurrence)
    assert account.record.counts.tolist() == expected.tolist()


def test_noise_without_a_table_is_read() -> None:
    """It was left out where it would have taken megabytes."""
    _, account = only(version_1({**NOISE, "cooccurrence": None}))

    assert account.record is None
    assert account.values == {"outliers": 0.01, "deviance": 1.25}


def test_a_table_alone_is_noise_that_was_not_tested() -> None:
    response, account = only(version_1({"cooccurrence": TABLE}))

    assert (account.kind, account.facts, account.fits) == ("noise", (), ())
    assert "was not tested" in str(verdict([response]))


def test_the_pattern_of_a_misfit_is_what_the_flag_means() -> None:
    for pattern in Pattern:
        with about(pattern):
            calibration = from_json(version_1({**MISFIT, "pattern": pattern.code}))

            assert calibration.channels[0].account("noise")["pattern"] == pattern.code
            (doubt,) = doubts(calibration)
            assert doubt.code == "misfit"
            assert doubt.details == (f"the pattern is {pattern.code}: {pattern.advice}",)


def test_what_dark_frames_would_bring_is_said_where_it_is_worth_it() -> None:
    """The root mean square over levels: of 0 and 0.024 in halves it is 0.017."""
    std = np.repeat([0.0, 0.024], 8)
    dark = {
        **NOISE,
        "inverse_lut_std": std.tolist(),
        "inverse_lut_std_with_dark": (std / 2).tolist(),
        "flags": ["dark-levels-unseen"],
    }

    calibration = from_json(version_1(dark))

    (doubt,) = doubts(calibration)
    assert doubt.details == (
        "two frames with the lens covered (`dark`) would bring the error from ± 0.017 to ± 0.008",
    )
    fact = calibration.channels[0].account("noise")["error_with_dark"]
    assert fact == pytest.approx(0.012 / np.sqrt(2))


def test_what_dark_frames_would_bring_is_no_doubt_without_the_flag() -> None:
    content = version_1({**NOISE, "inverse_lut_std_with_dark": [0.01] * 16})

    assert doubts(from_json(content)) == []


def test_similarity_is_read() -> None:
    response, account = only(KINDS["similarity"])

    label = "Image similarity, relative to the truth"
    assert account.fits == (Fit("similarity", label, 0.98765, ".3f"),)
    assert account.facts == ()
    assert fit_text(response) == "similarity 0.988"
    assert response.history is not None
    assert response.history.values == (0.1, 0.9)


def test_exposures_of_a_channel_are_read() -> None:
    _, account = only(KINDS["bracket"])

    assert account.facts == (
        Fact("exposures", "Exposures", (1.0, 4.0), ".4g"),
        Fact("exponent_error", "Error of the exponent", 0.0, ".1%"),
        Fact("scatter", "Scatter between exposures", 0.0125, ".1%"),
    )
    transfer = SeenTransfer(4.0, (4.0, 8.0, 12.0), (2.0, 4.0, 6.0))
    assert account.record == SeenTransfers(16, (transfer,))


def test_how_well_the_curve_explains_exposures_is_computed() -> None:
    _, exact = only(KINDS["bracket"])
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0]["ratio"] = 4 * np.exp(0.1)
    _, off = only(content)

    (fit,) = off.fits
    assert (fit.code, fit.form, fit.good, fit.bad) == ("mismatch", ".1%", 0.05, None)
    assert off["mismatch"] == pytest.approx(0.1)
    assert exact["mismatch"] == pytest.approx(0, abs=1e-12)


def test_exposures_that_share_no_levels_have_no_fit() -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0].update(upper=[], lower=[])

    _, account = only(content)

    assert account.fits == ()


def test_what_raw_files_told_is_read() -> None:
    _, account = only(KINDS["raw"])

    assert account.values == {
        "matrix": (1.5, -0.3, -0.2),
        "gains": (1.0, 1.125),
        "corner_gain": 1.2345678901234567,
        "scatter": 0.0125,
    }
    assert account.fits == (Fit("scatter", "Scatter of greys", 0.0125, ".1%", good=0.06),)
    assert account.record is None


def test_channels_have_their_own_accounts() -> None:
    channels = from_json(KINDS["three"]).channels

    assert [each.kinds for each in channels] == [("noise",), ("noise",), ()]
    assert [fit_text(each) for each in channels] == ["deviance 1.25", "deviance 3.50", "-"]


def test_a_reading_has_the_words_and_inputs_of_the_provenance() -> None:
    (reading,) = from_json(KINDS["noise"]).evidence

    same_reading(
        reading,
        Reading(
            kind="noise",
            title="noise of repeated frames",
            sentence="what was read",
            inputs=(0, 1),
            example=0,
        ),
    )


def test_without_inputs_there_is_no_example() -> None:
    content = deepcopy(KINDS["noise"])
    content["provenance"]["inputs"] = []

    (reading,) = from_json(content).evidence

    assert (reading.inputs, reading.example) == ((), None)


def test_exposures_in_the_provenance_become_a_table() -> None:
    calibration = from_json(KINDS["bracket"])

    (reading,) = calibration.evidence
    (table,) = reading.tables
    assert table.code == "exposures"
    assert tuple(column.code for column in table.columns) == COLUMNS
    assert table.columns[0] == Column("file", "Exposure", "file")
    assert table.rows == (
        ("a.png", 1.0, None, 0.008, 0.0, 0.99, 0.25),
        ("b.png", 4.0, None, 0.001, 0.025, None, None),
    )
    assert "exposures" not in calibration.provenance
    assert calibration.provenance["remarks"] == ["a.png: a remark"]


def test_only_a_bracket_has_a_table() -> None:
    bracket, noise = from_json(KINDS["both"]).evidence

    assert len(bracket.tables) == 1
    assert noise.tables == ()


def test_exposures_that_are_others_than_given_are_in_the_table() -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["relative"] = [1.0, 3.5]

    calibration = from_json(content)

    assert found(calibration) == [1.0, 3.5]
    assert calibration.evidence[0].tables[0].columns[2].label == "Found (Y)"


def test_exposures_were_found_in_the_middle_channel() -> None:
    channels = [deepcopy(BRACKET) for _ in "RGB"]
    for each, relative in zip(channels, (3.0, 3.5, 5.0), strict=True):
        each["exposures"]["relative"] = [1.0, relative]

    calibration = from_json(version_1(*channels, exposures=EXPOSURES))

    assert found(calibration) == [1.0, 3.5]
    assert calibration.evidence[0].tables[0].columns[2].label == "Found (G)"


def test_exposures_without_an_account_are_a_table_too() -> None:
    calibration = from_json(version_1(BARE, exposures=EXPOSURES))

    assert calibration.channels[0].accounts == ()
    assert found(calibration) == [None, None]


def test_files_that_are_older_still_are_read() -> None:
    for extra in (
        *("shape_std", "white_std", "inverse_lut_std_with_dark", "parameters_covariance"),
        *("response_lut", "outliers", "exposures", "raw", "similarity", "pattern"),
        *("log_evidence", "search", "cooccurrence"),
    ):
        with about(extra):
            (response,) = from_json(changed(KINDS["noise"], (*CHANNEL, extra), MISSING)).channels

            assert response.kinds == ("noise",)
            assert response.account("noise")["deviance"] == 1.25


def test_a_provenance_may_lack_anything() -> None:
    for key in ("settings", "exposures", "remarks", "inputs", "chartless"):
        with about(key):
            content = changed(KINDS["bracket"], ("provenance", key), MISSING)

            (reading,) = from_json(content).evidence

            assert reading.kind == "bracket"


# The verdict is that of the rule


def test_a_calibration_is_judged_by_its_accounts() -> None:
    doubtful = {"doubtful": version_1({**MISFIT, "deviance": 1.9})}
    for name, grade, reason in (
        ("noise", Grade.GOOD, "The curve is known to ± 0.011"),
        ("misfit", Grade.DISTRUST, "do not explain the pictures: misfit."),
        ("doubtful", Grade.CARE, "Doubtful: misfit."),
        ("similarity", Grade.CARE, "The error of this curve is unknown."),
        ("bracket", Grade.GOOD, "The shape of the curve is known to ± 0.008"),
        ("raw", Grade.GOOD, "The curve is known to ± 0.011"),
        ("both", Grade.GOOD, "The shape of the curve is known to ± 0.008"),
        ("none", Grade.GOOD, "The curve is known to ± 0.011"),
    ):
        with about(name):
            judged = verdict(from_json((KINDS | doubtful)[name]).channels)

            assert judged.grade is grade
            assert reason in str(judged)


def test_exposures_off_their_ratio_are_in_the_verdict() -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0]["ratio"] = 4 * np.exp(0.1)

    judged = verdict(from_json(content).channels)

    assert judged.grade is Grade.CARE
    assert "from their ratio by 10.0% (channel Y" in judged.reasons[-1]


# Saving


def test_it_is_saved_as_version_2(tmp_path: Path) -> None:
    for name, content in KINDS.items():
        with about(name):
            old, new = tmp_path / "old.json", tmp_path / "new.json"
            old.write_text(json.dumps(content))
            before = load(old)

            save(before, new)

            after = load(new)
            assert json.loads(new.read_text())["version"] == 2
            for first, second in zip(before.channels, after.channels, strict=True):
                same(first, second)
            for read, kept in zip(before.evidence, after.evidence, strict=True):
                same_reading(read, kept)
            assert after.provenance == before.provenance
            assert verdict(after.channels) == verdict(before.channels)


def test_what_has_moved_is_not_where_it_was() -> None:
    content = to_json(from_json(KINDS["both"]))

    assert MOVED.isdisjoint(content["channels"][0])
    assert "exposures" not in content["provenance"]


def test_a_file_of_version_2_is_not_read_as_one_of_version_1() -> None:
    assert "no 'accounts'" in refused({**KINDS["noise"], "version": 2})


# Damage


DAMAGE: list[tuple[Place, Any, str]] = [
    ((*CHANNEL, "deviance"), "poor", "poor"),
    ((*CHANNEL, "deviance"), [1], ""),
    ((*CHANNEL, "deviance"), float("nan"), "one of its numbers is not finite"),
    ((*CHANNEL, "similarity"), {}, ""),
    ((*CHANNEL, "outliers"), "few", "few"),
    ((*CHANNEL, "pattern"), "haunted", "the pattern 'haunted' is unknown"),
    ((*CHANNEL, "pattern"), 5, "the pattern 5 is unknown"),
    ((*CHANNEL, "flags"), ["haunted"], "haunted"),
    ((*CHANNEL, "cooccurrence"), 5, ""),
    ((*CHANNEL, "cooccurrence"), {}, "first"),
    ((*CHANNEL, "cooccurrence"), {"first": [0] * 16}, "counts"),
    ((*CHANNEL, "cooccurrence", "first", 0), -3, "impossible counts"),
    ((*CHANNEL, "cooccurrence", "first", 0), 99, "impossible counts"),
    ((*CHANNEL, "cooccurrence", "counts", 0), [10**30], ""),
    ((*CHANNEL, "cooccurrence", "counts", 0), [-4], "impossible counts"),
    ((*CHANNEL, "cooccurrence", "counts"), [], ""),
    ((*CHANNEL, "inverse_lut_std"), [0.1], ""),
    ((*CHANNEL, "noise", "std"), {"log_slope": 1, "log_floor": 1}, "correlation"),
    ((*CHANNEL, "exposures"), [1, 2], ""),
    ((*CHANNEL, "exposures"), {}, "relative"),
    ((*CHANNEL, "exposures", "relative"), 3, ""),
    ((*CHANNEL, "exposures", "relative"), ["a"], "a"),
    ((*CHANNEL, "exposures", "relative"), MISSING, "relative"),
    ((*CHANNEL, "exposures", "exponent_error"), None, ""),
    ((*CHANNEL, "exposures", "exponent_error"), MISSING, "exponent_error"),
    ((*CHANNEL, "exposures", "scatter"), "much", "much"),
    ((*CHANNEL, "exposures", "scatter"), MISSING, "scatter"),
    ((*CHANNEL, "exposures", "transfers"), MISSING, "transfers"),
    ((*CHANNEL, "exposures", "transfers"), [5], ""),
    ((*CHANNEL, "exposures", "transfers", 0, "ratio"), 0, "ratio of its exposures is 0"),
    ((*CHANNEL, "exposures", "transfers", 0, "ratio"), MISSING, "ratio"),
    ((*CHANNEL, "exposures", "transfers", 0, "upper"), [1], "of 1 and 3 levels"),
    ((*CHANNEL, "exposures", "transfers", 0, "lower"), [3, 16, 1], "are not those of 16"),
    ((*CHANNEL, "raw"), [1], ""),
    ((*CHANNEL, "raw"), {}, "matrix"),
    ((*CHANNEL, "raw", "matrix"), [1, 2], ""),
    ((*CHANNEL, "raw", "matrix"), "abc", "a"),
    ((*CHANNEL, "raw", "gains"), 1, ""),
    ((*CHANNEL, "raw", "gains"), MISSING, "gains"),
    ((*CHANNEL, "raw", "corner_gain"), None, ""),
    ((*CHANNEL, "raw", "corner_gain"), MISSING, "corner_gain"),
    ((*CHANNEL, "raw", "scatter"), float("inf"), "one of its numbers is not finite"),
    ((*CHANNEL, "raw", "scatter"), MISSING, "scatter"),
    (("provenance", "exposures"), 5, ""),
    (("provenance", "exposures"), "ab", ""),
    (("provenance", "exposures"), [5], ""),
    (("provenance", "exposures"), [{"file": "a.png"}], "relative"),
    (("provenance", "exposures", 0, "relative"), None, ""),
    (("provenance", "exposures", 0, "relative"), "long", "its exposures should each have"),
    (("provenance", "exposures", 0, "black"), float("nan"), "one of its numbers is not finite"),
    (("provenance", "inputs", 0, "file"), None, "inputs should each have file, sha256"),
]


def test_damage_is_refused_in_one_line() -> None:
    for place, value, word in DAMAGE:
        with about((place, value)):
            refused_as_damaged(changed(WHOLE, place, value), word)


def test_damaged_errors_with_dark_frames_are_refused() -> None:
    for with_dark in (
        *([0.1], [0.1] * 17, "dark", [[0.1] * 16], {}),
        *([each] * 16 for each in (None, -0.1, 1e200)),
    ):
        with about(with_dark):
            dark = {"inverse_lut_std_with_dark": with_dark, "flags": ["dark-levels-unseen"]}
            refused_as_damaged(version_1({**NOISE, **dark}))


def test_exposures_that_cannot_be_shown_are_refused() -> None:
    for key in ("file", "black", "white", "overlap", "displacement"):
        for value in ({}, [], [1, 2], True):
            with about((key, value)):
                refused_as_damaged(changed(WHOLE, ("provenance", "exposures", 0, key), value))


PLACES = [
    place
    for place in places_in(WHOLE)
    if place[:2] == ("provenance", "exposures") or MOVED.intersection(place)
]


@pytest.mark.parametrize("values", slow_but(VALUES, "usual"))
def test_no_damage_of_one_key_is_an_error_of_ours(values: str) -> None:
    for place in PLACES:
        for value in VALUES[values]:
            with about((place, value)):
                kept_or_refused(changed(WHOLE, place, value))
