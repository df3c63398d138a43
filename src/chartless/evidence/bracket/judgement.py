"""Judgement of a search with a bracket: exposures, scatter, flags and bands."""

import numpy as np

from chartless.evidence.base import Judgement
from chartless.evidence.bracket.account import (
    SeenTransfer,
    SeenTransfers,
    account_of_bracket,
)
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.evidence.bracket.term import EXPOSURES, scatter_name
from chartless.evidence.bracket.transfer import brightness_transfer
from chartless.flags import Flag
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.estimate import CurveEstimate
from chartless.inference.posterior import covariance_of
from chartless.noise import AffineNoise
from chartless.types import Floats

# Deviation of ln γ above which the power of a curve is undetermined; deviations of
# exposures from their given values; relative scatter above which they do not belong
# together.
_UNSURE_EXPONENT, _FAR_OFF, _MUCH_SCATTER = 0.05, 3.0, 0.15
# Least deviation of ln γ with repeats: γ moved by 0.01 to 0.05 with the treatment of
# the noise between exposures and of the shoulder, on photographs and on scenes whose
# density is the inverse of light.
_EXPONENT_LIMIT = 0.03
# The same for lossless exposures that are nearly known: what 0.0045 lacked to reach the
# 0.0053 needed in 32 cases of benchmarks/files.py, PNG, exposures off by 2 %.
_EXPONENT_LOSSLESS = 0.003
# The same where only the prior determines γ (benchmarks/files.py, row unknown).
_EXPONENT_BY_PRIOR = 0.3
# Change of ln t from the given values above which exposures are off, so small that
# rounded shutter times stay below; and as a share of the range of ln t, where lossy
# files are 3 % off though exposures are right.
_OTHER_EXPOSURES, _OTHER_BY_LOSSY = 0.05, 0.1
# Deviation of the light above the highest level observed, as a share of what the prior
# expects there: for digital cameras it is up to two and a half times that, and in lossy
# files the highest levels hold the fewest bright pixels (benchmarks/files.py, PNG and
# JPEG).
_UNSEEN, _UNSEEN_LOSSY = 0.5, 1.5
# Errors of levels are correlated between pixels in lossy files, and where levels are
# matched by rank. Deviation of their shape, as a multiple of that for independent
# pixels; further deviations in levels and as a share of the noise. Chosen on sixteen
# cases of benchmarks/files.py, JPEG at three noise levels, checked on sixteen others.
_TOGETHER_TIMES, _TOGETHER_LEVELS, _TOGETHER_NOISE = 2.0, 1.0, 0.2
# Where blocks with white are left out, noise selects the pixels compared near white:
# relative deviations of the shape and of the light at white, in deviations of the noise
# at white. In eighteen other brackets, grey JPEG of quality 92 by soft curves, they
# cover errors of five deviations.
_CHOSEN_SHAPE, _CHOSEN_WHITE = 1.5, 3.0


def judged(
    estimate: CurveEstimate,
    found: ChannelMode,
    counts: ExposureCounts,
    *,
    exponent_error: float,
    noted: tuple[Flag, ...],
) -> Judgement:
    """Judge a search.

    Parameters
    ----------
    estimate : CurveEstimate
    found : ChannelMode
    counts : ExposureCounts
        Counts as the search used them.
    exponent_error : float
        Deviation of ln γ from exposures that a first search settled.
    noted : tuple of Flag
        Flags of that search about the exposures.
    """
    log_exposures, error = exposures_found(counts, found)
    # Exposures that are free here were found with other evidence, which determines γ.
    least = least_exponent_error(counts, noise_known=True)
    error = float(np.hypot(np.hypot(error, least), exponent_error))
    scatter = float(np.exp(found.mode.values[scatter_name(found.channel)][0]))
    relative = np.exp(log_exposures - log_exposures.min())
    doubts = (
        (Flag.EXPONENT_UNKNOWN, error > _UNSURE_EXPONENT),
        (Flag.EXPOSURES_OFF, are_off(counts, log_exposures)),
        (Flag.SCATTER, scatter > _MUCH_SCATTER),
    )
    flags = (*noted, *(flag for flag, holds in doubts if holds))
    white_error = float(np.hypot(counts.white_error, _unseen_error(counts, estimate)))
    estimate = estimate.with_white_error(white_error)
    noise = found.noise
    for holds in (counts.lossy, not counts.aligned):
        if holds:
            estimate = estimate.with_level_errors(_errors_together(estimate, noise))
    if counts.lossy and counts.aligned:
        estimate = _with_noise_beside_white(estimate, noise)
    account = account_of_bracket(
        found.channel,
        estimate.curve,
        exposures=relative.tolist(),
        exponent_error=error,
        scatter=scatter,
        transfers=seen_transfers(counts, log_exposures),
    )
    return Judgement(estimate, flags, (account,))


