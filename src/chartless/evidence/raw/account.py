"""Account of raw files: matrix, gains, falloff and scatter."""

from chartless.flags import Flag
from chartless.result.account import Account, Fact, Fit

NAME = "raw"
"""Name of this kind of evidence."""
MUCH_SCATTER = 0.06
"""Relative scatter of greys above which tones do not depend on light alone."""


def account_of_raw(
    *, matrix: tuple[float, ...], gains: tuple[float, ...], corner_gain: float, scatter: float
) -> Account:
    """Account of the raw files of a channel.

    Parameters
    ----------
    matrix : tuple of three float
        Weights of the raw file's red, green and blue in the channel, of sum 1.
    gains : tuple of float
        Gains of the camera in each shot, the first being 1.
    corner_gain : float
        Gain of the corners relative to the middle, which corrects the lens.
    scatter : float
        Relative deviation of the light of greys from that of the curve at the same
        level.
    """
    return Account(
        kind=NAME,
        facts=(
            Fact("matrix", "Weights of raw red, green, blue", matrix, ".2f"),
            Fact("gains", "Gains of the shots", gains, ".3f"),
            Fact("corner_gain", "Gain of the corners", corner_gain, ".3f"),
        ),
        fits=(Fit("scatter", "Scatter of greys", scatter, ".1%", good=MUCH_SCATTER),),
    )


def doubts(account: Account) -> tuple[Flag, ...]:
    """Flags that follow from an account."""
    return (Flag.UNEVEN_TONES,) if account["scatter"] > MUCH_SCATTER else ()
