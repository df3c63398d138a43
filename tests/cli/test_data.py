"""``chartless data``: what is listed, fetched and found."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pooch
import pytest

Chartless = Callable[..., Any]
Refusal = Callable[..., str]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache in place of the user's; the folder of dorf in it."""
    monkeypatch.delenv("CHARTLESS_DATA", raising=False)
    monkeypatch.setattr(pooch, "os_cache", lambda project: tmp_path / "cache" / project)
    return tmp_path / "cache" / "chartless" / "dorf"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of 201 made-up curves in the folder that CHARTLESS_DATA names."""
    irradiance = np.linspace(0, 1, 1024, dtype=np.float32)
    exponents = np.linspace(0.2, 3, 201)
    exponents[1] = exponents[0]
    path = tmp_path / "own" / "dorf" / "dorf_own.npz"
    path.parent.mkdir(parents=True)
    np.savez(
        path,
        I=irradiance,
        B=irradiance ** exponents[:, np.newaxis].astype(np.float32),
        name=np.array([f"Film_{n // 3}CD{('Red', 'Green', 'Blue')[n % 3]}" for n in range(201)]),
        scale_class=np.array(["graph-log-log-neg"] * 150 + ["graph-lin-lin"] * 51),
    )
    monkeypatch.setenv("CHARTLESS_DATA", str(tmp_path / "own"))
    return path


@pytest.fixture
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    from chartless.datasets import DATASETS

    archive = replace(DATASETS["dorf"], url="http://127.0.0.1:1/dorfCurves.zip")
    monkeypatch.setenv("NO_PROXY", "*")
    monkeypatch.setitem(DATASETS._items, "dorf", archive)


@pytest.mark.parametrize("option", ["--help", "-h"])
@pytest.mark.parametrize("command", ["list", "fetch", "path"])
def test_help_of_every_command_has_an_example(
    command: str, option: str, chartless: Chartless
) -> None:
    done = chartless("data", command, option)

    assert (done.status, done.err) == (0, "")
    _, _, example = done.out.partition("Example:\n")
    assert example.startswith(f"      chartless data {command}")


def test_help_of_the_group_names_every_command(chartless: Chartless) -> None:
    done = chartless("data", "-h")

    assert (done.status, done.err) == (0, "")
    assert "Example:\n      chartless data list\n" in done.out
    for command in ("list", "fetch", "path"):
        assert f"\n  {command} " in done.out
    assert "..." not in done.out.partition("Commands:")[2]


def test_help_loads_nothing_heavy() -> None:
    script = (
        "import sys; from chartless.cli import main; main(['data', 'fetch', '--help'])\n"
        "sys.exit(', '.join({'numpy', 'pooch', 'requests'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


# list


def test_the_list_without_data(chartless: Chartless) -> None:
    done = chartless("data", "list")

    assert (done.status, done.err) == (0, "")
    header, row = done.out.splitlines()
    assert header.split() == ["name", "where", "what", "licence"]
    for column, text in (("name", "dorf"), ("where", "not fetched"), ("what", "201 "),
                         ("licence", "none stated")):  # fmt: skip
        assert row.startswith(text, header.index(column))


def test_the_list_with_data(chartless: Chartless, own: Path) -> None:
    header, row = chartless("data", "list").out.splitlines()

    assert row.startswith(f"{own}  ", header.index("where"))


def test_the_list_for_machines(
    chartless: Chartless, own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (entry,) = chartless("data", "list", "--json").json["datasets"]
    assert list(entry) == ["name", "path", "what", "licence", "url"]
    assert (entry["name"], entry["path"]) == ("dorf", str(own))

    monkeypatch.delenv("CHARTLESS_DATA")
    (entry,) = chartless("data", "list", "--json").json["datasets"]
    assert entry["path"] is None


# path


def test_the_path_alone(chartless: Chartless, own: Path) -> None:
    done = chartless("data", "path", "dorf")

    assert (done.status, done.out, done.err) == (0, f"{own}\n", "")


def test_no_path(refusal: Refusal) -> None:
    line = refusal("data", "path", "dorf")

    assert line == "dorf is not on this computer: run chartless data fetch dorf"


# fetch


def test_what_is_there_is_not_fetched_but_described(chartless: Chartless, own: Path) -> None:
    done = chartless("data", "fetch", "dorf")

    assert done.status == 0
    assert done.err == "chartless: note: dorf is on this computer already: nothing to download\n"
    assert done.out.splitlines() == [
        str(own),
        "",
        "kind     curves  distinct  cameras",
        "film        150       149       50",
        "digital      51        51       17",
        "all         201       200       67",
        "",
        "equal curves, by row:",
        "  0 Film_0CDRed = 1 Film_0CDGreen",
    ]


def test_the_measured_curves_are_described(
    chartless: Chartless, data_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHARTLESS_DATA", str(data_path))

    lines = chartless("data", "fetch", "dorf").out.splitlines()

    assert Path(lines[0]).parent == data_path / "dorf"
    assert [line.split()[:3] for line in lines[3:7]] == [
        ["film", "154", "148"],
        ["digital", "34", "29"],
        ["gamma", "13", "13"],
        ["all", "201", "190"],
    ]
    assert len(lines) == 9 + 10


@pytest.mark.usefixtures("no_network")
def test_a_failed_download_is_one_line(chartless: Chartless, cache: Path) -> None:
    done = chartless("data", "fetch", "dorf")

    assert (done.status, done.out) == (2, "")
    note, error = done.err.splitlines()
    assert note == "chartless: note: downloading http://127.0.0.1:1/dorfCurves.zip"
    assert error.startswith("chartless: error: dorf cannot be fetched: there is no connection")
    assert f"save it as {cache / 'dorfCurves.zip'}, or set CHARTLESS_DATA" in error


def test_a_damaged_file_is_named(chartless: Chartless, own: Path) -> None:
    own.write_bytes(own.read_bytes()[:1000])

    done = chartless("data", "fetch", "dorf")

    assert (done.status, done.out) == (2, "")
    assert f"chartless: error: {own}: cannot be read as DoRF: it is not an .npz" in done.err


@pytest.mark.parametrize("command", ["fetch", "path"])
def test_an_unknown_data_set_is_refused_with_a_suggestion(command: str, refusal: Refusal) -> None:
    assert refusal("data", command, "drof") == (
        "unknown data set 'drof'. Did you mean 'dorf'? Available: dorf."
    )


@pytest.mark.parametrize(
    ("arguments", "command"),
    [
        ((), "data"),
        (("fetch",), "data fetch"),
        (("path",), "data path"),
        (("fetchh", "dorf"), "data"),
    ],
)
def test_what_is_missing_is_a_usage_error(
    arguments: tuple[str, ...], command: str, refusal: Refusal
) -> None:
    assert refusal("data", *arguments).endswith(f"(see chartless {command} --help)")
