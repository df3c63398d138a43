"""Figures of level pairs: observed and expected counts, and noise at each level."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from matplotlib import colors
from matplotlib.axes import Axes

from chartless.evidence.kind import Figure
from chartless.evidence.noise.account import NAME
from chartless.evidence.noise.cooccurrence import (
    Cooccurrence,
    difference_moments,
    noise_level_function,
)
from chartless.evidence.noise.likelihood import PairCounts, with_scene
from chartless.noise import AffineNoise
from chartless.plotting import CHANNEL_COLOURS, VERMILION
from chartless.result.response import Response
from chartless.result.summary import of_each
from chartless.types import Counts, Floats, Indices

_MOST = 4.0  # deviations at the ends of the colour scale
_NEVER = 0.05  # expected pairs below which an empty cell is not drawn
_SCENE_STEPS = 15  # of expectation maximisation, for the pairs that a model expects
_QUARTERS = (0.25, 0.5, 0.75)


def figures(channels: Sequence[Response]) -> tuple[Figure, ...]:
    """Figures of all channels, and of the worst explained; none without tables."""
    tables = [each.account(NAME).record for each in channels]
    if any(table is None for table in tables) or any(each.noise is None for each in channels):
        return ()
    one = _least_explained(channels)
    return (
        Figure(
            "noise", "Noise of one frame", partial(draw_noise, channels=channels),
            _words_of_noise(channels),
        ),
        Figure(
            "pairs", "Level pairs", partial(draw_cooccurrence, response=one), _words_of_pairs(one)
        ),
        Figure(
            "rest", "Observed minus expected", partial(draw_residuals, response=one),
            _words_of_residuals(one),
        ),
    )  # fmt: skip


def draw_cooccurrence(axes: Axes, response: Response) -> None:
    """Draw counts of level pairs, with contours of the model at the same counts.

    The difference of the levels is drawn over the level in one frame: the band along
    the diagonal of the table, laid flat.
    """
    band = _laid_flat(axes, f"Level pairs, channel {response.name} (lines: model)", response)
    image = axes.pcolormesh(
        band.level, band.difference, np.ma.masked_equal(band.seen, 0), norm=colors.LogNorm(),
        cmap="viridis", rasterized=True,
    )  # fmt: skip
    axes.figure.colorbar(image, ax=axes, label="pixel pairs")
    decades = 10.0 ** np.arange(0, np.ceil(np.log10(max(band.seen.max(), 10))))
    # Scenes have few pixels at some levels: smooth contours need smooth counts.
    axes.contour(
        band.level, band.difference, band.expected, levels=decades, colors=VERMILION, linewidths=0.7
    )


def draw_residuals(axes: Axes, response: Response) -> None:
    """Draw level pairs minus those expected, in deviations of chance, laid flat.

    Cells with less than one expected pair are treated as if it were one. Grey noise is
    a good fit; `chartless.evidence.noise.misfit.Pattern` explains shapes.
    """
    account = response.account(NAME)
    pattern = f": {account['pattern']}" if "pattern" in account else ""
    band = _laid_flat(axes, f"Observed minus expected{pattern}", _of_seen_noise(response))
    # Symmetric counts on the diagonal come in twos, which doubles their variance.
    variance = np.maximum(band.expected, 1.0) * np.where(band.difference == 0, 2, 1)
    residual = (band.seen - band.expected) / np.sqrt(variance)
    nothing = (band.seen == 0) & (band.expected < _NEVER)
    image = axes.pcolormesh(
        band.level, band.difference, np.ma.masked_where(nothing, residual), cmap="RdBu_r",
        vmin=-_MOST, vmax=_MOST, rasterized=True,
    )  # fmt: skip
    axes.figure.colorbar(image, ax=axes, label="deviations", extend="both")


class _Band(NamedTuple):
    """The band along the diagonal of a table, shape (2R + 1, L) each."""

    level: Indices
    difference: Indices
    seen: Counts
    expected: Floats


def _laid_flat(axes: Axes, title: str, response: Response) -> _Band:
    """Label the axes, and extract the band that they show."""
    axes.set(title=title, xlabel="level in one frame", ylabel="other, difference")
    counts = _table(response).symmetric
    n_levels = counts.shape[0]
    reach = _reach(_table(response))
    level, difference = np.meshgrid(np.arange(n_levels), np.arange(-reach, reach + 1))
    other = level + difference
    inside = (other >= 0) & (other < n_levels)
    other = other.clip(0, n_levels - 1)
    seen = np.where(inside, counts[level, other], 0)
    expected = np.where(inside, _expected(response)[level, other], 0.0)
    axes.set_ylim(-reach, reach)
    return _Band(level, difference, seen, expected)


def draw_noise(axes: Axes, channels: Sequence[Response]) -> None:
    """Draw the noise level function, observed and modelled: deviation of one frame."""
    for response in channels:
        colour = CHANNEL_COLOURS[response.name]
        label = f"{response.name}: {_noise_text(response)}"
        counts = _table(response).symmetric
        expected = _expected(response).copy()
        for table in (counts, expected):  # clipped levels have no meaningful noise
            table[[0, -1]] = table[:, [0, -1]] = 0
        axes.plot(noise_level_function(counts), ".", color=colour, markersize=3, alpha=0.5)
        axes.plot(noise_level_function(expected), color=colour, label=label)
    axes.set(
        title="Noise of one frame (dots: seen, lines: model)",
        xlabel="level",
        ylabel="deviation in levels",
    )
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)


@lru_cache(maxsize=4)  # shared by figures: R, G, B and one with observed noise
def _expected(response: Response) -> Floats:
    """Level pairs expected from curve and noise, with the scene that fits best."""
    assert response.noise is not None
    pairs = _table(response).symmetric.astype(np.float64)
    edges = response.curve.inverse((np.arange(len(pairs) - 1) + 0.5) / (len(pairs) - 1))
    counts = PairCounts(pairs, np.zeros(len(pairs)))
    model = with_scene(edges, response.noise, counts, _SCENE_STEPS)
    return np.asarray(model.pairs * pairs.sum())


def _table(response: Response) -> Cooccurrence:
    record = response.account(NAME).record
    assert isinstance(record, Cooccurrence)
    return record


@lru_cache(maxsize=4)
def _of_seen_noise(response: Response) -> Response:
    """Response with its noise scaled to the pairs, where curve and noise are means.

    Means over the ratio u/v belong to no single ratio: their noise is one or two per
    cent too small, which shows with a million pairs.
    """
    noise = response.noise
    if noise is None or response.noise_error is None:
        return response
    counts = _table(response).symmetric
    seen, expected = (
        difference_moments(table[1:-1, 1:-1]).squares.sum()
        for table in (counts, _expected(response))
    )
    scale = float(seen / expected)
    return replace(response, noise=AffineNoise(scale * noise.slope, scale * noise.floor))


def _reach(table: Cooccurrence) -> int:
    """Difference of levels that includes 99.9 % of the pairs, with a margin."""
    earlier, later = np.nonzero(table.counts)
    size = np.bincount(np.abs(earlier - later), table.counts[earlier, later])
    share = np.cumsum(size) / size.sum()
    return int(1.3 * np.searchsorted(share, 0.999)) + 3


def _noise_text(response: Response) -> str:
    noise = response.noise
    return "unknown" if noise is None else f"U = {noise.slope_8bit:.3f}, V = {noise.floor_8bit:.1f}"


def _least_explained(channels: Sequence[Response]) -> Response:
    """The channel with the largest misfit; the middle one where none is known."""
    accounts = [each.account(NAME) for each in channels]
    if all("deviance" in each for each in accounts):
        return max(channels, key=lambda each: float(each.account(NAME)["deviance"]))
    return channels[len(channels) // 2]


def _words_of_noise(channels: Sequence[Response]) -> str:
    """Text on the observed noise at three levels."""
    last = channels[0].n_levels - 1
    levels = [round(share * last) for share in _QUARTERS]

    def seen(response: Response) -> str:
        noise = noise_level_function(_table(response).symmetric)[levels]
        return " / ".join("unseen" if np.isnan(each) else f"{each:.2f}" for each in noise)

    places = " / ".join(map(str, levels))
    return (
        f"At the levels {places} a pixel of one frame deviates by {of_each(channels, seen)} "
        "levels. Dots: seen, lines: model."
    )


def _words_of_pairs(response: Response) -> str:
    """Text on the differences between the levels of pairs."""
    table = _table(response)
    earlier, later = np.nonzero(table.counts)
    size = np.bincount(np.abs(earlier - later), table.counts[earlier, later])
    share = np.cumsum(size) / size.sum()
    half, most = (int(np.searchsorted(share, part)) for part in (0.5, 0.99))
    return (
        f"{table.n_pairs:,} pairs of one pixel in two frames, channel {response.name}. "
        f"Half of them are at most {half} level{'s' * (half != 1)} apart, 99 % at most {most}. "
        "Lines: model, a factor of ten from one to the next."
    )


def _words_of_residuals(response: Response) -> str:
    """Text on how well the model explains the level pairs."""
    account = response.account(NAME)
    fit = "This method measures no goodness of fit"
    if "deviance" in account:
        times = f"{account['deviance']:.2f} times"
        fit = f"The misfit is {times} that of chance alone (1 is perfect)"
    elif "similarity" in account:
        fit = f"The similarity is {account['similarity']:.3f} of what the true model would reach"
    pattern = f"; its pattern is “{account['pattern']}”" if "pattern" in account else ""
    return (
        f"{fit}{pattern}. Channel {response.name}: an even speckle is chance, shapes are not. "
        "Red: more pairs than expected, blue: fewer, full colour at 4 deviations."
    )
