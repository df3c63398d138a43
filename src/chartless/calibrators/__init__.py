"""Methods of calibration, from evidence to `Response`, one file for each kind.

`CALIBRATORS` has them by name: ``ism-bin``, the image-similarity search of the source paper
with levels integrated over their bins, is the default; ``ism-sampled`` is the search as
published, for comparison.
"""

from chartless.calibrators._base import CALIBRATORS, AbstractCalibrator, ChannelProgress
from chartless.calibrators.similarity_search import SimilaritySearch

__all__ = ["CALIBRATORS", "AbstractCalibrator", "ChannelProgress", "SimilaritySearch"]
