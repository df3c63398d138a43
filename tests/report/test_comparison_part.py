"""Curves of several cameras side by side, as a part of a page."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import html5lib
import numpy as np
import pytest

from chartless import Calibration, ModelCurve
from chartless.report import comparison, stylesheet

Element = Any
GAMMA = ModelCurve("gamma", (0.5,))


@pytest.fixture
def compared(of_noise: Calibration) -> Callable[..., Element]:
    """The part for √I and cameras with other curves, by name."""

    def part(**curves: ModelCurve) -> Element:
        others = [
            (name, replace(of_noise, channels=(replace(of_noise.channels[1], curve=curve),)))
            for name, curve in curves.items()
        ]
        text = comparison([("first", of_noise), *others])
        parser = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False)
        return parser.parseFragment(text)

    return part


def texts(part: Element, tag: str) -> list[str]:
    return [" ".join("".join(each.itertext()).split()) for each in part.iter(tag)]


def test_the_table_says_how_far_light_is_apart(compared: Callable[..., Element]) -> None:
    """Root mean square of b − b² over brightness is √(1/30)."""
    part = compared(linear=ModelCurve("gamma", (1.0,)), same=GAMMA)

    rows = [texts(row, "td") for row in part.iter("tr")][1:]

    assert texts(part, "th")[-3:] == ["first", "linear", "same"]
    assert [row[-1] for row in rows][::2] == ["-", "0.000"]
    assert float(rows[1][-1]) == pytest.approx(np.sqrt(1 / 30), abs=0.001)
    assert [row[-2] for row in rows] == ["± 0.007"] * 3


def test_the_figures_say_what_they_show(compared: Callable[..., Element]) -> None:
    """b − b² is a quarter in the middle."""
    part = compared(linear=ModelCurve("gamma", (1.0,)))

    names = {each.get("id"): text for each, text in zip(
        part.iter("figcaption"), texts(part, "figcaption"), strict=True
    )}  # fmt: skip
    svgs = [each for each in part.iter() if str(each.tag).endswith("svg")]
    assert [each.get("aria-labelledby") for each in svgs] == [*names]
    assert "Brightness 0.5 stands for 0.250 to 0.500" in names["compared-text"]
    assert re.search(r"linear, by \+0\.250 at brightness 0\.50", names["difference-text"])


def test_curves_below_the_first_have_a_sign(compared: Callable[..., Element]) -> None:
    part = compared(steep=ModelCurve("gamma", (0.25,)))

    assert "steep, by −0.250 at brightness 0.71" in texts(part, "figcaption")[1]


def test_curves_that_are_the_same_are_called_so(compared: Callable[..., Element]) -> None:
    assert "the same to three digits" in texts(compared(same=GAMMA), "figcaption")[1]


def test_long_names_leave_room_for_the_curves(compared: Callable[..., Element]) -> None:
    """What differs is at their end, and the table has all of it."""
    name = f"{'x' * 500}, gumbel4"

    part = compared(**{name: GAMMA})

    drawn = ["".join(each.itertext()) for each in part.iter() if str(each.tag).endswith("}text")]
    assert "\u200b" + "x" * 14 + "…" + "x" * 5 + ", gumbel4" in drawn
    assert texts(part, "th")[-1] == name


@pytest.mark.slow
@pytest.mark.parametrize("width", [320, 390, 1280, 1920])
def test_no_word_is_cut_and_no_screen_scrolls_sideways(
    browser: Any, of_noise: Calibration, width: int
) -> None:
    text = comparison([("frame_1.png and 1 more", of_noise), ("other.yml", of_noise)])
    page = browser.new_page(viewport={"width": width, "height": 844})
    page.set_content(f"<!doctype html><style>{stylesheet()}</style><main>{text}</main>")

    assert page.evaluate("document.documentElement.scrollWidth") <= width
    heights = page.locator("thead th:visible").evaluate_all(
        "all => all.map(each => each.clientHeight / parseFloat(getComputedStyle(each).lineHeight))"
    )
    names = page.locator("tbody th").evaluate_all("all => all.map(each => each.clientWidth)")
    page.close()
    assert max(heights) < 3.6  # a line for each word of "From the first"
    assert len(heights) == (4 if width < 480 else 6)
    assert min(names) > 100
