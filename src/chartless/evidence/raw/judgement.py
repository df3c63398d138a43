"""Judgement of a search with raw files: matrix, gains, scatter and wider bands."""

import numpy as np

from chartless.evidence.base import Judgement
from chartless.evidence.raw.account import account_of_raw, doubts
from chartless.evidence.raw.term import RawTerm, raw_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate

# Errors of blocks of one shot are correlated. Deviation of their shape, as a multiple
# of that for independent blocks, which held at 0.86 of the patches of nine cameras
# (benchmarks/raw_pairs.py).
_TOGETHER_TIMES = 2.0


def judged(estimate: CurveEstimate, found: ChannelMode, term: RawTerm) -> Judgement:
    """Judge a search; arguments as for `AbstractCurveEvidence.judged`."""
    own, model = found.mode.values[raw_name(found.channel)], term.model
    log_gains = own[model.gains]
    account = account_of_raw(
        matrix=tuple(map(float, model.matrix(own))),
        gains=tuple(map(float, np.exp(log_gains - log_gains[0]))),
        corner_gain=float(np.exp(own[model.falloff].sum())),
        scatter=term.scatter,
    )
    together = np.sqrt(_TOGETHER_TIMES**2 - 1) * estimate.shape_or_all
    together[[0, -1]] = 0.0  # black and white are fixed by definition
    estimate = estimate.with_level_errors(together)
    return Judgement(estimate, doubts(account), (account,))
