"""``chartless reproduce fits``: what is printed and what the folder holds."""

import contextlib
import csv
import io
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pooch
import pytest
from matplotlib.figure import Figure

from chartless.cli import main
from chartless.datasets import DigitalCameras, Dorf, load_dorf
from chartless.experiments import fits, fits_figures
from chartless.models import MODELS, Table

Chartless = Callable[..., Any]
Refusal = Callable[..., str]

STATISTICS = ["median", "q25", "q75", "mean", "max", "not_monotone", "out_of_range", "seconds"]
FIGURES = ["digital", "fig1_responses", "fig2_medians", "fig2_rmse_by_order", "fig3_examples"]
LEFT_OUT = ("emor-left-out", "emor-monotone-left-out", "logemor-left-out")
CASES = 3


@dataclass(frozen=True)
class Reproduced:
    out: str
    folder: Path

    @property
    def summary(self) -> Any:
        return json.loads((self.folder / "summary.json").read_text())["fits"]


@pytest.fixture(scope="module", autouse=True)
def _little_data() -> Iterator[None]:
    """A short table and two digital cameras: all of them take their time."""
    irradiance = np.linspace(0, 1, 32)
    curves = np.array([irradiance**0.4, irradiance**0.5])
    cameras = DigitalCameras(irradiance, curves, ("one", "other"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(MODELS._items, "table", Table(order=20))
        patch.setattr("chartless.datasets.find_digital", lambda: cameras)
        yield


def small(path: Path | None) -> Dorf:
    """Fewer curves and samples than any file of DoRF has."""
    whole = load_dorf(path)
    rows, columns = [*range(6), *range(195, 201)], slice(None, None, 33)
    return Dorf(
        whole.irradiance[columns],
        whole.curves[rows, columns],
        tuple(whole.names[row] for row in rows),
        tuple(whole.scales[row] for row in rows),
    )


@pytest.fixture(scope="module")
def reproduced(dorf_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Reproduced:
    """The whole experiment on a few curves."""
    folder = tmp_path_factory.mktemp("out") / "fits"
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as out:
        patch.setattr("chartless.datasets.load_dorf", small)
        arguments = ["-o", str(folder), "--cases", f"{CASES}", "--dorf", str(dorf_file)]
        status = main(["reproduce", "fits", *arguments])
    assert status == 0
    return Reproduced(out.getvalue(), folder)


def keep(monkeypatch: pytest.MonkeyPatch, wanted: Callable[[str, int], bool]) -> None:
    """Leave the other families and orders out."""
    of_all = fits._of_all
    monkeypatch.setattr(
        fits, "_of_all", lambda *of: (each for each in of_all(*of) if wanted(each[0], each[1]))
    )
    plan = fits.plan
    monkeypatch.setattr(
        fits, "plan", lambda *of: (each for each in plan(*of) if wanted(each[0], each[1]))
    )


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what is fast, with empty figures."""
    names = {"poly", "ameegc", "ameegc-exact", "emor", "emor-left-out"}
    keep(monkeypatch, lambda family, order: family in names and order <= 2)
    for name in ("curves", "boxes", "medians", "examples"):
        monkeypatch.setattr(fits_figures, f"{name}_figure", lambda *_: Figure(figsize=(1, 1)))


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# The folder


@pytest.mark.slow
def test_the_folder_holds_tables_figures_and_a_summary(reproduced: Reproduced) -> None:
    names = sorted(path.name for path in reproduced.folder.iterdir())

    figures = [f"{name}.png" for name in FIGURES]
    tables = ["digital.csv", "fits.csv", "summary.json", "winners.csv"]
    assert names == sorted(["cases", *figures, *tables])
    for name in figures:
        content = (reproduced.folder / name).read_bytes()
        assert content.startswith(b"\x89PNG\r\n")
        assert len(content) > 20_000


@pytest.mark.slow
def test_the_summary_has_every_family_and_order_with_the_statistics_agreed_upon(
    reproduced: Reproduced,
) -> None:
    content = json.loads((reproduced.folder / "summary.json").read_text())

    assert list(content) == ["fits", "digital"]
    expected: dict[str, set[str]] = {}
    for model in MODELS.values():
        if model.order <= 6 or model.name == "table":
            expected.setdefault(model.family, set()).add(str(model.order))
    assert {family: set(orders) for family, orders in content["digital"].items()} == expected
    expected |= {family: {*map(str, range(7))} for family in LEFT_OUT}
    assert {family: set(orders) for family, orders in content["fits"].items()} == expected
    for orders in content["fits"].values():
        for statistics in orders.values():
            assert list(statistics) == STATISTICS
            assert 0 <= statistics["q25"] <= statistics["median"] <= statistics["q75"]
            assert statistics["q75"] <= statistics["max"] < 1
            assert 0 <= statistics["mean"] <= statistics["max"]
            for count in ("not_monotone", "out_of_range"):
                assert isinstance(statistics[count], int)
                assert 0 <= statistics[count] <= CASES
            assert statistics["seconds"] >= 0


@pytest.mark.slow
def test_every_fit_is_a_row_that_adds_up_to_the_summary(reproduced: Reproduced) -> None:
    rows = rows_of(reproduced.folder / "fits.csv")

    n_tables = sum(map(len, reproduced.summary.values()))
    assert len(rows) == CASES * n_tables
    assert {row["row"] for row in rows} == {"0", "6", "11"}
    by_table: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        by_table.setdefault((row["family"], row["order"]), []).append(float(row["rmse"]))
    assert len(by_table) == n_tables
    for (family, order), errors in by_table.items():
        statistics = reproduced.summary[family][order]
        assert statistics["median"] == pytest.approx(np.median(errors), abs=1e-8)
        assert statistics["mean"] == pytest.approx(np.mean(errors), abs=1e-8)
        assert statistics["max"] == pytest.approx(max(errors), abs=1e-8)


@pytest.mark.slow
def test_the_winners_are_ranked_at_each_number_of_parameters(reproduced: Reproduced) -> None:
    rows = rows_of(reproduced.folder / "winners.csv")

    for n_parameters in range(1, 8):
        own = [row for row in rows if int(row["parameters"]) == n_parameters]
        order = str(n_parameters - 1)
        medians = {
            family: orders[order]["median"]
            for family, orders in reproduced.summary.items()
            if order in orders
        }
        assert [int(row["place"]) for row in own] == list(range(1, len(medians) + 1))
        assert {row["family"] for row in own} == set(medians)
        ranked = [medians[row["family"]] for row in own]
        assert ranked == sorted(ranked)
    assert {int(row["parameters"]) for row in rows} == set(range(1, 8))


# What is printed


@pytest.mark.slow
def test_the_medians_are_printed(reproduced: Reproduced) -> None:
    of_dorf, of_digital, (last,) = (part.splitlines() for part in reproduced.out.split("\n\n"))
    title, header, *rows = of_dorf

    assert title == f"median RMSE over {CASES} curves of DoRF"
    assert of_digital[0] == "median RMSE over 2 digital cameras"
    assert of_digital[1].split() == header.split()
    assert ["gamma", "0.00000"] in [line.split() for line in of_digital]  # which they are
    assert header.split("  ")[0] == "family"
    assert header.split()[1:] == [word for n in range(7) for word in ("order", str(n))]
    assert last == f"figures, tables and summary.json in {reproduced.folder}"
    families = [row.split()[0] for row in rows]
    assert families == [family for family in reproduced.summary if family != "table"]
    for row in rows:
        family, *cells = row.split()
        medians = [
            statistics["median"]
            for order, statistics in sorted(reproduced.summary[family].items())
            if int(order) <= 6
        ]
        assert [float(cell) for cell in cells] == pytest.approx(medians, abs=6e-6)


@pytest.mark.slow
def test_a_second_run_prints_the_same_at_once_and_json_is_the_summary(
    reproduced: Reproduced, dorf_file: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        pytest.fail("fitted again")

    monkeypatch.setattr(fits, "fit_many", never)
    monkeypatch.setattr("chartless.datasets.load_dorf", small)
    before = (reproduced.folder / "summary.json").read_bytes()

    done = chartless(
        "reproduce", "fits", "-o", reproduced.folder, "--cases", CASES, "--dorf", dorf_file,
        "--json",
    )  # fmt: skip

    assert (done.status, done.err) == (0, "")
    assert done.json == json.loads(before)
    assert (reproduced.folder / "summary.json").read_bytes() == before


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_an_interruption_is_one_line_and_the_next_run_goes_on(
    dorf_file: Path, tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ("reproduce", "fits", "--cases", 4, "--dorf", dorf_file)
    chartless(*arguments, "-o", tmp_path / "whole")
    fit_many, calls = fits.fit_many, list[Any]()

    def interrupted(*of: Any, **how: Any) -> Any:
        calls.append(of[0])
        if len(calls) == 4:
            raise KeyboardInterrupt
        return fit_many(*of, **how)

    with monkeypatch.context() as patch:
        patch.setattr(fits, "fit_many", interrupted)
        done = chartless(*arguments, "-o", tmp_path / "out")
    assert (done.status, done.out) == (130, "")
    assert done.err == "chartless: error: interrupted\n"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["cases"]
    assert len(list((tmp_path / "out" / "cases").iterdir())) == 3

    done = chartless(*arguments, "-o", tmp_path / "out")

    assert (done.status, done.err) == (0, "")
    for name in ("fits.csv", "winners.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_two_processes_find_the_same_as_one(
    dorf_file: Path, tmp_path: Path, chartless: Chartless
) -> None:
    for name, jobs in (("one", 1), ("two", 2)):
        done = chartless(
            "reproduce", "fits", "-o", tmp_path / name, "--cases", 2, "--jobs", jobs,
            "--dorf", dorf_file,
        )  # fmt: skip
        assert (done.status, done.err) == (0, "")

    def results(name: str) -> Any:
        summary = json.loads((tmp_path / name / "summary.json").read_text())["fits"]
        for orders in summary.values():
            for statistics in orders.values():
                del statistics["seconds"]
        return summary

    assert results("one") == results("two")
    for name in ("fits.csv", "winners.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


@pytest.mark.slow
def test_a_single_case(
    dorf_file: Path, tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep(monkeypatch, lambda family, order: order == 0 or family.startswith("ameegc"))
    monkeypatch.setattr("chartless.datasets.load_dorf", small)

    done = chartless("reproduce", "fits", "-o", tmp_path / "out", "--cases", 1, "--dorf", dorf_file)

    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("median RMSE over 1 curve")
    assert (tmp_path / "out" / "fig3_examples.png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_the_measured_curves_are_found_by_themselves(
    data_path: Path, tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHARTLESS_DATA", str(data_path))

    done = chartless("reproduce", "fits", "-o", tmp_path / "out", "--cases", 5, "--json")

    assert (done.status, done.err) == (0, "")
    exact = done.json["fits"]["ameegc-exact"]["2"]
    assert 0.001 < exact["median"] < 0.01
    assert exact["not_monotone"] == 0


# Refusals


def test_without_data_or_network_one_line_says_what_to_do(
    tmp_path: Path, refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    from chartless.datasets import DATASETS

    archive = replace(DATASETS["dorf"], url="http://127.0.0.1:1/dorfCurves.zip")
    monkeypatch.delenv("CHARTLESS_DATA", raising=False)
    monkeypatch.setenv("NO_PROXY", "*")
    monkeypatch.setattr(pooch, "os_cache", lambda project: tmp_path / "cache" / project)
    monkeypatch.setitem(DATASETS._items, "dorf", archive)

    line = refusal("reproduce", "fits", "-o", tmp_path / "out", "--json")

    assert line.startswith("dorf cannot be fetched: there is no connection")
    assert "download http://127.0.0.1:1/dorfCurves.zip by hand" in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("missing.npz", "No such file"),
        (".", "holds no DoRF data"),
        ("a.mat", "not a known form of the DoRF"),
    ],
)
def test_a_file_that_is_no_dorf(name: str, why: str, tmp_path: Path, refusal: Refusal) -> None:
    line = refusal("reproduce", "fits", "-o", tmp_path / "out", "--dorf", tmp_path / name)

    assert line.startswith(str(tmp_path))
    assert why in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("output", "why"),
    [
        ("missing/out", "does not exist: create it first"),
        ("file", "is a file: choose another output folder"),
        ("file/out", "cannot be made"),
    ],
)
@pytest.mark.usefixtures("quick")
def test_a_folder_that_cannot_be_made(
    output: str, why: str, dorf_file: Path, tmp_path: Path, refusal: Refusal
) -> None:
    (tmp_path / "file").touch()

    line = refusal("reproduce", "fits", "-o", tmp_path / output, "--dorf", dorf_file, "--json")

    assert line.startswith(f"{tmp_path / output}: ")
    assert why in line
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--cases", 0), "--cases"),
        (("--jobs", 0), "--jobs"),
        (("--cases", "many"), "--cases"),
    ],
)
def test_bad_numbers_are_usage_errors(
    arguments: tuple[Any, ...], named: str, tmp_path: Path, refusal: Refusal
) -> None:
    assert named in refusal("reproduce", "fits", "-o", tmp_path / "out", *arguments)


def test_an_experiment_must_be_named(refusal: Refusal) -> None:
    assert "fitz" in refusal("reproduce", "fitz")


def test_help_has_an_example(chartless: Chartless) -> None:
    done = chartless("reproduce", "fits", "--help")

    _, _, example = done.out.partition("Example:\n")
    assert (done.status, done.err) == (0, "")
    assert example.startswith("      chartless reproduce fits -o ")


@pytest.mark.usefixtures("quick")
def test_without_digital_cameras_a_line_says_how_to_give_them(
    dorf_file: Path, tmp_path: Path, chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chartless.datasets.find_digital", lambda: None)
    monkeypatch.setattr("chartless.datasets.load_dorf", small)

    done = chartless("reproduce", "fits", "-o", tmp_path / "out", "--cases", 2, "--dorf", dorf_file)

    assert done.status == 0
    assert done.err == (
        "chartless: note: digital cameras are left out: set CHARTLESS_DATA to a folder that holds "
        "modern_curves/responses_1024.npz (docs/reproduction.md)\n"
    )
    assert "digital cameras" not in done.out
    assert not (tmp_path / "out" / "digital.csv").exists()
