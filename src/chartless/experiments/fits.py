"""How compactly does each family describe measured cameras? Sections III and IV of the paper.

Every family at every order is fitted to every curve of the Database of Response Functions,
and to responses of digital cameras where there are any.
EMoR appears a second time as ``emor-left-out``, and so do its monotone and logarithmic forms: a
basis made from the curves that it is tested on flatters itself, so there the basis of each fit
is made without the camera under test.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from chartless._files import make_folder, write_csv
from chartless._version import __version__
from chartless.curves.comparison import stays_inside
from chartless.curves.fitting import Fit, fit_many
from chartless.datasets import DigitalCameras, Dorf
from chartless.experiments._cases import Case, OnCase, fingerprint_of, run_cases
from chartless.models import (
    MODELS,
    UNIFORM_IRRADIANCE,
    AbstractModel,
    Basis,
    Emor,
    EmorMonotone,
    LogEmor,
    principal_basis,
)
from chartless.types import Bools, Floats, JsonObject

ORDERS = range(7)
"""The paper compares orders 0 to 6."""
LEFT_OUT = "-left-out"
"""Ends the names of families whose basis is made without the camera under test."""
_LEFT_OUT_MODELS: dict[str, Callable[[int, Basis], AbstractModel]] = {
    "emor": Emor,
    "emor-monotone": EmorMonotone,
    "logemor": LogEmor,
}


@dataclass(frozen=True, slots=True, eq=False)
class FitTable:
    """One family at one order, fitted to B curves."""

    family: str
    """Name of the family without the order."""
    order: int
    rmse: Floats
    """Shape (B,)."""
    not_monotone: Bools
    """Fitted curve (for a family that describes g, fitted inverse) decreases, shape (B,)."""
    out_of_range: Bools
    """Fitted curve leaves [0, 1], shape (B,)."""
    seconds: float
    """Seconds for all curves, lower orders included where a fit starts from theirs."""

    @property
    def summary(self) -> JsonObject:
        """Statistics over the curves."""
        low, middle, high = np.quantile(self.rmse, (0.25, 0.5, 0.75)).tolist()
        return {
            "median": middle,
            "q25": low,
            "q75": high,
            "mean": float(self.rmse.mean()),
            "max": float(self.rmse.max()),
            "not_monotone": int(self.not_monotone.sum()),
            "out_of_range": int(self.out_of_range.sum()),
            "seconds": round(self.seconds, 3),
        }


def run(
    dorf: Dorf, output: Path, *, cases: int | None = None, jobs: int = 1,
    on_case: OnCase | None = None,
) -> list[FitTable]:  # fmt: skip
    """Fit all families to the measured curves and write tables.

    Parameters
    ----------
    dorf : Dorf
    output : Path
        Folder for fits.csv, winners.csv and the records of finished cases; made if missing.
    cases : int, optional
        Fit only so many curves, spread over the data base. Bases are made from all.
    jobs : int
        Processes.
    on_case : OnCase, optional

    Returns
    -------
    list of FitTable
        In the order of `plan`.
    """
    make_folder(output)
    rows = chosen_rows(dorf, cases)
    named = list(plan(dorf, rows))
    fingerprint = fingerprint_of(dorf.irradiance, dorf.curves, dorf.cameras, rows, __version__)
    results = run_cases(
        {f"{family}-{order}": case for family, order, case in named},
        output / "cases",
        fingerprint=fingerprint,
        jobs=jobs,
        on_case=on_case,
    )
    tables = [_table(family, order, results[f"{family}-{order}"]) for family, order, _ in named]
    _write_fits(output / "fits.csv", dorf, rows, tables)
    _write_winners(output / "winners.csv", tables)
    return tables


def run_digital(
    cameras: DigitalCameras, output: Path, *, jobs: int = 1, on_case: OnCase | None = None
) -> list[FitTable]:
    """Fit all families to digital cameras and write digital.csv.

    Families that are made of DoRF's principal components know none of these cameras.

    Parameters
    ----------
    cameras : DigitalCameras
    output, jobs, on_case
        As for `run`.
    """
    make_folder(output)
    named = {
        f"digital-{family}-{order}": (family, order, case)
        for family, order, case in _of_all(cameras.irradiance, cameras.curves)
    }
    results = run_cases(
        {name: case for name, (_, _, case) in named.items()},
        output / "cases",
        fingerprint=fingerprint_of(cameras.irradiance, cameras.curves, __version__),
        jobs=jobs,
        on_case=on_case,
    )
    tables = [_table(family, order, results[name]) for name, (family, order, _) in named.items()]
    write_csv(
        output / "digital.csv",
        ("family", "order", "camera", "rmse", "not_monotone", "out_of_range"),
        (
            (
                table.family,
                table.order,
                name,
                f"{table.rmse[place]:.8f}",
                int(table.not_monotone[place]),
                int(table.out_of_range[place]),
            )
            for table in tables
            for place, name in enumerate(cameras.names)
        ),
    )
    return tables


def chosen_rows(dorf: Dorf, cases: int | None) -> list[int]:
    """All rows of the data base, or so many, spread evenly."""
    n_curves = len(dorf.curves)
    wanted = n_curves if cases is None else min(cases, n_curves)
    rows: list[int] = np.linspace(0, n_curves - 1, wanted).round().astype(int).tolist()
    return rows


def plan(dorf: Dorf, rows: list[int]) -> Iterator[tuple[str, int, Case]]:
    """Family, order and case of everything that is fitted."""
    yield from _of_all(dorf.irradiance, dorf.curves[rows])
    for family in _LEFT_OUT_MODELS:
        for order in ORDERS:
            yield family + LEFT_OUT, order, partial(_fit_left_out, family, order, dorf, rows)


def _of_all(irradiance: Floats, curves: Floats) -> Iterator[tuple[str, int, Case]]:
    for model in MODELS.values():
        if model.order in ORDERS or model.name == "table":
            yield model.family, model.order, partial(_fit_all, model.name, irradiance, curves)


def summarize(tables: list[FitTable], name: str = "fits") -> JsonObject:
    """Statistics by family and order, under a name."""
    fits: JsonObject = {}
    for table in tables:
        fits.setdefault(table.family, {})[str(table.order)] = table.summary
    return {name: fits}


def winners(tables: list[FitTable]) -> list[list[FitTable]]:
    """Tables of each order, lowest median first."""
    return [
        sorted(
            (table for table in tables if table.order == order),
            key=lambda table: float(np.median(table.rmse)),
        )
        for order in ORDERS
    ]


def _fit_all(name: str, irradiance: Floats, curves: Floats) -> JsonObject:
    begun = time.perf_counter()
    fits = fit_many(name, irradiance, curves)
    return _result(fits, time.perf_counter() - begun)


def _fit_left_out(family: str, order: int, dorf: Dorf, rows: list[int]) -> JsonObject:
    begun = time.perf_counter()
    fits: dict[int, Fit] = {}
    cameras = dorf.cameras
    samples = np.log(dorf.curves[:, 1:]) if family == "logemor" else dorf.curves
    for one_of_camera in {cameras[row]: row for row in rows}.values():
        remaining = dorf.left_out(one_of_camera)
        model = _LEFT_OUT_MODELS[family](order, principal_basis(samples[remaining]))
        own = [row for row in rows if not remaining[row]]
        found = fit_many(model, dorf.irradiance, dorf.curves[own])
        fits.update(zip(own, found, strict=True))
    return _result([fits[row] for row in rows], time.perf_counter() - begun)


def _result(fits: list[Fit], seconds: float) -> JsonObject:
    return {
        "rmse": [fit.rmse for fit in fits],
        "not_monotone": [not fit.increases for fit in fits],
        "out_of_range": [not stays_inside(fit.response(UNIFORM_IRRADIANCE)) for fit in fits],
        "seconds": seconds,
    }


def _table(family: str, order: int, result: JsonObject) -> FitTable:
    return FitTable(
        family,
        order,
        np.array(result["rmse"]),
        np.array(result["not_monotone"]),
        np.array(result["out_of_range"]),
        result["seconds"],
    )


def _write_fits(path: Path, dorf: Dorf, rows: list[int], tables: list[FitTable]) -> None:
    kinds, cameras = dorf.kinds, dorf.cameras
    first_equal = {row: group[0] for group in dorf.duplicates for row in group[1:]}
    header = (
        "family", "order", "row", "name", "kind", "camera", "equals_row",
        "rmse", "not_monotone", "out_of_range",
    )  # fmt: skip
    write_csv(
        path,
        header,
        (
            (
                table.family,
                table.order,
                row,
                dorf.names[row],
                kinds[row],
                cameras[row],
                first_equal.get(row, ""),
                f"{table.rmse[place]:.8f}",
                int(table.not_monotone[place]),
                int(table.out_of_range[place]),
            )
            for table in tables
            for place, row in enumerate(rows)
        ),
    )


def _write_winners(path: Path, tables: list[FitTable]) -> None:
    write_csv(
        path,
        ("parameters", "place", "family", "median_rmse", "not_monotone"),
        (
            (
                order + 1,
                place,
                table.family,
                f"{np.median(table.rmse):.6f}",
                int(table.not_monotone.sum()),
            )
            for order, ranked in zip(ORDERS, winners(tables), strict=True)
            for place, table in enumerate(ranked, start=1)
        ),
    )
