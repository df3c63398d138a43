"""Calibrations on disk: what is saved is loaded, and nothing else is."""

import json
import re
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from saved_cameras import (
    CURVE,
    EXPOSURES,
    PAIRS,
    RAW,
    READING,
    WHOLE,
    about,
    again,
    changed,
    one,
    places_in,
    record_of,
    response_of,
    same,
    same_account,
    same_reading,
    same_record,
)

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, load, save
from chartless.curves import SampledCurve
from chartless.errors import OutputError
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers, account_of_bracket
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.misfit import Pattern
from chartless.flags import Flag
from chartless.formats.calibration_file import from_json, to_json, to_text
from chartless.result.account import (
    Account,
    Column,
    Fact,
    Fit,
    Reading,
    Table,
    UnknownRecord,
)
from chartless.result.response import Status


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "camera.json"


# Round trips


CHANGES: list[dict[str, Any]] = [
    {},
    {"flags": ()},
    {"flags": tuple(Flag)},
    {"history": None, "accounts": ()},
    {"status": Status.CONVERGED},
    {"curve": ModelCurve("gamma", (0.1 + 0.2,))},
    {"curve": ModelCurve("eegc3", (-0.7, 0.1, 1e-300, 0.2))},
    {"noise": AffineNoise(np.pi / 1e4, np.e / 1e5)},
    {"n_levels": 300, "accounts": (RAW,)},
    {"accounts": (RAW, EXPOSURES, PAIRS)},
]


def test_what_is_saved_is_loaded_exactly(path: Path) -> None:
    for changes in CHANGES:
        with about(changes):
            calibration = one(response_of(**changes), READING)

            save(calibration, path)

            loaded = load(path)
            same(calibration.channels[0], loaded.channels[0])
            assert loaded.bit_depth == calibration.bit_depth
            assert loaded.provenance == calibration.provenance
            same_reading(*calibration.evidence, *loaded.evidence)
            assert to_json(loaded) == to_json(calibration)


def test_a_bracket_is_kept() -> None:
    """With and without noise: methods of exposures tell none."""
    for noise in (None, AffineNoise.from_8bit(0.03, 16)):
        with about(noise):
            before = one(response_of(accounts=(EXPOSURES,), noise=noise, method="debevec"))

            (response,) = again(before).channels

            same(before.channels[0], response)
            assert response.noise == noise
            assert response.account("bracket")["exposures"] == (1.0, 2.0 + 1 / 3, 16.0)
            (entry,) = to_json(before)["channels"]
            assert (entry["noise"] is None) == (noise is None)


def test_what_raw_files_told_comes_back() -> None:
    (response,) = again(one(response_of(accounts=(RAW,)))).channels

    assert response.account("raw").values == RAW.values
    assert response.account("raw")["corner_gain"] == 1.23456789012345678


def test_three_channels() -> None:
    channels = tuple(
        response_of(name, curve=ModelCurve("gamma", (0.4 + 0.05 * c,)))
        for c, name in enumerate("RGB")
    )
    loaded = again(Calibration(channels=channels, bit_depth=16))

    assert loaded.bit_depth == 16
    for before, after in zip(channels, loaded.channels, strict=True):
        same(before, after)


def test_deviations_are_kept() -> None:
    arrays = {
        "inverse_lut_std": np.linspace(0, 0.01, 16) ** 2,
        "shape_std": np.linspace(0, 0.009, 16) ** 2,
        "parameter_covariance": np.diag([0.1, 0.2, 1 / 3]) + 1e-7,
    }

    loaded = again(one(response_of(**arrays, white_std=1 / 3))).channels[0]

    for name, array in arrays.items():
        assert np.array_equal(getattr(loaded, name), array), name
    assert loaded.white_std == 1 / 3


