"""Everything there is to see about a calibration, on one picture."""

from functools import partial

from matplotlib.figure import Figure

from chartless.curves import AbstractCurve
from chartless.plotting import draw_deviations, draw_response
from chartless.report._figures import planned
from chartless.result.calibration import Calibration

_ROW = 3.6  # inches
_WITH_TRUTH = {"response": draw_response, "error": draw_deviations}


def overview(calibration: Calibration, *, truth: AbstractCurve | None = None) -> Figure:
    """All figures of a report on one picture, two in a row.

    Parameters
    ----------
    calibration : Calibration
    truth : AbstractCurve, optional
        Known response, drawn beside the estimate and, where errors are known, taken from it.

    Returns
    -------
    Figure
    """
    channels = calibration.channels
    shown = planned(channels)
    n_rows = -(-len(shown) // 2)
    figure = Figure(figsize=(11, _ROW * n_rows + 0.5), layout="constrained")
    places = [*figure.subplots(n_rows, 2, squeeze=False).flat]
    for axes, each in zip(places, shown, strict=False):
        draw = each.draw
        if each.name in _WITH_TRUTH:
            draw = partial(_WITH_TRUTH[each.name], channels=channels, truth=truth)
        draw(axes)
    for axes in places[len(shown) :]:
        axes.set_axis_off()
    flags = ", ".join(flag.code for flag in calibration.flags)
    title = f"{channels[0].method}" + (f" — doubtful: {flags}" if flags else "")
    figure.suptitle(f"Camera response by {title}", fontsize=12)
    return figure
