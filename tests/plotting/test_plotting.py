"""Figures of responses: what is drawn, not how it looks."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from chartless import AffineNoise, ModelCurve, Response
from chartless.errors import ImageError, OutputError
from chartless.plotting import draw_differences, draw_response, draw_search, save_figure
from chartless.result.response import SearchHistory, Status


def response_of(name: str = "Y", **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name,
        "curve": ModelCurve("gamma", (1.0,)),
        "noise": AffineNoise.from_8bit(0.05, 9),
        "n_levels": 256,
        "observed_levels": (0, 255),
        "n_pairs": 200_000,
        "method": "ism-bin",
        "status": Status.CONVERGED,
        "history": SearchHistory("bin", (0.5, 0.9, 0.99), 10),
    }
    return Response(**{**values, **changes})


def test_the_response_is_drawn_as_it_is() -> None:
    figure = Figure()
    axes = figure.subplots()
    response = response_of(
        curve=ModelCurve("gamma", (0.5,)),
        observed_levels=(20, 200),
        inverse_lut_std=np.full(256, 0.01),
    )
    draw_response(axes, [response])

    curve, dots = axes.lines[:2]
    assert np.allclose(curve.get_xdata(), np.linspace(0, 1, 256) ** 2)
    assert np.allclose(curve.get_ydata(), np.linspace(0, 1, 256))
    assert np.allclose(dots.get_ydata(), [20 / 255, 200 / 255])
    assert len(axes.collections) == 1  # the band


@pytest.mark.parametrize(("n_pairs", "dots"), [(1, True), (0, False)])
def test_dots_are_levels_that_somebody_saw(n_pairs: int, dots: bool) -> None:
    axes = Figure().subplots()

    draw_response(axes, [response_of(n_pairs=n_pairs)])

    assert any(line.get_marker() == "o" for line in axes.lines) == dots
    assert ("dots" in axes.get_title()) == dots


def test_differences_are_of_light_at_one_brightness() -> None:
    """Of √I and I: brightness b stands for b² and b, whatever the levels."""
    first = response_of(curve=ModelCurve("gamma", (0.5,)), n_levels=1024, observed_levels=(0, 1023))
    std = np.full(256, 0.01)
    axes = Figure().subplots()

    draw_differences(axes, [first, response_of(inverse_lut_std=std)])

    zero, other = axes.lines
    assert np.abs(zero.get_ydata()).max() < 1e-12
    b = np.linspace(0, 1, 256)
    np.testing.assert_allclose(other.get_xdata(), b)
    np.testing.assert_allclose(other.get_ydata(), b - b**2, atol=1e-6)
    (band,) = axes.collections
    corners = band.get_paths()[0].vertices
    assert corners[:, 1].max() == pytest.approx(0.26, abs=1e-3)
    assert other.get_color() != zero.get_color()


def test_the_search_of_an_unbounded_objective() -> None:
    axes = Figure().subplots()

    draw_search(axes, [response_of(history=SearchHistory("sampled", (3.0, 7.0), 5))])

    assert axes.lines[0].get_ydata().tolist() == [3.0, 7.0]
    assert axes.get_ylabel() == "image similarity"


def test_a_search_without_history_is_empty() -> None:
    axes = Figure().subplots()

    draw_search(axes, [response_of(history=None)])

    assert not axes.lines


@pytest.mark.parametrize(
    ("name", "magic"),
    [("a.png", b"\x89PNG\r\n"), ("a.svg", b"<?xml"), ("a.pdf", b"%PDF"), ("a.PDF", b"%PDF")],
)
def test_figures_are_written(name: str, magic: bytes, tmp_path: Path) -> None:
    figure = Figure()
    figure.subplots()

    save_figure(figure, tmp_path / name)

    assert (tmp_path / name).read_bytes().startswith(magic)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.jpg", "a.txt", "a", "a.png.bak"])
def test_other_extensions_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"figures are written as \.png, \.svg, \.pdf"):
        save_figure(Figure(), tmp_path / name)

    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="create it first"):
        save_figure(Figure(), tmp_path / "missing" / "a.png")
