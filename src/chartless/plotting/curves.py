"""Figures of families fitted to measured curves."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless.curves.fitting import Fit
from chartless.plotting._style import SERIES_COLOURS
from chartless.types import Floats

_MANY = 80  # samples; more are drawn as a line


def draw_fits(
    upper: Axes, lower: Axes, irradiance: Floats, brightness: Floats, fits: Sequence[Fit]
) -> None:
    """Samples and fitted curves above, differences below.

    Parameters
    ----------
    upper, lower : Axes
    irradiance, brightness : ndarray, shape (N,)
        The samples.
    fits : sequence of Fit
    """
    fine = np.linspace(0, 1, 1024)
    if irradiance.size > _MANY:
        upper.plot(irradiance, brightness, color="0.75", linewidth=5, label="measured")
    else:
        upper.plot(irradiance, brightness, "o", color="0.6", markersize=4, label="measured")
    for fit, colour in zip(fits, SERIES_COLOURS, strict=False):
        label = f"{fit.model.name} ({fit.rmse:.4f})"
        upper.plot(fine, fit.response(fine), color=colour, linewidth=1.2, label=label)
        difference = fit.response(irradiance) - brightness
        mark = "" if irradiance.size > _MANY else "."
        lower.plot(irradiance, difference, marker=mark, color=colour, linewidth=1)
    lower.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    upper.set(ylabel="brightness", xlim=(0, 1), ylim=(0, 1))
    lower.set(xlabel="irradiance", ylabel="fit − measured", xlim=(0, 1))
    upper.tick_params(labelbottom=False)
    upper.legend(loc="lower right", frameon=False, fontsize="small", title="family (RMSE)")


def fits_figure(
    irradiance: Floats, brightness: Floats, fits: Sequence[Fit], *, title: str
) -> Figure:
    """One measured curve with the families fitted to it."""
    figure = Figure(figsize=(6.5, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, height_ratios=(3, 1))
    draw_fits(upper, lower, irradiance, brightness, fits)
    figure.suptitle(title, fontsize=12)
    return figure
