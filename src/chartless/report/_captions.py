"""What figures show, in numbers: their captions, and all that a screen reader has of them."""

from collections.abc import Sequence

import numpy as np

from chartless.result.response import Response
from chartless.result.summary import of_each
from chartless.result.verdict import deviation

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
        f"Brightness 0.5 stands for {of_each(channels, half)} of the light at white; in a linear "
        "camera it would be 0.5."
        + (f" Dots: range of levels seen, {of_each(channels, seen)}." if dots else "")
        + (" Bands: one deviation." if band else "")
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
        f"Deviation of the light that a level stands for: {of_each(channels, mean)} over all "
        f"levels, {of_each(channels, worst)} at most. Bands: one and two deviations."
    )


def of_search(channels: Sequence[Response]) -> str:
    """What the search gained."""

    def gain(response: Response) -> str:
        history = response.history
        if history is None:
            return "unknown"
        rounds = len(history.values) - 1
        return f"from {history.values[0]:.4g} to {history.values[-1]:.4g} in {rounds} rounds"

    return f"The image similarity rose {of_each(channels, gain)}."
