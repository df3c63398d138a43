"""Fits of every family to measured cameras, on made-up ones; the measured ones at the end."""

import csv
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slow_cases import slow_but

from chartless.curves.fitting import fit
from chartless.datasets import Dorf, load_dorf
from chartless.errors import OutputError
from chartless.experiments import fits, fits_figures
from chartless.experiments.fits import FitTable
from chartless.models import MODELS, Table

LEFT_OUT = ("emor-left-out", "emor-monotone-left-out", "logemor-left-out")
QUICK = {"gamma", "ameegc", "ameegc-exact", "poly", "emor", "emor-left-out"}


def made_up(names: tuple[str, ...] | None = None, n_samples: int = 64) -> Dorf:
    """Cameras of three channels each, smooth and increasing."""
    names = names or tuple(f"Film-{n}{c}" for n in range(4) for c in ("Red", "Green", "Blue"))
    irradiance = np.linspace(0, 1, n_samples)
    model, rng = MODELS["gumbel3"], np.random.default_rng(1)
    steps = rng.normal(size=(len(names), 4)) * [0.4, 0.25, 0.1, 0.1]
    curves = model.response(irradiance, model.identity + steps)
    return Dorf(irradiance, curves, names, ("graph-log-log-neg",) * len(names))


@pytest.fixture(scope="module")
def dorf() -> Dorf:
    return made_up()


@pytest.fixture(scope="module", autouse=True)
def _short_table() -> Iterator[None]:
    """The whole table takes its time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(MODELS._items, "table", Table(order=30))
        yield


@pytest.fixture(scope="module")
def finished(dorf: Dorf, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[FitTable]]:
    """Everything fitted to three curves."""
    folder = tmp_path_factory.mktemp("finished")
    return folder, fits.run(dorf, folder, cases=3)


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Leave the slow families out; names of the cases that run."""
    names: list[str] = []
    plan = fits.plan

    def counted(name: str, case: Callable[[], Any]) -> Any:
        names.append(name)
        return case()

    def quick(dorf: Dorf, rows: list[int]) -> Iterator[tuple[str, int, Any]]:
        for family, order, case in plan(dorf, rows):
            if family in QUICK and order <= 2:
                name = f"{family}-{order}"
                yield family, order, lambda name=name, case=case: counted(name, case)

    monkeypatch.setattr(fits, "plan", quick)
    return names


def case_of(dorf: Dorf, rows: list[int], family: str, order: int) -> Any:
    (case,) = [case for *key, case in fits.plan(dorf, rows) if key == [family, order]]
    return case()


def without_seconds(tables: list[FitTable]) -> list[Any]:
    return [
        (
            table.family,
            table.order,
            table.rmse.tolist(),
            table.not_monotone.tolist(),
            table.out_of_range.tolist(),
        )
        for table in tables
    ]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


# Which curves


@pytest.mark.parametrize(
    ("cases", "rows"),
    [(None, list(range(12))), (12, list(range(12))), (99, list(range(12))), (1, [0]),
     (2, [0, 11]), (3, [0, 6, 11])],
)  # fmt: skip
def test_curves_are_chosen_all_over_the_data_base(
    cases: int | None, rows: list[int], dorf: Dorf
) -> None:
    assert fits.chosen_rows(dorf, cases) == rows


@pytest.mark.parametrize("cases", range(1, 13))
def test_so_many_curves_are_chosen_each_once(cases: int, dorf: Dorf) -> None:
    rows = fits.chosen_rows(dorf, cases)

    assert len(rows) == len(set(rows)) == cases
    assert rows == sorted(rows)


def test_the_plan_has_every_family_at_every_order_up_to_six(dorf: Dorf) -> None:
    planned = [(family, order) for family, order, _ in fits.plan(dorf, [0])]

    expected = {(each.family, each.order) for each in MODELS.values() if each.order <= 6}
    expected |= {(family, order) for family in LEFT_OUT for order in range(7)}
    assert set(planned) == expected | {("table", 30)}
    assert len(planned) == len(set(planned))


# Results


@pytest.mark.slow
def test_results_are_those_of_fit(dorf: Dorf, finished: tuple[Path, list[FitTable]]) -> None:
    rows = [0, 6, 11]
    for table in finished[1]:
        name = next(
            (each.name for each in MODELS.values()
             if (each.family, each.order) == (table.family, table.order)), None,
        )  # fmt: skip
        if name is None or table.order not in {0, 2}:
            continue
        found = [fit(name, dorf.irradiance, dorf.curves[row]) for row in rows]
        assert table.rmse == pytest.approx([each.rmse for each in found], rel=1e-3, abs=1e-8)
        assert table.not_monotone.tolist() == [not each.increases for each in found]


