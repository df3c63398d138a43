"""Methods of calibration, from evidence to `Response`, one file for each kind.

`CALIBRATORS` has them by name: ``likelihood``, the exact likelihood of level pairs, is the
default; ``nlf`` uses the noise level alone, in milliseconds; ``ism-bin`` is the image-similarity
search of the source paper with levels integrated over their bins, ``ism-sampled`` as published.
``debevec``, ``mitsunaga`` and ``robertson`` read exposures of the literature's way; ``raw`` reads
raw files beside their JPEGs.
"""

from chartless.methods._base import CALIBRATORS, AbstractCalibrator, ChannelProgress
from chartless.methods.debevec import DebevecCalibrator
from chartless.methods.ism.search import SimilaritySearch
from chartless.methods.likelihood import LikelihoodSearch
from chartless.methods.mitsunaga import MitsunagaCalibrator
from chartless.methods.nlf import NoiseLevelSearch
from chartless.methods.raw_pairs import RawPairSearch
from chartless.methods.robertson import RobertsonCalibrator

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
