"""Figures of level pairs: what is drawn, not how it looks."""

from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from chartless import AffineNoise, Cooccurrence, ModelCurve, Response, named_curve
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.noise.cooccurrence import noise_level_function
from chartless.evidence.noise.figures import draw_cooccurrence, draw_noise, draw_residuals
from chartless.evidence.noise.likelihood import PairCounts, with_scene
from chartless.evidence.noise.misfit import Pattern
from chartless.evidence.registry import KINDS
from chartless.noise import NoiseError
from chartless.result.response import Status
from chartless.simulate import simulate_frames
from chartless.types import Floats

NOISE = AffineNoise.from_8bit(0.05, 9)
EDGES = (np.arange(255) + 0.5) / 255


@pytest.fixture(scope="module")
def table() -> Cooccurrence:
    """Every irradiance equally often, a linear camera."""
    scene = np.random.default_rng(0).uniform(size=(400, 500))
    first, second = simulate_frames(scene, named_curve("linear"), NOISE)
    return Cooccurrence.of_pair(first, second)


def response_of(
    table: Cooccurrence | None,
    name: str = "Y",
    *,
    told: dict[str, Any] | None = None,
    **changes: Any,
) -> Response:
    """A response with an account of level pairs that says more besides."""
    values: dict[str, Any] = {
        "name": name,
        "curve": ModelCurve("gamma", (1.0,)),
        "noise": NOISE,
        "n_levels": 256,
        "observed_levels": (0, 255),
        "n_pairs": 200_000,
        "method": "ism-bin",
        "status": Status.CONVERGED,
        "accounts": (account_of_pairs(table, **(told or {})),),
    }
    return Response(**{**values, **changes})


@pytest.mark.parametrize("n_levels", [16, 64, 256])
def test_level_pairs_of_few_levels(n_levels: int, table: Cooccurrence) -> None:
    step = 256 // n_levels
    coarse = table.counts.reshape(n_levels, step, n_levels, step).sum(axis=(1, 3))
    response = response_of(Cooccurrence(coarse), n_levels=n_levels)
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
    residuals = drawn_residuals(response_of(table))

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
        drawn_residuals(response_of(table, noise=small, noise_error=each)) for each in (error, None)
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
    prepared = PairCounts(symmetric.astype(np.float64), np.zeros(256))
    model = with_scene(EDGES, NOISE, prepared, 15)
    expected = model.pairs[100, other] * symmetric.sum()

    residuals = drawn_residuals(response_of(Cooccurrence(counts)))

    drawn = residuals[len(residuals) // 2 + other - 100, 100]
    assert drawn == pytest.approx(
        (symmetric[100, other] - expected) / np.sqrt(variance * expected), rel=1e-9
    )
    assert drawn > 30


def test_the_pattern_of_a_misfit_is_named_above_its_residuals(table: Cooccurrence) -> None:
    axes = Figure().subplots()

    draw_residuals(axes, response_of(table, told={"pattern": Pattern.PEAKED}))

    assert axes.get_title() == "Observed minus expected: peaked"


@pytest.mark.parametrize("method", ["ism-bin", "likelihood", "nlf"])
def test_what_is_expected_is_of_the_scene_that_was_seen(method: str) -> None:
    """Much dark, little bright: an even scene would expect too many brighter partners."""
    scene = np.random.default_rng(1).uniform(size=(400, 500)) ** 3
    frames = simulate_frames(scene, named_curve("linear"), NOISE)

    residuals = drawn_residuals(response_of(Cooccurrence.of_pair(*frames), method=method))

    middle = len(residuals) // 2
    core = residuals[middle - 6 : middle + 7, 16:100]
    assert np.std(core) == pytest.approx(1, abs=0.1)
    assert abs(core[:4].mean()) < 0.1  # darker partners
    assert abs(core[-4:].mean()) < 0.1


def test_there_are_figures_of_noise_of_pairs_and_of_what_is_left(table: Cooccurrence) -> None:
    shown = KINDS["noise"].figures([response_of(table)])

    assert [each.name for each in shown] == ["noise", "pairs", "rest"]
    for each in shown:
        axes = Figure().subplots()
        each.draw(axes)
        assert axes.get_title().startswith(each.title)


def test_without_a_table_there_are_no_figures(table: Cooccurrence) -> None:
    """Not even if a single channel has none."""
    red, blue = (response_of(table, name) for name in "RB")
    green = response_of(None, "G")

    assert KINDS["noise"].figures([green]) == ()
    assert KINDS["noise"].figures([red, green, blue]) == ()
    assert KINDS["noise"].figures([red, blue]) != ()


def test_without_a_noise_there_are_no_figures(table: Cooccurrence) -> None:
    assert KINDS["noise"].figures([response_of(table, noise=None)]) == ()


@pytest.mark.parametrize(
    ("deviances", "shown"),
    [
        ((1.3, 1.1, 1.2), "R"),
        ((1.1, 1.1, 1.2), "B"),
        ((None, None, None), "G"),
        ((9, None, 1), "G"),
    ],
)
def test_the_channel_that_is_explained_least_is_shown(
    deviances: tuple[float | None, ...], shown: str, table: Cooccurrence
) -> None:
    """The middle one where that is not known."""
    channels = [
        response_of(table, name, told={"deviance": deviance})
        for name, deviance in zip("RGB", deviances, strict=True)
    ]

    _, pairs, rest = KINDS["noise"].figures(channels)

    assert f"channel {shown}." in pairs.words
    assert f"Channel {shown}:" in rest.words


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"deviance": 1.234}, "The misfit is 1.23 times that of chance alone (1 is perfect)."),
        ({"similarity": 0.9876}, "The similarity is 0.988 of what the true model would reach."),
        ({}, "This method measures no goodness of fit."),
        ({"deviance": 3, "pattern": Pattern.PEAKED}, "(1 is perfect); its pattern is “peaked”."),
    ],
)
def test_words_say_how_well_the_pairs_are_explained(
    told: dict[str, Any], words: str, table: Cooccurrence
) -> None:
    *_, rest = KINDS["noise"].figures([response_of(table, told=told)])

    assert words in rest.words


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
