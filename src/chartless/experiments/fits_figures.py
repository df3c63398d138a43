"""Figures of the experiment `chartless.experiments.fits`, numbered as in the paper."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless.curves.fitting import fit
from chartless.datasets import Dorf
from chartless.experiments.fits import LEFT_OUT, ORDERS, FitTable
from chartless.plotting import BLUE, DARK, GREEN, ORANGE, PURPLE, SKY, VERMILION, draw_fits

_KINDS = {"film": BLUE, "digital": VERMILION, "gamma": GREEN, "unknown": "0.5"}
_PANELS = (
    "poly", "conpoly", "pegc", "eegc",
    "logemor", "inverse-emor", "emor", "emor-left-out",
    "emor-monotone", "emor-monotone-left-out", "meegc", "gumbel",
)  # fmt: skip
_MARKED = ("ameegc", "ameegc-exact")
_LINES = {
    "poly": ("0.6", "-"),
    "pegc": (PURPLE, "-"),
    "emor": (ORANGE, "-"),
    "emor-left-out": (ORANGE, ":"),
    "emor-monotone-left-out": (VERMILION, ":"),
    "eegc": (SKY, "-"),
    "meegc": (BLUE, "--"),
    "gumbel": (GREEN, "-"),
}
_EXAMPLES = ("ameegc2-exact", "emor2-monotone", "gumbel4")


def curves_figure(dorf: Dorf) -> Figure:
    """Fig. 1: the measured responses."""
    figure = Figure(figsize=(5.5, 5), layout="constrained")
    axes = figure.subplots()
    kinds = np.array(dorf.kinds)
    for kind, colour in _KINDS.items():
        rows = np.flatnonzero(kinds == kind)
        if rows.size:
            lines = axes.plot(
                dorf.irradiance, dorf.curves[rows].T, color=colour, linewidth=0.6, alpha=0.6
            )
            lines[0].set_label(f"{kind} ({rows.size})")
    axes.set(
        title=f"{len(dorf.curves)} measured responses, {len(dorf.distinct)} of them distinct",
        xlabel="irradiance",
        ylabel="brightness",
        xlim=(0, 1),
        ylim=(0, 1),
    )
    for handle in axes.legend(loc="lower right", frameon=False).legend_handles:
        if handle is not None:
            handle.set(alpha=1, linewidth=2)
    return figure


def boxes_figure(tables: list[FitTable]) -> Figure:
    """Fig. 2: RMSE by order for every family, the medians of AMEEGC marked in each panel."""
    figure = Figure(figsize=(11, 8.5), layout="constrained")
    panels = figure.subplots(3, 4, sharex=True, sharey=True)
    for axes, family in zip(panels.flat, _PANELS, strict=True):
        _draw_boxes(axes, family, tables)
    for axes in panels[-1]:
        axes.set_xlabel("order (parameters − 1)")
    for axes in panels[:, 0]:
        axes.set_ylabel("RMSE in brightness")
    panels.flat[0].legend(frameon=False, loc="lower left", fontsize="small")
    figure.suptitle(
        "Fits to the measured responses: median, quartiles, whiskers from 5 to 95 %",
        fontsize=12,
    )
    return figure


def medians_figure(tables: list[FitTable], of: str = "the measured responses") -> Figure:
    """Medians of Fig. 2 in one drawing, of the families that were fitted."""
    figure = Figure(figsize=(6.5, 5), layout="constrained")
    axes = figure.subplots()
    for family, (colour, style) in _LINES.items():
        own = _of_family(family, tables)
        if not own:
            continue
        medians = [float(np.median(table.rmse)) for table in own]
        orders = [table.order for table in own]
        label = family.replace(LEFT_OUT, ", camera left out")
        axes.plot(orders, medians, style, color=colour, marker=".", label=label)
    _draw_marked(axes, tables)
    for table in _of_family("ppisp", tables):
        median = float(np.median(table.rmse))
        axes.plot(table.order, median, "s", color=DARK, markerfacecolor="none", label="ppisp")
    axes.set(
        title=f"Median RMSE over {of}",
        xlabel="order (parameters − 1)",
        ylabel="RMSE in brightness",
        yscale="log",
        xticks=list(ORDERS),
    )
    axes.grid(visible=True, axis="y", color="0.9")
    axes.legend(frameon=False, fontsize="small", ncols=2)
    return figure


def examples_figure(dorf: Dorf, tables: list[FitTable], rows: list[int]) -> Figure:
    """Fig. 3: the curves that the exact AMEEGC fits best, middling and worst."""
    (exact,) = _of_family("ameegc-exact", tables)
    distinct = set(dorf.distinct)
    eligible = [
        place
        for place, row in enumerate(rows)
        if row in distinct and dorf.kinds[row] != "gamma"  # which it contains
    ] or range(len(rows))
    ranked = sorted(eligible, key=lambda place: float(exact.rmse[place]))
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    panels = figure.subplots(2, 3, height_ratios=(3, 1), sharey="row")
    chosen = {"good": ranked[0], "middling": ranked[len(ranked) // 2], "bad": ranked[-1]}
    for (word, place), (upper, lower) in zip(chosen.items(), panels.T, strict=True):
        row = rows[place]
        brightness = dorf.curves[row]
        fits = [fit(name, dorf.irradiance, brightness) for name in _EXAMPLES]
        draw_fits(upper, lower, dorf.irradiance, brightness, fits)
        upper.set_title(f"{word}: {dorf.names[row][:32]}")
    for axes in panels[:, 1:].flat:
        axes.set_ylabel("")
    return figure


def _draw_boxes(axes: Axes, family: str, tables: list[FitTable]) -> None:
    own = _of_family(family, tables)
    axes.boxplot(
        [table.rmse for table in own],
        whis=(5, 95),
        positions=[table.order for table in own],
        widths=0.6,
        flierprops={"marker": ".", "markersize": 2, "markeredgecolor": "0.6"},
        medianprops={"color": VERMILION, "linewidth": 1.5},
        boxprops={"color": DARK},
        whiskerprops={"color": "0.5"},
        capprops={"color": "0.5"},
        manage_ticks=False,
    )
    _draw_marked(axes, tables)
    axes.set(title=family.replace(LEFT_OUT, ", camera left out"), yscale="log", xticks=list(ORDERS))
    axes.set_ylim(1e-4, 0.5)
    axes.grid(visible=True, axis="y", color="0.92")


def _draw_marked(axes: Axes, tables: list[FitTable]) -> None:
    for family, marker in zip(_MARKED, ("D", "x"), strict=True):
        own = _of_family(family, tables)
        axes.plot(
            [table.order for table in own],
            [float(np.median(table.rmse)) for table in own],
            marker,
            color=BLUE,
            markersize=5 if marker == "D" else 7,
            markerfacecolor="none",
            label=f"{family}, median",
        )


def _of_family(family: str, tables: list[FitTable]) -> list[FitTable]:
    return [table for table in tables if table.family == family]