def test_the_pattern_of_a_misfit_is_kept() -> None:
    for pattern in (None, *Pattern):
        with about(pattern):
            account = account_of_pairs(None, deviance=3.0, pattern=pattern)

            (loaded,) = again(one(response_of(accounts=(account,)))).channels[0].accounts

            same_account(account, loaded)
            told = pattern is not None
            assert ("pattern" in loaded) == ("misfit" in loaded.details) == told


rows = st.lists(st.integers(0, 2**53), min_size=16, max_size=16) | st.just([0] * 16)


@given(counts=st.lists(rows, min_size=16, max_size=16))
def test_any_table_comes_back(counts: list[list[int]]) -> None:
    table = Cooccurrence(np.array(counts, dtype=np.int64))

    loaded = again(one(response_of(accounts=(account_of_pairs(table),))))

    same_record(record_of(loaded), table)


@given(
    cells=st.dictionaries(
        st.tuples(st.integers(0, 15), st.integers(0, 15)), st.integers(1, 10**9), max_size=30
    )
)
def test_any_sparse_table_comes_back(cells: dict[tuple[int, int], int]) -> None:
    table = Cooccurrence.zeros(16)
    for cell, count in cells.items():
        table.counts[cell] = count

    loaded = again(one(response_of(accounts=(account_of_pairs(table),))))

    same_record(record_of(loaded), table)


def test_a_huge_table_is_left_out(path: Path) -> None:
    dense = Cooccurrence(np.ones((512, 512), dtype=np.int64))
    account = account_of_pairs(dense, outliers=0.02)

    save(one(response_of(n_levels=512, accounts=(account,))), path)

    loaded = load(path)
    assert record_of(loaded) is None
    assert loaded.channels[0].account("noise").facts == account.facts
    assert path.stat().st_size < 200_000


def test_a_curve_of_no_model_is_kept_by_its_samples() -> None:
    """The samples at the levels are what other programs can provide."""
    curve = SampledCurve((0.0, 0.1, 0.4, 1.0), (0.0, 0.5, 0.8, 1.0))
    before = one(response_of(curve=curve))

    loaded = again(before)

    assert to_json(before)["model"] is None
    assert np.allclose(loaded.channels[0].inverse_lut, before.channels[0].inverse_lut, atol=1e-15)


def test_files_without_the_extras_are_read() -> None:
    content = deepcopy(WHOLE)
    for extra in ("search", "parameters_covariance", "shape_std", "white_std", "log_evidence"):
        del content["channels"][0][extra]

    (response,) = from_json(content).channels

    assert (response.history, response.log_evidence) == (None, None)
    assert (response.shape_std, response.white_std) == (None, None)
    assert response.parameter_covariance is None


def test_unknown_keys_are_no_harm() -> None:
    content = deepcopy(WHOLE)
    entry = content["channels"][0]
    for each in (content, entry, entry["accounts"][0], entry["accounts"][0]["facts"][0]):
        each["note"] = "from the future"

    same(from_json(content).channels[0], response_of())


# Accounts and readings


FACTS = (
    Fact("length", "Length", 1 / 3),
    Fact("length", "Länge", 1e-300, ".4g"),
    Fact("length", "Length", -0.0, ".1%"),
    Fact("pairs", "Pairs", 2.0**53, ".0f"),
    Fact("pattern", "Pattern", "peaked"),
    Fact("file", "File", "a/ä.png", "file"),
    Fact("empty", "Empty", ""),
    Fact("gains", "Gains", (1.0, 0.1 + 0.2, 1e300), ".3f"),
    Fact("gains", "Gains", (1.0,), ".3f"),
    Fact("gains", "Gains", (), ".3f"),
)
FITS = (
    Fit("deviance", "Deviance", 1 / 3),
    Fit("deviance", "Deviance", 1e-300, ".3f", 1.5, 2.0),
    Fit("deviance", "Deviance", 1.0, ".3f", good=0.0),
    Fit("deviance", "Deviance", 1.0, ".1%", bad=0.1 + 0.2),
    Fit("deviance", "Deviance", 3.0, good=1.5, remark="The pairs are not explained: „nein“."),
)


