"""Figures of responses, whatever evidence they are from."""

from collections.abc import Sequence

import numpy as np
from matplotlib import ticker
from matplotlib.axes import Axes

from chartless.curves import AbstractCurve
from chartless.plotting._style import CHANNEL_COLOURS, SERIES_COLOURS
from chartless.result.response import Response, rmse
from chartless.types import Floats, Indices

_MOST_DRAWN = 1024


def draw_response(
    axes: Axes, channels: Sequence[Response], *, truth: AbstractCurve | None = None
) -> None:
    """Brightness over irradiance, with the deviation as a band where it is known."""
    for response in channels:
        error = "" if truth is None else f" (RMSE {rmse(response.curve, truth):.3f})"
        _draw_curve(axes, response, CHANNEL_COLOURS[response.name], f"{response.name}{error}")
    if truth is not None:
        irradiance = np.linspace(0, 1, 1024)
        axes.plot(irradiance, truth.response(irradiance), "k--", linewidth=1.2, label="truth")
    _frame_responses(axes, channels)


def draw_responses(axes: Axes, named: Sequence[tuple[str, Response]]) -> None:
    """Brightness over irradiance of several cameras, by name, as `draw_response` does for one."""
    for place, (name, response) in enumerate(named):
        # Else matplotlib would set $x$ as a formula, and leave _DSC0001 out of the legend.
        label = "\N{ZERO WIDTH SPACE}" + name.replace("$", r"\$")
        _draw_curve(axes, response, SERIES_COLOURS[place % len(SERIES_COLOURS)], label)
    _frame_responses(axes, [response for _, response in named])


def draw_differences(axes: Axes, responses: Sequence[Response]) -> None:
    """Irradiance over brightness less that of the first, each with its own deviation as a band.

    Colours are those of `draw_responses`.
    """
    first = responses[0].curve
    for place, response in enumerate(responses):
        colour = SERIES_COLOURS[place % len(SERIES_COLOURS)]
        kept = _kept(response)
        brightness = _brightness(response)[kept]
        apart = response.inverse_lut[kept] - first.inverse(brightness)
        axes.plot(brightness, apart, color=colour)
        if response.inverse_lut_std is not None:
            spread = response.inverse_lut_std[kept]
            axes.fill_between(
                brightness, apart - spread, apart + spread, color=colour, alpha=0.2, linewidth=0
            )
    axes.set(
        title="Light minus that of the first (bands: one deviation)",
        xlabel="brightness",
        ylabel="difference of irradiance",
        xlim=(0, 1),
    )


def _draw_curve(axes: Axes, response: Response, colour: str, label: str) -> None:
    kept = _kept(response)
    level = _brightness(response)
    inverse = response.inverse_lut
    axes.plot(inverse[kept], level[kept], color=colour, label=label)
    if response.inverse_lut_std is not None:
        light, spread = inverse[kept], response.inverse_lut_std[kept]
        axes.fill_betweenx(
            level[kept], light - spread, light + spread, color=colour, alpha=0.2, linewidth=0
        )
    if response.n_pairs:  # else nobody saw a level: another program made the curve
        ends = [*response.observed_levels]
        axes.plot(inverse[ends], level[ends], "o", color=colour, markersize=4)


def _frame_responses(axes: Axes, responses: Sequence[Response]) -> None:
    dots = " (dots: range of levels seen)" if any(each.n_pairs for each in responses) else ""
    axes.plot([0, 1], [0, 1], color="0.8", linewidth=0.8, zorder=0)
    axes.set(
        title=f"Response{dots}",
        xlabel="irradiance",
        ylabel="brightness",
        xlim=(0, 1),
        ylim=(0, 1),
    )
    axes.legend(loc="lower right", frameon=False)


def draw_deviations(
    axes: Axes, channels: Sequence[Response], *, truth: AbstractCurve | None = None
) -> None:
    """Deviation of the inverse response at each level and, with a truth, the actual error."""
    for response in channels:
        colour = CHANNEL_COLOURS[response.name]
        if response.inverse_lut_std is not None:
            for factor, alpha in ((2, 0.12), (1, 0.2)):
                kept = _kept(response)
                spread = factor * response.inverse_lut_std[kept]
                axes.fill_between(kept, -spread, spread, color=colour, alpha=alpha, linewidth=0)
            axes.plot([], [], color=colour, label=response.name)
        if truth is not None:
            error = response.inverse_lut - truth.inverse(_brightness(response))
            axes.plot(error, color=colour, linewidth=1)
    lines = "" if truth is None else "; lines: actual error"
    axes.set(
        title=f"How sure (bands: 1 and 2 deviations{lines})",
        xlabel="level",
        ylabel="irradiance",
    )
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False)


def draw_search(axes: Axes, channels: Sequence[Response]) -> None:
    """How the objective improved from round to round."""
    bounded = True
    for response in channels:
        if response.history is None:
            continue
        values = np.array(response.history.values)
        bounded = bounded and response.history.objective == "bin"
        cost = 1 - values if bounded else values
        axes.plot(cost, ".-", color=CHANNEL_COLOURS[response.name], label=response.name)
    axes.set(
        title="Search",
        xlabel="round",
        ylabel="1 − image similarity" if bounded else "image similarity",
        yscale="log",
    )
    axes.yaxis.set_minor_locator(ticker.LogLocator(subs=(2, 5)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:g}")
    if axes.lines:
        axes.legend(frameon=False)


def _kept(response: Response) -> Indices:
    """Levels that are drawn, at most `_MOST_DRAWN`; files of figures grow with each."""
    step = -(-response.n_levels // _MOST_DRAWN)
    return np.unique(np.append(np.arange(0, response.n_levels, step), response.n_levels - 1))


def _brightness(response: Response) -> Floats:
    return np.linspace(0.0, 1.0, response.n_levels)
