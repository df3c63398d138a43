"""Figures of calibrations."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from matplotlib import colors, ticker
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chartless.curves import AbstractCurve
from chartless.evidence.bracket.estimates import SeenTransfer
from chartless.evidence.noise.cooccurrence import (
    Cooccurrence,
    difference_moments,
    noise_level_function,
)
from chartless.evidence.noise.likelihood import PairCounts, with_scene
from chartless.methods.ism.objectives import expected_counts, half_levels
from chartless.noise import AffineNoise
from chartless.plotting._style import CHANNEL_COLOURS, SERIES_COLOURS, VERMILION
from chartless.result.calibration import Calibration
from chartless.result.response import Response, rmse
from chartless.result.verdict import typical_of_exposures
from chartless.types import Counts, Floats, Indices

_MOST = 4.0  # deviations at the ends of the colour scale
_NEVER = 0.05  # pairs expected where there are none: nothing to see
_MOST_DRAWN = 1024
_MOST_APART = 0.3  # relative, at the ends of a scale
_SCENE_STEPS = 15  # of expectation maximisation, for the pairs that a model expects


def overview(calibration: Calibration, *, truth: AbstractCurve | None = None) -> Figure:
    """Everything there is to see about a calibration on one page.

    Parameters
    ----------
    calibration : Calibration
    truth : AbstractCurve, optional
        Known response, drawn beside the estimate.

    Returns
    -------
    Figure
        Response; level pairs of the middle channel, and how they differ from the model; noise
        by level; history of the search or, for methods without one, the deviations of the inverse
        response. Of a bracket without repeats: response, transfer of brightness from
        exposure to exposure, and deviations.
    """
    if all(response.table is None and response.exposures for response in calibration.channels):
        return _bracket_overview(calibration, truth)
    figure = Figure(figsize=(11, 9.5), layout="constrained")
    axes = figure.subplot_mosaic(
        [["response", "pairs"], ["response", "residuals"], ["noise", "last"]],
        height_ratios=(1, 1, 1.7),
    )
    channels = calibration.channels
    middle = channels[len(channels) // 2]
    draw_response(axes["response"], channels, truth=truth)
    draw_cooccurrence(axes["pairs"], middle)
    axes["pairs"].set_xlabel("")  # that of the residuals below
    draw_residuals(axes["residuals"], middle)
    draw_noise(axes["noise"], channels)
    if any(response.history is not None for response in channels):
        draw_search(axes["last"], channels)
    else:
        draw_deviations(axes["last"], channels, truth=truth)
    _name(figure, calibration)
    return figure


def _bracket_overview(calibration: Calibration, truth: AbstractCurve | None) -> Figure:
    figure = Figure(figsize=(11, 9.5), layout="constrained")
    axes = figure.subplot_mosaic([["response", "transfer"], ["error", "last"]])
    channels = calibration.channels
    typical = typical_of_exposures(channels) or channels[len(channels) // 2]
    draw_response(axes["response"], channels, truth=truth)
    draw_transfers(axes["transfer"], typical)
    draw_transfer_errors(axes["error"], typical)
    draw_deviations(axes["last"], channels, truth=truth)
    _name(figure, calibration)
    return figure


def _name(figure: Figure, calibration: Calibration) -> None:
    flags = ", ".join(flag.code for flag in calibration.flags)
    title = f"{calibration.channels[0].method}" + (f" — doubtful: {flags}" if flags else "")
    figure.suptitle(f"Camera response by {title}", fontsize=12)


def draw_transfers(axes: Axes, response: Response) -> None:
    """Level of an exposure over that of a longer one, seen and by the curve."""
    axes.set(
        title=f"Transfer, channel {response.name} (dots: seen, lines: model)",
        xlabel="level in the longer exposure",
        ylabel="level in the shorter exposure",
    )
    top = response.n_levels - 1
    level = np.arange(top + 1)
    for transfer, colour in _transfers(response):
        axes.plot(transfer.upper, transfer.lower, ".", color=colour, markersize=3, alpha=0.6)
        follows = top * response.curve.response(response.inverse_lut / transfer.ratio)
        axes.plot(level, follows, color=colour, linewidth=1, label=f"{transfer.ratio:.3g} times")
    if axes.lines:
        axes.legend(frameon=False, title="exposure")


def draw_transfer_errors(axes: Axes, response: Response) -> None:
    """How much more light the longer exposure has than the curve makes of it, level by level."""
    axes.set(
        title="Light of the pair over what the exposures say",
        xlabel="level in the longer exposure",
        ylabel="relative difference",
        ylim=(-_MOST_APART, _MOST_APART),
    )
    for transfer, colour in _transfers(response):
        apart = np.expm1(transfer.apart(response.curve, response.n_levels))
        axes.plot(transfer.upper, apart, ".", color=colour, markersize=3, alpha=0.6)
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))


def _transfers(response: Response) -> list[tuple[SeenTransfer, str]]:
    """Transfers from the least ratio, at most so many, and a colour for each."""
    found = [] if response.exposures is None else [*response.exposures.transfers]
    found = sorted((each for each in found if each.upper), key=lambda each: each.ratio)
    found = found[:: max(1, -(-len(found) // len(SERIES_COLOURS)))]
    return list(zip(found, SERIES_COLOURS, strict=False))


def draw_response(
    axes: Axes, channels: Sequence[Response], *, truth: AbstractCurve | None = None
) -> None:
    """Brightness over irradiance, with the deviation as a band where it is known."""
    for response in channels:
        error = "" if truth is None else f" (RMSE {rmse(response.curve, truth):.3f})"
        _draw_curve(axes, response, CHANNEL_COLOURS[response.name], f"{response.name}{error}")
    if truth is not None:
        irradiance = np.linspace(0, 1, 1024)
        axes.plot(irradiance, truth.response(irradiance), "k--", linewidth=1.2, label="truth")
    _frame_responses(axes, channels)


def draw_responses(axes: Axes, named: Sequence[tuple[str, Response]]) -> None:
    """Brightness over irradiance of several cameras, by name, as `draw_response` does for one."""
    for place, (name, response) in enumerate(named):
        # Else matplotlib would set $x$ as a formula, and leave _DSC0001 out of the legend.
        label = "\N{ZERO WIDTH SPACE}" + name.replace("$", r"\$")
        _draw_curve(axes, response, SERIES_COLOURS[place % len(SERIES_COLOURS)], label)
    _frame_responses(axes, [response for _, response in named])


def draw_differences(axes: Axes, responses: Sequence[Response]) -> None:
    """Irradiance over brightness less that of the first, each with its own deviation as a band.

    Colours are those of `draw_responses`.
    """
    first = responses[0].curve
    for place, response in enumerate(responses):
        colour = SERIES_COLOURS[place % len(SERIES_COLOURS)]
        kept = _kept(response)
        brightness = _brightness(response)[kept]
        apart = response.inverse_lut[kept] - first.inverse(brightness)
        axes.plot(brightness, apart, color=colour)
        if response.inverse_lut_std is not None:
            spread = response.inverse_lut_std[kept]
            axes.fill_between(
                brightness, apart - spread, apart + spread, color=colour, alpha=0.2, linewidth=0
            )
    axes.set(
        title="Light less that of the first (bands: one deviation)",
        xlabel="brightness",
        ylabel="difference of irradiance",
        xlim=(0, 1),
    )


def _draw_curve(axes: Axes, response: Response, colour: str, label: str) -> None:
    kept = _kept(response)
    level = _brightness(response)
    inverse = response.inverse_lut
    axes.plot(inverse[kept], level[kept], color=colour, label=label)
    if response.inverse_lut_std is not None:
        light, spread = inverse[kept], response.inverse_lut_std[kept]
        axes.fill_betweenx(
            level[kept], light - spread, light + spread, color=colour, alpha=0.2, linewidth=0
        )
    if response.n_pairs:  # else nobody saw a level: another program made the curve
        ends = [*response.observed_levels]
        axes.plot(inverse[ends], level[ends], "o", color=colour, markersize=4)


def _frame_responses(axes: Axes, responses: Sequence[Response]) -> None:
    dots = " (dots: range of levels seen)" if any(each.n_pairs for each in responses) else ""
    axes.plot([0, 1], [0, 1], color="0.8", linewidth=0.8, zorder=0)
    axes.set(
        title=f"Response{dots}",
        xlabel="irradiance",
        ylabel="brightness",
        xlim=(0, 1),
        ylim=(0, 1),
    )
    axes.legend(loc="lower right", frameon=False)


def draw_cooccurrence(axes: Axes, response: Response) -> None:
    """Counts of level pairs, with the model's contours at the same counts.

    Over the level in one frame stands the difference to the other: the band along the
    diagonal of the table, laid flat.
    """
    band = _laid_flat(axes, f"Level pairs, channel {response.name} (lines: model)", response)
    if band is None:
        return
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
    """Level pairs less those that the model expects, in deviations of chance, laid flat likewise.

    Cells of which less than one pair is expected are judged as if it were one. Grey noise
    is a good fit; `chartless.flags.Pattern` says what shapes mean.
    """
    kind = "" if response.pattern is None else f": {response.pattern.code}"
    band = _laid_flat(axes, f"Seen less expected{kind}", _of_seen_noise(response))
    if band is None:
        return
    # On the diagonal symmetric counts come in twos, which doubles their variance.
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


def _laid_flat(axes: Axes, title: str, response: Response) -> _Band | None:
    """Name the axes, and cut out the band that they show; without a table say so."""
    axes.set(title=title, xlabel="level in one frame", ylabel="other, difference")
    if response.table is None:
        axes.text(
            0.5, 0.5, "no co-occurrence table in the file", ha="center", va="center",
            transform=axes.transAxes,
        )  # fmt: skip
        return None
    counts = response.table.symmetric
    n_levels = counts.shape[0]
    reach = _reach(response.table)
    level, difference = np.meshgrid(np.arange(n_levels), np.arange(-reach, reach + 1))
    other = level + difference
    inside = (other >= 0) & (other < n_levels)
    other = other.clip(0, n_levels - 1)
    seen = np.where(inside, counts[level, other], 0)
    expected = np.where(inside, _expected(response)[level, other], 0.0)
    axes.set_ylim(-reach, reach)
    return _Band(level, difference, seen, expected)


def draw_noise(axes: Axes, channels: Sequence[Response]) -> None:
    """Noise level function: deviation of one frame at each level, seen and modelled."""
    for response in channels:
        colour = CHANNEL_COLOURS[response.name]
        label = f"{response.name}: {_noise_text(response)}"
        if response.table is None:
            axes.plot([], [], color=colour, label=label)
            continue
        counts = response.table.symmetric
        expected = _expected(response).copy()
        for table in (counts, expected):  # clipped levels have no noise to speak of
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


def draw_deviations(
    axes: Axes, channels: Sequence[Response], *, truth: AbstractCurve | None = None
) -> None:
    """Deviation of the inverse response at each level and, with a truth, the actual error."""
    for response in channels:
        colour = CHANNEL_COLOURS[response.name]
        if response.inverse_lut_std is not None:
            for factor, alpha in ((2, 0.12), (1, 0.2)):
                kept = _kept(response)
                spread = factor * response.inverse_lut_std[kept]
                axes.fill_between(kept, -spread, spread, color=colour, alpha=alpha, linewidth=0)
            axes.plot([], [], color=colour, label=response.name)
        if truth is not None:
            error = response.inverse_lut - truth.inverse(_brightness(response))
            axes.plot(error, color=colour, linewidth=1)
    lines = "" if truth is None else "; lines: actual error"
    axes.set(
        title=f"How sure (bands: 1 and 2 deviations{lines})",
        xlabel="level",
        ylabel="irradiance",
    )
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False)


def draw_search(axes: Axes, channels: Sequence[Response]) -> None:
    """How the objective improved from round to round."""
    bounded = True
    for response in channels:
        if response.history is None:
            continue
        values = np.array(response.history.values)
        bounded = bounded and response.history.objective == "bin"
        cost = 1 - values if bounded else values
        axes.plot(cost, ".-", color=CHANNEL_COLOURS[response.name], label=response.name)
    axes.set(
        title="Search",
        xlabel="round",
        ylabel="1 − image similarity" if bounded else "image similarity",
        yscale="log",
    )
    axes.yaxis.set_minor_locator(ticker.LogLocator(subs=(2, 5)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:g}")
    if axes.lines:
        axes.legend(frameon=False)


@lru_cache(maxsize=4)  # figures of a report ask for the same: R, G, B and one with seen noise
def _expected(response: Response) -> Floats:
    """Level pairs that the model expects; methods without a scene of their own take an even one."""
    assert response.noise is not None
    assert response.table is not None
    counts = response.table.symmetric
    inverse = response.curve.inverse(half_levels(response.n_levels))
    if response.method.startswith("ism"):
        return expected_counts(counts, inverse, response.noise)
    pairs = counts.astype(np.float64)
    prepared = PairCounts(pairs, np.zeros(len(pairs)))
    model = with_scene(inverse[1::2], response.noise, prepared, _SCENE_STEPS)
    return np.asarray(model.pairs * pairs.sum())


@lru_cache(maxsize=4)
def _of_seen_noise(response: Response) -> Response:
    """The response with its noise scaled to that of the pairs, where curve and noise are means.

    Means over the ratio u/v are not those of any one ratio: their noise is a per cent or two
    too small, which a million pairs notice.
    """
    noise = response.noise
    if response.table is None or noise is None or response.noise_error is None:
        return response
    counts = response.table.symmetric
    seen, expected = (
        difference_moments(table[1:-1, 1:-1]).squares.sum()
        for table in (counts, _expected(response))
    )
    scale = float(seen / expected)
    return replace(response, noise=AffineNoise(scale * noise.slope, scale * noise.floor))


def _reach(table: Cooccurrence) -> int:
    """Difference of levels that holds 99.9 % of the pairs, and a little more."""
    earlier, later = np.nonzero(table.counts)
    size = np.bincount(np.abs(earlier - later), table.counts[earlier, later])
    share = np.cumsum(size) / size.sum()
    return int(1.3 * np.searchsorted(share, 0.999)) + 3


def _noise_text(response: Response) -> str:
    noise = response.noise
    return "unknown" if noise is None else f"U = {noise.slope_8bit:.3f}, V = {noise.floor_8bit:.1f}"


def _kept(response: Response) -> Indices:
    """Levels that are drawn, at most `_MOST_DRAWN`; files of figures grow with each."""
    step = -(-response.n_levels // _MOST_DRAWN)
    return np.unique(np.append(np.arange(0, response.n_levels, step), response.n_levels - 1))


def _brightness(response: Response) -> Floats:
    return np.linspace(0.0, 1.0, response.n_levels)
