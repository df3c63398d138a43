"""Families of response curves, one file each, and `MODELS`, where users find them by name.

Which one? Where only a few numbers can be estimated, `AmeegcExact`: three parameters,
increasing whatever they are, and 0.004 RMSE from the median of 201 measured cameras.
`Eegc` goes to any order when a measured curve is to be fitted closely. `Gamma` is the
baseline everything should beat.

A new family is one file beside these, ending in a call of ``register_model``, and one
import line here.
"""

from chartless.models._base import MODELS, AbstractModel, checked_brightness, register_model
from chartless.models._exponent import ExponentModel
from chartless.models.ameegc import Ameegc
from chartless.models.ameegc_exact import AmeegcExact
from chartless.models.eegc import Eegc
from chartless.models.gamma import Gamma

__all__ = [
    "MODELS",
    "AbstractModel",
    "Ameegc",
    "AmeegcExact",
    "Eegc",
    "ExponentModel",
    "Gamma",
    "checked_brightness",
    "register_model",
]
