"""Figures as SVG inside a page."""

import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib import colors
from matplotlib.axes import Axes

from chartless import plotting
from chartless.report._svg import inline_svg

SIZE = (360, 250)


def drawn(draw: Callable[[Axes], Any], salt: str = "a", **attributes: str) -> ET.Element:
    text = str(inline_svg(draw, SIZE, salt=salt, **attributes))
    return ET.fromstring(
        text.replace("<svg ", '<svg xmlns:xlink="http://www.w3.org/1999/xlink" ', 1)
    )


def test_text_stays_text_to_the_last_digit() -> None:
    def draw(axes: Axes) -> None:
        axes.set_yticks([0.12345, 0.5], ["0.12345", "2.71828182"])
        axes.set_xlabel("a <b> & c")

    texts = [each.text for each in drawn(draw).iter("text")]

    assert {"0.12345", "2.71828182", "a <b> & c"} <= set(texts)


@pytest.mark.slow
def test_threads_that_draw_at_once_do_not_mix_their_settings() -> None:
    def draw(salt: str) -> str:
        return str(inline_svg(lambda axes: axes.plot([0, 1]), SIZE, salt=salt))

    salts = [f"salt {number}" for number in range(8)]
    alone = [draw(salt) for salt in salts]
    with ThreadPoolExecutor(8) as threads:
        assert list(threads.map(draw, salts)) == alone


def test_coordinates_are_rounded_where_nobody_sees_it() -> None:
    figure = drawn(lambda axes: axes.plot(np.linspace(0, 1, 50), np.linspace(0, 1, 50) ** 3))

    paths = " ".join(each.get("d", "") for each in figure.iter("path"))
    assert re.search(r"\d\.\d\d\b", paths)
    assert not re.search(r"\.\d{3}|\d\.(?!\d)", paths)


def test_colours_follow_the_page() -> None:
    def draw(axes: Axes) -> None:
        for place, colour in enumerate(plotting.SERIES_COLOURS):
            axes.axhline(place, color=colour)
            axes.text(0, place, "x", color=colour)

    text = str(inline_svg(draw, SIZE, salt="a"))

    for colour in plotting.SERIES_COLOURS:
        assert not re.search(rf"(?<!, ){colour}", text)
    assert text.count("currentColor") > 2
    assert "#000000" not in text


def test_it_leaves_the_rest_of_the_page_alone() -> None:
    """No style for all elements, no background, no names that other figures have too."""
    figures = [drawn(lambda axes: axes.plot([0, 1]), salt) for salt in "ab"]

    names = [each.get("id") for figure in figures for each in figure.iter() if each.get("id")]
    assert names
    assert len(names) == len(set(names))
    for figure in figures:
        assert not list(figure.iter("style"))
        assert not re.search("fill: #fff", ET.tostring(figure, "unicode"))


def test_attributes_are_escaped() -> None:
    figure = drawn(lambda axes: None, aria_label='a "quoted" <b>')

    assert figure.get("aria-label") == 'a "quoted" <b>'
    assert figure.get("role") == "img"
    assert figure.get("viewBox") == "0 0 360 250"


def test_dense_images_are_pictures() -> None:
    def draw(axes: Axes) -> None:
        values = np.random.default_rng(1).uniform(1, 100, (200, 256))
        axes.pcolormesh(values, norm=colors.LogNorm(), rasterized=True)

    figure = drawn(draw)

    (image,) = figure.iter("image")
    assert str(image.get("{http://www.w3.org/1999/xlink}href")).startswith(
        "data:image/png;base64,iV"
    )


def test_the_title_is_left_to_the_page() -> None:
    figure = drawn(lambda axes: axes.set_title("Response"))

    assert "Response" not in "".join(figure.itertext())


@pytest.mark.parametrize("n_levels", [4096, 65536])
def test_figures_do_not_grow_with_the_levels(n_levels: int) -> None:
    from chartless import ModelCurve, Response
    from chartless.result.response import Status

    response = Response(
        name="G", curve=ModelCurve("gamma", (0.5,)), noise=None, n_levels=n_levels,
        observed_levels=(0, n_levels - 1), n_pairs=1, method="likelihood",
        status=Status.CONVERGED, inverse_lut_std=np.full(n_levels, 0.01),
    )  # fmt: skip

    for draw in (plotting.draw_response, plotting.draw_deviations):
        assert len(inline_svg(lambda axes, draw=draw: draw(axes, [response]), SIZE, salt="a")) < 2e5
