"""Curves of several cameras side by side."""

import hashlib
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from chartless.calibration import Calibration
from chartless.plotting import draw_differences, draw_responses
from chartless.report._figures import HALF, Drawing
from chartless.report._page import environment
from chartless.report._svg import inline_svg
from chartless.response import Response
from chartless.summary import error_text
from chartless.types import Floats
from chartless.verdict import deviation, verdict

_BRIGHTNESS = np.linspace(0.0, 1.0, 256)
_ALIKE = 0.0005
_LONGEST = 29  # characters of a name in the legend


def comparison(cameras: Sequence[tuple[str, Calibration]]) -> str:
    """Curves of several calibrations in one figure, and how far they are apart in another.

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
    apart = [_apart(response, first) for _, response in curves]
    rows = [
        {
            "name": name,
            "channel": response.name,
            "method": response.method,
            "grade": verdict(calibration.channels).grade.value,
            "error": error_text(response.inverse_lut_std),
            "apart": "-" if response is first else f"{deviation(difference):.3f}",
        }
        for (name, calibration), (_, response), difference in zip(
            cameras, curves, apart, strict=True
        )
    ]
    page = environment().get_template("comparison.html")
    return page.render(figures=_figures(curves, apart), rows=rows)


def _figures(curves: Sequence[tuple[str, Response]], apart: Sequence[Floats]) -> list[Drawing]:
    responses = [response for _, response in curves]
    digest = hashlib.sha256(b"".join(each.inverse_lut.tobytes() for each in responses)).hexdigest()

    def drawing(name: str, title: str, draw: Callable[[Axes], None], text: str) -> Drawing:
        salt, label = f"{name} {digest}", f"{name}-text"
        svg = inline_svg(draw, HALF, salt=salt, aria_labelledby=label)
        return Drawing(name, title, svg, text, "half")

    return [
        drawing(
            "compared",
            "Response",
            lambda axes: draw_responses(axes, [(_short(name), each) for name, each in curves]),
            f"{_halves(curves)} Bands: one deviation. Of three channels green is shown.",
        ),
        drawing(
            "difference",
            "Difference from the first",
            lambda axes: draw_differences(axes, responses),
            "Light that a brightness stands for, less that of the first. "
            f"{_farthest(curves, apart)} Curves whose bands overlap may be the same; colours as in "
            "“Response”.",
        ),
    ]


def _halves(curves: Sequence[tuple[str, Response]]) -> str:
    light = [float(response.curve.inverse(np.array(0.5))) for _, response in curves]
    return f"Brightness 0.5 stands for {min(light):.3f} to {max(light):.3f} of the light at white."


def _farthest(curves: Sequence[tuple[str, Response]], apart: Sequence[Floats]) -> str:
    """Where which curve is farthest from the first."""
    camera = int(np.argmax([np.abs(each).max() for each in apart]))
    place = int(np.abs(apart[camera]).argmax())
    name, most = curves[camera][0], float(apart[camera][place])
    if abs(most) < _ALIKE:
        return "All are the same to three digits, 0.000."
    signed = f"{most:+.3f}".replace("-", "\N{MINUS SIGN}")
    return f"Farthest is {name}, by {signed} at brightness {_BRIGHTNESS[place]:.2f}."


def _apart(response: Response, first: Response) -> Floats:
    """Difference of irradiance over brightness, shape (256,)."""
    return np.asarray(response.curve.inverse(_BRIGHTNESS) - first.curve.inverse(_BRIGHTNESS))


def _short(name: str) -> str:
    """Name without its middle, if it is too long for the figure: what differs is at the end."""
    side = _LONGEST // 2
    return name if len(name) <= _LONGEST else f"{name[:side]}…{name[-side:]}"


def _middle(calibration: Calibration) -> Response:
    channels = calibration.channels
    return channels[len(channels) // 2]
