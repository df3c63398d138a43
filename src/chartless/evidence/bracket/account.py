"""Account of a bracket: exposures, scatter, and mismatch of light and exposure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from typing_extensions import override

from chartless.curves import AbstractCurve
from chartless.result.account import AbstractRecord, Account, Column, Fact, Fit, Table
from chartless.types import Floats, JsonObject

NAME = "bracket"
"""Name of this kind of evidence."""
GOOD_MISMATCH = 0.05
"""Relative mismatch of the light of two exposures and their ratio up to which a bracket
is good. Of nine measured cameras, the four good ones are off by 0.0054 at most, the
others by up to 0.0147 (docs/brackets.md)."""
_DARKEST = 1e-12  # irradiance, for its logarithm
_ALIKE = 0.0005  # relative difference of exposures, invisible in four digits


class SeenTransfer(NamedTuple):
    """Levels of an exposure and the corresponding levels of a longer one."""

    ratio: float
    """Ratio of the exposures, as estimated."""
    upper: tuple[float, ...]
    """Levels of the longer exposure."""
    lower: tuple[float, ...]
    """Median level of the same pixels in the shorter one."""

    def apart(self, curve: AbstractCurve, n_levels: int) -> Floats:
        """Ln of the light ratio by the curve, less ln of `ratio`; shape of `upper`."""
        longer, shorter = (
            np.log(np.maximum(curve.inverse(np.array(levels) / (n_levels - 1)), _DARKEST))
            for levels in (self.upper, self.lower)
        )
        return np.asarray(longer - shorter - np.log(self.ratio))


@dataclass(frozen=True, slots=True)
class SeenTransfers(AbstractRecord):
    """Transfers of brightness between exposures, before any model."""

    n_levels: int
    transfers: tuple[SeenTransfer, ...]

    @classmethod
    def from_json(cls, content: JsonObject, n_levels: int) -> Self:
        """Read the output of `to_json`; raise ValueError if it is damaged."""
        return cls(n_levels, tuple(_transfer(each, n_levels) for each in content["transfers"]))

    @override
    def to_json(self) -> JsonObject:
        return {"transfers": [each._asdict() for each in self.transfers]}

    @override
    def at_levels(self, n_levels: int) -> "SeenTransfers":
        factor = (n_levels - 1) / (self.n_levels - 1)
        scaled = (
            SeenTransfer(
                each.ratio,
                tuple(factor * level for level in each.upper),
                tuple(factor * level for level in each.lower),
            )
            for each in self.transfers
        )
        return SeenTransfers(n_levels, tuple(scaled))

    def mismatch(self, curve: AbstractCurve) -> float | None:
        """Median relative mismatch of the light of two exposures and their ratio.

        It is None where the exposures share no levels.
        """
        if not any(each.upper for each in self.transfers):
            return None
        apart = [each.apart(curve, self.n_levels) for each in self.transfers]
        return float(np.median(np.abs(np.concatenate(apart))))


def account_of_bracket(
    channel: str,
    curve: AbstractCurve,
    *,
    exposures: Sequence[float],
    transfers: SeenTransfers,
    exponent_error: float | None = None,
    scatter: float | None = None,
) -> Account:
    """Account of the exposures of a channel.

    Parameters
    ----------
    channel : str
    curve : AbstractCurve
        As estimated.
    exposures : sequence of float
        As estimated, in the order of the inputs, the least being 1.
    transfers : SeenTransfers
    exponent_error : float, optional
        Deviation of ln γ if the curve is known up to f^γ; 0 if the exposures are exact.
        A curve and its powers fit a bracket equally well, with exposures that are
        powers of each other.
    scatter : float, optional
        Relative deviation of irradiance between exposures that noise does not explain.
    """
    facts = [Fact("exposures", "Exposures", tuple(exposures), ".4g")]
    if exponent_error is not None:
        facts.append(Fact("exponent_error", "Error of the exponent", exponent_error, ".1%"))
    if scatter is not None:
        facts.append(Fact("scatter", "Scatter between exposures", scatter, ".1%"))
    mismatch = transfers.mismatch(curve)
    fits = []
    if mismatch is not None:
        remark = (
            "In the median the light of two exposures differs from their ratio by "
            f"{mismatch:.1%} (channel {channel}; good brackets {GOOD_MISMATCH:.0%} or less): "
            "the camera may have changed white balance or tone."
        )
        label = "Light of two exposures, deviation from their ratio"
        fits.append(Fit("mismatch", label, mismatch, ".1%", good=GOOD_MISMATCH, remark=remark))
    return Account(kind=NAME, facts=tuple(facts), fits=tuple(fits), record=transfers)


def exposure_table(
    rows: Sequence[JsonObject], accounts: Mapping[str, Account]
) -> tuple[Table, ...]:
    """Table of exposures as given and, if different, as found in the middle channel.

    Parameters
    ----------
    rows : sequence of dict
        As returned by `chartless.evidence.bracket.screening.exposure_rows`; no table if
        empty.
    accounts : mapping from channels to Account
    """
    if not rows:
        return ()
    channel = [*accounts, ""][len(accounts) // 2]
    found = _found([float(row["relative"]) for row in rows], accounts.get(channel))
    columns = (
        Column("file", "Exposure", "file"),
        Column("relative", "Relative", ".4g"),
        Column("found", f"Found ({channel})", ".4g"),
        Column("black", "Black", ".1%"),
        Column("white", "White", ".1%"),
        Column("overlap", "Shared with next", ".0%"),
        Column("displacement", "Displaced, px", ".1f"),
    )
    title = "Exposures as given or assumed; shares of black and white pixels"
    cells = tuple(
        tuple({**row, "found": found[place]}.get(column.code) for column in columns)
        for place, row in enumerate(rows)
    )
    return (Table("exposures", title, columns, cells),)


def _found(given: Sequence[float], account: Account | None) -> Sequence[float | None]:
    """Exposures found, in units of those given; all None if they agree with these."""
    known = () if account is None else account["exposures"]
    if len(known) != len(given) or min(known, default=0) <= 0:
        return [None] * len(given)
    with np.errstate(over="ignore"):  # damaged files may hold any numbers
        found = np.array(known) / known[int(np.argmin(given))] * min(given)
    same = np.allclose(found, given, rtol=_ALIKE, atol=0)
    return [None] * len(given) if same or not np.isfinite(found).all() else found.tolist()


def _transfer(entry: JsonObject, n_levels: int) -> SeenTransfer:
    ratio = float(entry["ratio"])
    upper, lower = (tuple(map(float, entry[key])) for key in ("upper", "lower"))
    if not 0 < ratio < math.inf or len(upper) != len(lower):
        msg = f"a ratio of its exposures is {ratio:g}, of {len(upper)} and {len(lower)} levels"
        raise ValueError(msg)
    if not all(0 <= level < n_levels for level in (*upper, *lower)):
        msg = f"levels of its exposures are not those of {n_levels}"
        raise ValueError(msg)
    return SeenTransfer(ratio, upper, lower)