@pytest.mark.slow
def test_families_that_promise_it_stay_increasing_and_inside(
    finished: tuple[Path, list[FitTable]],
) -> None:
    for table in finished[1]:
        assert table.rmse.shape == table.not_monotone.shape == table.out_of_range.shape == (3,)
        assert np.all(np.isfinite(table.rmse))
        if table.family in {"gamma", "ameegc-exact", "meegc", "gumbel", "table", "emor-monotone",
                            "emor-monotone-left-out"}:  # fmt: skip
            assert not table.not_monotone.any(), table.family
            assert not table.out_of_range.any(), table.family


@pytest.mark.slow
def test_each_order_of_an_extensible_family_comes_nearer(
    finished: tuple[Path, list[FitTable]],
) -> None:
    by_family: dict[str, list[FitTable]] = {}
    for table in finished[1]:
        by_family.setdefault(table.family, []).append(table)
    for family in ("eegc", "meegc", "gumbel", "poly", "conpoly", "emor", "emor-left-out",
                   "emor-monotone-left-out"):  # fmt: skip
        orders = by_family[family]
        assert [table.order for table in orders] == list(range(7))
        for below, above in pairwise(orders):
            assert np.all(above.rmse <= below.rmse + 1e-9), (family, above.order)


def test_the_summary_of_a_table_is_that_of_its_curves() -> None:
    rmse = np.array([0.1, 0.4, 0.2, 0.3, 0.5])
    decreases, leaves = np.array([1, 0, 0, 1, 0]) > 0, np.array([0, 0, 0, 0, 1]) > 0

    summary = FitTable("any", 2, rmse, decreases, leaves, 1.23456).summary

    assert summary == {
        "median": pytest.approx(0.3),
        "q25": pytest.approx(0.2),
        "q75": pytest.approx(0.4),
        "mean": pytest.approx(0.3),
        "max": 0.5,
        "not_monotone": 2,
        "out_of_range": 1,
        "seconds": 1.235,
    }
    assert json.loads(json.dumps(summary))["not_monotone"] == 2


@pytest.mark.slow
def test_the_best_family_of_each_number_of_parameters_comes_first(
    finished: tuple[Path, list[FitTable]],
) -> None:
    ranked = fits.winners(finished[1])

    assert len(ranked) == 7
    for order, tables in enumerate(ranked):
        assert {table.order for table in tables} == {order}
        medians = [np.median(table.rmse) for table in tables]
        assert medians == sorted(medians)
    assert sum(map(len, ranked)) == len(finished[1]) - 1  # the table has an order of its own


# Files


@pytest.mark.slow
def test_every_fit_is_a_row(dorf: Dorf, finished: tuple[Path, list[FitTable]]) -> None:
    folder, tables = finished
    rows = rows_of(folder / "fits.csv")

    assert len(rows) == 3 * len(tables)
    expected = [(table, place) for table in tables for place in range(3)]
    for row, (table, place) in zip(rows, expected, strict=True):
        number = (0, 6, 11)[place]
        assert (row["family"], int(row["order"])) == (table.family, table.order)
        assert int(row["row"]) == number
        assert row["name"] == dorf.names[number]
        assert row["kind"] == "film"
        assert row["camera"] == dorf.cameras[number]
        assert row["equals_row"] == ""
        assert float(row["rmse"]) == pytest.approx(table.rmse[place], abs=6e-9)
        assert int(row["not_monotone"]) == table.not_monotone[place]
        assert int(row["out_of_range"]) == table.out_of_range[place]


@pytest.mark.usefixtures("ran")
def test_a_copy_is_marked(dorf: Dorf, tmp_path: Path) -> None:
    curves = dorf.curves.copy()
    curves[7] = curves[11] = curves[2]

    fits.run(replace(dorf, curves=curves), tmp_path)

    equal = {int(row["row"]): row["equals_row"] for row in rows_of(tmp_path / "fits.csv")}
    assert {row: first for row, first in equal.items() if first} == {7: "2", 11: "2"}


@pytest.mark.slow
def test_the_winners_are_ranked(finished: tuple[Path, list[FitTable]]) -> None:
    folder, tables = finished
    rows = rows_of(folder / "winners.csv")

    expected = [
        (table.order + 1, place, table.family)
        for ranked in fits.winners(tables)
        for place, table in enumerate(ranked, start=1)
    ]
    got = [(int(row["parameters"]), int(row["place"]), row["family"]) for row in rows]
    assert got == expected
    for before, after in pairwise(rows):
        if before["parameters"] == after["parameters"]:
            assert float(before["median_rmse"]) <= float(after["median_rmse"])


