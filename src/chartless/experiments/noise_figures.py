"""Figures of the experiment `chartless.experiments.noise`, numbered as in the paper."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from chartless.experiments.noise import (
    INFEASIBLE,
    LEAST_SIZE,
    LEFT_OUT,
    MODEL_NAMES,
    OBJECTIVES,
    CaseResult,
    Outcome,
)
from chartless.experiments.noise_sweeps import FACTORS, Camera, SweepPoint
from chartless.images import read_values
from chartless.plotting import BLUE, DARK, GREEN, ORANGE, VERMILION
from chartless.types import Floats

_WIDTH = 8.5  # inches; letters of 10 points are 8 points high in print, 17 cm wide
_LINES = {
    "ameegc2": (BLUE, "-"),
    "ameegc2-exact": (GREEN, "--"),
    "emor2": (ORANGE, "-"),
    "emor4": (VERMILION, "-"),
}
_THUMBNAIL = 4  # every so many pixels
_BINS = np.geomspace(1e-3, 10**0.5, 36)
_TITLES = {"ism-bin": "levels integrated over their bins", "ism-sampled": "sampled at the levels"}


def scenes_figure(files: list[Path]) -> Figure:
    """Fig. 4: the photographs taken for scenes."""
    columns = 5
    rows = -(-len(files) // columns)
    figure = Figure(figsize=(_WIDTH, 1.02 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    for axes in panels.flat:
        axes.set_axis_off()
    for axes, path in zip(panels.flat, files, strict=False):
        axes.imshow(read_values(path).values[::_THUMBNAIL, ::_THUMBNAIL].clip(0, 1))
    return figure


def search_figure(results: list[CaseResult]) -> Figure:
    """Fig. 5, upper part: the cost by round and how often a curve is infeasible."""
    figure = Figure(figsize=(_WIDTH, 6.4), layout="constrained")
    panels = figure.subplots(2, 2, height_ratios=(4, 3))
    for (cost, count), objective in zip(panels.T, OBJECTIVES, strict=True):
        binned = objective == "ism-bin"
        if binned:
            _set_log(cost)
        for model, (colour, style) in _LINES.items():
            values = np.array(
                [each.values for each in outcomes_of(f"{objective}/{model}", results)]
            )
            _draw_cost(cost, 1 - values if binned else -values, colour, style, model)
        _draw_infeasible(count, objective, results)
        cost.set(
            title=_TITLES[objective],
            xlabel="round",
            ylabel="cost: 1 − similarity" if binned else "cost: −similarity",
        )
        cost.xaxis.get_major_locator().set_params(integer=True)
        cost.grid(visible=True, axis="y", color="0.92")
    panels[0, 0].legend(frameon=False, title="median; thin: 20 and 80 %")
    panels[1, 1].tick_params(labelleft=False)
    return figure


def errors_figure(results: list[CaseResult]) -> Figure:
    """Fig. 5, lower part: histograms of the RMSE."""
    figure = Figure(figsize=(_WIDTH, 4.6), layout="constrained")
    panels = figure.subplots(2, len(_LINES), sharex=True, sharey=True)
    for row, objective in zip(panels, OBJECTIVES, strict=True):
        for axes, (model, (colour, _)) in zip(row, _LINES.items(), strict=True):
            median = _draw_errors(axes, f"{objective}/{model}", results, color=colour)
            if model + LEFT_OUT in MODEL_NAMES:
                outline = {"histtype": "step", "color": DARK, "label": "camera\nleft out"}
                _draw_errors(axes, f"{objective}/{model}{LEFT_OUT}", results, **outline)
            axes.axvline(median, ymax=0.84, color="k", linewidth=1, linestyle="--")
            axes.text(0.04, 0.95, f"median {median:.3f}", transform=axes.transAxes, va="top")
        row[0].set_ylabel(f"{_TITLES[objective]}\n\ncases of {len(results)}", fontsize="small")
    for axes, model in zip(panels[0], _LINES, strict=True):
        axes.set_title(model)
    for axes in panels[-1]:
        axes.set_xlabel("RMSE in brightness")
    panels[0, -1].legend(frameon=False, fontsize="small", loc=(0.52, 0.64), handlelength=1)
    panels[0, 0].set(xscale="log", ylim=(0, 1.35 * panels[0, 0].get_ylim()[1]))
    return figure


def outcomes_of(method: str, results: list[CaseResult]) -> list[Outcome]:
    """Outcomes of one method over all cases."""
    return [result.outcomes[method] for result in results]


def _draw_cost(axes: Axes, cost: Floats, colour: str, style: str, label: str) -> None:
    low, middle, high = np.quantile(cost, (0.2, 0.5, 0.8), axis=0)
    axes.plot(middle, style, color=colour, linewidth=2, label=label)
    for edge in (low, high):
        axes.plot(edge, style, color=colour, linewidth=0.8)


def _set_log(axes: Axes) -> None:
    """Logarithmic ordinate with plain numbers: 0.02, 0.05, 0.1."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _draw_infeasible(axes: Axes, objective: str, results: list[CaseResult]) -> None:
    counts = [
        sum(each.infeasible for each in outcomes_of(f"{objective}/{model}", results))
        for model in MODEL_NAMES
    ]
    names = [model.replace(LEFT_OUT, ",\ncamera left out") for model in MODEL_NAMES]
    colours = [_LINES[model.removesuffix(LEFT_OUT)][0] for model in MODEL_NAMES]
    bars = axes.barh(names, counts, color=colours)
    axes.bar_label(bars, padding=3)
    axes.tick_params(axis="y", labelsize="small")
    axes.set(
        xlabel=f"infeasible of {len(results)}: total variation above {INFEASIBLE:g}",
        xlim=(0, 1.1 * len(results)),
    )
    axes.invert_yaxis()


