"""What users may choose about brackets."""

from dataclasses import dataclass

from chartless.evidence.options import Option, option


@dataclass(frozen=True, slots=True)
class Options:
    """What users may choose about brackets.

    Parameters
    ----------
    aligned : bool
        Whether a pixel sees the same spot in all exposures; if not, their histograms are matched.
    bloom_radius : int
        Pixels around saturated ones that are left out of an exposure.
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
        0, Option("count", "leave out this many pixels around saturated ones.")
    )