def kept(account: Account) -> Account:
    """The account as it is loaded after it was saved."""
    (loaded,) = again(one(response_of(accounts=(account,)))).channels[0].accounts
    return loaded


def test_a_fact_is_kept_exactly() -> None:
    for fact in FACTS:
        with about(fact):
            (found,) = kept(Account(kind="raw", facts=(fact,))).facts

            assert found == fact
            assert type(found.value) is type(fact.value)
            assert found.text == fact.text


def test_a_fit_is_kept_exactly() -> None:
    for fit in FITS:
        with about(fit):
            assert kept(Account(kind="raw", fits=(fit,))).fits == (fit,)


def test_the_share_of_the_information_is_kept() -> None:
    for share in (None, 0.0, 1 / 3, 1.0):
        with about(share):
            assert kept(Account(kind="raw", share=share)).share == share


def test_what_flags_mean_here_is_kept_in_its_order() -> None:
    details = {"misfit": "the wedge was tilted", "clipped": "", "haunted": "a flag of the future"}

    found = kept(Account(kind="raw", details=details)).details

    assert list(found.items()) == list(details.items())


TRANSFERS: tuple[tuple[SeenTransfer, ...], ...] = (
    (),
    (SeenTransfer(4.0, (), ()),),
    (SeenTransfer(1e-300, (0.0, 15.0), (1 / 3, 14.999)), SeenTransfer(16.0, (7.0,), (2.5,))),
)


def test_transfers_of_a_bracket_are_kept() -> None:
    for transfers in TRANSFERS:
        with about(transfers):
            seen = SeenTransfers(16, transfers)
            account = account_of_bracket("Y", CURVE, exposures=(1.0, 4.0), transfers=seen)

            loaded = kept(account)

            assert loaded.record == seen
            same_account(account, loaded)


READINGS = (
    READING,
    Reading(kind="noise", title="", sentence=""),
    Reading(kind="noise", title="t", sentence="s", inputs=(0, 1), example=0),
    Reading(kind="raw", title="t", sentence="s", tables=(Table("t", "T", (), ()),)),
    Reading(
        kind="raw",
        title="t",
        sentence="s",
        tables=(
            Table("a", "A", (Column("x", "X"),), ((None,), ("x",), (1e-300,), ((1.0, 2.0),))),
            Table("b", "B", (Column("y", "Y", ".9f"),), ()),
        ),
    ),
)


def test_a_reading_is_kept_exactly() -> None:
    for reading in READINGS:
        with about(reading):
            (loaded,) = again(one(response_of(), reading)).evidence

            same_reading(reading, loaded)


def test_readings_are_kept_in_their_order() -> None:
    other = Reading(kind="noise", title="t", sentence="s")

    loaded = again(one(response_of(), other, READING)).evidence

    assert [each.kind for each in loaded] == ["noise", "bracket"]


