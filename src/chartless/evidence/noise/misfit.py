"""Classification of the misfit of level pairs and model.

Non-Gaussian noise shows in the kurtosis of the differences of pairs, by its sign and by
how far out it arises; levels that a camera skips or favours already show in single
frames.
"""

import numpy as np
from scipy.special import xlogy

from chartless.evidence.noise.cooccurrence import difference_moments
from chartless.flags import Advice
from chartless.types import Floats

# Limits between the values of simulated faults, which tests/test_misfit.py repeats.
_LEVEL_WISE = 0.9  # share of the deviance: combs and bent levels 0.96 and more, others up to 0.85
# Difference of the kurtosis from the model's and from that of a Gaussian: the median of
# 3 × 3 pixels 0.07 and more, JPEG and movers up to 2; uniform noise 0.5 below, families
# too stiff for a camera up to 0.07 below.
_GAUSSIAN, _PEAKED, _FLAT = 3.0, 0.05, 0.2
# Deviations beyond which movers lie; share of the excess kurtosis from there: movers
# 0.69 and more, denoised, compressed and Laplacian noise up to 0.50.
_FAR, _MOSTLY_FAR = 4.5, 0.6
_FEWEST_PAIRS = 100  # at a sum of levels, for a fourth moment
# Difference of the kurtosis from that of a model by the noise level alone: 0.035 or
# less in 57 of 60 simulated cameras without faults; JPEG of quality 85, H.264 of CRF 10
# (at an error of 0.009), movers and shifts of 0.3 pixels 0.077 and more.
_GAUSSIAN_ENOUGH = 0.07


class Pattern(Advice):
    """Pattern of a misfit of level pairs, with its likely causes."""

    PEAKED = (
        "peaked",
        (
            "more pixels hardly change, and more change a lot, than with Gaussian noise, a "
            "sign of denoising and compression: switch these off or use a higher quality"
        ),
    )
    FAR_TAILS = (
        "far-tails",
        (
            "some pixels change far more than the others, a sign of movers, flicker and "
            "faulty pixels: keep the scene still or exclude such parts with a `mask`"
        ),
    )
    FLAT_TOPPED = (
        "flat-topped",
        (
            "no pixel changes as much as some would with Gaussian noise, a sign of noise that "
            "was limited, dithered or synthesised: give frames as the camera writes them"
        ),
    )
    LEVEL_WISE = (
        "level-wise",
        (
            "single levels occur more or less often than their neighbours, a sign of stretching, "
            "tone mapping and few bits: give frames as the camera writes them"
        ),
    )
    NOISE_LEVEL = (
        "noise-level",
        (
            "the noise is Gaussian but its strength at each level differs from the model, a sign "
            "of a family too stiff for the camera or of processing that depends on brightness: "
            "switch HDR off, and omit `model`"
        ),
    )


def misfit_pattern(seen: Floats, expected: Floats) -> Pattern:
    """Classify the misfit between level pairs and a model.

    Parameters
    ----------
    seen : ndarray of float, shape (L, L)
        Symmetric counts C + Cᵀ.
    expected : ndarray of float, shape (L, L)
        Counts expected by the model, above 0.

    Returns
    -------
    Pattern
    """
    single = 2 * _deviance(seen.sum(axis=0), expected.sum(axis=0))  # of either frame
    if single > _LEVEL_WISE * _deviance(seen, expected):
        return Pattern.LEVEL_WISE
    pixels = _usable_pixels(seen)
    kurtosis, far = _kurtosis(seen, pixels)
    model, model_far = _kurtosis(expected, pixels)
    # A poor model is wrong about the kurtosis too: a Gaussian must agree.
    if kurtosis - max(model, _GAUSSIAN) > _PEAKED:
        mostly_far = far - model_far > _MOSTLY_FAR * (kurtosis - model)
        return Pattern.FAR_TAILS if mostly_far else Pattern.PEAKED
    if min(model, _GAUSSIAN) - kurtosis > _FLAT:
        return Pattern.FLAT_TOPPED
    return Pattern.NOISE_LEVEL


def peakedness(seen: Floats) -> float:
    """Excess kurtosis of the differences of level pairs at each sum of levels.

    Parameters
    ----------
    seen : ndarray of float, shape (L, L)
        Symmetric counts C + Cᵀ.

    Returns
    -------
    float
        0 for Gaussian noise, above for denoised and compressed frames. Clipping makes it
        negative.
    """
    kurtosis, _ = _kurtosis(seen, _usable_pixels(seen))
    return float(kurtosis) - _GAUSSIAN


def is_gaussian(seen: Floats, expected: Floats) -> bool:
    """Whether the differences of level pairs have the kurtosis of Gaussian noise.

    Denoising, compression and movers change the kurtosis; scene and noise level do not.
    So it can judge a model whose scene is not good enough for a deviance.

    Parameters
    ----------
    seen, expected : ndarray of float, shape (L, L)
        As for `misfit_pattern`.
    """
    pixels = _usable_pixels(seen)
    (kurtosis, _), (model, _) = _kurtosis(seen, pixels), _kurtosis(expected, pixels)
    by_chance = np.sqrt(24 / max(1.0, float(pixels.sum())))  # of Gaussian numbers
    return bool(abs(kurtosis - model) <= _GAUSSIAN_ENOUGH + 3 * by_chance)


def _usable_pixels(seen: Floats) -> Floats:
    """Pixels at each sum of two levels, 0 if too few for a kurtosis, (2L − 1,)."""
    pixels, _, squares = difference_moments(_unclipped(seen))
    pixels[(pixels < _FEWEST_PAIRS) | (squares == 0)] = 0.0
    return pixels


def _deviance(seen: Floats, expected: Floats) -> float:
    """Half the deviance of counts."""
    return float(np.sum(xlogy(seen, seen / expected) - seen + expected))


def _kurtosis(pairs: Floats, pixels: Floats) -> Floats:
    """Kurtosis of the difference of pairs, and the part of it that is far out, shape (2,).

    It is computed at each sum of two levels, so that no error of the noise level
    enters, and averaged with the weights `pixels`, shape (2L − 1,).
    """
    pairs = _unclipped(pairs)
    n, _, squares = difference_moments(pairs)
    used = pixels > 0
    precision, share = np.zeros(n.size), np.zeros(n.size)
    np.divide(n, squares, out=precision, where=used)
    np.divide(pixels, n, out=share, where=used)
    level = np.arange(len(pairs))
    sums = level[:, np.newaxis] + level
    standard = (level[:, np.newaxis] - level) ** 2 * precision[sums]
    fourth = pairs * share[sums] * standard**2
    far = fourth[standard > _FAR**2]
    both: Floats = np.array([fourth.sum(), far.sum()]) / max(1.0, float(pixels.sum()))
    return both


def _unclipped(pairs: Floats) -> Floats:
    """Pairs without black and white."""
    inner = np.zeros_like(pairs)
    inner[1:-1, 1:-1] = pairs[1:-1, 1:-1]
    return inner
