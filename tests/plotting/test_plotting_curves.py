"""Figures of fits: what is drawn, not how it looks."""

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from chartless.curves.fitting import Fit, fit
from chartless.plotting import SERIES_COLOURS, draw_fits, fits_figure


def curve(n_samples: int) -> tuple[Any, Any]:
    irradiance = np.linspace(0, 1, n_samples)
    return irradiance, irradiance**0.5 + 0.02 * np.sin(np.pi * irradiance)


def fitted(n_samples: int, *names: str) -> list[Fit]:
    return [fit(name, *curve(n_samples)) for name in names]


@pytest.mark.parametrize("n_samples", [20, 300])
def test_samples_and_fits_are_above_and_differences_below(n_samples: int) -> None:
    irradiance, brightness = curve(n_samples)
    fits = fitted(n_samples, "gamma", "eegc1", "poly2")

    figure = fits_figure(irradiance, brightness, fits, title="a curve")

    upper, lower = figure.axes
    measured, *lines = upper.get_lines()
    assert np.array_equal(measured.get_xdata(), irradiance)
    assert np.array_equal(measured.get_ydata(), brightness)
    assert len(lines) == 3
    for line, each in zip(lines, fits, strict=True):
        assert line.get_ydata() == pytest.approx(each.response(line.get_xdata()))
        assert line.get_xdata()[[0, -1]].tolist() == [0, 1]
    *differences, zero = lower.get_lines()
    assert len(differences) == 3
    assert list(zero.get_ydata()) == [0, 0]
    for line, each in zip(differences, fits, strict=True):
        assert line.get_ydata() == pytest.approx(each.response(irradiance) - brightness)
        rms = np.sqrt(np.mean(np.square(line.get_ydata())))
        assert rms == pytest.approx(each.rmse, rel=1e-9)
    colours = [line.get_color() for line in lines]
    assert colours == [line.get_color() for line in differences]
    assert len(set(colours)) == 3


def test_the_legend_names_families_and_their_errors() -> None:
    irradiance, brightness = curve(30)
    fits = fitted(30, "gamma", "ameegc2-exact")

    figure = fits_figure(irradiance, brightness, fits, title="curve.csv")

    legend = figure.axes[0].get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["measured", *(f"{each.model.name} ({each.rmse:.4f})" for each in fits)]
    assert figure.get_suptitle() == "curve.csv"


def test_axes_are_named() -> None:
    figure = fits_figure(*curve(30), fitted(30, "gamma"), title="")

    upper, lower = figure.axes
    assert upper.get_ylabel() == "brightness"
    assert (lower.get_xlabel(), lower.get_ylabel()) == ("irradiance", "fit − measured")
    assert upper.get_xlim() == lower.get_xlim() == (0, 1)


def test_few_samples_are_points_and_many_a_line() -> None:
    few, many = (
        fits_figure(*curve(n), fitted(n, "gamma"), title="").axes[0].get_lines()[0]
        for n in (20, 300)
    )

    assert few.get_marker() == "o"
    assert few.get_linestyle() == "None"
    assert many.get_linestyle() == "-"


def test_without_fits_the_samples_are_drawn() -> None:
    upper, lower = Figure().subplots(2, 1)

    draw_fits(upper, lower, *curve(20), [])

    assert len(upper.get_lines()) == 1
    assert len(lower.get_lines()) == 1


def test_as_many_fits_as_colours_can_be_told_apart() -> None:
    names = ("gamma", "eegc1", "eegc2", "poly2", "poly3", "conpoly1", "conpoly2")
    upper, lower = Figure().subplots(2, 1)

    draw_fits(upper, lower, *curve(20), fitted(20, *names))

    colours = [line.get_color() for line in upper.get_lines()[1:]]
    assert len(set(colours)) == len(names) == len(SERIES_COLOURS)


def test_figures_are_no_part_of_pyplot() -> None:
    """Nothing to close, nothing to show."""
    import matplotlib.pyplot as plt

    fits_figure(*curve(20), fitted(20, "gamma"), title="")

    assert plt.get_fignums() == []
