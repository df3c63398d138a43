"""What figures show, in numbers: their captions, and all that a screen reader has of them."""

from collections.abc import Callable, Sequence

import numpy as np

from chartless.evidence.bracket.estimates import SeenTransfer
from chartless.evidence.noise.cooccurrence import noise_level_function
from chartless.result.response import Response
from chartless.result.verdict import deviation

_QUARTERS = (0.25, 0.5, 0.75)
_NO_BREAK = "\N{NO-BREAK SPACE}"


def unbroken(text: str) -> str:
    """Return the text so that no line ends after a ±."""
    return text.replace("± ", f"±{_NO_BREAK}")


def of_response(channels: Sequence[Response]) -> str:
    """How much light the middle of the brightness range stands for."""

    def half(response: Response) -> str:
        middle = response.n_levels // 2
        light = f"{response.curve.inverse(np.array(0.5)):.3f}"
        std = response.inverse_lut_std
        return light if std is None else f"{light} ± {std[middle]:.3f}"

    def seen(response: Response) -> str:
        return "{} to {}".format(*response.observed_levels)

    dots = all(response.n_pairs for response in channels)
    band = any(response.inverse_lut_std is not None for response in channels)
    return (
        f"Brightness 0.5 stands for {_each(channels, half)} of the light at white; in a linear "
        "camera it would be 0.5."
        + (f" Dots: range of levels seen, {_each(channels, seen)}." if dots else "")
        + (" Bands: one deviation." if band else "")
    )


def of_noise(channels: Sequence[Response]) -> str:
    """How much pixels differ at three levels, as seen."""
    last = channels[0].n_levels - 1
    levels = [round(share * last) for share in _QUARTERS]

    def seen(response: Response) -> str:
        assert response.table is not None
        noise = noise_level_function(response.table.symmetric)[levels]
        return " / ".join("unseen" if np.isnan(each) else f"{each:.2f}" for each in noise)

    places = " / ".join(map(str, levels))
    return (
        f"At the levels {places} a pixel of one frame deviates by {_each(channels, seen)} levels. "
        "Dots: seen, lines: model."
    )


def of_pairs(response: Response) -> str:
    """How far the levels of a pair are apart."""
    assert response.table is not None
    earlier, later = np.nonzero(response.table.counts)
    size = np.bincount(np.abs(earlier - later), response.table.counts[earlier, later])
    share = np.cumsum(size) / size.sum()
    half, most = (int(np.searchsorted(share, part)) for part in (0.5, 0.99))
    return (
        f"{response.table.n_pairs:,} pairs of one pixel in two frames, channel {response.name}. "
        f"Half of them are at most {half} level{'s' * (half != 1)} apart, 99 % at most {most}. "
        "Lines: model, a factor of ten from one to the next."
    )


def of_residuals(response: Response) -> str:
    """How well the model explains the level pairs."""
    if response.deviance is not None:
        fit = f"The misfit is {response.deviance:.2f} times what chance alone gives (1 is perfect)"
    elif response.similarity is not None:
        fit = f"The similarity is {response.similarity:.3f} of what the true model would reach"
    else:
        fit = "This method measures no goodness of fit"
    pattern = "" if response.pattern is None else f"; its pattern is “{response.pattern.code}”"
    return (
        f"{fit}{pattern}. Channel {response.name}: an even speckle is chance, shapes are not. "
        "Red: more pairs than expected, blue: fewer, full colour at 4 deviations."
    )


def of_deviations(channels: Sequence[Response]) -> str:
    """Where the curve is least sure."""

    def worst(response: Response) -> str:
        std = response.inverse_lut_std
        return "unknown" if std is None else f"± {std.max():.3f} at level {int(std.argmax())}"

    def mean(response: Response) -> str:
        std = response.inverse_lut_std
        return "unknown" if std is None else f"± {deviation(std):.3f}"

    return (
        f"Deviation of the light that a level stands for: {_each(channels, mean)} over all levels, "
        f"{_each(channels, worst)} at most. Bands: one and two deviations."
    )


def of_search(channels: Sequence[Response]) -> str:
    """What the search gained."""

    def gain(response: Response) -> str:
        history = response.history
        if history is None:
            return "unknown"
        rounds = len(history.values) - 1
        return f"from {history.values[0]:.4g} to {history.values[-1]:.4g} in {rounds} rounds"

    return f"The image similarity rose {_each(channels, gain)}."


def of_transfers(response: Response) -> str:
    """What level follows which, in the middle of the longer exposure."""
    transfers = _seen(response)
    n, ratios = len(transfers), sorted(each.ratio for each in transfers)
    nearest = min(transfers, key=lambda each: each.ratio)
    middle = int(np.argmin(np.abs(np.array(nearest.upper) - response.n_levels / 2)))
    return (
        f"{n} pair{'s' * (n != 1)} of exposures, {ratios[0]:.3g} to {ratios[-1]:.3g} times apart. "
        f"Pixels at level {nearest.upper[middle]:.0f} of an exposure show level "
        f"{nearest.lower[middle]:.0f} in one {nearest.ratio:.3g} times shorter. "
        f"Channel {response.name}; dots: seen, lines: model."
    )


def of_transfer_errors(channels: Sequence[Response], shown: Response) -> str:
    """How far the light of two exposures is from their ratio, and what is left as scatter."""
    assert shown.exposures is not None

    def misfit(response: Response) -> str:
        apart = response.exposure_misfit
        return "unknown" if apart is None else f"{apart:.1%}"

    which = f"Channel {shown.name}"
    if len(channels) > 1:
        which += ", the middle one, by which the bracket is judged"
    return (
        f"In the median the light of two exposures is {_each(channels, misfit)} from their ratio; "
        f"single pixels scatter by {shown.exposures.scatter:.1%} beyond noise. {which}; colours as "
        "in “Exposure to exposure”."
    )


def _seen(response: Response) -> list[SeenTransfer]:
    kept = () if response.exposures is None else response.exposures.transfers
    return [each for each in kept if each.upper]


def _each(channels: Sequence[Response], text: Callable[[Response], str]) -> str:
    """A text for each channel with its name, or alone; lines break between channels only."""
    if len(channels) == 1:
        return text(channels[0]).replace(" ", _NO_BREAK)
    named = (f"{response.name} {text(response)}" for response in channels)
    return ", ".join(each.replace(" ", _NO_BREAK) for each in named)
