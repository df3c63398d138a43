"""Figures. Functions draw on Axes that they are given, or make a Figure; they never show it.

Only this package and the figures of `chartless.experiments` import matplotlib, and only the
commands that draw import them.
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
from chartless.plotting.calibration import (
    draw_cooccurrence,
    draw_deviations,
    draw_differences,
    draw_noise,
    draw_residuals,
    draw_response,
    draw_responses,
    draw_search,
    draw_transfer_errors,
    draw_transfers,
    overview,
)
from chartless.plotting.curves import draw_fits, fits_figure

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
    "draw_cooccurrence",
    "draw_deviations",
    "draw_differences",
    "draw_fits",
    "draw_noise",
    "draw_residuals",
    "draw_response",
    "draw_responses",
    "draw_search",
    "draw_transfer_errors",
    "draw_transfers",
    "fits_figure",
    "overview",
    "save_figure",
]
