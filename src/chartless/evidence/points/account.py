"""What measured points say besides the curve: the factor of their irradiance, and scatter."""

from dataclasses import dataclass
from typing import Self

from typing_extensions import override

from chartless.flags import Flag
from chartless.result.account import AbstractRecord, Account, Fact, Fit
from chartless.types import JsonObject

NAME = "points"
"""Of this kind of evidence."""
MUCH_SCATTER = 0.06
"""Relative scatter of the irradiance above which brightness does not depend on it alone."""


@dataclass(frozen=True, slots=True)
class SeenPoints(AbstractRecord):
    """Points as the curve takes them, for figures."""

    irradiance: tuple[float, ...]
    """1 is that of white, by the factor that was found."""
    brightness: tuple[float, ...]

    @classmethod
    def from_json(cls, content: JsonObject) -> Self:
        """Read what `to_json` wrote; ValueError if it is damaged."""
        irradiance, brightness = (
            tuple(map(float, content[name])) for name in ("irradiance", "brightness")
        )
        if len(irradiance) != len(brightness):
            msg = f"its points are {len(irradiance)} irradiances and {len(brightness)} brightnesses"
            raise ValueError(msg)
        return cls(irradiance, brightness)

    @override
    def to_json(self) -> JsonObject:
        return {"irradiance": list(self.irradiance), "brightness": list(self.brightness)}

    @override
    def at_levels(self, n_levels: int) -> "SeenPoints":
        return self


def account_of_points(*, seen: SeenPoints, scale: float, scatter: float) -> Account:
    """Account of the points of a channel.

    Parameters
    ----------
    seen : SeenPoints
    scale : float
        Irradiance in units of that at white, for an irradiance of 1 in the table.
    scatter : float
        Relative deviation of irradiance from what the curve makes of the brightness.
    """
    return Account(
        kind=NAME,
        facts=(
            Fact("number", "Points used", float(len(seen.brightness)), ".0f"),
            Fact("scale", "Irradiance at white over that of the table", 1 / scale, ".4g"),
        ),
        fits=(Fit("scatter", "Scatter of the points", scatter, ".1%", good=MUCH_SCATTER),),
        record=seen,
    )


def doubts(account: Account) -> tuple[Flag, ...]:
    """Flags that follow from an account."""
    return (Flag.UNEVEN_TONES,) if account["scatter"] > MUCH_SCATTER else ()
