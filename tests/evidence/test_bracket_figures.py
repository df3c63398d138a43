"""Figures of brackets: what is drawn, not how it looks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from chartless import ModelCurve, Response
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers, account_of_bracket
from chartless.evidence.bracket.figures import draw_transfer_errors, draw_transfers
from chartless.evidence.registry import KINDS
from chartless.plotting import SERIES_COLOURS
from chartless.result.response import Status

CURVE = ModelCurve("gamma", (0.5,))
"""√I: a quarter of the light is half the level."""
UPPER = (100.0, 200.0)


def seen(ratio: float, upper: Sequence[float] = UPPER, *, off: float = 1.0) -> SeenTransfer:
    """What the curve makes of two exposures, said to be off times as far apart as they are."""
    return SeenTransfer(off * ratio, tuple(upper), tuple(np.array(upper) / np.sqrt(ratio)))


def response_of(
    *transfers: SeenTransfer, name: str = "Y", scatter: float | None = 0.03
) -> Response:
    account = account_of_bracket(
        name,
        CURVE,
        exposures=(1.0, 2.0),
        transfers=SeenTransfers(256, transfers),
        scatter=scatter,
    )
    return Response(
        name=name, curve=CURVE, noise=None, n_levels=256, observed_levels=(0, 255), n_pairs=1000,
        method="likelihood", status=Status.CONVERGED, accounts=(account,),
    )  # fmt: skip


def test_transfers_are_drawn_as_seen_beside_those_of_the_curve() -> None:
    axes = Figure().subplots()

    draw_transfers(axes, response_of(seen(4.0, off=1.5)))

    dots, line = axes.lines
    assert tuple(dots.get_xdata()) == UPPER
    assert tuple(dots.get_ydata()) == (50, 100)
    np.testing.assert_allclose(line.get_ydata(), np.arange(256) / np.sqrt(6), atol=1e-9)
    assert line.get_color() == dots.get_color()
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["6 times"]


def test_errors_are_how_much_more_light_there_is_than_the_exposures_say() -> None:
    """Four times the light where five times is said: a fifth is lacking."""
    axes = Figure().subplots()

    draw_transfer_errors(axes, response_of(seen(4.0, off=1.25), seen(2.0)))

    exact, off, _ = axes.lines
    np.testing.assert_allclose(exact.get_ydata(), 0, atol=1e-9)
    np.testing.assert_allclose(off.get_ydata(), -0.2, atol=1e-9)
    assert tuple(off.get_xdata()) == UPPER


def test_of_many_transfers_no_more_are_drawn_than_colours_can_be_told_apart() -> None:
    ratios = np.linspace(16, 2, 15)
    axes = Figure().subplots()

    draw_transfers(axes, response_of(*map(seen, ratios)))

    labels = [line.get_label() for line in axes.lines[1::2]]
    assert labels == ["2 times", "5 times", "8 times", "11 times", "14 times"]
    assert len({line.get_color() for line in axes.lines}) == 5 <= len(SERIES_COLOURS)


def test_there_are_figures_of_transfers_and_of_their_light() -> None:
    shown = KINDS["bracket"].figures([response_of(seen(4.0))])

    assert [each.name for each in shown] == ["transfer", "ratio"]
    for each in shown:
        axes = Figure().subplots()
        each.draw(axes)
        assert len(axes.lines) == 2


def test_without_levels_that_exposures_share_there_are_no_figures() -> None:
    shared, none = response_of(seen(4.0)), response_of(seen(4.0, ()))
    (account,) = shared.accounts
    unkept = replace(shared, accounts=(replace(account, record=None),))

    assert KINDS["bracket"].figures([none]) == ()
    assert KINDS["bracket"].figures([unkept]) == ()


@pytest.mark.parametrize("draw", [draw_transfers, draw_transfer_errors])
def test_without_such_levels_no_dot_is_drawn(draw: object) -> None:
    axes = Figure().subplots()

    assert callable(draw)
    draw(axes, response_of(seen(4.0, ())))

    assert axes.get_title()
    assert not [line for line in axes.lines if line.get_marker() == "."]


def test_the_channel_by_which_the_bracket_is_judged_is_shown() -> None:
    """The middle one by how far the light is off."""
    channels = [
        response_of(seen(4.0, off=off), name=name)
        for name, off in zip("RGB", (1.02, 1.08, 1.05), strict=True)
    ]

    transfer, ratio = KINDS["bracket"].figures(channels)

    assert "Channel B;" in transfer.words
    assert "Channel B, the middle one, by which the bracket is judged" in ratio.words
    assert "R 2.0%, G 7.7%, B 4.9%" in ratio.words.replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize("scatter", [None, 0.034])
def test_words_say_how_pixels_scatter_where_that_is_known(scatter: float | None) -> None:
    _, ratio = KINDS["bracket"].figures([response_of(seen(4.0), scatter=scatter)])

    assert ("scatter" in ratio.words) == (scatter is not None)
    assert ("single pixels scatter by 3.4% beyond noise" in ratio.words) == (scatter is not None)
