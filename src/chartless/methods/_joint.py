"""Joint search for the curves of all channels, given all evidence on them.

Terms that share unknowns, such as the exposures of a bracket, are searched together,
the others separately. The search does not depend on the kinds of evidence.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from chartless._numeric.threads import in_order
from chartless.curves.prior import CurvePrior
from chartless.curves.space import AbstractCurveSpace, FreeCurve
from chartless.evidence.base import AbstractCurveEvidence
from chartless.inference.block import Values, curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.populations import gains, in_space, with_evidence
from chartless.inference.search import Mode, connected, maximise
from chartless.inference.term import AbstractTerm
from chartless.types import Floats

_FIRST_SETTLED = 5.0  # nats: the first search only sets weights for the next
_MOST_LOOKS = 20

Parts: TypeAlias = Mapping[str, Sequence[AbstractCurveEvidence]]
"""Evidence on the curve of each channel, by channel name."""
MoreTerms: TypeAlias = Callable[
    [Mapping[str, Floats], Values], tuple[Sequence[AbstractTerm], Values]
]
"""Function from edges and values of a first search to more terms and their start."""


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """Result of a search of all channels."""

    space: AbstractCurveSpace
    """Space of each curve."""
    found: Mapping[str, ChannelMode]
    """Modes by channel."""
    terms: Mapping[str, tuple[AbstractTerm, ...]]
    """Terms of the parts of each channel, in order, as the search used them."""


def searched(
    parts: Parts, space: AbstractCurveSpace, prior: CurvePrior, more: MoreTerms | None = None
) -> Searched:
    """Most probable curves of all channels.

    Parameters
    ----------
    parts : mapping from channels to sequences of AbstractCurveEvidence
    space : AbstractCurveSpace
        Space of each curve.
    prior : CurvePrior
        Prior for first guesses.
    more : callable, optional
        Function that adds terms, those of level pairs of one exposure.
    """
    spaces = {curve_name(channel): space for channel in parts}
    values = _begun(parts, space, prior)
    edges: Mapping[str, Floats] = {name: space.edges(values[name]) for name in spaces}
    owned = [
        (channel, part.term(channel, noise_known=more is not None))
        for channel, own in parts.items()
        for part in own
    ]
    terms: list[AbstractTerm] = [term for _, term in owned]
    looks = [term.first_look(edges, values) for term in terms]
    modes = _modes(looks, spaces, values, tolerance=_FIRST_SETTLED)
    values, edges = _state(modes)
    terms = [term.informed(edges, values) for term in terms]
    added: Sequence[AbstractTerm] = ()
    if more is not None:
        added, begun = more(edges, values)
        values = {**values, **begun}
    for _ in range(_MOST_LOOKS):
        modes = _modes([*terms, *added], spaces, values)
        values, edges = _state(modes)
        again = [term.informed(edges, values) for term in terms]
        if all(one is other for one, other in zip(again, terms, strict=True)):
            break
        terms = again
    weighed, space = _with_populations(modes, space)
    of_curve = {name: mode for mode in weighed for name in mode.edges}
    used = list(zip((channel for channel, _ in owned), terms, strict=True))
    return Searched(
        space,
        {channel: ChannelMode(of_curve[curve_name(channel)], channel) for channel in parts},
        {channel: tuple(term for name, term in used if name == channel) for channel in parts},
    )


def _begun(parts: Parts, space: AbstractCurveSpace, prior: CurvePrior) -> Values:
    """Start of a first search: best guess of each channel, mean of shared unknowns."""
    values: dict[str, Floats] = {}
    shared: dict[str, list[Floats]] = {}
    for channel, own in parts.items():
        guesses = [guess for part in own if (guess := part.guess(prior)) is not None]
        coordinates = space.nearest(guesses[0].edges) if guesses else space.mean
        values[curve_name(channel)] = coordinates
        edges = space.edges(coordinates)
        for part in own:
            values.update(part.start(channel, edges))
        for guess in guesses:
            for name, value in guess.values.items():
                shared.setdefault(name, []).append(value)
    return {**values, **{name: np.mean(rows, axis=0) for name, rows in shared.items()}}


def _modes(
    terms: Sequence[AbstractTerm],
    spaces: Mapping[str, AbstractCurveSpace],
    start: Values,
    **how: float,
) -> list[Mode]:
    groups = connected(terms)
    return list(in_order(partial(maximise, group, spaces, start, **how) for group in groups))


def _with_populations(
    modes: Sequence[Mode], space: AbstractCurveSpace
) -> tuple[Sequence[Mode], AbstractCurveSpace]:
    """Modes under the populations that all channels of the camera favour."""
    if not isinstance(space, FreeCurve) or not space.populations:
        return modes, space
    n_curves = [len(mode.edges) for mode in modes]
    gained = list(in_order(partial(gains, mode, space) for mode in modes))
    after = with_evidence(space, np.average(gained, axis=0, weights=n_curves))
    return list(in_order(partial(in_space, mode, space, after) for mode in modes)), after


def _state(modes: Sequence[Mode]) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Values and edges of all modes."""
    values = {name: value for mode in modes for name, value in mode.values.items()}
    edges = {name: each for mode in modes for name, each in mode.edges.items()}
    return values, edges
