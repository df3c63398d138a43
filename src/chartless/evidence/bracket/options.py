"""Options for brackets."""

from dataclasses import dataclass

from chartless.evidence.options import Option, option


@dataclass(frozen=True, slots=True)
class Options:
    """Options for brackets.

    Parameters
    ----------
    aligned : bool
        Whether a pixel shows the same spot in all exposures; if not, their histograms
        are matched.
    bloom_radius : int
        Radius around saturated pixels that is left out of an exposure, in pixels.
    """

    aligned: bool = option(
        True,
        Option(
            "flag",
            "match exposures by their histograms, for hand-held ones.",
            flag="unaligned",
            page="The camera moved between exposures",
        ),
    )
    bloom_radius: int = option(
        0, Option("count", "exclude this many pixels around saturated ones.")
    )
