"""The figures of a report: what there is to draw, and what each shows in words."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from markupsafe import Markup

from chartless import plotting
from chartless.evidence.kind import Figure
from chartless.evidence.registry import KINDS
from chartless.report import _captions
from chartless.report._svg import inline_svg
from chartless.result.response import Response

HALF, THIRD = (360, 250), (285, 215)  # of the page


class Drawing(NamedTuple):
    """A figure with its text."""

    name: str
    title: str
    svg: Markup
    text: str
    """What it shows, in numbers; the page has it as element "{name}-text"."""
    width: str
    """Share of the width of the page: "half" or "third"."""


def drawings(channels: Sequence[Response]) -> list[Drawing]:
    """Everything there is to see about the channels of a camera, the curve first."""
    plans = planned(channels)
    n_halves = _halves(len(plans))
    found = []
    for place, plan in enumerate(plans):
        width, size = ("half", HALF) if place < n_halves else ("third", THIRD)
        svg = inline_svg(plan.draw, size, salt=plan.name, aria_labelledby=f"{plan.name}-text")
        found.append(Drawing(plan.name, plan.title, svg, plan.words, width))
    return found


def _halves(n_figures: int) -> int:
    """How many figures, the first ones, take half of the page and not a third: rows are full."""
    if n_figures % 2 == 0 or n_figures == 1:
        return n_figures
    return 2 if n_figures > 3 else 0  # noqa: PLR2004 - a row of thirds


def planned(channels: Sequence[Response]) -> list[Figure]:
    """Figures that there are to draw: curve, error, those of each kind of evidence, search."""
    shown = [
        Figure(
            "response", "Response", lambda axes: plotting.draw_response(axes, channels),
            _captions.of_response(channels),
        )
    ]  # fmt: skip
    if all(each.inverse_lut_std is not None for each in channels):
        words = _captions.of_deviations(channels)
        draw = partial(plotting.draw_deviations, channels=channels)
        shown.append(Figure("error", "How sure", draw, words))
    for name, kind in KINDS.items():
        if all(name in each.kinds for each in channels):
            shown += kind.figures(channels)
    if all(each.history is not None for each in channels):
        draw = partial(plotting.draw_search, channels=channels)
        shown.append(Figure("search", "Search", draw, _captions.of_search(channels)))
    return shown
