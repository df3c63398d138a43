"""Account of measured points: the factor of their irradiance, and scatter."""

from dataclasses import dataclass
from typing import Self

from typing_extensions import override

from chartless.flags import Flag
from chartless.result.account import AbstractRecord, Account, Fact, Fit
from chartless.types import JsonObject

NAME = "points"
"""Name of this kind of evidence."""
MUCH_SCATTER = 0.06
"""Relative scatter of the irradiance above which brightness does not depend on
irradiance alone."""


@dataclass(frozen=True, slots=True)
class SeenPoints(AbstractRecord):
    """Points in the irradiance of the curve, for figures."""

    irradiance: tuple[float, ...]
    """Irradiance relative to white, by the estimated factor."""
    brightness: tuple[float, ...]

    @classmethod
    def from_json(cls, content: JsonObject) -> Self:
        """Read the output of `to_json`; raise ValueError if it is damaged."""
        irradiance, brightness = (
            tuple(map(float, content[name])) for name in ("irradiance", "brightness")
        )
        if len(irradiance) != len(brightness):
            msg = f"its points are {len(irradiance)} irradiances and {len(brightness)} brightnesses"
            raise ValueError(msg)
        if not all(0 <= b <= 1 for b in brightness) or not all(x > 0 for x in irradiance):
            msg = "its points should have irradiance above 0 and brightness between 0 and 1"
            raise ValueError(msg)
        return cls(irradiance, brightness)

    @override
    def to_json(self) -> JsonObject:
        return {"irradiance": list(self.irradiance), "brightness": list(self.brightness)}

    @override
    def at_levels(self, n_levels: int) -> "SeenPoints":
        return self


def account_of_points(*, seen: SeenPoints, white: float, scatter: float) -> Account:
    """Account of the points of a channel.

    Parameters
    ----------
    seen : SeenPoints
    white : float
        Irradiance that just reaches white, in units of the table.
    scatter : float
        Relative deviation of irradiance from that of the curve at the same brightness.
    """
    return Account(
        kind=NAME,
        facts=(
            Fact("number", "Points used", float(len(seen.brightness)), ".0f"),
            Fact("white", "Irradiance at white, as in the table", white, ".4g"),
        ),
        fits=(Fit("scatter", "Scatter of the points", scatter, ".1%", good=MUCH_SCATTER),),
        record=seen,
    )


def doubts(account: Account) -> tuple[Flag, ...]:
    """Flags that follow from an account."""
    return (Flag.UNEVEN_TONES,) if account["scatter"] > MUCH_SCATTER else ()
