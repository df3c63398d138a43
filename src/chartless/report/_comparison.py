"""Curves of several cameras side by side."""

import hashlib
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from chartless.plotting import draw_differences, draw_responses
from chartless.report._figures import HALF, THIRD, Drawing
from chartless.report._page import environment
from chartless.report._svg import inline_svg
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.result.summary import error_text
from chartless.result.verdict import deviation, verdict
from chartless.types import Floats

_BRIGHTNESS = np.linspace(0.0, 1.0, 256)
_ALIKE = 0.0005
_COLOURS = ("R", "G", "B")
_LONGEST = 25  # characters of a name in the legend


class _Channel(NamedTuple):
    """What is compared in one channel."""

    name: str
    curves: list[tuple[str, Response]]
    """Response of each camera, with its name."""
    apart: list[Floats]
    """How far each is from the first, as `_apart` has it."""


def comparison(cameras: Sequence[tuple[str, Calibration]]) -> str:
    """Curves of several calibrations, channel by channel, and how far they are apart.

    Parameters
    ----------
    cameras : sequence of (str, Calibration)
        With a name for each. One of a single channel is compared in all channels of the others.

    Returns
    -------
    str
        An HTML fragment.
    """
    channels = _channels(cameras)
    rows = [
        {
            "name": name,
            "method": calibration.channels[0].method,
            "grade": verdict(calibration.channels).grade.value,
            "errors": [_named(each, error_text(each.inverse_lut_std), calibration.channels)
                       for each in calibration.channels],
            "apart": [] if place == 0 else _distances(channels, place),
        }
        for place, (name, calibration) in enumerate(cameras)
    ]  # fmt: skip
    page = environment().get_template("comparison.html")
    limits = _limits(channels)
    figures = [*map(_responses, channels), *(_differences(each, limits) for each in channels)]
    return page.render(
        figures=figures,
        rows=rows,
        farthest=_farthest_of_all(channels),
    )


def _channels(cameras: Sequence[tuple[str, Calibration]]) -> list[_Channel]:
    """Channels of the camera that has most."""
    names = max((calibration.channels for _, calibration in cameras), key=len)
    found = []
    for name in (response.name for response in names):
        curves = [(camera, _of_channel(calibration, name)) for camera, calibration in cameras]
        apart = [_apart(response, curves[0][1]) for _, response in curves]
        found.append(_Channel(name, curves, apart))
    return found


def _of_channel(calibration: Calibration, name: str) -> Response:
    """Response of a channel; a single one serves all."""
    return calibration.channels[0] if len(calibration.channels) == 1 else calibration.channel(name)


def _named(response: Response, text: str, channels: Sequence[Response]) -> str:
    return text if len(channels) == 1 else f"{response.name} {text}"


def _distances(channels: Sequence[_Channel], place: int) -> list[dict[str, object]]:
    """How far a camera is from the first in each channel, and which is the worst."""
    values = [deviation(each.apart[place]) for each in channels]
    worst = int(np.argmax(values))
    return [
        {
            "text": f"{each.name} {value:.3f}" if len(channels) > 1 else f"{value:.3f}",
            "is_worst": len(channels) > 1 and index == worst and value - min(values) >= _ALIKE,
        }
        for index, (each, value) in enumerate(zip(channels, values, strict=True))
    ]


def _responses(channel: _Channel) -> Drawing:
    def draw(axes: Axes) -> None:
        draw_responses(axes, [(_short(name), each) for name, each in channel.curves])

    text = f"{_halves(channel.curves)} Bands: one deviation."
    return _drawing("compared", "Response", channel, draw, text)


def _differences(channel: _Channel, limits: tuple[float, float]) -> Drawing:
    """Differences on an axis with the limits that all channels share."""

    def draw(axes: Axes) -> None:
        draw_differences(axes, [response for _, response in channel.curves])
        axes.set_ylim(limits)

    text = (
        f"Light that a brightness stands for, minus that of the first. {_farthest(channel)} Curves "
        "whose bands overlap may be the same; colours as in “Response”."
    )
    return _drawing("difference", "Difference from the first", channel, draw, text)


def _limits(channels: Sequence[_Channel]) -> tuple[float, float]:
    """Least and largest difference of all channels, with the bands and some room."""
    ends = [-_ALIKE, _ALIKE]
    for channel in channels:
        for (_, response), apart in zip(channel.curves, channel.apart, strict=True):
            std = response.inverse_lut_std
            spread = 0.0 if std is None else float(std.max())
            ends += [float(apart.min()) - spread, float(apart.max()) + spread]
    room = 0.05 * (max(ends) - min(ends))
    return min(ends) - room, max(ends) + room


def _drawing(
    name: str, title: str, channel: _Channel, draw: Callable[[Axes], None], text: str
) -> Drawing:
    """A figure of one channel; for a camera in colour, a third of the page."""
    luts = b"".join(response.inverse_lut.tobytes() for _, response in channel.curves)
    digest = hashlib.sha256(luts).hexdigest()
    size, width = HALF, "half"
    if channel.name in _COLOURS:
        name, title, size, width = (
            f"{name}-{channel.name}",
            f"{title}, {channel.name}",
            THIRD,
            "third",
        )
    svg = inline_svg(draw, size, salt=f"{name} {digest}", aria_labelledby=f"{name}-text")
    return Drawing(name, title, svg, text, width)


def _halves(curves: Sequence[tuple[str, Response]]) -> str:
    light = [float(response.curve.inverse(np.array(0.5))) for _, response in curves]
    return f"Brightness 0.5 stands for {min(light):.3f} to {max(light):.3f} of the light at white."


def _farthest(channel: _Channel) -> str:
    """Where which curve is farthest from the first."""
    camera = int(np.argmax([np.abs(each).max() for each in channel.apart]))
    place = int(np.abs(channel.apart[camera]).argmax())
    most = float(channel.apart[camera][place])
    if abs(most) < _ALIKE:
        return "All are the same to three digits, 0.000."
    signed = f"{most:+.3f}".replace("-", "\N{MINUS SIGN}")
    name = channel.curves[camera][0]
    return f"The largest difference is {signed} ({name}, at brightness {_BRIGHTNESS[place]:.2f})."


def _farthest_of_all(channels: Sequence[_Channel]) -> str:
    """The same for the channel in which that is most; empty where there is only one."""
    if len(channels) == 1:
        return ""
    worst = max(channels, key=lambda each: max(np.abs(part).max() for part in each.apart))
    return f"Channel {worst.name} differs most. {_farthest(worst)}"


def _apart(response: Response, first: Response) -> Floats:
    """Difference of irradiance over brightness, shape (256,)."""
    return np.asarray(response.curve.inverse(_BRIGHTNESS) - first.curve.inverse(_BRIGHTNESS))


def _short(name: str) -> str:
    """Name without its middle, if it is too long for the figure: what differs is at the end."""
    side = _LONGEST // 2
    return name if len(name) <= _LONGEST else f"{name[:side]}…{name[-side:]}"
