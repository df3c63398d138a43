"""Calibrations on disk: what is saved is loaded, and nothing else is."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response, load, save
from chartless.cli import main
from chartless.curves import SampledCurve
from chartless.errors import CalibrationFileError, ChartlessError, OutputError
from chartless.evidence.bracket.estimates import ExposureEstimate
from chartless.evidence.raw.estimates import RawEstimate
from chartless.flags import Flag, Pattern
from chartless.result.file import to_json
from chartless.result.response import SearchHistory, Status


def response_of(name: str = "Y", **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name,
        "curve": ModelCurve("ameegc2-exact", (-0.8, 1.5, -0.6)),
        "noise": AffineNoise.from_8bit(0.03, 16),
        "n_levels": 16,
        "observed_levels": (1, 14),
        "n_pairs": 1234,
        "outliers": 0.02,
        "method": "ism-bin",
        "status": Status.LIMIT_REACHED,
        "flags": (Flag.CLIPPED, Flag.SEARCH_UNFINISHED),
        "history": SearchHistory("bin", (0.1, 1 / 3, 0.9), 77),
        "table": Cooccurrence(np.eye(16, dtype=np.int64) * 5),
    }
    return Response(**{**values, **changes})


def one(response: Response) -> Calibration:
    provenance = {"chartless": "0.1.0", "inputs": [{"file": "ä.png", "sha256": "0"}]}
    return Calibration(channels=(response,), bit_depth=8, provenance=provenance)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "camera.json"


def again(calibration: Calibration, path: Path) -> Calibration:
    save(calibration, path)
    return load(path)


def same(first: Response, second: Response) -> None:
    for field in (
        *("name", "curve", "noise", "n_levels", "observed_levels", "n_pairs", "outliers"),
        *("method", "status", "flags", "history"),
    ):
        assert getattr(first, field) == getattr(second, field), field
    assert np.array_equal(first.inverse_lut, second.inverse_lut)
    assert np.array_equal(first.response_lut, second.response_lut)
    assert (first.table is None) == (second.table is None)
    if first.table is not None and second.table is not None:
        assert second.table.counts.dtype == np.int64
        assert np.array_equal(first.table.counts, second.table.counts)


# Round trips


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"flags": ()},
        {"flags": tuple(Flag)},
        {"history": None, "table": None},
        {"status": Status.CONVERGED},
        {"curve": ModelCurve("gamma", (0.1 + 0.2,))},
        {"curve": ModelCurve("eegc3", (-0.7, 0.1, 1e-300, 0.2))},
        {"noise": AffineNoise(np.pi / 1e4, np.e / 1e5)},
        {"n_levels": 300, "table": None},
    ],
)
def test_what_is_saved_is_loaded_exactly(changes: dict[str, Any], path: Path) -> None:
    calibration = one(response_of(**changes))

    loaded = again(calibration, path)

    same(calibration.channels[0], loaded.channels[0])
    assert loaded.bit_depth == calibration.bit_depth
    assert loaded.provenance == calibration.provenance
    assert to_json(loaded) == to_json(calibration)


@pytest.mark.parametrize(
    "exposures",
    [
        None,
        ExposureEstimate((1.0, 2.0 + 1 / 3, 16.0), 0.0, 0.012345678901234567),
        ExposureEstimate((4.0, 1.0), 1 / 7, 1e-300),
    ],
)
@pytest.mark.parametrize("noise", [None, AffineNoise.from_8bit(0.03, 16)])
def test_a_bracket_is_kept(
    exposures: ExposureEstimate | None, noise: AffineNoise | None, path: Path
) -> None:
    """With and without noise: methods of exposures tell none."""
    before = one(response_of(exposures=exposures, noise=noise, method="debevec", table=None))

    loaded = again(before, path)

    same(before.channels[0], loaded.channels[0])
    assert loaded.channels[0].exposures == exposures
    assert loaded.channels[0].noise == noise
    assert to_json(loaded) == to_json(before)
    (entry,) = json.loads(path.read_text())["channels"]
    assert (entry["noise"] is None) == (noise is None)
    assert (entry["exposures"] is None) == (exposures is None)


def test_what_raw_files_told_comes_back(path: Path) -> None:
    told = RawEstimate((1.5, -1 / 3, -1 / 6), (1.0, 1.1), 1.23456789012345678, 1e-3)
    (response,) = again(one(response_of(raw=told)), path).channels

    assert response.raw == told


@pytest.mark.parametrize("raw", [{}, [1], {"matrix": [1, 2]}, {"matrix": "abc"}], ids=str)
def test_damaged_words_about_raw_files_are_refused(raw: Any, path: Path) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    rest = {"gains": [1], "corner_gain": 1, "scatter": 0.1}
    content["channels"][0]["raw"] = {**rest, **raw} if isinstance(raw, dict) else raw
    path.write_text(json.dumps(content))

    with pytest.raises(CalibrationFileError, match="damaged calibration file"):
        load(path)


def test_older_files_know_no_exposures(path: Path) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    for key in ("exposures", "raw", "outliers", "pattern", "inverse_lut_std_with_dark"):
        del content["channels"][0][key]
    path.write_text(json.dumps(content))

    (response,) = load(path).channels

    assert response.exposures is None
    assert response.noise == AffineNoise.from_8bit(0.03, 16)


@pytest.mark.parametrize(
    "exposures", [{}, {"relative": [1, 2]}, {"relative": 3}, {"relative": ["a"]}, [1, 2]], ids=str
)
def test_damaged_exposures_are_refused(exposures: Any, path: Path) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    whole = {"exponent_error": 0.1, "scatter": 0.1} if exposures != {"relative": [1, 2]} else {}
    content["channels"][0]["exposures"] = (
        {**exposures, **whole} if isinstance(exposures, dict) else exposures
    )
    path.write_text(json.dumps(content))

    with pytest.raises(CalibrationFileError, match="damaged calibration file"):
        load(path)


def test_three_channels(path: Path) -> None:
    channels = tuple(
        response_of(name, curve=ModelCurve("gamma", (0.4 + 0.05 * c,)))
        for c, name in enumerate("RGB")
    )
    loaded = again(Calibration(channels=channels, bit_depth=16), path)

    assert loaded.bit_depth == 16
    for before, after in zip(channels, loaded.channels, strict=True):
        same(before, after)


def test_deviations_are_kept(path: Path) -> None:
    arrays = {
        "inverse_lut_std": np.linspace(0, 0.01, 16) ** 2,
        "inverse_lut_std_with_dark": np.linspace(0, 0.009, 16) ** 2,
        "parameter_covariance": np.diag([0.1, 0.2, 1 / 3]) + 1e-7,
    }

    loaded = again(one(response_of(**arrays)), path).channels[0]

    for name, array in arrays.items():
        assert np.array_equal(getattr(loaded, name), array), name


@pytest.mark.parametrize("pattern", [None, *Pattern])
def test_the_pattern_of_a_misfit_is_kept(pattern: Pattern | None, path: Path) -> None:
    loaded = again(one(response_of(pattern=pattern)), path)

    assert loaded.channels[0].pattern is pattern
    assert loaded.patterns == ({} if pattern is None else {pattern: ["Y"]})


rows = st.lists(st.integers(0, 2**53), min_size=16, max_size=16) | st.just([0] * 16)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(counts=st.lists(rows, min_size=16, max_size=16))
def test_any_table_comes_back(counts: list[list[int]], path: Path) -> None:
    table = Cooccurrence(np.array(counts, dtype=np.int64))

    loaded = again(one(response_of(table=table)), path)

    kept = loaded.channels[0].table
    assert kept is not None
    assert np.array_equal(kept.counts, table.counts)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(
    cells=st.dictionaries(
        st.tuples(st.integers(0, 15), st.integers(0, 15)), st.integers(1, 10**9), max_size=30
    )
)
def test_any_sparse_table_comes_back(cells: dict[tuple[int, int], int], path: Path) -> None:
    table = Cooccurrence.zeros(16)
    for cell, count in cells.items():
        table.counts[cell] = count

    kept = again(one(response_of(table=table)), path).channels[0].table

    assert kept is not None
    assert np.array_equal(kept.counts, table.counts)


def test_a_huge_table_is_left_out(path: Path) -> None:
    dense = Cooccurrence(np.ones((512, 512), dtype=np.int64))

    loaded = again(one(response_of(n_levels=512, table=dense)), path)

    assert loaded.channels[0].table is None
    assert path.stat().st_size < 200_000


def test_a_curve_of_no_model_is_kept_by_its_samples(path: Path) -> None:
    """The samples at the levels are what other programs can provide."""
    curve = SampledCurve((0.0, 0.1, 0.4, 1.0), (0.0, 0.5, 0.8, 1.0))
    before = one(response_of(curve=curve))

    loaded = again(before, path)

    assert json.loads(path.read_text())["model"] is None
    assert np.allclose(loaded.channels[0].inverse_lut, before.channels[0].inverse_lut, atol=1e-15)


def test_files_without_the_extras_are_read(path: Path) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    for extra in (
        *("search", "cooccurrence", "deviance", "pattern"),
        *("inverse_lut_std_with_dark", "parameters_covariance"),
    ):
        del content["channels"][0][extra]
    path.write_text(json.dumps(content))

    response = load(path).channels[0]

    assert (response.history, response.table, response.deviance) == (None, None, None)
    assert response.pattern is None
    assert response.inverse_lut_std_with_dark is None
    assert response.parameter_covariance is None


def test_unknown_keys_are_no_harm(path: Path) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    content["note"] = content["channels"][0]["note"] = "from the future"
    path.write_text(json.dumps(content))

    same(load(path).channels[0], response_of())


# The layout


def test_the_file_is_plain_json_with_every_documented_key(path: Path) -> None:
    save(one(response_of()), path)

    def no_constant(name: str) -> None:
        pytest.fail(f"{name} is not JSON")

    content = json.loads(path.read_text(encoding="utf-8"), parse_constant=no_constant)

    assert {key: type(content[key]) for key in content} == {
        "format": str, "version": int, "bit_depth": int, "levels": int, "method": str,
        "model": str, "verdict": dict, "channels": list, "provenance": dict,
    }  # fmt: skip
    (channel,) = content["channels"]
    assert {key: type(channel[key]) for key in channel}.items() >= {
        "name": str, "parameters": dict, "inverse_lut": list, "inverse_lut_std": type(None),
        "response_lut": list, "noise": dict, "observed_levels": list, "pairs": int,
        "status": str, "flags": list, "search": dict, "cooccurrence": dict,
    }.items()  # fmt: skip
    assert set(channel["noise"]) == {"u", "v", "U", "V", "std"}
    assert (len(channel["inverse_lut"]), len(channel["response_lut"])) == (16, 1024)
    assert channel["flags"] == ["clipped", "search-unfinished"]


def test_nothing_that_is_not_finite_is_written(path: Path) -> None:
    path.write_text("older")
    broken = response_of(inverse_lut_std=np.full(16, np.nan))

    with pytest.raises(ValueError, match="JSON"):
        save(one(broken), path)

    assert path.read_text() == "older"


def test_a_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="does not exist: create it first"):
        save(one(response_of()), tmp_path / "missing" / "camera.json")


# Damage


def refused(content: Any, path: Path) -> str:
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(CalibrationFileError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert isinstance(caught.value, ChartlessError)
    return message.removeprefix(f"{path}: ")


@pytest.fixture
def content(path: Path) -> Any:
    save(one(response_of()), path)
    return json.loads(path.read_text())


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_truncated_file(share: float, content: Any, path: Path) -> None:
    text = json.dumps(content)

    assert "not JSON" in refused(text[: int(share * len(text))], path)


@pytest.mark.parametrize(
    "other", ["[]", "{}", "3", "null", '"text"', '{"format": "chartless-truth", "version": 1}']
)
def test_other_json(other: str, path: Path) -> None:
    assert "not a calibration file" in refused(other, path)


def test_a_binary_file(path: Path) -> None:
    path.write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")

    with pytest.raises(CalibrationFileError, match="not a calibration file"):
        load(path)


def test_a_file_that_does_not_exist(path: Path) -> None:
    with pytest.raises(CalibrationFileError, match=r"camera\.json: cannot be read: No such file"):
        load(path)


@pytest.mark.parametrize("version", [2, 0, "1", None, 1.5])
def test_another_version_is_named(version: object, content: Any, path: Path) -> None:
    content["version"] = version

    message = refused(content, path)

    assert f"version {version} of the format" in message
    assert "reads version 1" in message


@pytest.mark.parametrize("key", ["bit_depth", "levels", "method", "model", "channels"])
def test_a_key_that_is_missing(key: str, content: Any, path: Path) -> None:
    del content[key]

    message = refused(content, path)

    assert "damaged calibration file" in message
    assert key in message


@pytest.mark.parametrize(
    "key",
    ["name", "parameters", "inverse_lut", "noise", "observed_levels", "pairs", "status", "flags"],
)
def test_a_key_of_a_channel_that_is_missing(key: str, content: Any, path: Path) -> None:
    del content["channels"][0][key]

    assert key in refused(content, path)


def put(*keys: str | int) -> Callable[[Any, Any], None]:
    """Setter of the value at the end of the keys."""

    def setter(content: Any, value: Any) -> None:
        for key in keys[:-1]:
            content = content[key]
        content[keys[-1]] = value

    return setter


CHANNEL = ("channels", 0)


def told(**wrong: object) -> object:
    """A bracket of two exposures, something about it wrong."""
    transfer = {"ratio": 4.0, "upper": [5, 9], "lower": [3, 6], **wrong}
    return {
        "relative": [1.0, 4.0],
        "exponent_error": 0.0,
        "scatter": 0.01,
        "transfers": [transfer],
    }


@pytest.mark.parametrize(
    ("keys", "value", "word"),
    [
        ((*CHANNEL, "inverse_lut"), [0.0, 1.0], "inverse_lut should be 16 numbers"),
        ((*CHANNEL, "inverse_lut"), [0.0] * 17, "inverse_lut should be 16 numbers"),
        ((*CHANNEL, "inverse_lut", 3), float("nan"), "inverse_lut should be 16 numbers"),
        ((*CHANNEL, "inverse_lut", 3), float("inf"), "inverse_lut should be 16 numbers"),
        ((*CHANNEL, "inverse_lut", 3), None, "inverse_lut"),
        ((*CHANNEL, "inverse_lut", 3), "x", "x"),
        ((*CHANNEL, "inverse_lut_std"), [0.1], "inverse_lut_std should be 16 numbers"),
        ((*CHANNEL, "inverse_lut_std_with_dark"), [0.1], "std_with_dark should be 16 numbers"),
        ((*CHANNEL, "parameters_covariance"), [[0.1]], "covariance should be 3 × 3 numbers"),
        ((*CHANNEL, "flags"), ["haunted"], "'haunted'"),
        ((*CHANNEL, "pattern"), "haunted", "the pattern 'haunted' is unknown"),
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
        ((*CHANNEL, "cooccurrence", "first", 0), -3, ""),
        ((*CHANNEL, "cooccurrence", "first", 0), 99, ""),
        ((*CHANNEL, "cooccurrence", "counts", 0), [10**30], ""),
        ((*CHANNEL, "cooccurrence", "counts", 0), [-4], ""),
        ((*CHANNEL, "cooccurrence", "counts"), [], ""),
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
        ((*CHANNEL, "exposures"), told(ratio=0), "ratio of its exposures is 0"),
        ((*CHANNEL, "exposures"), told(upper=[1]), "of 1 and 2 levels"),
        ((*CHANNEL, "exposures"), told(lower=[3, 16]), "are not those of 16"),
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
        (("provenance", "exposures"), [{"file": "a.png"}], "exposures should each have file"),
    ],
)
def test_damage_is_refused_in_one_line(
    keys: tuple[str | int, ...], value: Any, word: str, content: Any, path: Path
) -> None:
    put(*keys)(content, value)

    message = refused(content, path)

    assert message.startswith("damaged calibration file: ")
    assert message.endswith("; calibrate again")
    assert word in message


@pytest.mark.parametrize("value", [0.0, 1e-6, 0.99, 1.0])
def test_a_curve_of_no_model_must_increase(value: float, content: Any, path: Path) -> None:
    content["model"] = None
    content["channels"][0]["inverse_lut"][5] = value

    assert "damaged calibration file" in refused(content, path)


def test_a_table_larger_than_any_of_ours_is_refused(content: Any, path: Path) -> None:
    """Its file may be short, and its table takes gigabytes."""
    n_levels = 65536
    content["levels"] = n_levels
    (entry,) = content["channels"]
    entry["inverse_lut"] = [level / (n_levels - 1) for level in range(n_levels)]
    entry["cooccurrence"] = {"first": n_levels * [0], "counts": n_levels * [[]]}
    path.write_text(json.dumps(content))

    assert "co-occurrence table has 1024 levels at most, not 65536" in refused(content, path)


def test_deep_nesting_is_refused(path: Path) -> None:
    refused("[" * 100_000, path)


ODD = [float("nan"), float("inf"), -1, 10**30, [], {}, [float("nan")], [[]], [-1, 1], "\n"]
anything = st.sampled_from(ODD) | st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inside: (
        st.lists(inside, max_size=3) | st.dictionaries(st.text(max_size=3), inside, max_size=2)
    ),
    max_leaves=4,
)
PLACES = [
    *((key,) for key in ("version", "bit_depth", "levels", "method", "model", "channels")),
    *(
        (*CHANNEL, key)
        for key in (
            *("name", "parameters", "inverse_lut", "inverse_lut_std", "noise", "pattern"),
            *("inverse_lut_std_with_dark", "parameters_covariance"),
            *("observed_levels", "pairs", "status", "flags", "search", "cooccurrence"),
        )
    ),
    *((*CHANNEL, "noise", key) for key in ("u", "v")),
    *((*CHANNEL, "cooccurrence", key) for key in ("first", "counts")),
    *((*CHANNEL, "search", key) for key in ("objective", "values", "evaluations")),
    ("provenance",),
    *(("provenance", key) for key in ("inputs", "settings", "exposures", "remarks")),
    *(("provenance", "inputs", 0, key) for key in ("file", "sha256", "frames", "used")),
]


@pytest.mark.slow
@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=80, deadline=None
)
@given(place=st.sampled_from(PLACES), value=anything)
def test_whatever_stands_in_a_file_it_is_shown_or_refused(
    place: tuple[str | int, ...],
    value: Any,
    path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    save(one(response_of()), path)
    content = json.loads(path.read_text())
    put(*place)(content, value)
    path.write_text(json.dumps(content))
    capsys.readouterr()

    status = main(["show", str(path), "--json"])

    out, err = capsys.readouterr()
    assert status in (0, 2), err
    json.loads(out)
    assert status == 0 or err.startswith(f"chartless: error: {path}: ")
    if status == 0:
        save(load(path), path)
