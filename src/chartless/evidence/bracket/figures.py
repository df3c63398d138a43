"""Figures of brackets: brightness transfers, observed and by the curve."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib import ticker
from matplotlib.axes import Axes

from chartless.evidence.bracket.account import NAME, SeenTransfer, SeenTransfers
from chartless.evidence.kind import Figure
from chartless.plotting import SERIES_COLOURS
from chartless.result.response import Response
from chartless.result.summary import of_each
from chartless.result.verdict import typical

_MOST_APART = 0.3  # relative, at the ends of a scale


def figures(channels: Sequence[Response]) -> tuple[Figure, ...]:
    """Figures of the channel that judges the bracket; none if no levels are shared."""
    shown = typical(channels, NAME, "mismatch")
    if shown is None or not _transfers(shown):
        return ()
    return (
        Figure(
            "transfer", "Exposure to exposure", partial(draw_transfers, response=shown),
            _words_of_transfers(shown),
        ),
        Figure(
            "ratio", "Light of two exposures", partial(draw_transfer_errors, response=shown),
            _words_of_errors(channels, shown),
        ),
    )  # fmt: skip


def draw_transfers(axes: Axes, response: Response) -> None:
    """Draw level against level in a longer exposure, observed and by the curve."""
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
    """Draw the light ratio by the curve over the exposure ratio, level by level."""
    axes.set(
        title="Light of the pair over the ratio of its exposures",
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
    """Transfers in order of ratio, thinned to one for each colour, with colours."""
    found = sorted(_seen(response), key=lambda each: each.ratio)
    found = found[:: max(1, -(-len(found) // len(SERIES_COLOURS)))]
    return list(zip(found, SERIES_COLOURS, strict=False))


def _seen(response: Response) -> list[SeenTransfer]:
    record = response.account(NAME).record if NAME in response.kinds else None
    transfers = record.transfers if isinstance(record, SeenTransfers) else ()
    return [each for each in transfers if each.upper]


def _words_of_transfers(response: Response) -> str:
    """Text on corresponding levels in the middle of the longer exposure."""
    transfers = _seen(response)
    n, ratios = len(transfers), sorted(each.ratio for each in transfers)
    nearest = min(transfers, key=lambda each: each.ratio)
    middle = int(np.argmin(np.abs(np.array(nearest.upper) - response.n_levels / 2)))
    return (
        f"{n} pair{'s' * (n != 1)} of exposures, {ratios[0]:.3g} to {ratios[-1]:.3g} times apart. "
        f"Pixels at level {nearest.upper[middle]:.0f} of an exposure show level "
        f"{nearest.lower[middle]:.0f} in one {nearest.ratio:.3g} times shorter. "
        f"Channel {response.name}; dots: seen, lines: model."
    )


def _words_of_errors(channels: Sequence[Response], shown: Response) -> str:
    """Text on the mismatch of light and exposure ratio, and on the scatter."""

    def mismatch(response: Response) -> str:
        account = response.account(NAME)
        return f"{account['mismatch']:.1%}" if "mismatch" in account else "unknown"

    account = shown.account(NAME)
    which = f"Channel {shown.name}"
    if len(channels) > 1:
        which += ", the middle one, by which the bracket is judged"
    scatter = (
        f"; single pixels scatter by {account['scatter']:.1%} beyond noise"
        if "scatter" in account
        else ""
    )
    return (
        f"In the median the light of two exposures differs by {of_each(channels, mismatch)} "
        f"from their ratio{scatter}. {which}; colours as in “Exposure to exposure”."
    )
