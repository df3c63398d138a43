"""Figures as SVG inside a page: its font, its colours, light or dark."""

import io
import re
import threading
from collections.abc import Callable

from markupsafe import Markup, escape
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless.plotting import BLUE, DARK, GREEN, ORANGE, PURPLE, SKY, VERMILION

# A page may give each paint another colour, for dark backgrounds; a notebook need not.
_PAINTS = {
    BLUE: f"var(--blue, {BLUE})",
    ORANGE: f"var(--orange, {ORANGE})",
    GREEN: f"var(--green, {GREEN})",
    VERMILION: f"var(--vermilion, {VERMILION})",
    SKY: f"var(--sky, {SKY})",
    PURPLE: f"var(--purple, {PURPLE})",
    DARK: "currentColor",
    "#000000": "currentColor",
    "#cccccc": "var(--faint, rgb(128 128 128 / 50%))",
}
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
_SETTINGS = threading.Lock()  # matplotlib's are those of all threads
_LEFT, _BOTTOM, _MARGIN, _BESIDE_BAR = 54, 40, 8, 50  # of the axes: room for labels
_DPI = 160  # of what is dense and therefore an image


def inline_svg(
    draw: Callable[[Axes], object], size: tuple[float, float], *, salt: str, **attributes: str
) -> Markup:
    """Draw on axes, and return them as an ``<svg>`` element.

    Parameters
    ----------
    draw : callable
        Given the axes; the title that it sets is left to the page.
    size : (float, float)
        Width and height in units of the view box, of which text is 10.5 high.
    salt : str
        Makes names inside the element differ from those of other figures in the page.
    **attributes : str
        Attributes of the element; underscores stand for hyphens.

    Returns
    -------
    Markup
        Safe to stand in HTML: text is escaped, nothing is loaded.
    """
    with _SETTINGS, rc_context({"svg.fonttype": "none", "svg.hashsalt": salt, "font.size": 10.5}):
        figure = Figure(figsize=(size[0] / 72, size[1] / 72))
        axes = figure.subplots()
        draw(axes)
        axes.set_title("")
        _leave_margins(figure, *size)
        file = io.StringIO()
        figure.savefig(file, format="svg", dpi=_DPI, transparent=True, metadata=_NO_METADATA)
    return _inlined(file.getvalue(), {"role": "img", "fill": "currentColor", **attributes})


def _leave_margins(figure: Figure, width: float, height: float) -> None:
    """Fixed margins around the axes: laying out by labels doubles the time of a figure."""
    has_bar = len(figure.axes) > 1
    figure.subplots_adjust(
        left=_LEFT / width,
        bottom=_BOTTOM / height,
        right=1 - (_BESIDE_BAR if has_bar else _MARGIN) / width,
        top=1 - _MARGIN / height,
    )


def _inlined(document: str, attributes: dict[str, str]) -> Markup:
    """The drawing of an SVG document, without what concerns a file or all of the page."""
    start = document.index("<svg")
    (view,) = re.findall(r'viewBox="[^"]*"', document)
    body = document[document.index(">", start) + 1 :]
    body = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", body, flags=re.DOTALL)
    body = re.sub(r"<[^>]+>", lambda tag: _compact(tag[0]), body)
    body = re.sub(r">\s+<", "><", body)
    named = " ".join(
        f'{name.replace("_", "-")}="{escape(value)}"' for name, value in attributes.items()
    )
    return Markup(f"<svg {view} {named}>{body.strip()}")  # noqa: S704 - escaped by matplotlib


def _compact(tag: str) -> str:
    tag = re.sub(r"\s+", " ", tag).replace("base64, ", "base64,")
    tag = re.sub(r'^<g id="[^"]*"', "<g", tag)  # nobody refers to a group, and figures share names
    tag = re.sub(r"font-family: [^;]*;", "", tag)
    tag = re.sub(r"#[0-9a-f]{6}\b", lambda colour: _PAINTS.get(colour[0], colour[0]), tag)
    return re.sub(r"\d+\.\d{3,}", lambda number: f"{round(float(number[0]), 2):g}", tag)
