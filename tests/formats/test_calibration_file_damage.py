"""Damaged calibration files are refused, in one line."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from saved_cameras import (
    MISSING,
    ODD,
    VALUES,
    WHOLE,
    Place,
    about,
    again,
    changed,
    kept_or_refused,
    places_in,
    refused,
    refused_as_damaged,
)
from slow_cases import slow_but

from chartless import load
from chartless.cli import main
from chartless.errors import CalibrationFileError, ChartlessError
from chartless.formats.calibration_file import from_json


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "camera.json"


def refused_file(text: str, path: Path) -> str:
    """Why a file is not read, after its name."""
    path.write_text(text)
    with pytest.raises(CalibrationFileError) as caught:
        load(path)
    message = str(caught.value)
    assert isinstance(caught.value, ChartlessError)
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


def test_a_truncated_file(path: Path) -> None:
    text = json.dumps(WHOLE)

    for share in (0.0, 0.1, 0.5, 0.99):
        with about(share):
            assert "not JSON" in refused_file(text[: int(share * len(text))], path)


def test_other_json(path: Path) -> None:
    for other in (
        *("[]", "{}", "3", "null", '"text"'),
        '{"format": "chartless-truth", "version": 1}',
    ):
        with about(other):
            assert "not a calibration file" in refused_file(other, path)


def test_a_binary_file(path: Path) -> None:
    path.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")

    with pytest.raises(CalibrationFileError, match="not a calibration file"):
        load(path)


def test_a_file_that_does_not_exist(path: Path) -> None:
    with pytest.raises(CalibrationFileError, match=r"camera\.json: cannot be read: No such file"):
        load(path)


def test_a_damaged_file_is_named(path: Path) -> None:
    for place, value, word in (
        (CHANNEL, {}, "no 'inverse_lut'"),
        ((*CHANNEL, "inverse_lut", 3), float("nan"), "inverse_lut should be 16 numbers"),
        ((*PAIRS_AT, "facts", 0, "value"), 10**400, ""),
        (("version",), 3, "reads versions 1 to 2"),
    ):
        with about(place):
            message = refused_file(json.dumps(changed(WHOLE, place, value)), path)

            assert word in message
            assert "\n" not in message


def test_another_version_is_named() -> None:
    for version in (3, 0, -1, "1", "2", None, 1.5, 2.0, True, []):
        with about(version):
            message = refused(changed(WHOLE, ("version",), version))

            assert f"version {version} of the format" in message
            assert "reads versions 1 to 2" in message


CHANNEL = ("channels", 0)
EXPOSURES_AT = (*CHANNEL, "accounts", 0)
PAIRS_AT = (*CHANNEL, "accounts", 1)
READING_AT = ("evidence", 0)
TABLE_AT = (*READING_AT, "tables", 0)
NEEDED: dict[Place, tuple[str, ...]] = {
    (): ("bit_depth", "levels", "method", "model", "evidence", "channels", "provenance"),
    CHANNEL: (
        *("name", "parameters", "inverse_lut", "inverse_lut_std", "noise", "observed_levels"),
        *("pairs", "status", "flags", "accounts"),
    ),
    (*CHANNEL, "noise"): ("u", "v"),
    (*CHANNEL, "noise", "std"): ("log_slope", "log_floor", "correlation"),
    (*CHANNEL, "search"): ("objective", "values", "evaluations"),
    PAIRS_AT: ("kind", "facts", "fits", "details", "share", "record"),
    (*PAIRS_AT, "facts", 0): ("code", "label", "value", "form"),
    (*PAIRS_AT, "fits", 0): ("code", "label", "value", "form", "good", "bad", "remark"),
    (*PAIRS_AT, "record"): ("first", "counts"),
    (*EXPOSURES_AT, "record"): ("transfers",),
    (*EXPOSURES_AT, "record", "transfers", 0): ("ratio", "upper", "lower"),
    READING_AT: ("kind", "title", "sentence", "inputs", "example", "tables"),
    TABLE_AT: ("code", "title", "columns", "rows"),
    (*TABLE_AT, "columns", 0): ("code", "label", "form"),
    ("provenance", "inputs", 0): ("file", "sha256"),
}


MAY_BE_MISSING: dict[Place, tuple[str, ...]] = {
    (): ("verdict",),
    CHANNEL: (
        *("parameters_covariance", "shape_std", "white_std", "response_lut"),
        *("log_evidence", "search"),
    ),
    (*CHANNEL, "noise"): ("U", "V", "std"),
    ("provenance",): ("chartless", "settings", "remarks"),
    ("provenance", "inputs", 1): ("frames", "used"),
}


def test_a_key_that_is_missing() -> None:
    for where, keys in NEEDED.items():
        for key in keys:
            with about((*where, key)):
                refused_as_damaged(changed(WHOLE, (*where, key), MISSING), key)


def test_a_key_that_may_be_missing() -> None:
    for where, keys in MAY_BE_MISSING.items():
        for key in keys:
            with about((*where, key)):
                again(from_json(changed(WHOLE, (*where, key), MISSING)))


def transfer(**wrong: object) -> dict[str, object]:
    """A transfer of two exposures, something about it wrong."""
    return {"ratio": 4.0, "upper": [5, 9], "lower": [3, 6], **wrong}


DAMAGE: list[tuple[Place, Any, str]] = [
    ((*CHANNEL, "inverse_lut"), [0.0, 1.0], "inverse_lut should be 16 numbers"),
    ((*CHANNEL, "inverse_lut"), [0.0] * 17, "inverse_lut should be 16 numbers"),
    ((*CHANNEL, "inverse_lut", 3), float("nan"), "inverse_lut should be 16 numbers"),
    ((*CHANNEL, "inverse_lut", 3), float("inf"), "inverse_lut should be 16 numbers"),
    ((*CHANNEL, "inverse_lut", 3), None, "inverse_lut"),
    ((*CHANNEL, "inverse_lut", 3), "x", "x"),
    ((*CHANNEL, "inverse_lut_std"), [0.1], "inverse_lut_std should be 16 numbers"),
    ((*CHANNEL, "shape_std"), [0.1], "shape_std should be 16 numbers"),
    ((*CHANNEL, "shape_std"), [-0.1] * 16, "errors of irradiance"),
    ((*CHANNEL, "white_std"), "wide", "wide"),
    ((*CHANNEL, "white_std"), float("nan"), "one of its numbers is not finite"),
    ((*CHANNEL, "log_evidence"), [1], ""),
    ((*CHANNEL, "parameters_covariance"), [[0.1]], "covariance should be 3 × 3 numbers"),
    ((*CHANNEL, "flags"), ["haunted"], "'haunted'"),
    ((*CHANNEL, "status"), "asleep", "asleep"),
    ((*CHANNEL, "noise", "u"), -1, "U = -255"),
    ((*CHANNEL, "noise", "v"), 0, "V = 0"),
    ((*CHANNEL, "noise", "u"), float("nan"), "U = nan"),
    ((*CHANNEL, "noise"), [1, 2], ""),
    ((*CHANNEL, "parameters", "a"), float("nan"), "finite"),
    ((*CHANNEL, "parameters"), {"a": 1}, ""),
    ((*CHANNEL, "parameters"), [1, 2, 3], ""),
    ((*CHANNEL, "observed_levels"), [1], ""),
    ((*CHANNEL, "observed_levels"), [3, 400], ""),
    ((*CHANNEL, "observed_levels"), [9, 2], ""),
    ((*CHANNEL, "observed_levels"), [-7, 9], ""),
    ((*CHANNEL, "pairs"), "many", "many"),
    ((*CHANNEL, "pairs"), float("inf"), ""),
    ((*CHANNEL, "name"), "Z", "channels"),
    ((*CHANNEL, "search"), {"objective": "bin"}, "values"),
    ((*CHANNEL, "search"), 5, ""),
    ((*CHANNEL, "search", "values"), [], ""),
    ((*CHANNEL, "search", "values"), [0.5, float("nan")], ""),
    ((*CHANNEL, "inverse_lut_std"), [1e308] * 16, "errors of irradiance"),
    ((*CHANNEL, "inverse_lut_std"), [-0.1] * 16, "errors of irradiance"),
    ((*CHANNEL, "noise", "std"), {"log_slope": "", "log_floor": 1, "correlation": 0}, ""),
    ((*CHANNEL, "noise", "std"), {"log_slope": [[]], "log_floor": 1, "correlation": 0}, ""),
    ((*CHANNEL, "noise", "std"), {"log_slope": -1, "log_floor": 1, "correlation": 0}, "noise"),
    (
        (*CHANNEL, "noise", "std"),
        {"log_slope": 1, "log_floor": float("inf"), "correlation": 0},
        "errors of its noise are 1 and inf",
    ),
    ((*CHANNEL, "accounts"), 5, ""),
    ((*CHANNEL, "accounts"), None, ""),
    ((*CHANNEL, "accounts"), ["noise"], ""),
    ((*CHANNEL, "accounts"), [[]], ""),
    (PAIRS_AT, None, ""),
    ((*PAIRS_AT, "facts"), 5, ""),
    ((*PAIRS_AT, "facts"), [5], ""),
    ((*PAIRS_AT, "facts"), ["outliers"], ""),
    ((*PAIRS_AT, "facts", 0, "value"), None, ""),
    ((*PAIRS_AT, "facts", 0, "value"), {}, ""),
    ((*PAIRS_AT, "facts", 0, "value"), [1, None], ""),
    ((*PAIRS_AT, "facts", 0, "value"), ["many"], "many"),
    ((*PAIRS_AT, "facts", 0, "value"), [[1]], ""),
    ((*PAIRS_AT, "facts", 0, "value"), float("nan"), "one of its numbers is not finite"),
    ((*PAIRS_AT, "facts", 0, "value"), [float("inf")], "one of its numbers is not finite"),
    ((*PAIRS_AT, "facts", 0, "value"), 10**400, ""),
    ((*PAIRS_AT, "facts", 0, "form"), ".2x", "form must be such as"),
    ((*PAIRS_AT, "facts", 0, "form"), ">99.2f", "form must be such as"),
    ((*PAIRS_AT, "facts", 0, "form"), None, "form must be such as"),
    ((*PAIRS_AT, "facts", 0, "form"), [], "form must be such as"),
    ((*PAIRS_AT, "fits"), 5, ""),
    ((*PAIRS_AT, "fits"), [5], ""),
    ((*PAIRS_AT, "fits", 0, "value"), "good", "good"),
    ((*PAIRS_AT, "fits", 0, "value"), None, ""),
    ((*PAIRS_AT, "fits", 0, "value"), [0.9], ""),
    ((*PAIRS_AT, "fits", 0, "value"), float("inf"), "one of its numbers is not finite"),
    ((*PAIRS_AT, "fits", 0, "form"), "d", "form must be such as"),
    ((*PAIRS_AT, "fits", 0, "good"), "any", "any"),
    ((*PAIRS_AT, "fits", 0, "bad"), {}, ""),
    ((*PAIRS_AT, "details"), 5, "details should be an object"),
    ((*PAIRS_AT, "details"), None, "details should be an object"),
    ((*PAIRS_AT, "details"), ["misfit"], "details should be an object"),
    ((*PAIRS_AT, "share"), "most", "most"),
    ((*PAIRS_AT, "share"), [], ""),
    ((*PAIRS_AT, "share"), float("nan"), "one of its numbers is not finite"),
    ((*PAIRS_AT, "record"), 5, ""),
    ((*PAIRS_AT, "record"), [1], ""),
    ((*PAIRS_AT, "record", "first", 0), -3, "impossible counts"),
    ((*PAIRS_AT, "record", "first", 0), 99, "impossible counts"),
    ((*PAIRS_AT, "record", "first", 0), None, ""),
    ((*PAIRS_AT, "record", "counts", 0), [10**30], ""),
    ((*PAIRS_AT, "record", "counts", 0), [-4], "impossible counts"),
    ((*PAIRS_AT, "record", "counts", 0), ["many"], "many"),
    ((*PAIRS_AT, "record", "counts"), [], ""),
    ((*PAIRS_AT, "kind"), "bracket", "transfers"),
    ((*PAIRS_AT, "kind"), "raw", "raw keeps no records"),
    ((*EXPOSURES_AT, "record"), [1, 2], ""),
    ((*EXPOSURES_AT, "record", "transfers"), 5, ""),
    ((*EXPOSURES_AT, "record", "transfers"), [5], ""),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(ratio=0)], "its exposures is 0"),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(ratio=-1)], "its exposures is -1"),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(ratio="x")], "x"),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(upper=[1])], "of 1 and 2 levels"),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(upper=["a", 1])], ""),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(lower=[3, 16])], "not those of 16"),
    ((*EXPOSURES_AT, "record", "transfers"), [transfer(lower=[-1, 3])], "not those of 16"),
    (("evidence",), 5, ""),
    (("evidence",), None, ""),
    (("evidence",), ["noise"], ""),
    (("evidence",), [[]], ""),
    ((*READING_AT, "inputs"), 5, ""),
    ((*READING_AT, "inputs"), None, ""),
    ((*READING_AT, "inputs"), ["a.png"], "a.png"),
    ((*READING_AT, "inputs"), [[0]], ""),
    ((*READING_AT, "inputs"), [0, 2], "its evidence names inputs that are not in its prov"),
    ((*READING_AT, "inputs"), [-1], "its evidence names inputs that are not in its prov"),
    ((*READING_AT, "inputs"), [10**30], "its evidence names inputs that are not in its prov"),
    ((*READING_AT, "example"), 2, "its evidence names inputs that are not in its provenance"),
    ((*READING_AT, "example"), -1, "its evidence names inputs that are not in its provenance"),
    ((*READING_AT, "example"), "a.png", "a.png"),
    ((*READING_AT, "example"), [], ""),
    (("provenance", "inputs"), [], "its evidence names inputs that are not in its provenance"),
    (("provenance",), {}, "its evidence names inputs that are not in its provenance"),
    ((*READING_AT, "tables"), 5, ""),
    ((*READING_AT, "tables"), None, ""),
    ((*READING_AT, "tables"), ["exposures"], ""),
    ((*TABLE_AT, "columns"), 5, ""),
    ((*TABLE_AT, "columns"), [5, 6], ""),
    ((*TABLE_AT, "columns"), [], "rows of its table exposures should have 0 cells"),
    ((*TABLE_AT, "columns", 1, "form"), "%d", "form must be such as"),
    ((*TABLE_AT, "rows"), 5, ""),
    ((*TABLE_AT, "rows"), [5], ""),
    ((*TABLE_AT, "rows"), [None], ""),
    ((*TABLE_AT, "rows", 0), ["a.png"], "rows of its table exposures should have 2 cells"),
    ((*TABLE_AT, "rows", 1), ["a.png", 1, 2], "of its table exposures should have 2 cells"),
    ((*TABLE_AT, "rows", 0, 1), {}, ""),
    ((*TABLE_AT, "rows", 0, 1), ["x"], "x"),
    ((*TABLE_AT, "rows", 0, 1), [[]], ""),
    ((*TABLE_AT, "rows", 0, 1), float("nan"), "one of its numbers is not finite"),
    (("provenance", "settings"), {"weight": float("nan")}, "one of its numbers is not finite"),
    (("model",), "ameegc9", "ameegc9"),
    (("model",), 7, "7"),
    (("levels",), 1, ""),
    (("levels",), -1, ""),
    (("levels",), "all", "all"),
    (("levels",), float("inf"), ""),
    (("bit_depth",), "deep", "deep"),
    (("channels",), [], "channels"),
    (("channels",), 5, ""),
    (("channels",), ["Y"], ""),
    (("bit_depth",), 10**9, "bit_depth 1000000000"),
    (("bit_depth",), 0, "bit_depth 0"),
    ((*CHANNEL, "noise", "u"), 1e308, "U = inf"),
    ((*CHANNEL, "noise", "v"), 1e308, "V = inf"),
    (("provenance",), 5, ""),
    (("provenance", "settings"), ["a"], "settings"),
    (("provenance", "remarks"), "a", "remarks"),
    (("provenance", "remarks"), [["a"]], "remarks"),
    (("provenance", "inputs"), {}, "inputs should each have file, sha256"),
    (("provenance", "inputs", 0, "file"), None, "inputs should each have file, sha256"),
    (("provenance", "inputs", 0, "sha256"), None, "inputs should each have file, sha256"),
    (("provenance", "inputs", 0, "frames"), [1], ""),
    (("provenance", "inputs", 0, "frames"), [1, "2"], "frames of its inputs"),
    (("provenance", "inputs", 0, "used"), "2", "frames of its inputs"),
]


def test_damage_is_refused_in_one_line() -> None:
    for place, value, word in DAMAGE:
        with about((place, value)):
            refused_as_damaged(changed(WHOLE, place, value), word)


def test_a_curve_of_no_model_must_increase() -> None:
    content = changed(WHOLE, ("model",), None)

    for value in (0.0, 1e-6, 0.99, 1.0):
        with about(value):
            refused_as_damaged(changed(content, (*CHANNEL, "inverse_lut", 5), value))


def test_a_table_larger_than_any_of_ours_is_refused() -> None:
    """Its file may be short, and its table takes gigabytes."""
    n_levels = 65536
    content = deepcopy(WHOLE)
    content["levels"] = n_levels
    (entry,) = content["channels"]
    entry["inverse_lut"] = [level / (n_levels - 1) for level in range(n_levels)]
    entry["accounts"] = entry["accounts"][1:]
    entry["accounts"][0]["record"] = {"first": n_levels * [0], "counts": n_levels * [[]]}

    assert "co-occurrence table has 1024 levels at most, not 65536" in refused(content)


def test_deep_nesting_is_refused(path: Path) -> None:
    refused_file("[" * 100_000, path)


anything = st.sampled_from(ODD) | st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inside: (
        st.lists(inside, max_size=3) | st.dictionaries(st.text(max_size=3), inside, max_size=2)
    ),
    max_leaves=4,
)
PLACES = list(places_in(WHOLE))


@pytest.mark.slow
@pytest.mark.parametrize("values", slow_but(VALUES, "usual"))
def test_no_damage_of_one_key_is_an_error_of_ours(values: str) -> None:
    for place in PLACES:
        for value in VALUES[values]:
            with about((place, value)):
                kept_or_refused(changed(WHOLE, place, value))


@pytest.mark.slow
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=200, deadline=None
)
@given(
    # Parameters of any size overflow, of which NumPy warns.
    place=st.sampled_from([each for each in PLACES if "parameters" not in each[2:]]),
    value=st.just(MISSING) | anything,
)
def test_whatever_stands_in_a_file_it_is_shown_or_refused(
    place: Place,
    value: Any,
    path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path.write_text(json.dumps(changed(WHOLE, place, value)))
    capsys.readouterr()

    status = main(["show", str(path), "--json"])

    out, err = capsys.readouterr()
    assert status in (0, 2), err
    json.loads(out)
    assert status == 0 or err.startswith(f"chartless: error: {path}: ")
    if status == 0:
        again(load(path))
