"""Exposures that all channels of a camera share.

Each channel finds exposures of its own, where these are not exact, and with them a power of the
curve: two channels that differ in it are a cast of colour that changes with brightness. But the
shutter was one. So channels are estimated twice: first each with its own exposures, then all with
the median of what they found.

Lossy files tell exposures worse than a shutter does: ratios come out 1 to 3 % off, and much surer
than that (benchmarks/files.py, row exif). Where exposures are given, they stay as given; what they
err by goes to the band, and what the files say of them to a flag (docs/design/0011-jpeg.md).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chartless.evidence.bracket.gather import BracketEvidence
from chartless.flags import Flag
from chartless.result.response import Response
from chartless.types import Floats

LOSSY_ERROR = 0.05
"""Of ln of exposures, given for lossy files: where they are said to err by less, they stay."""
_KEPT = (Flag.EXPONENT_UNKNOWN, Flag.EXPOSURES_OFF)


@dataclass(frozen=True, slots=True, eq=False)
class SharedExposures:
    """What channels found together."""

    log_exposures: Floats
    """ln of the exposures, the least being 0, shape (K,)."""
    exponent_error: float
    """Deviation of ln γ: that of a channel, and how far channels are apart."""

    def taken_by(self, response: Response, alone: Response) -> Response:
        """Return a response for these exposures, with what is not known of them.

        Parameters
        ----------
        response : Response
            Estimated with these exposures as if they were exact.
        alone : Response
            The same channel with exposures of its own.
        """
        assert response.exposures is not None
        exposures = replace(response.exposures, exponent_error=self.exponent_error)
        shared = replace(response, exposures=exposures).with_exponent_error(self.exponent_error)
        return _with_flags_of_exposures(shared, alone)


def with_shared_exposures(
    estimates: Callable[[BracketEvidence | None], tuple[Response, ...]],
    bracket: BracketEvidence | None,
) -> tuple[Response, ...]:
    """Channels estimated one by one and, where exposures are not exact, again with common ones.

    Parameters
    ----------
    estimates : callable
        Given a bracket, returns all channels.
    bracket : BracketEvidence, optional
        Without, nothing is shared.
    """
    alone = estimates(bracket)
    if bracket is None or bracket.exposure_error == 0:
        return alone
    if bracket.lossy and bracket.exposure_error < LOSSY_ERROR:
        again = estimates(bracket.held())
        return tuple(map(_with_flags_of_exposures, again, alone))
    shared = shared_exposures(alone)
    if shared is None:
        return alone
    again = estimates(bracket.held_at(shared.log_exposures))
    return tuple(map(shared.taken_by, again, alone))


def _with_flags_of_exposures(response: Response, alone: Response) -> Response:
    """Response with what the same channel, with exposures of its own, said of them."""
    return response.with_flags(*(flag for flag in alone.flags if flag in _KEPT))


def shared_exposures(channels: Sequence[Response]) -> SharedExposures | None:
    """Median of the exposures that channels found; None for one channel or exact exposures."""
    found = [each.exposures for each in channels if each.exposures is not None]
    if len(found) < 2 or all(each.exponent_error == 0 for each in found):  # noqa: PLR2004
        return None
    own = np.log([each.relative for each in found])
    common = np.median(own, axis=0)
    extents = np.ptp(own, axis=1)
    apart = float(np.std(extents, ddof=1) / np.median(extents))
    alone = float(np.median([each.exponent_error for each in found]))
    # The prior's choice of γ is one for all channels: it does not average out.
    return SharedExposures(common - common.min(), float(np.hypot(alone, apart)))
