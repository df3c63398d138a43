"""Figures: what is drawn, not how it looks."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response, named_curve
from chartless.errors import ImageError, OutputError
from chartless.evidence.noise.cooccurrence import noise_level_function
from chartless.evidence.noise.estimates import NoiseError
from chartless.flags import Pattern
from chartless.methods.ism.objectives import expected_counts, half_levels
from chartless.plotting import (
    draw_cooccurrence,
    draw_differences,
    draw_noise,
    draw_residuals,
    draw_response,
    draw_search,
    overview,
    save_figure,
)
from chartless.result.response import SearchHistory, Status
from chartless.simulate import simulate_frames
from chartless.types import Floats

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
    for word in ("Response", "Level pairs, channel G", "Seen less", "Noise", "Search"):
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


def drawn_residuals(response: Response) -> Floats:
    """By level and difference, from −R to R."""
    axes = Figure().subplots()
    draw_residuals(axes, response)
    (mesh,) = (each for each in axes.collections if isinstance(each, QuadMesh))
    assert mesh.get_clim() == (-4, 4)
    return np.ma.filled(mesh.get_array(), np.nan).reshape(-1, response.n_levels)


def test_residuals_of_a_good_fit_are_chance(table: Cooccurrence) -> None:
    """Of the truth itself, in deviations of Poisson counts."""
    residuals = drawn_residuals(response_of(table=table))

    middle = len(residuals) // 2
    core = residuals[middle - 8 : middle + 9, 40:216]
    assert np.std(core) == pytest.approx(1, abs=0.05)
    # Equal levels; a bit less, as this model knows the total of each row.
    assert np.std(core[8]) == pytest.approx(0.9, abs=0.1)
    assert abs(core.mean()) < 0.05


def test_residuals_leave_out_what_means_over_the_ratio_get_wrong(table: Cooccurrence) -> None:
    """Noise a tenth too small, of a method that gives its error, is scaled to that of the pairs."""
    small = AffineNoise(0.9 * NOISE.slope, 0.9 * NOISE.floor)
    error = NoiseError(0.5, 0.2, -0.9)

    scaled, plain = (
        drawn_residuals(response_of(table=table, noise=small, noise_error=each))
        for each in (error, None)
    )

    middle = len(scaled) // 2
    assert np.abs(scaled[middle - 1 : middle + 2, 40:216].mean()) < 0.1
    assert plain[middle - 1 : middle + 2, 40:216].mean() < -0.5


@pytest.mark.parametrize(("other", "variance"), [(103, 1), (97, 1), (100, 2)])
def test_a_residual_is_what_is_seen_too_much(
    other: int, variance: int, table: Cooccurrence
) -> None:
    """Pairs of one level with itself are counted twice, so that chance counts double."""
    counts = table.counts.copy()
    counts[100, other] += 1000
    symmetric = Cooccurrence(counts).symmetric
    expected = expected_counts(symmetric, half_levels(256), NOISE)[100, other]

    residuals = drawn_residuals(response_of(table=Cooccurrence(counts)))

    drawn = residuals[len(residuals) // 2 + other - 100, 100]
    assert drawn == pytest.approx(
        (symmetric[100, other] - expected) / np.sqrt(variance * expected), rel=1e-9
    )
    assert drawn > 30


def test_the_pattern_of_a_misfit_is_named_above_its_residuals(table: Cooccurrence) -> None:
    axes = Figure().subplots()

    draw_residuals(axes, response_of(table=table, pattern=Pattern.PEAKED))

    assert axes.get_title() == "Seen less expected: peaked"


@pytest.mark.parametrize("draw", [draw_cooccurrence, draw_residuals])
def test_level_pairs_without_a_table_say_so(draw: Callable[[Axes, Response], None]) -> None:
    axes = Figure().subplots()

    draw(axes, response_of())

    assert "no co-occurrence table" in axes.texts[0].get_text()


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


@pytest.mark.parametrize(("n_pairs", "dots"), [(1, True), (0, False)])
def test_dots_are_levels_that_somebody_saw(n_pairs: int, dots: bool) -> None:
    axes = Figure().subplots()

    draw_response(axes, [response_of(n_pairs=n_pairs)])

    assert any(line.get_marker() == "o" for line in axes.lines) == dots
    assert ("dots" in axes.get_title()) == dots


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
