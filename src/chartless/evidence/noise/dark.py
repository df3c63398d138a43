"""Gain expected from frames taken with the lens covered."""

from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky

from chartless.curves.space import AbstractCurveSpace, in_coordinates
from chartless.evidence.noise.likelihood import DARK_PIXELS
from chartless.evidence.noise.term import PairFit
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import Posterior, at_mode
from chartless.types import Floats


def std_with_dark(posterior: Posterior, space: AbstractCurveSpace) -> Floats:
    """Expected deviation of g at the levels after two frames with the lens covered.

    Each has `DARK_PIXELS` pixels or more. Their expected information narrows the curve
    at the best mode; the uncertainty of the ratio remains, as they do not determine it.

    Returns
    -------
    ndarray, shape (L,)
    """
    best = posterior.best
    (model,) = (fit.model for fit in best.mode.fits if isinstance(fit, PairFit))
    of_edges = model.dark_information(DARK_PIXELS, best.noise_mix[:, 1] * best.noise.floor)
    added = in_coordinates(of_edges, best.edges.size, space.pull(best.coordinates))
    information = best.mode.factor @ best.mode.factor.T
    information[: len(added), : len(added)] += added  # curve and noise come first
    factor = cholesky(information, lower=True, check_finite=False)
    after = at_mode(ChannelMode(replace(best.mode, factor=factor), best.channel), space)
    between = np.maximum(posterior.inverse_std**2 - posterior.best_variance, 0.0)
    return np.sqrt(after.best_variance + between)
