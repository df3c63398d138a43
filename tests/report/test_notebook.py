"""What a notebook shows of a calibration and of a response."""

import re
from dataclasses import replace

import html5lib
import pytest

from chartless import Calibration
from chartless.flags import Flag


@pytest.mark.parametrize("which", ["calibration", "response"])
def test_a_notebook_shows_verdict_and_curve(of_noise: Calibration, which: str) -> None:
    value = of_noise if which == "calibration" else of_noise.channels[1]

    output = value._repr_html_()

    fragment = html5lib.HTMLParser(strict=True).parseFragment(output)
    words = " ".join("".join(fragment.itertext()).split())
    assert words.startswith("Camera response: good. The curve is known to ± 0.007")
    assert output.count("<svg ") == 1
    assert re.search(r'aria-label="Brightness 0\.5 stands for .*0\.250', output)
    assert ("R\N{NO-BREAK SPACE}0.250" in output) == (which == "calibration")
    assert "http" not in output
    assert "<script" not in output


def test_the_line_of_a_linear_camera_is_weaker_than_curves_on_any_ground(
    of_noise: Calibration,
) -> None:
    output = of_noise._repr_html_()

    assert "var(--faint, rgb(128 128 128 / 50%))" in output
    assert "#cccccc" not in output


def test_no_line_ends_after_a_plus_minus(of_noise: Calibration) -> None:
    output = of_noise._repr_html_()

    assert "±\N{NO-BREAK SPACE}0.007" in output
    assert "± " not in output


def test_doubts_are_shown(of_noise: Calibration) -> None:
    output = of_noise.channels[0].with_flags(Flag.CORRELATED_NOISE)._repr_html_()

    assert "Camera response: do not trust." in output
    assert "correlated noise" in output


def test_outputs_of_one_notebook_share_no_names(of_noise: Calibration) -> None:
    """A drawing that is folded away must not take the others' clipping with it."""
    first = of_noise.channels[0]
    other = replace(first, curve=type(first.curve)("gamma", (0.6,)))

    names = [
        re.findall(r' id="([^"]*)"', value._repr_html_()) for value in (first, other, of_noise)
    ]

    assert all(names)
    assert len(set().union(*names)) == sum(map(len, names))


def test_ipython_finds_it(of_noise: Calibration) -> None:
    formatters = pytest.importorskip(
        "IPython.core.formatters", reason="IPython is not installed: pip install ipython"
    )

    output = formatters.HTMLFormatter()(of_noise)

    assert "Camera response: good." in output
