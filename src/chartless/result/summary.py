"""A calibration in short texts: what the terminal and the report both say."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from chartless.flags import Flag
from chartless.result.account import written
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status
from chartless.result.verdict import deviation
from chartless.types import Floats, JsonObject

_NO_BREAK = "\N{NO-BREAK SPACE}"
_MOST_DECIMALS = 5  # of the noise; what is less is as good as none


@dataclass(frozen=True, slots=True)
class Doubt:
    """A flag, in words."""

    code: str
    """As in `Flag`."""
    channels: tuple[str, ...]
    advice: str
    """What it means and what to do."""
    details: tuple[str, ...] = ()
    """What it means here, where kinds of evidence say so; with the channels where these differ."""


class Line(NamedTuple):
    """A quantity with its value for each channel."""

    name: str
    values: tuple[str, ...]


def n_frames(calibration: Calibration) -> int:
    """Frames that were given for a calibration; of a video those used."""
    inputs = calibration.provenance.get("inputs", [])
    return sum(map(_frames_of, inputs))


def doubts(calibration: Calibration) -> list[Doubt]:
    """What is doubtful about a calibration, with what to do; empty if nothing is."""
    return [
        Doubt(flag.code, tuple(names), flag.advice, _details(calibration, flag, names))
        for flag, names in calibration.flags.items()
    ]


def status_text(response: Response) -> str:
    """Status of a channel in one word: "doubtful" if it is flagged."""
    if response.flags and response.status is not Status.ASSUMED:
        return "doubtful"
    return response.status.value


def account_lines(channels: Sequence[Response]) -> list[Line]:
    """Facts and fits of all kinds of evidence, a line for each that a channel has."""
    found: dict[tuple[str, str], tuple[str, dict[str, str]]] = {}
    for response in channels:
        for account in response.accounts:
            shown = [
                *((fact.code, fact.label, fact.text) for fact in account.facts),
                *((fit.code, fit.label, written(fit.value, fit.form)) for fit in account.fits),
            ]
            if account.share is not None:
                label = f"Share of the information from {account.kind}"
                shown.append(("share", label, f"{account.share:.0%}"))
            for code, label, text in shown:
                _, texts = found.setdefault((account.kind, code), (label, {}))
                texts[response.name] = text
    return [
        Line(label, tuple(texts.get(response.name, "-") for response in channels))
        for label, texts in found.values()
    ]


def noise_text(which: Literal["slope", "floor"], response: Response, digits: int) -> str:
    """U or V with two digits of its deviation; to so many and one more where that is not known."""
    if response.noise is None:
        return "-"
    value = float(getattr(response.noise, f"{which}_8bit"))
    if response.noise_error is None:
        return f"{value:.{digits + 1}f}"
    error = value * float(getattr(response.noise_error, f"log_{which}"))
    least = 10.0**-_MOST_DECIMALS
    if max(value, error) < least:
        return f"< {least:.{_MOST_DECIMALS}f}"
    first = math.floor(math.log10(max(error, least)))  # digit of the deviation
    decimals = min(max(1 - first, 0), _MOST_DECIMALS)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"


def error_text(std: Floats | None) -> str:
    """Root mean square of the deviations of the inverse response."""
    return "-" if std is None else f"± {deviation(std):.3f}"


def white_text(response: Response) -> str:
    """Deviation of the light at white, apart from that of the shape."""
    return "-" if response.white_std is None else f"± {response.white_std:.1%}"


def fit_text(response: Response) -> str:
    """Goodness of fit, by the measures that kinds of evidence have."""
    return ", ".join(fit.text for fit in response.fits) or "-"


def of_each(channels: Sequence[Response], text: Callable[[Response], str]) -> str:
    """A text for each channel with its name, or alone; lines break between channels only."""
    if len(channels) == 1:
        return text(channels[0]).replace(" ", _NO_BREAK)
    named = (f"{response.name} {text(response)}" for response in channels)
    return ", ".join(each.replace(" ", _NO_BREAK) for each in named)


def _frames_of(source: JsonObject) -> int:
    if "frames" not in source:
        return 1  # also of a picture that was not used
    first, last = source["frames"]
    return int(source.get("used", last - first + 1))


def _details(calibration: Calibration, flag: Flag, names: Sequence[str]) -> tuple[str, ...]:
    """What accounts say of a flag, each text once."""
    owners: dict[str, list[str]] = {}
    for name in names:
        for account in calibration.channel(name).accounts:
            if account.details.get(flag.code):
                owners.setdefault(account.details[flag.code], []).append(name)
    everywhere = len(calibration.channels)
    return tuple(
        text if len(where) in (everywhere, len(names)) else f"{', '.join(where)}: {text}"
        for text, where in owners.items()
    )
