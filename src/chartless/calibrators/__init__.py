"""Methods of calibration, from evidence to `Response`, one file for each kind.

`CALIBRATORS` has them by name: ``likelihood``, the exact likelihood of level pairs, is the
default; ``nlf`` uses the noise level alone, in milliseconds; ``ism-bin`` is the image-similarity
search of the source paper with levels integrated over their bins, ``ism-sampled`` as published.
``debevec``, ``mitsunaga`` and ``robertson`` read exposures of the literature's way; ``raw`` reads
raw files beside their JPEGs.
"""

from chartless.calibrators._base import CALIBRATORS, AbstractCalibrator, ChannelProgress
from chartless.calibrators.debevec import DebevecCalibrator
from chartless.calibrators.likelihood import LikelihoodSearch
from chartless.calibrators.mitsunaga import MitsunagaCalibrator
from chartless.calibrators.noise_level import NoiseLevelSearch
from chartless.calibrators.raw_pairs import RawPairSearch
from chartless.calibrators.robertson import RobertsonCalibrator
from chartless.calibrators.similarity_search import SimilaritySearch

__all__ = [
    "CALIBRATORS",
    "AbstractCalibrator",
    "ChannelProgress",
    "DebevecCalibrator",
    "LikelihoodSearch",
    "MitsunagaCalibrator",
    "NoiseLevelSearch",
    "RawPairSearch",
    "RobertsonCalibrator",
    "SimilaritySearch",
]