def least_exponent_error(counts: ExposureCounts, *, noise_known: bool) -> float:
    """Least deviation of ln γ by a bracket."""
    if counts.unknown:
        return _EXPONENT_LIMIT if noise_known else _EXPONENT_BY_PRIOR
    if counts.settled:
        return 0.0
    if counts.lossy:
        return _EXPONENT_LIMIT
    extent = float(np.ptp(counts.log_exposures))
    return min(_EXPONENT_LOSSLESS, float(np.sqrt(2)) * counts.exposure_error / extent)


def exposures_found(counts: ExposureCounts, found: ChannelMode) -> tuple[Floats, float]:
    """Ln of the exposures, and the deviation of the exponent."""
    if counts.exposure_error == 0:
        return counts.log_exposures, 0.0
    ends = np.zeros(counts.log_exposures.size)
    ends[counts.log_exposures.argmax()], ends[counts.log_exposures.argmin()] = 1.0, -1.0
    log_exposures = counts.log_exposures + found.mode.values[EXPOSURES]
    variance = float(ends @ covariance_of(found.mode, found.mode.places[EXPOSURES]) @ ends)
    return log_exposures, float(np.sqrt(variance)) / float(log_exposures @ ends)


def _errors_together(estimate: CurveEstimate, noise: AffineNoise) -> Floats:
    """Deviation of g at the levels beyond that for independent pixels, shape (L,)."""
    light = estimate.inverse_lut
    variance = (
        (_TOGETHER_TIMES**2 - 1) * estimate.shape_or_all**2
        + (_TOGETHER_LEVELS * np.gradient(light)) ** 2
        + _TOGETHER_NOISE**2 * noise.variance(light)
    )
    variance[[0, -1]] = 0.0  # black and white are fixed by definition
    return np.asarray(np.sqrt(variance))


def _with_noise_beside_white(estimate: CurveEstimate, noise: AffineNoise) -> CurveEstimate:
    """Widen the bands by the noise where lossy blocks with white are left out."""
    at_white = float(np.sqrt(noise.variance(np.array(1.0))))
    below_white = np.append(estimate.inverse_lut[:-1], 0.0)
    wider = estimate.with_level_errors(_CHOSEN_SHAPE * at_white * below_white)
    return wider.with_white_error(_CHOSEN_WHITE * at_white)


def _unseen_error(counts: ExposureCounts, estimate: CurveEstimate) -> float:
    """Relative deviation of the light at white due to levels that are not observed."""
    highest = min(counts.observed_levels[1], counts.n_levels - 2 - counts.margin)
    share = 1.0 - float(estimate.inverse_lut[highest])
    return (_UNSEEN_LOSSY if counts.lossy else _UNSEEN) * share


def are_off(counts: ExposureCounts, found: Floats) -> bool:
    """Whether ln of the exposures found differs from what was given."""
    if counts.settled:
        return False
    off = float(np.ptp(found - counts.log_exposures))
    most = 2 * _FAR_OFF * counts.exposure_error
    if counts.lossy:
        return off > max(most, _OTHER_BY_LOSSY * float(np.ptp(counts.log_exposures)))
    return off > (most if counts.unknown else min(most, _OTHER_EXPOSURES))


def seen_transfers(counts: ExposureCounts, log_exposures: Floats) -> SeenTransfers:
    """Brightness transfers observed before any model, rounded for the file."""
    found = []
    for table in counts.forward:
        upper, lower = brightness_transfer(table.counts)
        ratio = float(np.exp(log_exposures[table.longer] - log_exposures[table.shorter]))
        found.append(SeenTransfer(ratio, tuple(upper.tolist()), tuple(lower.round(2).tolist())))
    return SeenTransfers(counts.n_levels, tuple(found))
