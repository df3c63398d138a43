"""Figures of the experiment `chartless.experiments.noise`, numbered as in the paper."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless.experiments.noise import (
    LEAST_SIZE,
    LEFT_OUT,
    MODEL_NAMES,
    OBJECTIVES,
    CaseResult,
    Outcome,
)
from chartless.experiments.noise_sweeps import FACTORS, SweepPoint
from chartless.images import read_values
from chartless.plotting import BLUE, GREEN, ORANGE, VERMILION
from chartless.types import Floats

_COLOURS = {"ameegc2": BLUE, "ameegc2-exact": GREEN, "emor2": ORANGE, "emor4": VERMILION}
_THUMBNAIL = 8  # every so many pixels
_BINS = np.geomspace(1e-3, 1.0, 31)
_TITLES = {"ism-bin": "levels integrated over their bins", "ism-sampled": "sampled at the levels"}


def scenes_figure(files: list[Path]) -> Figure:
    """Fig. 4: the photographs taken for scenes."""
    columns = 5
    rows = -(-len(files) // columns)
    figure = Figure(figsize=(11, 1.35 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    for axes in panels.flat:
        axes.set_axis_off()
    for axes, path in zip(panels.flat, files, strict=False):
        axes.imshow(read_values(path).values[::_THUMBNAIL, ::_THUMBNAIL].clip(0, 1))
    return figure


def search_figure(results: list[CaseResult]) -> Figure:
    """Fig. 5, upper part: the cost by round and how often a curve is infeasible."""
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    panels = figure.subplots(2, 2)
    for (cost, count), objective in zip(panels.T, OBJECTIVES, strict=True):
        for model, colour in _COLOURS.items():
            outcomes = outcomes_of(f"{objective}/{model}", results)
            values = np.array([outcome.values for outcome in outcomes])
            _draw_cost(cost, 1 - values if objective == "ism-bin" else -values, colour, model)
        _draw_infeasible(count, objective, results)
        cost.set(
            title=_TITLES[objective],
            xlabel="round",
            ylabel="1 − image similarity" if objective == "ism-bin" else "−image similarity",
            yscale="log" if objective == "ism-bin" else "linear",
        )
    panels[0, 0].legend(frameon=False, title="median, 20 to 80 % shaded")
    return figure


def errors_figure(results: list[CaseResult]) -> Figure:
    """Fig. 5, lower part: histograms of the RMSE."""
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    panels = figure.subplots(2, 4, sharex=True, sharey=True)
    for row, objective in zip(panels, OBJECTIVES, strict=True):
        for axes, (model, colour) in zip(row, _COLOURS.items(), strict=True):
            rmse = [each.rmse for each in outcomes_of(f"{objective}/{model}", results)]
            axes.hist(rmse, bins=_BINS.tolist(), color=colour)
            median = float(np.median(rmse))
            axes.axvline(median, color="k", linewidth=1, linestyle="--")
            axes.set(title=f"{objective}/{model}\nmedian {median:.3f}", xscale="log")
        row[0].set_ylabel("cases")
    for axes in panels[-1]:
        axes.set_xlabel("RMSE of the response")
    return figure


def outcomes_of(method: str, results: list[CaseResult]) -> list[Outcome]:
    """Outcomes of one method over all cases."""
    return [result.outcomes[method] for result in results]


def _draw_cost(axes: Axes, cost: Floats, colour: str, label: str) -> None:
    low, middle, high = np.quantile(cost, (0.2, 0.5, 0.8), axis=0)
    rounds = np.arange(cost.shape[1])
    axes.plot(rounds, middle, color=colour, label=label)
    axes.fill_between(rounds, low, high, color=colour, alpha=0.15, linewidth=0)


def _draw_infeasible(axes: Axes, objective: str, results: list[CaseResult]) -> None:
    counts = [
        sum(each.infeasible for each in outcomes_of(f"{objective}/{model}", results))
        for model in MODEL_NAMES
    ]
    names = [model.replace(LEFT_OUT, "\ncamera left out") for model in MODEL_NAMES]
    colours = [_COLOURS[model.removesuffix(LEFT_OUT)] for model in MODEL_NAMES]
    bars = axes.bar(names, counts, color=colours)
    axes.bar_label(bars)
    axes.set(ylabel=f"infeasible of {len(results)}", ylim=(0, len(results)))
    axes.tick_params(axis="x", labelsize=7)


def sweeps_figure(points: list[SweepPoint]) -> Figure:
    """Error against each property of the frames, with the bound of the same pairs dashed."""
    figure = Figure(figsize=(11, 6.5), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True)
    for axes, (factor, (label, values)) in zip(panels.flat, FACTORS.items(), strict=True):
        own = [point for point in points if point.factor == factor]
        places = np.arange(len(values))
        low, middle, high = np.quantile([point.rmse for point in own], (0.25, 0.5, 0.75), axis=1)
        axes.plot(places, middle, "o-", color=GREEN, label="exact AMEEGC, binned similarity")
        axes.fill_between(places, low, high, color=GREEN, alpha=0.15, linewidth=0)
        bounds = [float(np.median(point.bound)) for point in own]
        axes.plot(places, bounds, "k--", label="Cramér–Rao bound")
        axes.set(
            xlabel=label, yscale="log", xticks=places,
            xticklabels=[_tick(factor, value) for value in values],
        )  # fmt: skip
        axes.grid(visible=True, axis="y", color="0.92")
    for axes in panels[:, 0]:
        axes.set_ylabel("RMSE of the response")
    panels[0, 0].legend(frameon=False, fontsize="small")
    n_cases = len(points[0].rmse)
    figure.suptitle(f"One factor at a time, {n_cases} cases each: median, quartiles shaded")
    return figure


def _tick(factor: str, value: float | None) -> str:
    if value is None:
        return "none"
    if factor == "stride":
        rows, columns = (-(-length // int(value)) for length in LEAST_SIZE)
        return f"{columns} × {rows}"
    return f"{value:g}"
