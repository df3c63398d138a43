"""Account of pictures that do not constrain the curve."""

from chartless.result.account import Account, Fact

NAME = "typical"
"""Name of this kind of evidence."""


def account_of_levels(*, black: float, white: float) -> Account:
    """Account of the levels of a channel.

    Parameters
    ----------
    black, white : float
        Shares of the pixels at the lowest and the highest level.
    """
    return Account(
        kind=NAME,
        facts=(
            Fact("black", "Pixels that are black", black, ".1%"),
            Fact("white", "Pixels that are white", white, ".1%"),
        ),
    )
