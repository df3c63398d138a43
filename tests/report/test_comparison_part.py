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


def cells(part: Element) -> list[list[list[str]]]:
    """Lines of the cells of each camera."""
    return [
        [["".join(line.split()) for line in lines_of(cell)] for cell in row.iter("td")]
        for row in part.iter("tr")
    ][1:]


def lines_of(cell: Element) -> list[str]:
    """Text of a cell, broken where it is."""
    lines = [cell.text or ""]
    for each in cell:
        if each.tag == "br":
            lines.append(each.tail or "")
        else:
            lines[-1] += "".join(each.itertext()) + (each.tail or "")
    return lines


@pytest.mark.slow
def test_the_table_says_how_far_light_is_apart(compared: Callable[..., Element]) -> None:
    """Root mean square of b − b² over brightness is √(1/30), in all channels alike."""
    part = compared(linear=ModelCurve("gamma", (1.0,)), same=GAMMA)

    first, linear, same = cells(part)

    assert texts(part, "th")[-3:] == ["first", "linear", "same"]
    assert first[-1] == ["-"]
    assert [line[0] for line in linear[-1]] == ["R", "G", "B"]
    distances = [float(line[1:]) for line in linear[-1]]
    assert distances == pytest.approx([np.sqrt(1 / 30)] * 3, abs=0.001)
    assert same[-1] == ["R0.000", "G0.000", "B0.000"]
    assert first[-2] == ["R±0.007", "G±0.007", "B±0.007"]
    assert linear[-2] == ["±0.007"]
    assert list(part.iter("b")) == []  # no channel is worse


def in_blue(of_noise: Calibration, curve: ModelCurve) -> Calibration:
    """The camera with another curve in its third channel."""
    red, green, blue = of_noise.channels
    return replace(of_noise, channels=(red, green, replace(blue, curve=curve)))


@pytest.mark.slow
def test_a_difference_in_one_channel_is_not_hidden(of_noise: Calibration) -> None:
    """f = I in blue alone, where the first has √I: a quarter in the middle."""
    text = comparison(
        [("first", of_noise), ("odd", in_blue(of_noise, ModelCurve("gamma", (1.0,))))]
    )
    part = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parseFragment(text)

    _, odd = cells(part)

    assert odd[-1] == ["R0.000", "G0.000", "B0.182"]
    assert texts(part, "b") == ["B 0.182"]
    wanted = "Channel B differs most. The largest difference is +0.250 (odd, at brightness 0.50)."
    assert wanted in texts(part, "p")
    captions = dict(
        zip((each.get("id") for each in part.iter("figcaption")), texts(part, "figcaption"),
            strict=True)
    )  # fmt: skip
    assert "the same to three digits" in captions["difference-G-text"]
    assert "difference is +0.250 (odd" in captions["difference-B-text"]


def test_cameras_of_one_channel_have_no_letters(of_noise: Calibration) -> None:
    grey = replace(of_noise, channels=(replace(of_noise.channels[1], name="Y"),))
    linear = replace(grey.channels[0], curve=ModelCurve("gamma", (1.0,)))

    text = comparison([("first", grey), ("second", replace(grey, channels=(linear,)))])

    part = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parseFragment(text)
    assert texts(part, "h3") == ["Response", "Difference from the first"]
    assert cells(part)[1][-1] == ["0.182"]
    assert "differs most" not in text


def test_the_figures_say_what_they_show(compared: Callable[..., Element]) -> None:
    """b − b² is a quarter in the middle."""
    part = compared(linear=ModelCurve("gamma", (1.0,)))

    names = {each.get("id"): text for each, text in zip(
        part.iter("figcaption"), texts(part, "figcaption"), strict=True
    )}  # fmt: skip
    svgs = [each for each in part.iter() if str(each.tag).endswith("svg")]
    assert [each.get("aria-labelledby") for each in svgs] == [*names]
    assert len(names) == 6
    for channel in "RGB":
        assert "Brightness 0.5 stands for 0.250 to 0.500" in names[f"compared-{channel}-text"]
        told = names[f"difference-{channel}-text"]
        assert re.search(r"\+0\.250 \(linear, at brightness 0\.50", told)


@pytest.mark.slow
def test_curves_below_the_first_have_a_sign(compared: Callable[..., Element]) -> None:
    part = compared(steep=ModelCurve("gamma", (0.25,)))

    assert "−0.250 (steep, at brightness 0.71)" in texts(part, "figcaption")[3]


def test_curves_that_are_the_same_are_called_so(compared: Callable[..., Element]) -> None:
    assert "the same to three digits" in texts(compared(same=GAMMA), "figcaption")[3]


@pytest.mark.slow
def test_long_names_leave_room_for_the_curves(compared: Callable[..., Element]) -> None:
    """What differs is at their end, and the table has all of it."""
    name = f"{'x' * 500}, gumbel4"

    part = compared(**{name: GAMMA})

    drawn = ["".join(each.itertext()) for each in part.iter() if str(each.tag).endswith("}text")]
    assert "\u200b" + "x" * 12 + "…" + "x" * 3 + ", gumbel4" in drawn
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
    assert len(heights) == (4 if width < 480 else 5)
    assert min(names) > 100
