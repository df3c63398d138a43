"""Curves of several cameras side by side."""

import hashlib
from collections.abc import Sequence

from matplotlib.axes import Axes

from chartless.calibration import Calibration
from chartless.plotting import draw_responses
from chartless.report._page import environment, part
from chartless.report._svg import inline_svg
from chartless.response import Response, rmse
from chartless.summary import error_text
from chartless.verdict import verdict

_SIZE = (480, 340)


def comparison(cameras: Sequence[tuple[str, Calibration]]) -> str:
    """Curves of several calibrations in one figure, with how far they are apart.

    Parameters
    ----------
    cameras : sequence of (str, Calibration)
        With a name for each; of three channels the middle one, green, is shown.

    Returns
    -------
    str
        An HTML fragment.
    """
    curves = [(name, _middle(calibration)) for name, calibration in cameras]
    _, first = curves[0]

    def draw(axes: Axes) -> None:
        draw_responses(axes, curves)

    rows = [
        {
            "name": name,
            "channel": response.name,
            "method": response.method,
            "grade": verdict(calibration.channels).grade.value,
            "error": error_text(response.inverse_lut_std),
            "apart": "-" if response is first else f"{rmse(response.curve, first.curve):.4f}",
        }
        for (name, calibration), (_, response) in zip(cameras, curves, strict=True)
    ]
    digest = hashlib.sha256(b"".join(each.inverse_lut.tobytes() for _, each in curves))
    svg = inline_svg(draw, _SIZE, salt=digest.hexdigest(), aria_labelledby="comparison-table")
    page = environment().from_string(part("comparison.html"))
    return page.render(svg=svg, rows=rows)


def _middle(calibration: Calibration) -> Response:
    channels = calibration.channels
    return channels[len(channels) // 2]
