"""All figures of a report on one picture: what is drawn, not how it looks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless import Calibration, ModelCurve
from chartless.flags import Flag
from chartless.plotting import save_figure
from chartless.report import overview, render
from chartless.result.response import SearchHistory

TRUTH = ModelCurve("gamma", (0.5,))
"""Of `of_noise` and `of_bracket`."""


def titled(figure: Figure) -> list[Axes]:
    """Axes of figures; those of scales have no title."""
    return [axes for axes in figure.axes if axes.get_title()]


def with_history(calibration: Calibration) -> Calibration:
    history = SearchHistory("bin", (0.5, 0.9, 0.99), 10)
    channels = tuple(replace(each, history=history) for each in calibration.channels)
    return replace(calibration, channels=channels)


def texts(figure: Figure) -> str:
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    return "\n".join(text.get_text() for legend in legends if legend for text in legend.get_texts())


@pytest.mark.slow
@pytest.mark.parametrize("which", ["of_noise", "of_bracket", "linear_camera"])
def test_it_has_as_many_figures_as_the_report(which: str, request: pytest.FixtureRequest) -> None:
    calibration = request.getfixturevalue(which)

    figure = overview(calibration)

    in_report = render(calibration).count("<svg ")
    assert in_report == {"of_noise": 5, "of_bracket": 4, "linear_camera": 1}[which]
    assert len(titled(figure)) == in_report


def test_one_page_shows_everything(of_noise: Calibration) -> None:
    figure = overview(with_history(of_noise), truth=TRUTH)

    titles = [axes.get_title() for axes in titled(figure)]
    wanted = ("Response", "How sure", "Noise", "Level pairs, channel B", "Observed minus", "Search")
    assert len(titles) == len(wanted)
    for title, word in zip(titles, wanted, strict=True):
        assert title.startswith(word)
    for name in "RGB":
        assert f"{name} (RMSE 0.000)" in texts(figure)
        assert f"{name}: U = 0.050, V = 9.0" in texts(figure)
    assert "truth" in texts(figure)


def test_a_bracket_is_shown_from_exposure_to_exposure(of_bracket: Calibration) -> None:
    titles = [axes.get_title() for axes in titled(overview(of_bracket))]

    assert titles[2:] == [
        "Transfer, channel Y (dots: seen, lines: model)",
        "Light of the pair over the ratio of its exposures",
    ]


def test_errors_are_taken_from_the_truth(of_bracket: Calibration) -> None:
    """Of √I where I is true: b² − b at brightness b, −1/4 at most."""
    figure = overview(of_bracket, truth=ModelCurve("gamma", (1.0,)))

    (axes,) = (each for each in figure.axes if "lines: actual error" in each.get_title())
    errors = axes.lines[-1].get_ydata()
    b = np.linspace(0, 1, 256)
    np.testing.assert_allclose(errors, b**2 - b, atol=1e-6)


@pytest.mark.slow
def test_a_place_without_a_figure_is_empty(of_noise: Calibration) -> None:
    """Of five figures, two in a row."""
    figure = overview(of_noise)

    assert sum(not axes.axison for axes in figure.axes) == 1


def test_doubts_are_in_the_title(of_noise: Calibration) -> None:
    channels = tuple(each.with_flags(Flag.CLIPPED, Flag.MISFIT) for each in of_noise.channels)

    figure = overview(replace(of_noise, channels=channels))

    assert figure.get_suptitle() == "Camera response by likelihood — doubtful: clipped, misfit"


def test_a_bare_calibration_is_drawn_too(linear_camera: Calibration, tmp_path: Path) -> None:
    """One that another program made: no error, no noise, no account, no history."""
    save_figure(overview(linear_camera), tmp_path / "bare.png")

    assert (tmp_path / "bare.png").stat().st_size > 1000


def test_figures_are_no_part_of_pyplot(of_noise: Calibration) -> None:
    """Nothing to close, nothing to show."""
    import matplotlib.pyplot as plt

    overview(of_noise)

    assert plt.get_fignums() == []