def _draw_errors(axes: Axes, method: str, results: list[CaseResult], **style: str) -> float:
    """Histogram of a method's RMSE, what lies beyond the bins in the last; its median."""
    rmse = np.array([each.rmse for each in outcomes_of(method, results)])
    axes.hist(rmse.clip(_BINS[0], _BINS[-1]), bins=_BINS.tolist(), **style)  # type: ignore[arg-type]
    return float(np.median(rmse))


def sweeps_figure(points: list[SweepPoint]) -> Figure:
    """Error against each property of the frames, with the bound of the same pairs dashed."""
    figure = Figure(figsize=(_WIDTH, 5.6), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True)
    for axes, (factor, (label, values)) in zip(panels.flat, FACTORS.items(), strict=True):
        own = [point for point in points if point.factor == factor]
        places = np.arange(len(values))
        rmse = np.array([point.rmse for point in own])  # (values, cases)
        lines = axes.plot(places, rmse, color=GREEN, linewidth=0.8, alpha=0.5)
        lines[0].set_label("each case")
        axes.plot(places, np.median(rmse, axis=1), "o-", color=GREEN, linewidth=2, label="median")
        bounds = [float(np.median(point.bound)) for point in own]
        axes.plot(places, bounds, "--", color=DARK, label="Cramér–Rao bound, median")
        axes.set(
            xlabel=label, yscale="log", xticks=places,
            xticklabels=[_tick(factor, value) for value in values],
        )  # fmt: skip
        axes.grid(visible=True, axis="y", color="0.92")
    for axes in panels[:, 0]:
        axes.set_ylabel("RMSE in brightness")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    n_cases, reference = len(points[0].rmse), Camera()
    figure.suptitle(
        f"ism-bin/ameegc2-exact, {n_cases} cases; one factor at a time, "
        f"the others being {reference.frames} frames,\n"
        f"{LEAST_SIZE[1]} × {LEAST_SIZE[0]}, U = {reference.slope_8bit:g}, "
        f"V = {reference.floor_8bit:g}, {reference.bits} bits, no JPEG",
        fontsize="medium",
    )
    return figure


def _tick(factor: str, value: float | None) -> str:
    if value is None:
        return "none"
    if factor == "stride":
        rows, columns = (-(-length // int(value)) for length in LEAST_SIZE)
        return f"{columns}\n× {rows}"
    return f"{value:g}"
