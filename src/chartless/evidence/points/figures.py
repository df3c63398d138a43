"""Figure of measured points: how far the curve is from them."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib import ticker
from matplotlib.axes import Axes

from chartless.evidence.kind import Figure
from chartless.evidence.points.account import NAME, SeenPoints
from chartless.plotting import CHANNEL_COLOURS
from chartless.result.response import Response
from chartless.result.summary import of_each
from chartless.types import Floats


def figures(channels: Sequence[Response]) -> tuple[Figure, ...]:
    """Figure of all channels; none where the points are not kept."""
    if any(each.account(NAME).record is None for each in channels):
        return ()
    draw = partial(draw_points, channels=channels)
    return (Figure("points", "Measured points", draw, _words(channels)),)


def draw_points(axes: Axes, channels: Sequence[Response]) -> None:
    """Draw the light of points by the curve relative to that measured, less 1."""
    for response in channels:
        brightness, apart = _apart(response)
        colour = CHANNEL_COLOURS[response.name]
        axes.plot(brightness, apart, "o", color=colour, markersize=4, label=response.name)
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    axes.set(
        title="Light by the curve minus measured light",
        xlabel="brightness",
        ylabel="relative difference",
        xlim=(0, 1),
    )
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    axes.legend(frameon=False)


def _apart(response: Response) -> tuple[Floats, Floats]:
    record = response.account(NAME).record
    assert isinstance(record, SeenPoints)
    brightness = np.array(record.brightness)
    return brightness, response.curve.inverse(brightness) / np.array(record.irradiance) - 1


def _words(channels: Sequence[Response]) -> str:
    def off(response: Response) -> str:
        return f"{np.median(np.abs(_apart(response)[1])):.1%}"

    number = sum(len(_apart(each)[0]) for each in channels)
    return (
        f"{number} points. In the median the light by the curve is {of_each(channels, off)} from "
        "what was measured."
    )
