"""Calibration files of version 1 are read, and saved as version 2."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from saved_cameras import (
    MISSING,
    ODD,
    Place,
    again,
    kept_or_refused,
    places_in,
    put,
    refused,
    same,
    same_reading,
)

from chartless import Calibration, Cooccurrence, load, save
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers
from chartless.evidence.noise.misfit import Pattern
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


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "camera.json"


def loaded(content: dict[str, Any], path: Path) -> Calibration:
    path.write_text(json.dumps(content))
    return load(path)


def only(content: dict[str, Any], path: Path) -> tuple[Response, Account]:
    """The only channel and its only account."""
    (response,) = loaded(content, path).channels
    (account,) = response.accounts
    return response, account


def found(calibration: Calibration) -> list[Any]:
    """What the table of exposures says was found."""
    (table,) = calibration.evidence[0].tables
    place = [column.code for column in table.columns].index("found")
    return [row[place] for row in table.rows]


# What is read


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("noise", ("noise",)),
        ("misfit", ("noise",)),
        ("similarity", ("noise",)),
        ("bracket", ("bracket",)),
        ("raw", ("raw",)),
        ("both", ("bracket", "noise")),
        ("none", ()),
    ],
)
def test_each_kind_has_an_account_and_a_reading(
    name: str, kinds: tuple[str, ...], path: Path
) -> None:
    calibration = loaded(KINDS[name], path)

    assert calibration.channels[0].kinds == kinds
    assert tuple(each.kind for each in calibration.evidence) == kinds


def test_curve_and_noise_are_read(path: Path) -> None:
    (response,) = loaded(KINDS["noise"], path).channels

    assert response.inverse_lut.tolist() == pytest.approx(BARE["inverse_lut"])
    assert response.inverse_lut_std is not None
    assert response.inverse_lut_std.tolist() == BARE["inverse_lut_std"]
    assert response.noise is not None
    assert (response.noise.slope, response.noise.floor) == (1e-4, 1e-5)
    assert response.noise_error is not None
    assert response.noise_error.correlation == -0.5
    assert (response.observed_levels, response.n_pairs) == ((1, 14), 1234)
    assert response.log_evidence == -1234.5


def test_deviance_and_outliers_are_read(path: Path) -> None:
    _, account = only(KINDS["noise"], path)

    assert account.facts == (Fact("outliers", "Pairs left out", 0.01, ".2%"),)
    label = "Deviance of the level pairs, over that of chance"
    assert account.fits == (Fit("deviance", label, 1.25, ".2f", good=1.5, bad=2.0),)
    assert dict(account.details) == {}
    assert account.share is None


def test_level_pairs_are_read(path: Path) -> None:
    _, account = only(KINDS["noise"], path)

    expected = np.diag([5] * 15 + [0]) + np.diag([1] * 15, 1)
    assert isinstance(account.record, Cooccurrence)
    assert account.record.counts.tolist() == expected.tolist()


def test_noise_without_a_table_is_read(path: Path) -> None:
    """It was left out where it would have taken megabytes."""
    _, account = only(version_1({**NOISE, "cooccurrence": None}), path)

    assert account.record is None
    assert account.values == {"outliers": 0.01, "deviance": 1.25}


def test_a_table_alone_is_noise_that_was_not_tested(path: Path) -> None:
    response, account = only(version_1({"cooccurrence": TABLE}), path)

    assert (account.kind, account.facts, account.fits) == ("noise", (), ())
    assert "was not tested" in str(verdict([response]))


@pytest.mark.parametrize("pattern", Pattern)
def test_the_pattern_of_a_misfit_is_what_the_flag_means(pattern: Pattern, path: Path) -> None:
    calibration = loaded(version_1({**MISFIT, "pattern": pattern.code}), path)

    assert calibration.channels[0].account("noise")["pattern"] == pattern.code
    (doubt,) = doubts(calibration)
    assert doubt.code == "misfit"
    assert doubt.details == (f"the pattern is {pattern.code}: {pattern.advice}",)


def test_what_dark_frames_would_bring_is_said_where_it_is_worth_it(path: Path) -> None:
    """The root mean square over levels: of 0 and 0.024 in halves it is 0.017."""
    std = np.repeat([0.0, 0.024], 8)
    dark = {
        **NOISE,
        "inverse_lut_std": std.tolist(),
        "inverse_lut_std_with_dark": (std / 2).tolist(),
        "flags": ["dark-levels-unseen"],
    }

    calibration = loaded(version_1(dark), path)

    (doubt,) = doubts(calibration)
    assert doubt.details == (
        "two frames with the lens covered (`dark`) would bring the error from ± 0.017 to ± 0.008",
    )
    fact = calibration.channels[0].account("noise")["error_with_dark"]
    assert fact == pytest.approx(0.012 / np.sqrt(2))


def test_what_dark_frames_would_bring_is_no_doubt_without_the_flag(path: Path) -> None:
    content = version_1({**NOISE, "inverse_lut_std_with_dark": [0.01] * 16})

    assert doubts(loaded(content, path)) == []


def test_similarity_is_read(path: Path) -> None:
    response, account = only(KINDS["similarity"], path)

    label = "Image similarity, over that of the truth"
    assert account.fits == (Fit("similarity", label, 0.98765, ".3f"),)
    assert account.facts == ()
    assert fit_text(response) == "similarity 0.988"
    assert response.history is not None
    assert response.history.values == (0.1, 0.9)


def test_exposures_of_a_channel_are_read(path: Path) -> None:
    _, account = only(KINDS["bracket"], path)

    assert account.facts == (
        Fact("exposures", "Exposures", (1.0, 4.0), ".4g"),
        Fact("exponent_error", "Error of the exponent", 0.0, ".1%"),
        Fact("scatter", "Scatter between exposures", 0.0125, ".1%"),
    )
    transfer = SeenTransfer(4.0, (4.0, 8.0, 12.0), (2.0, 4.0, 6.0))
    assert account.record == SeenTransfers(16, (transfer,))


def test_how_well_the_curve_explains_exposures_is_computed(path: Path) -> None:
    _, exact = only(KINDS["bracket"], path)
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0]["ratio"] = 4 * np.exp(0.1)
    _, off = only(content, path)

    (fit,) = off.fits
    assert (fit.code, fit.form, fit.good, fit.bad) == ("mismatch", ".1%", 0.05, None)
    assert off["mismatch"] == pytest.approx(0.1)
    assert exact["mismatch"] == pytest.approx(0, abs=1e-12)


def test_exposures_that_share_no_levels_have_no_fit(path: Path) -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0].update(upper=[], lower=[])

    _, account = only(content, path)

    assert account.fits == ()


def test_what_raw_files_told_is_read(path: Path) -> None:
    _, account = only(KINDS["raw"], path)

    assert account.values == {
        "matrix": (1.5, -0.3, -0.2),
        "gains": (1.0, 1.125),
        "corner_gain": 1.2345678901234567,
        "scatter": 0.0125,
    }
    assert account.fits == (Fit("scatter", "Scatter of greys", 0.0125, ".1%", good=0.06),)
    assert account.record is None


def test_channels_have_their_own_accounts(path: Path) -> None:
    channels = loaded(KINDS["three"], path).channels

    assert [each.kinds for each in channels] == [("noise",), ("noise",), ()]
    assert [fit_text(each) for each in channels] == ["deviance 1.25", "deviance 3.50", "-"]


def test_a_reading_has_the_words_and_inputs_of_the_provenance(path: Path) -> None:
    (reading,) = loaded(KINDS["noise"], path).evidence

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


def test_without_inputs_there_is_no_example(path: Path) -> None:
    content = deepcopy(KINDS["noise"])
    content["provenance"]["inputs"] = []

    (reading,) = loaded(content, path).evidence

    assert (reading.inputs, reading.example) == ((), None)


def test_exposures_in_the_provenance_become_a_table(path: Path) -> None:
    calibration = loaded(KINDS["bracket"], path)

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


def test_only_a_bracket_has_a_table(path: Path) -> None:
    bracket, noise = loaded(KINDS["both"], path).evidence

    assert len(bracket.tables) == 1
    assert noise.tables == ()


def test_exposures_that_are_others_than_given_are_in_the_table(path: Path) -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["relative"] = [1.0, 3.5]

    calibration = loaded(content, path)

    assert found(calibration) == [1.0, 3.5]
    assert calibration.evidence[0].tables[0].columns[2].label == "Found (Y)"


def test_exposures_were_found_in_the_middle_channel(path: Path) -> None:
    channels = [deepcopy(BRACKET) for _ in "RGB"]
    for each, relative in zip(channels, (3.0, 3.5, 5.0), strict=True):
        each["exposures"]["relative"] = [1.0, relative]

    calibration = loaded(version_1(*channels, exposures=EXPOSURES), path)

    assert found(calibration) == [1.0, 3.5]
    assert calibration.evidence[0].tables[0].columns[2].label == "Found (G)"


def test_exposures_without_an_account_are_a_table_too(path: Path) -> None:
    calibration = loaded(version_1(BARE, exposures=EXPOSURES), path)

    assert calibration.channels[0].accounts == ()
    assert found(calibration) == [None, None]


@pytest.mark.parametrize(
    "extra",
    [
        *("shape_std", "white_std", "inverse_lut_std_with_dark", "parameters_covariance"),
        *("response_lut", "outliers", "exposures", "raw", "similarity", "pattern"),
        *("log_evidence", "search", "cooccurrence"),
    ],
)
def test_files_that_are_older_still_are_read(extra: str, path: Path) -> None:
    content = deepcopy(KINDS["noise"])
    del content["channels"][0][extra]

    (response,) = loaded(content, path).channels

    assert response.kinds == ("noise",)
    assert response.account("noise")["deviance"] == 1.25


@pytest.mark.parametrize("key", ["settings", "exposures", "remarks", "inputs", "chartless"])
def test_a_provenance_may_lack_anything(key: str, path: Path) -> None:
    content = deepcopy(KINDS["bracket"])
    del content["provenance"][key]

    (reading,) = loaded(content, path).evidence

    assert reading.kind == "bracket"


# The verdict is that of the rule


@pytest.mark.parametrize(
    ("content", "grade", "reason"),
    [
        (KINDS["noise"], Grade.GOOD, "The curve is known to ± 0.011"),
        (KINDS["misfit"], Grade.DISTRUST, "do not explain the pictures: misfit."),
        (version_1({**MISFIT, "deviance": 1.9}), Grade.CARE, "Doubtful: misfit."),
        (KINDS["similarity"], Grade.CARE, "No error is known for this curve."),
        (KINDS["bracket"], Grade.GOOD, "The shape of the curve is known to ± 0.008"),
        (KINDS["raw"], Grade.GOOD, "The curve is known to ± 0.011"),
        (KINDS["both"], Grade.GOOD, "The shape of the curve is known to ± 0.008"),
        (KINDS["none"], Grade.GOOD, "The curve is known to ± 0.011"),
    ],
)
def test_a_calibration_is_judged_by_its_accounts(
    content: dict[str, Any], grade: Grade, reason: str, path: Path
) -> None:
    judged = verdict(loaded(content, path).channels)

    assert judged.grade is grade
    assert reason in str(judged)


def test_exposures_off_their_ratio_are_in_the_verdict(path: Path) -> None:
    content = deepcopy(KINDS["bracket"])
    content["channels"][0]["exposures"]["transfers"][0]["ratio"] = 4 * np.exp(0.1)

    judged = verdict(loaded(content, path).channels)

    assert judged.grade is Grade.CARE
    assert "10.0% from their ratio in the median (channel Y)" in judged.reasons[-1]


# Saving


@pytest.mark.parametrize("name", KINDS)
def test_it_is_saved_as_version_2(name: str, path: Path) -> None:
    before = loaded(KINDS[name], path)

    after = again(before, path)

    assert json.loads(path.read_text())["version"] == 2
    for first, second in zip(before.channels, after.channels, strict=True):
        same(first, second)
    for read, kept in zip(before.evidence, after.evidence, strict=True):
        same_reading(read, kept)
    assert after.provenance == before.provenance
    assert verdict(after.channels) == verdict(before.channels)


def test_what_has_moved_is_not_where_it_was(path: Path) -> None:
    save(loaded(KINDS["both"], path), path)

    content = json.loads(path.read_text())
    assert MOVED.isdisjoint(content["channels"][0])
    assert "exposures" not in content["provenance"]


def test_a_file_of_version_2_is_not_read_as_one_of_version_1(path: Path) -> None:
    assert "no 'accounts'" in refused({**KINDS["noise"], "version": 2}, path)


# Damage


@pytest.mark.parametrize(
    ("keys", "value", "word"),
    [
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
    ],
)
def test_damage_is_refused_in_one_line(keys: Place, value: Any, word: str, path: Path) -> None:
    content = deepcopy(WHOLE)
    put(keys, content, value)

    message = refused(content, path)

    assert message.startswith("damaged calibration file: ")
    assert message.endswith("; calibrate again")
    assert "\n" not in message
    assert word in message


@pytest.mark.parametrize(
    "with_dark",
    [
        *([0.1], [0.1] * 17, "dark", [[0.1] * 16], {}),
        *([each] * 16 for each in (None, -0.1, 1e200)),
    ],
    ids=repr,
)
def test_damaged_errors_with_dark_frames_are_refused(with_dark: Any, path: Path) -> None:
    content = version_1(
        {**NOISE, "inverse_lut_std_with_dark": with_dark, "flags": ["dark-levels-unseen"]}
    )

    assert refused(content, path).startswith("damaged calibration file: ")


@pytest.mark.parametrize("value", [{}, [], [1, 2], True], ids=repr)
@pytest.mark.parametrize("key", ["file", "black", "white", "overlap", "displacement"])
def test_exposures_that_cannot_be_shown_are_refused(key: str, value: Any, path: Path) -> None:
    content = deepcopy(WHOLE)
    content["provenance"]["exposures"][0][key] = value

    assert refused(content, path).startswith("damaged calibration file: ")


@pytest.mark.parametrize(
    "place",
    [
        place
        for place in places_in(WHOLE)
        if place[:2] == ("provenance", "exposures") or MOVED.intersection(place)
    ],
    ids=str,
)
def test_no_damage_of_one_key_is_an_error_of_ours(place: Place, path: Path) -> None:
    for value in (MISSING, None, True, 0, 0.5, "", "x", [None], ["x"], [{}], *ODD):
        content = deepcopy(WHOLE)
        put(place, content, value)
        kept_or_refused(content, path)
