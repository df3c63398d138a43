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
    LIKELIHOODS,
    MODEL_NAMES,
    OBJECTIVES,
    CaseResult,
    Outcome,
)
from chartless.experiments.noise_sweeps import FACTORS, METHODS, Camera, SweepPoint
from chartless.images import read_values
from chartless.plotting import BLUE, DARK, GREEN, ORANGE, PURPLE, SKY, VERMILION
from chartless.types import Floats

_WIDTH = 8.5  # inches; letters of 10 points are 8 points high in print, 17 cm wide
_LINES = {
    "ameegc2": (BLUE, "-"),
    "ameegc2-exact": (GREEN, "--"),
    "emor2": (ORANGE, "-"),
    "emor4": (VERMILION, "-"),
}
_COMPARED = {
    "ism-bin/emor4": (VERMILION, "-"),
    "ism-bin/ameegc2-exact": (GREEN, "-"),
    "likelihood/ameegc2-exact": (ORANGE, "-"),
    "nlf/default": (SKY, "-"),
    "likelihood/default": (BLUE, "-"),
    "likelihood/dark": (PURPLE, "-"),
}
_BOUNDS = {
    METHODS[0]: "Cramér–Rao bound in the family",
    METHODS[1]: "Cramér–Rao bound, any curve",
}
_NORMAL_SHARES = (0.683, 0.954)
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


def likelihood_figure(results: list[CaseResult]) -> Figure:
    """Errors of the methods beside the bound, and whether their deviations hold."""
    figure = Figure(figsize=(_WIDTH, 4.4), layout="constrained")
    errors, coverage = figure.subplots(1, 2, width_ratios=(5, 4))
    share = np.arange(1, len(results) + 1) / len(results)
    for method, (colour, style) in _COMPARED.items():
        rmse = [each.rmse for each in outcomes_of(method, results)]
        errors.plot(np.sort(rmse), share, style, color=colour, label=method)
    bounds = np.sort([result.bound for result in results])
    errors.plot(bounds, share, "--", color=DARK, label="Cramér–Rao bound, any curve")
    errors.set_xscale("log")
    errors.set(xlabel="RMSE in brightness", ylabel="share of cases below", ylim=(0, 1))
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize="small")
    for place, method in enumerate(LIKELIHOODS):
        covered = np.array([each.covered for each in outcomes_of(method, results)]).mean(axis=0)
        bars = coverage.barh([place - 0.18, place + 0.18], covered, 0.34, color=[SKY, BLUE])
        coverage.bar_label(bars, fmt="%.2f", padding=2, fontsize="small")
    for expected, colour in zip(_NORMAL_SHARES, (SKY, BLUE), strict=True):
        coverage.axvline(expected, color=colour, linestyle=":")
    coverage.set(
        xlabel="truth within 1 (light) or 2 deviations:\nshare of levels; dotted: normal",
        xlim=(0, 1.12),
        yticks=range(len(LIKELIHOODS)),
        yticklabels=LIKELIHOODS,
    )
    coverage.invert_yaxis()
    return figure


def sweeps_figure(points: list[SweepPoint]) -> Figure:
    """Error against each property of the frames, with the bounds of the same pairs dashed."""
    figure = Figure(figsize=(_WIDTH, 6.0), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True)
    for axes, (factor, (label, values)) in zip(panels.flat, FACTORS.items(), strict=True):
        own = [point for point in points if point.factor == factor]
        places = np.arange(len(values))
        for method, colour in zip(METHODS, (GREEN, BLUE), strict=True):
            rmse = np.array([point.rmse[method] for point in own])  # (values, cases)
            axes.plot(places, rmse, color=colour, linewidth=0.6, alpha=0.4)
            axes.plot(places, np.median(rmse, axis=1), "o-", color=colour, label=method)
            bounds = [float(np.median(point.bound[method])) for point in own]
            axes.plot(places, bounds, "--", color=colour, label=f"{_BOUNDS[method]}")
        axes.set(
            xlabel=label, yscale="log", xticks=places,
            xticklabels=[_tick(factor, value) for value in values],
        )  # fmt: skip
        axes.grid(visible=True, axis="y", color="0.92")
    for axes in panels[:, 0]:
        axes.set_ylabel("RMSE in brightness")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    n_cases, reference = len(points[0].rmse[METHODS[0]]), Camera()
    figure.suptitle(
        f"{n_cases} cases, thick their median; one factor at a time, "
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
