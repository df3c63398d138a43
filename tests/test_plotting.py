"""Figures: what is drawn, not how it looks."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response, named_curve
from chartless.cooccurrence import noise_level_function
from chartless.errors import ImageError, OutputError
from chartless.objectives import expected_counts, half_levels
from chartless.plotting import (
    draw_cooccurrence,
    draw_noise,
    draw_response,
    draw_search,
    overview,
    save_figure,
)
from chartless.response import SearchHistory, Status
from chartless.simulate import simulate_frames

NOISE = AffineNoise.from_8bit(0.05, 9)


@pytest.fixture(scope="module")
def table() -> Cooccurrence:
    """Every irradiance equally often, a linear camera."""
    scene = np.random.default_rng(0).uniform(size=(400, 500))
    first, second = simulate_frames(scene, named_curve("linear"), NOISE)
    return Cooccurrence.of_pair(first, second)


def response_of(name: str = "Y", **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name,
        "curve": ModelCurve("gamma", (1.0,)),
        "noise": NOISE,
        "n_levels": 256,
        "observed_levels": (0, 255),
        "n_pairs": 200_000,
        "method": "ism-bin",
        "status": Status.CONVERGED,
        "history": SearchHistory("bin", (0.5, 0.9, 0.99), 10),
    }
    return Response(**{**values, **changes})


def texts(figure: Figure) -> str:
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    return "\n".join(text.get_text() for legend in legends if legend for text in legend.get_texts())


def test_one_page_shows_everything(table: Cooccurrence) -> None:
    channels = tuple(response_of(name, table=table) for name in "RGB")

    figure = overview(Calibration(channels=channels, bit_depth=8), truth=named_curve("linear"))

    titles = [axes.get_title() for axes in figure.axes]
    for word in ("Response", "Level pairs, channel G", "Noise", "Search"):
        assert any(word in title for title in titles), titles
    for name in "RGB":
        assert f"{name} (RMSE 0.000)" in texts(figure)
        assert f"{name}: U = 0.050, V = 9.0" in texts(figure)
    assert "truth" in texts(figure)


def test_doubts_are_in_the_title() -> None:
    from chartless.flags import Flag

    doubtful = response_of(flags=(Flag.CLIPPED, Flag.MISFIT))
    figure = overview(Calibration(channels=(doubtful,), bit_depth=8))

    assert "doubtful: clipped, misfit" in figure.get_suptitle()


def test_a_bare_calibration_is_drawn_too(tmp_path: Path) -> None:
    """One that another program made: no table, no history."""
    bare = response_of(history=None, table=None)

    figure = overview(Calibration(channels=(bare,), bit_depth=8))

    save_figure(figure, tmp_path / "bare.png")
    assert (tmp_path / "bare.png").stat().st_size > 1000


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


def test_the_search_of_an_unbounded_objective() -> None:
    axes = Figure().subplots()

    draw_search(axes, [response_of(history=SearchHistory("sampled", (3.0, 7.0), 5))])

    assert axes.lines[0].get_ydata().tolist() == [3.0, 7.0]
    assert axes.get_ylabel() == "image similarity"


def test_a_search_without_history_is_empty() -> None:
    axes = Figure().subplots()

    draw_search(axes, [response_of(history=None)])

    assert not axes.lines


@pytest.mark.parametrize("n_levels", [16, 64, 256])
def test_level_pairs_of_few_levels(n_levels: int, table: Cooccurrence) -> None:
    step = 256 // n_levels
    coarse = table.counts.reshape(n_levels, step, n_levels, step).sum(axis=(1, 3))
    response = response_of(n_levels=n_levels, table=Cooccurrence(coarse))
    first, second = Figure().subplots(1, 2)

    draw_cooccurrence(first, response)
    draw_noise(second, [response])

    assert first.collections
    assert second.lines


def test_level_pairs_without_a_table_say_so() -> None:
    axes = Figure().subplots()

    draw_cooccurrence(axes, response_of())

    assert "no co-occurrence table" in axes.texts[0].get_text()


def test_noise_by_level_is_the_noise_of_one_frame(table: Cooccurrence) -> None:
    seen = noise_level_function(table.symmetric)

    middle = slice(40, 216)  # away from the ends, where clipping narrows it
    level = np.arange(256)[middle]
    expected = np.sqrt(0.05 * level + 9 + 1 / 12)
    assert np.abs(seen[middle] / expected - 1).mean() < 0.05


def test_levels_with_few_pairs_have_no_noise(table: Cooccurrence) -> None:
    counts = table.symmetric.copy()
    counts[100:111, :] = counts[:, 100:111] = 0

    seen = noise_level_function(counts)

    assert np.isnan(seen[105])
    assert np.isfinite(seen[60])


def test_expected_counts_have_the_totals_of_those_seen(table: Cooccurrence) -> None:
    """Except for black and white, which say nothing about a pixel's light."""
    counts = table.symmetric

    expected = expected_counts(counts, half_levels(256), NOISE)

    assert expected.shape == counts.shape
    assert (expected >= 0).all()
    assert np.allclose(expected.sum(axis=1)[1:-1], counts.sum(axis=1)[1:-1], rtol=1e-6)


def test_expected_counts_of_the_truth_are_those_seen(table: Cooccurrence) -> None:
    counts = table.symmetric

    expected = expected_counts(counts, half_levels(256), NOISE)

    inside = np.zeros(counts.shape, bool)
    inside[30:226, 30:226] = True
    many = inside & (expected > 50)
    pulls = (counts[many] - expected[many]) / np.sqrt(expected[many])
    assert np.sqrt(np.mean(pulls**2)) < 2  # counts of a symmetric table come in twos


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


def test_figures_are_no_part_of_pyplot(table: Cooccurrence) -> None:
    """Nothing to close, nothing to show."""
    import matplotlib.pyplot as plt

    overview(Calibration(channels=(response_of(table=table),), bit_depth=8))

    assert plt.get_fignums() == []