@pytest.mark.slow
def test_figures_are_drawn(dorf: Dorf, finished: tuple[Path, list[FitTable]]) -> None:
    _, tables = finished
    figures = {
        "1.png": fits_figures.curves_figure(dorf),
        "2.png": fits_figures.boxes_figure(tables),
        "3.png": fits_figures.medians_figure(tables),
        "4.png": fits_figures.examples_figure(dorf, tables, [0, 6, 11]),
    }

    assert "12 measured responses, 12 of them distinct" in figures["1.png"].axes[0].get_title()
    panels = [axes.get_title() for axes in figures["2.png"].axes]
    assert "emor, camera left out" in panels
    assert len(panels) == len(set(panels)) == 12
    exact = next(table for table in tables if table.family == "ameegc-exact")
    chosen = [(0, 6, 11)[place] for place in np.argsort(exact.rmse)]
    titles = [axes.get_title() for axes in figures["4.png"].axes if axes.get_title()]
    words = ("good", "middling", "bad")
    assert titles == [f"{word}: {dorf.names[row]}" for word, row in zip(words, chosen, strict=True)]


# Interruption


@pytest.mark.parametrize("stop_after", slow_but([0, 1, 5], 1))
def test_an_interrupted_run_goes_on_where_it_stopped(
    stop_after: int, dorf: Dorf, ran: list[str], tmp_path: Path
) -> None:
    expected = fits.run(dorf, tmp_path / "whole", cases=3)
    everything = [*ran]
    ran.clear()

    def stop(done: int, total: int) -> None:
        assert total == len(everything)
        if done == stop_after:
            raise KeyboardInterrupt

    folder = tmp_path / "interrupted"
    with pytest.raises(KeyboardInterrupt):
        fits.run(dorf, folder, cases=3, on_case=stop)
    assert ran == everything[:stop_after]
    assert not (folder / "fits.csv").exists()
    ran.clear()

    tables = fits.run(dorf, folder, cases=3)

    assert ran == everything[stop_after:]
    assert without_seconds(tables) == without_seconds(expected)
    for name in ("fits.csv", "winners.csv"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_finished_run_is_not_done_again(dorf: Dorf, ran: list[str], tmp_path: Path) -> None:
    first = fits.run(dorf, tmp_path, cases=3)
    before = (tmp_path / "fits.csv").read_bytes()
    ran.clear()
    (tmp_path / "fits.csv").unlink()

    again = fits.run(dorf, tmp_path, cases=3)

    assert ran == []
    assert without_seconds(again) == without_seconds(first)
    assert [table.seconds for table in again] == [table.seconds for table in first]
    assert (tmp_path / "fits.csv").read_bytes() == before


def test_a_damaged_record_is_done_again(dorf: Dorf, ran: list[str], tmp_path: Path) -> None:
    expected = fits.run(dorf, tmp_path, cases=3)
    ran.clear()
    record = tmp_path / "cases" / "emor-1.json"
    record.write_bytes(record.read_bytes()[:40])

    tables = fits.run(dorf, tmp_path, cases=3)

    assert ran == ["emor-1"]
    assert without_seconds(tables) == without_seconds(expected)


@pytest.mark.slow
@pytest.mark.parametrize("change", ["cases", "curves", "cameras"])
def test_records_of_other_data_are_done_again(
    change: str, dorf: Dorf, ran: list[str], tmp_path: Path
) -> None:
    fits.run(dorf, tmp_path, cases=3)
    everything = [*ran]
    ran.clear()
    changed = {
        "cases": dorf,
        "curves": replace(dorf, curves=dorf.curves**1.000001),
        "cameras": replace(dorf, names=("Other-5Red", *dorf.names[1:])),
    }[change]

    tables = fits.run(changed, tmp_path, cases=2 if change == "cases" else 3)

    assert ran == everything
    assert all(len(table.rmse) == (2 if change == "cases" else 3) for table in tables)


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_processes(
    dorf: Dorf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = fits.plan
    monkeypatch.setattr(
        fits, "plan",
        lambda *of: (each for each in plan(*of) if each[0] in {*QUICK, "gumbel"} and each[1] <= 2),
    )  # fmt: skip
    calls: list[tuple[int, int]] = []

    one = fits.run(dorf, tmp_path / "one", cases=4)
    two = fits.run(
        dorf, tmp_path / "two", cases=4, jobs=2, on_case=lambda *call: calls.append(call)
    )

    assert without_seconds(one) == without_seconds(two)
    assert calls == [(done, len(one)) for done in range(len(one) + 1)]
    for name in ("fits.csv", "winners.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_folder_that_cannot_be_made(dorf: Dorf, ran: list[str], tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="create it first"):
        fits.run(dorf, tmp_path / "missing" / "out", cases=2)

    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="is a file: choose another output folder"):
        fits.run(dorf, tmp_path / "file", cases=2)

    assert ran == []


# The camera under test left out


@pytest.mark.parametrize("order", [0, 2, 5])
def test_the_basis_is_made_from_the_other_cameras(order: int, dorf: Dorf) -> None:
    rows = [1, 5, 6]

    found = case_of(dorf, rows, "emor-left-out", order)["rmse"]

    for row, rmse in zip(rows, found, strict=True):
        camera = slice(row // 3 * 3, row // 3 * 3 + 3)
        others = np.delete(dorf.curves, camera, axis=0)
        mean = others.mean(axis=0)
        components = np.linalg.svd(others - mean)[2][: order + 1]
        rest = dorf.curves[row] - mean
        rest -= rest @ components.T @ components
        assert rmse == pytest.approx(np.sqrt(np.mean(rest**2)), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("family", LEFT_OUT)
@pytest.mark.parametrize("seed", range(3))
def test_no_curve_of_the_same_camera_has_a_say(family: str, seed: int, dorf: Dorf) -> None:
    rng = np.random.default_rng(seed)
    row = int(rng.integers(12))
    own = [each for each in range(row // 3 * 3, row // 3 * 3 + 3) if each != row]
    before = case_of(dorf, [row], family, 2)

    curves = dorf.curves.copy()
    curves[own] = dorf.irradiance ** rng.uniform(0.1, 5, size=(2, 1))
    same_camera = case_of(replace(dorf, curves=curves), [row], family, 2)
    curves = dorf.curves.copy()
    curves[(row + 3) % 12] = dorf.irradiance**3
    other_camera = case_of(replace(dorf, curves=curves), [row], family, 2)

    assert same_camera["rmse"] == pytest.approx(before["rmse"], rel=1e-9)
    assert other_camera["rmse"] != pytest.approx(before["rmse"], rel=1e-3)


@pytest.mark.parametrize("family", LEFT_OUT)
def test_each_curve_gets_its_own_result_whatever_the_order_of_cameras(family: str) -> None:
    """The curves of a camera need not be neighbours."""
    dorf = made_up(tuple(f"Film-{n}{c}" for c in ("Red", "Green", "Blue") for n in range(3)))
    rows = list(range(9))

    together = case_of(dorf, rows, family, 1)

    apart = [case_of(dorf, [row], family, 1) for row in rows]
    for what in ("rmse", "not_monotone", "out_of_range"):
        assert together[what] == pytest.approx([each[what][0] for each in apart], rel=1e-6)
    assert len(set(together["rmse"])) == 9


def test_a_basis_made_without_the_camera_is_not_the_one_of_the_package(dorf: Dorf) -> None:
    left_out = case_of(dorf, [0, 4], "emor-left-out", 2)["rmse"]

    assert left_out != pytest.approx(case_of(dorf, [0, 4], "emor", 2)["rmse"], rel=1e-3)


# The measured cameras


@pytest.mark.slow
def test_the_measured_cameras_are_described_as_the_paper_found(
    data_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Median, mean and curves that decrease, over 201 curves: section 9 of the design."""
    expected = {
        ("ameegc", 1): (0.00935, 0.00970, 0),
        ("ameegc-exact", 2): (0.00395, 0.00509, 0),
        ("emor", 0): (0.02865, 0.03561, 30),
        ("emor", 2): (0.00377, 0.00566, 59),
        ("emor", 4): (0.00120, 0.00230, 76),
        ("poly", 2): (0.0266, None, None),
        ("conpoly", 2): (0.0145, None, None),
    }
    plan = fits.plan
    monkeypatch.setattr(
        fits, "plan", lambda *of: (each for each in plan(*of) if each[:2] in expected)
    )

    tables = fits.run(load_dorf(data_path / "dorf"), tmp_path)

    assert len(tables) == len(expected)
    for table in tables:
        median, mean, decrease = expected[table.family, table.order]
        assert table.summary["median"] == pytest.approx(median, rel=0.01)
        if mean is not None:
            assert table.summary["mean"] == pytest.approx(mean, rel=0.01)
        if decrease is not None:
            assert table.summary["not_monotone"] == pytest.approx(decrease, abs=2)


@pytest.mark.slow
def test_a_left_out_basis_is_no_better_on_measured_cameras(
    data_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = fits.plan
    wanted = {("emor", 2), ("emor-left-out", 2)}
    monkeypatch.setattr(
        fits, "plan", lambda *of: (each for each in plan(*of) if each[:2] in wanted)
    )

    full, left_out = fits.run(load_dorf(data_path / "dorf"), tmp_path, cases=20)

    assert np.mean(left_out.rmse) > np.mean(full.rmse)
    assert np.all(left_out.rmse > full.rmse * 0.7)
