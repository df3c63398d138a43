"""Screening of raw files and JPEGs: whether they determine a curve, and doubts."""

from collections.abc import Mapping

from chartless.errors import UnfitFramesError
from chartless.evidence._limits import GOOD_COVERAGE, LEAST_COVERAGE, MANY_CLIPPED
from chartless.evidence.raw.gather import RawEvidence
from chartless.flags import Flag

LEAST_BLOCKS, FEW_BLOCKS = 100, 500
"""Numbers of uniform blocks of a channel below which shots are refused, and flagged."""


def screen_raw(evidence: RawEvidence) -> Mapping[str, tuple[Flag, ...]]:
    """Refuse shots from which no curve can be estimated; flag what is doubtful.

    Returns
    -------
    mapping from channel names to tuples of Flag

    Raises
    ------
    UnfitFramesError
        If no curve can be estimated; the message says why and what to do.
    """
    return {name: _screened(evidence, name) for name in evidence.blocks}


def _screened(evidence: RawEvidence, name: str) -> tuple[Flag, ...]:
    blocks, clipped = evidence.blocks[name], evidence.clipped[name]
    if blocks.level.size < LEAST_BLOCKS:
        msg = (
            f"channel {name}: {blocks.level.size} blocks of pixels are uniform and unclipped, too "
            f"few for a curve (least {LEAST_BLOCKS}): photograph a scene with plain surfaces, in "
            "focus or not, and expose it so that little is clipped"
        )
        raise UnfitFramesError(msg)
    low, high = blocks.observed_levels
    coverage = (high - low) / (blocks.n_levels - 1)
    if coverage < LEAST_COVERAGE:
        msg = (
            f"channel {name}: levels {low} to {high} of 0 to {blocks.n_levels - 1} cover "
            f"{coverage:.0%} of the range, too little for a curve (least {LEAST_COVERAGE:.0%}):"
            " photograph a scene with both dark and bright parts, or add a shot of other exposure"
        )
        raise UnfitFramesError(msg)
    doubts = (
        (Flag.LEVELS_UNSEEN, coverage < GOOD_COVERAGE),
        (Flag.CLIPPED, clipped > MANY_CLIPPED),
        (Flag.FEW_PIXELS, blocks.level.size < FEW_BLOCKS),
    )
    return tuple(flag for flag, holds in doubts if holds)
