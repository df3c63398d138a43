"""Methods of calibration, from evidence to `Response`, one file for each.

`CALIBRATORS` has them by name. The default is ``likelihood``, the joint posterior given
any kinds of evidence; ``nlf`` uses the noise level alone, in milliseconds; ``ism-bin``
is the image-similarity search of the source paper with levels integrated over their
bins, ``ism-sampled`` as published. ``debevec``, ``mitsunaga`` and ``robertson`` are
methods from the literature for brackets.
"""

from chartless.methods._base import CALIBRATORS, AbstractCalibrator, ChannelProgress
from chartless.methods.debevec import DebevecCalibrator
from chartless.methods.ism.search import SimilaritySearch
from chartless.methods.likelihood import LikelihoodSearch
from chartless.methods.mitsunaga import MitsunagaCalibrator
from chartless.methods.nlf import NoiseLevelSearch
from chartless.methods.robertson import RobertsonCalibrator

__all__ = [
    "CALIBRATORS",
    "AbstractCalibrator",
    "ChannelProgress",
    "DebevecCalibrator",
    "LikelihoodSearch",
    "MitsunagaCalibrator",
    "NoiseLevelSearch",
    "RobertsonCalibrator",
    "SimilaritySearch",
]
