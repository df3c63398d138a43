"""Figures of responses. Functions draw on Axes that they are given, or make a Figure.

They never show it. Only this package, the figures of reports, of experiments and of the kinds of
evidence import matplotlib, and only the commands that draw import them.
"""

from chartless.plotting._style import (
    BLUE,
    CHANNEL_COLOURS,
    DARK,
    GREEN,
    ORANGE,
    PURPLE,
    SERIES_COLOURS,
    SKY,
    VERMILION,
    save_figure,
)
from chartless.plotting.curves import draw_fits, fits_figure
from chartless.plotting.responses import (
    draw_deviations,
    draw_differences,
    draw_response,
    draw_responses,
    draw_search,
)

__all__ = [
    "BLUE",
    "CHANNEL_COLOURS",
    "DARK",
    "GREEN",
    "ORANGE",
    "PURPLE",
    "SERIES_COLOURS",
    "SKY",
    "VERMILION",
    "draw_deviations",
    "draw_differences",
    "draw_fits",
    "draw_response",
    "draw_responses",
    "draw_search",
    "fits_figure",
    "save_figure",
]
