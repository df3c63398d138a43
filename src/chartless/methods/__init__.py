"""Methods of calibration, from evidence to `Response`, one file for each kind.

`CALIBRATORS` has them by name: ``likelihood``, the joint posterior given any kinds of evidence, is
the X
``debevec``, ``mitsunaga`` and ``robertson`` read brackets in the literature's way.
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
