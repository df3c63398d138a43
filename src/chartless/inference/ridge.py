"""Modes along the ratio r = u/v of the noise parameters.

The likelihood of level pairs is a long, curved ridge in r: `ridge` walks along it from
one ratio to the next and computes the Laplace approximation of the evidence at each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chartless.curves.space import AbstractCurveSpace
from chartless.inference.block import Values, curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.noise_block import noise_name
from chartless.inference.search import maximise
from chartless.inference.stabilised import log_extent, warped
from chartless.inference.term import AbstractTerm
from chartless.types import Floats

RATIOS = (
    *(0.005, 0.013, 0.032, 0.08, 0.2, 0.5, 1.25, 3.1, 7.8, 20.0, 50.0),
    *(125.0, 310.0, 780.0, 2000.0, 5000.0),
)
"""Ratios r = u/v at which modes are sought."""
_DROP = 3.0  # nats
_REFINEMENTS = 10
_WIDEST = 2.5  # distance of modes at the peak in deviations of the evidence


def at_ratio(ratio: float, log_floor: float) -> Floats:
    """(ln u, ln v) with u = r v."""
    return np.array([np.log(ratio) + log_floor, log_floor])


def predicted(space: AbstractCurveSpace, found: ChannelMode, ratio: float) -> Values:
    """Values at another ratio with the same noise level at every brightness."""
    before = found.ratio
    edges = warped(found.edges, before, ratio)
    log_floor = found.log_floor + 2 * (log_extent(ratio) - log_extent(before))
    return {
        **found.mode.values,
        curve_name(found.channel): space.nearest(edges),
        noise_name(found.channel): at_ratio(ratio, log_floor),
    }


def ridge(
    terms: Sequence[AbstractTerm],
    channel: str,
    space: AbstractCurveSpace,
    start: Values,
    share: float,
    *,
    on_mode: Callable[[int], None] | None = None,
) -> list[ChannelMode]:
    """Modes at `RATIOS`, each found from its neighbour, outward from the start.

    The walk ends on either side where the weighted evidence has fallen so far that
    modes beyond add nothing.

    Parameters
    ----------
    terms : sequence of AbstractTerm
        Terms of one channel, whose noise block holds its ratio.
    channel : str
    space : AbstractCurveSpace
    start : mapping from names to ndarray
        Values at a typical ratio, which replaces the nearest of `RATIOS`.
    share : float
        Weight of the pairs' evidence along the ridge.
    on_mode : callable, optional
        Called with the number of modes found, at most ``len(RATIOS)``.
    """
    walk = _Walk(terms, channel, space)
    first = walk.mode(start)
    place = int(np.abs(np.log(np.divide(RATIOS, first.ratio))).argmin())
    places = {place: first}
    middle, best = place, first.weighted(share)
    for way in (1, -1):
        place = middle
        while 0 <= place + way < len(RATIOS) and places[place].weighted(share) > best - _DROP:
            found = walk.further(places[place], RATIOS[place + way])
            place += way
            places[place] = found
            best = max(best, found.weighted(share))
            if on_mode is not None:
                on_mode(len(places))
    return walk.refined([places[place] for place in sorted(places)], share)


@dataclass(frozen=True, slots=True, eq=False)
class _Walk:
    """Searches of one channel at different ratios."""

    terms: Sequence[AbstractTerm]
    channel: str
    space: AbstractCurveSpace

    def mode(self, start: Values) -> ChannelMode:
        spaces = {curve_name(self.channel): self.space}
        return ChannelMode(maximise(self.terms, spaces, start), self.channel)

    def further(self, found: ChannelMode, ratio: float) -> ChannelMode:
        return self.mode(predicted(self.space, found, ratio))

    def refined(self, modes: list[ChannelMode], share: float) -> list[ChannelMode]:
        """Add modes where the evidence is narrower than their distance, as with dark frames."""
        for _ in range(_REFINEMENTS):
            x = np.log([found.ratio for found in modes])
            y = np.array([found.weighted(share) for found in modes])
            best = int(y.argmax())
            if not 0 < best < len(modes) - 1:
                break
            left, right = x[best] - x[best - 1], x[best + 1] - x[best]
            # Parabola through the best and its neighbours.
            fall_left, fall_right = (y[best] - y[best - 1]) / left, (y[best] - y[best + 1]) / right
            curvature = 2 * (fall_left + fall_right) / (left + right)
            deviation = 1 / np.sqrt(max(curvature, 1e-12))
            if max(left, right) < _WIDEST * deviation:
                break
            peak = x[best] + (fall_left * right - fall_right * left) / (fall_left + fall_right) / 2
            if abs(peak - x[best]) < deviation / 2:  # the peak is known: bring its sides nearer
                peak = x[best] + (deviation if right > left else -deviation)
            near = modes[int(np.abs(x - peak).argmin())]
            found = self.further(near, float(np.exp(peak)))
            modes = sorted([*modes, found], key=lambda mode: mode.ratio)
        return modes


def belief(found: ChannelMode, space: AbstractCurveSpace) -> float:
    """Weight of the evidence, 0 … 1: lower for curves that the prior makes improbable.

    With an unknown scale, the prior would distinguish curves by P/(2q) of the present
    amount, where P is the number of coordinates and q half the squared distance of the
    curve from its mean, about P/2 for curves like those it was learned from.
    """
    away = found.coordinates - space.mean
    surprise = 0.5 * float(away @ space.precision @ away)
    return min(1.0, 0.5 * away.size / max(surprise, 1e-9))