finite = st.floats(allow_nan=False, allow_infinity=False)
text = st.text(st.characters(codec="utf-8"), max_size=4)
value = finite | text | st.lists(finite, max_size=5).map(tuple)
form = st.sampled_from(["", "file", "%", ".2f", ".4g", ".1%"])
facts = st.builds(Fact, text, text, value, form)
fits = st.builds(Fit, text, text, finite, form, st.none() | finite, st.none() | finite, text)
scalars = st.none() | st.booleans() | st.integers() | finite | text
records = st.dictionaries(
    text, st.recursive(scalars, lambda inside: st.lists(inside, max_size=2), max_leaves=3)
)
wedges = st.builds(
    Account,
    kind=st.just("wedge"),
    facts=st.lists(facts, max_size=3).map(tuple),
    fits=st.lists(fits, max_size=3, unique_by=lambda fit: fit.code).map(tuple),
    details=st.dictionaries(text, text, max_size=2),
    share=st.none() | finite,
    record=st.none() | st.builds(UnknownRecord, records),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(account=wedges)
def test_any_account_comes_back(account: Account, path: Path) -> None:
    before = one(response_of(accounts=(account,)))

    save(before, path)

    loaded = load(path)
    same_account(account, loaded.channels[0].accounts[0])
    assert to_json(loaded) == to_json(before)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    columns = draw(st.lists(st.builds(Column, text, text, form), max_size=3))
    row = st.tuples(*(st.none() | value for _ in columns))
    return Table(draw(text), draw(text), tuple(columns), tuple(draw(st.lists(row, max_size=3))))


@given(tables=st.lists(tables(), max_size=2).map(tuple))
def test_any_table_of_a_reading_comes_back(tables: tuple[Table, ...]) -> None:
    reading = Reading(kind="wedge", title="t", sentence="s", tables=tables)

    (loaded,) = again(one(response_of(), reading)).evidence

    same_reading(reading, loaded)


WEDGE: Any = {
    "kind": "wedge",
    "facts": [{"code": "patches", "label": "Patches", "value": [1.0, 2.0], "form": ".1f"}],
    "fits": [
        {
            "code": "gap", "label": "Gap", "value": 0.5, "form": ".1%",
            "good": 0.1, "bad": None, "remark": "",
        },
    ],
    "details": {"clipped": "the wedge is white"},
    "share": 0.25,
    "record": {"patches": [{"level": 3, "seen": True}, None], "": {"nested": [[], {}, "ä"]}},
}  # fmt: skip
WEDGE_READING: Any = {
    "kind": "wedge",
    "title": "patches of a wedge",
    "sentence": "a wedge of two patches",
    "inputs": [1],
    "example": 0,
    "tables": [
        {
            "code": "patches",
            "title": "Patches",
            "columns": [{"code": "level", "label": "Level", "form": ".0f"}],
            "rows": [[3.0], [None], ["white"], [[1.0, 2.0]]],
        },
    ],
}


def test_a_kind_that_is_not_known_here_is_kept_word_by_word(path: Path) -> None:
    content = deepcopy(WHOLE)
    content["channels"][0]["accounts"].append(WEDGE)
    content["evidence"].insert(0, WEDGE_READING)
    path.write_text(json.dumps(content))

    save(load(path), path)

    written = json.loads(path.read_text())
    assert written["channels"][0]["accounts"][-1] == WEDGE
    assert written["evidence"][0] == WEDGE_READING
    assert written == content


def test_the_record_of_a_kind_that_is_not_known_here_is_not_looked_into() -> None:
    content = changed(WHOLE, ("channels", 0, "accounts"), [WEDGE])

    assert record_of(from_json(content), "wedge") == UnknownRecord(WEDGE["record"])


# The layout


def test_the_file_is_plain_json_with_every_documented_key(path: Path) -> None:
    save(one(response_of(), READING), path)

    def no_constant(name: str) -> None:
        pytest.fail(f"{name} is not JSON")

    content = json.loads(path.read_text(encoding="utf-8"), parse_constant=no_constant)

    assert {key: type(content[key]) for key in content} == {
        "format": str, "version": int, "bit_depth": int, "levels": int, "method": str,
        "model": str, "verdict": dict, "evidence": list, "channels": list, "provenance": dict,
    }  # fmt: skip
    assert content["version"] == 2
    (channel,) = content["channels"]
    nothing = type(None)
    assert {key: type(channel[key]) for key in channel} == {
        "name": str, "parameters": dict, "parameters_covariance": nothing, "inverse_lut": list,
        "inverse_lut_std": nothing, "shape_std": nothing, "white_std": nothing,
        "response_lut": list, "noise": dict, "observed_levels": list, "pairs": int,
        "status": str, "log_evidence": nothing, "flags": list, "search": dict, "accounts": list,
    }  # fmt: skip
    assert set(channel["noise"]) == {"u", "v", "U", "V", "std"}
    assert (len(channel["inverse_lut"]), len(channel["response_lut"])) == (16, 1024)
    assert channel["flags"] == ["clipped", "search-unfinished"]


def test_an_account_is_plain_json_with_every_documented_key() -> None:
    account = Account(
        kind="noise",
        facts=(Fact("outliers", "Excluded pairs", 0.02, ".2%"), Fact("gains", "Gains", (1.0,))),
        fits=(Fit("deviance", "Deviance", 1.2, ".2f", 1.5, 2.0, "A remark."),),
        details={"misfit": "the pattern is peaked"},
        share=0.5,
        record=Cooccurrence(np.diag([3, 0, 5])),
    )

    (channel,) = to_json(one(response_of(accounts=(account,))))["channels"]

    assert channel["accounts"] == [
        {
            "kind": "noise",
            "facts": [
                {"code": "outliers", "label": "Excluded pairs", "value": 0.02, "form": ".2%"},
                {"code": "gains", "label": "Gains", "value": (1.0,), "form": ""},
            ],
            "fits": [
                {
                    "code": "deviance", "label": "Deviance", "value": 1.2, "form": ".2f",
                    "good": 1.5, "bad": 2.0, "remark": "A remark.",
                },
            ],
            "details": {"misfit": "the pattern is peaked"},
            "share": 0.5,
            "record": {"first": [0, 0, 2], "counts": [[3], [], [5]]},
        },
    ]  # fmt: skip


def test_the_record_of_a_bracket_is_its_transfers() -> None:
    (channel,) = to_json(one(response_of(accounts=(EXPOSURES,))))["channels"]

    record = json.loads(json.dumps(channel["accounts"][0]["record"]))

    assert record == {"transfers": [{"ratio": 2 + 1 / 3, "upper": [5, 9], "lower": [3.25, 6.1]}]}


def test_a_reading_is_plain_json_with_every_documented_key() -> None:
    assert WHOLE["evidence"] == [
        {
            "kind": "bracket",
            "title": "exposures of one scene",
            "sentence": "a bracket of 2 exposures, 1 to 4 by EXIF",
            "inputs": [1, 0],
            "example": 1,
            "tables": [
                {
                    "code": "exposures",
                    "title": "Exposures as given",
                    "columns": [
                        {"code": "file", "label": "Exposure", "form": "file"},
                        {"code": "relative", "label": "Relative", "form": ".4g"},
                    ],
                    "rows": [["ä.png", 1 / 3], ["b.png", None]],
                },
            ],
        },
    ]


ANY_NAME = {("settings",), ("parameters",), ("details",)}
PAGE = Path(__file__).parents[2] / "docs" / "calibration-file.md"


def test_every_key_is_explained_in_the_documentation() -> None:
    page = PAGE.read_text(encoding="utf-8")
    names = {
        place[-1]
        for place in places_in(WHOLE)
        if isinstance(place[-1], str) and place[-2:-1] not in ANY_NAME
    }

    assert [name for name in sorted(names) if re.search(rf"`{name}\b", page) is None] == []


def test_the_examples_of_the_documentation_are_read() -> None:
    page = PAGE.read_text(encoding="utf-8")
    account, reading = (json.loads(part.split("```")[0]) for part in page.split("```json")[1:])
    account["record"]["first"] += [0] * 12
    account["record"]["counts"] += [[]] * 12
    content = deepcopy(WHOLE)
    content["channels"][0]["accounts"], content["evidence"] = [account], [reading]

    written = json.loads(to_text(from_json(content)))

    assert written["channels"][0]["accounts"] == [account]
    assert written["evidence"] == [reading]


def test_nothing_that_is_not_finite_is_written(path: Path) -> None:
    path.write_text("older")
    broken = response_of(inverse_lut_std=np.full(16, np.nan))

    with pytest.raises(ValueError, match="JSON"):
        save(one(broken), path)

    assert path.read_text() == "older"


def test_a_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="does not exist: create it first"):
        save(one(response_of()), tmp_path / "missing" / "camera.json")
