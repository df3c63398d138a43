"""Signs that the noise of frames is not the sensor's, as relative errors of its variance.

Denoising, compression and demosaicing change the noise by an amount that depends on level
and detail. They leave traces: lossy files, noise that is correlated between neighbours or
channels, differences that are peaked, levels that are never used.
"""

from collections.abc import Sequence

import numpy as np

from chartless.evidence._pair_check import PairCheck
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.misfit import peakedness
from chartless.evidence.noise.screening import empty_share

# Relative error of the variance in lossy files, at any quality: files of 98 and 100 show
# none of the other signs, and are off by up to three times as much as lossless ones.
_LOSSY = 0.6
# Correlation, besides so many deviations of chance, and excess kurtosis up to which noise may
# be that of a sensor. Simulated cameras without faults have 0.01 and, most of them, 0.11 at
# most; denoised ones 0.03 and more.
_UNCORRELATED, _CHANCE, _GAUSSIAN = 0.015, 4.0, 0.12
# Of the share of empty levels: a stretch by a quarter leaves 0.2 empty.
_EMPTY, _BY_EMPTY = 0.04, 3.0


def frame_errors(checks: Sequence[PairCheck], *, n_pixels: float, lossy: bool) -> tuple[float, ...]:
    """Relative errors of the noise variance by what pairs of frames show.

    Parameters
    ----------
    checks : sequence of PairCheck
        One per pair of frames.
    n_pixels : float
        Number of pixels of a frame.
    lossy : bool
        Whether the files are compressed with loss.

    Returns
    -------
    tuple of float
        Empty if nothing is wrong.
    """
    correlations = [
        max(abs(check.neighbour_correlation), check.channel_correlation) for check in checks
    ]
    correlation = float(np.median(correlations))
    limit = _UNCORRELATED + _CHANCE / np.sqrt(n_pixels)
    signs = ((_LOSSY, lossy), (correlation, correlation > limit))
    return tuple(error for error, seen in signs if seen)


def table_errors(table: Cooccurrence, *, processed: bool) -> tuple[float, ...]:
    """Relative errors of the noise variance by what level pairs show.

    Parameters
    ----------
    table : Cooccurrence
        Table without outliers.
    processed : bool
        Whether the frames show other signs. Only then is a peak of the differences one:
        sensors make it too, where the noise in levels changes quickly from level to
        level.
    """
    excess, empty = peakedness(table.symmetric.astype(np.float64)), empty_share(table)
    signs = (
        # Gaussian noise whose variance differs between pixels, by the relative deviation s,
        # has the kurtosis 3 (1 + s²).
        (float(np.sqrt(max(excess, 0.0) / 3)), processed and excess > _GAUSSIAN),
        (_BY_EMPTY * empty, empty > _EMPTY),
    )
    return tuple(error for error, seen in signs if seen)
