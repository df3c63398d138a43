"""The figures of a report: what there is to draw, and what each shows in words."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

from markupsafe import Markup
from matplotlib.axes import Axes

from chartless import plotting
from chartless.report import _words
from chartless.report._svg import inline_svg
from chartless.result.response import Response
from chartless.result.verdict import typical_of_exposures

HALF, THIRD = (360, 250), (285, 215)  # of the page

T = TypeVar("T")


class Drawing(NamedTuple):
    """A figure with its text."""

    name: str
    title: str
    svg: Markup
    text: str
    """What it shows, in numbers; the page has it as element "{name}-text"."""
    width: str
    """Of the page: "half" or "third"."""


class _Plan(NamedTuple):
    """A figure that is still to be drawn."""

    name: str
    title: str
    draw: Callable[[Axes], None]
    text: str


def drawings(channels: Sequence[Response]) -> list[Drawing]:
    """Everything there is to see about the channels of a camera, the curve first."""
    plans = _plans(channels)
    n_halves = _halves(len(plans))
    found = []
    for place, plan in enumerate(plans):
        width, size = ("half", HALF) if place < n_halves else ("third", THIRD)
        svg = inline_svg(plan.draw, size, salt=plan.name, aria_labelledby=f"{plan.name}-text")
        found.append(Drawing(plan.name, plan.title, svg, plan.text, width))
    return found


def _halves(n_figures: int) -> int:
    """How many figures, the first ones, take half of the page and not a third: rows are full."""
    if n_figures % 2 == 0 or n_figures == 1:
        return n_figures
    return 2 if n_figures > 3 else 0  # noqa: PLR2004 - a row of thirds


def _plans(channels: Sequence[Response]) -> list[_Plan]:
    one = _least_explained(channels)
    shown = [_plan("response", "Response", plotting.draw_response, channels, _words.of_response)]
    if all(each.inverse_lut_std is not None for each in channels):
        draw = plotting.draw_deviations
        shown += [_plan("error", "How sure", draw, channels, _words.of_deviations)]
    if all(each.table is not None and each.noise is not None for each in channels):
        shown += [
            _plan("noise", "Noise of one frame", plotting.draw_noise, channels, _words.of_noise),
            _plan("pairs", "Level pairs", plotting.draw_cooccurrence, one, _words.of_pairs),
            _plan("rest", "Seen less expected", plotting.draw_residuals, one, _words.of_residuals),
        ]
    typical = typical_of_exposures(channels)
    if typical is not None:
        draw_one, draw_ratios = plotting.draw_transfers, plotting.draw_transfer_errors
        shown += [
            _plan("transfer", "Exposure to exposure", draw_one, typical, _words.of_transfers),
            _plan(
                "ratio",
                "Light of two exposures",
                draw_ratios,
                typical,
                lambda one: _words.of_transfer_errors(channels, one),
            ),
        ]
    if all(each.history is not None for each in channels):
        shown += [_plan("search", "Search", plotting.draw_search, channels, _words.of_search)]
    return shown


def _plan(
    name: str, title: str, draw: Callable[[Axes, T], None], what: T, words: Callable[[T], str]
) -> _Plan:
    return _Plan(name, title, lambda axes: draw(axes, what), words(what))


def _least_explained(channels: Sequence[Response]) -> Response:
    """The channel with the largest misfit; the middle one where none is known."""
    if all(each.deviance is not None for each in channels):
        return max(channels, key=lambda each: each.deviance or 0.0)
    return channels[len(channels) // 2]
