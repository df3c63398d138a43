"""What raw files say besides the curve: matrix, gains, falloff and scatter."""

from chartless.flags import Flag
from chartless.result.account import Account, Fact, Fit

NAME = "raw"
"""Of this kind of evidence."""
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
        By which the camera brightened each shot, the first being 1.
    corner_gain : float
        By which it brightened the corners against the middle, to make up for the lens.
    scatter : float
        Relative deviation of the light of greys from what the curve makes of their levels.
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
