"""``chartless reproduce``: the experiments of the paper."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chartless.cli._options import AsJson, Jobs, Scheduler
from chartless.cli._terminal import case_bar, print_json, print_table, remark

if TYPE_CHECKING:
    from chartless.datasets import DigitalCameras
    from chartless.experiments.fits import FitTable

app = typer.Typer(help="Reproduce the experiments of the paper.", no_args_is_help=True)

_WITHOUT_DIGITAL = (
    "digital cameras are left out: set CHARTLESS_DATA to a folder that holds "
    "modern_curves/responses_1024.npz (docs/reproduction.md)"
)
Output = Annotated[
    Path, typer.Option("--output", "-o", help="Folder to create, or to continue in.")
]
DorfFile = Annotated[
    Path | None, typer.Option(help="File with the DoRF curves [found or downloaded].")
]


@app.command()
def fits(
    output: Output,
    cases: Annotated[
        int | None, typer.Option(min=1, help="Number of curves to fit, spread over all [all].")
    ] = None,
    jobs: Jobs = 1,
    dorf: DorfFile = None,
    as_json: AsJson = False,
) -> None:
    """Fit every family of curves to film and digital cameras.

    Writes fits.csv (every RMSE), winners.csv, summary.json and the figures; and digital.csv, if
    CHARTLESS_DATA names a folder with modern_curves/responses_1024.npz. An interrupted
    run goes on where it stopped.

    \b
    Example:
        chartless reproduce fits -o fits --jobs 2
    """
    from chartless._files import write_text
    from chartless.datasets import find_digital, load_dorf
    from chartless.experiments import fits as experiment
    from chartless.experiments import fits_figures
    from chartless.plotting import save_figure

    data = load_dorf(dorf)
    rows = experiment.chosen_rows(data, cases)
    with case_bar("fitting") as on_case:
        tables = experiment.run(data, output, cases=cases, jobs=jobs, on_case=on_case)
    digital = [] if (cameras := find_digital()) is None else _digital_fits(cameras, output, jobs)
    figures = [
        ("fig1_responses", fits_figures.curves_figure(data)),
        ("fig2_rmse_by_order", fits_figures.boxes_figure(tables)),
        ("fig2_medians", fits_figures.medians_figure(tables)),
        ("fig3_examples", fits_figures.examples_figure(data, tables, rows)),
    ]
    if digital:
        figures.append(("digital", fits_figures.medians_figure(digital, "digital cameras")))
    for name, figure in figures:
        save_figure(figure, output / f"{name}.png")
    summary = experiment.summarize(tables)
    if digital:
        summary |= experiment.summarize(digital, "digital")
    write_text(output / "summary.json", json.dumps(summary, indent=1) + "\n")
    if cameras is None:
        remark(_WITHOUT_DIGITAL)
    if as_json:
        print_json(summary)
        return
    _print_medians(f"median RMSE over {len(rows)} curves of DoRF", tables)
    if cameras is not None:
        _print_medians(f"\nmedian RMSE over {len(cameras.names)} digital cameras", digital)
    print(f"\nfigures, tables and summary.json in {output}")


def _digital_fits(cameras: "DigitalCameras", output: Path, jobs: int) -> "list[FitTable]":
    from chartless.experiments.fits import run_digital

    with case_bar("fitting digital cameras") as on_case:
        return run_digital(cameras, output, jobs=jobs, on_case=on_case)


def _print_medians(title: str, tables: "list[FitTable]") -> None:
    from chartless.experiments.fits import ORDERS

    lines: dict[str, list[str]] = {}
    for table in tables:
        line = lines.setdefault(table.family, [""] * len(ORDERS))
        if table.order in ORDERS:
            line[table.order] = f"{table.summary['median']:.5f}"
    print(title)
    header = ["family", *(f"order {order}" for order in ORDERS)]
    print_table(header, [[family, *line] for family, line in lines.items() if any(line)])


@app.command()
def noise(
    output: Output,
    cases: Annotated[int, typer.Option(min=1, help="Simulated cameras.")] = 200,
    jobs: Jobs = 1,
    sweeps: Annotated[
        int,
        typer.Option(min=0, help="Cases for each point of the dependence on the frames; 0: none."),
    ] = 4,
    scenes: Annotated[
        Path | None,
        typer.Option(
            help="Folder of RGB photographs, 1600 × 900 pixels or more [scenery_1600x900 in the "
            "folder that CHARTLESS_DATA names]."
        ),
    ] = None,
    dorf: DorfFile = None,
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal cases.")] = 0,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Calibrate simulated cameras by their noise, with every method.

    Writes cases.csv, summary.json, timing.json and the figures; and digital.csv, if CHARTLESS_DATA
    names a folder with modern_curves/responses_1024.npz. Each finished case is
    recorded at once: an interrupted run goes on where it stopped.

    \b
    Example:
        chartless reproduce noise -o noise --scenes photographs --cases 20 --jobs 2
    """
    from chartless._files import write_text
    from chartless.datasets import find_digital, load_dorf
    from chartless.experiments import noise as experiment
    from chartless.experiments import noise_digital, noise_figures, noise_sweeps
    from chartless.plotting import save_figure

    folder = experiment.default_scenes() if scenes is None else scenes
    data = load_dorf(dorf)
    with case_bar("calibrating") as on_case:
        results = experiment.run(
            data, folder, output, n_cases=cases, seed=seed, jobs=jobs, scheduler=scheduler,
            on_case=on_case,
        )  # fmt: skip
    cameras = find_digital()
    with case_bar("calibrating digital cameras") as on_case:
        digital = [] if cameras is None else noise_digital.run(
            cameras, data, folder, output, n_cases=cases, seed=seed, jobs=jobs,
            scheduler=scheduler, on_case=on_case,
        )  # fmt: skip
    with case_bar("varying the frames") as on_case:
        points = [] if sweeps == 0 else noise_sweeps.run(
            data, folder, output, n_cases=sweeps, seed=seed, jobs=jobs, scheduler=scheduler,
            on_case=on_case,
        )  # fmt: skip
    figures = [
        ("fig4_scenes", noise_figures.scenes_figure(experiment.scene_files(folder))),
        ("fig5_search", noise_figures.search_figure(results)),
        ("fig5_errors", noise_figures.errors_figure(results)),
        ("likelihood", noise_figures.likelihood_figure(results)),
    ]
    summary = experiment.summarize(results)
    if digital:
        summary |= noise_digital.summarize(digital)
    else:
        remark(_WITHOUT_DIGITAL)
    if points:
        figures.append(("dependence", noise_figures.sweeps_figure(points)))
        summary |= noise_sweeps.summarize(points)
    for name, figure in figures:
        save_figure(figure, output / f"{name}.png")
    write_text(output / "summary.json", json.dumps(summary, indent=1) + "\n")
    timing = experiment.timing(results)
    write_text(output / "timing.json", json.dumps(timing, indent=1) + "\n")
    if as_json:
        print_json(summary)
        return
    print(f"RMSE of the response over {cases} cases of DoRF")
    rows = [
        [
            method,
            *(f"{numbers[what]:.4f}" for what in ("median", "mean", "p90")),
            str(numbers["infeasible"]),
            "-" if numbers["evaluations"] is None else f"{numbers['evaluations']:.0f}",
            f"{timing['seconds'][method]:.2f}",
        ]
        for method, numbers in summary["noise"].items()
    ]
    print_table(["method", "median", "mean", "p90", "infeasible", "evaluations", "seconds"], rows)
    if digital:
        print(f"\nRMSE over {cases} cases of digital cameras, and levels within two deviations")
        rows = [
            [method, *(f"{numbers[what]:.4f}" for what in ("median", "mean", "p90", "within_2"))]
            for method, numbers in summary["digital"].items()
        ]
        print_table(["method", "median", "mean", "p90", "within"], rows)
    print(f"\nfigures, tables and summary.json in {output}")
