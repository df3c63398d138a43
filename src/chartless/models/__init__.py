"""Families of response curves, one file each, and `MODELS`, where users find them by name.

Which one? Where only a few numbers can be estimated, `AmeegcExact`: three parameters,
increasing whatever they are, and 0.004 RMSE from the median of 201 measured cameras. Where
more are known, `Gumbel` at the order they allow: it increases at every order. docs/models.md
compares all of them.

A new family is one file beside these, ending in a call of ``register_model``, and one
import line here.
"""

from chartless.models._base import (
    MODELS,
    UNIFORM_IRRADIANCE,
    AbstractModel,
    Property,
    checked_brightness,
    register_model,
)
from chartless.models._exponent import ExponentModel, PolynomialExponentModel
from chartless.models._linear import LinearModel
from chartless.models._principal import (
    N_COMPONENTS,
    Basis,
    PrincipalModel,
    measured_basis,
    principal_basis,
)
from chartless.models.ameegc import Ameegc
from chartless.models.ameegc_exact import AmeegcExact
from chartless.models.conpoly import ConPoly
from chartless.models.eegc import Eegc
from chartless.models.emor import Emor
from chartless.models.emor_monotone import EmorMonotone
from chartless.models.gamma import Gamma
from chartless.models.ggc import Ggc
from chartless.models.gumbel import Gumbel
from chartless.models.inverse_emor import InverseEmor
from chartless.models.logemor import LogEmor
from chartless.models.meegc import Meegc
from chartless.models.pegc import Pegc
from chartless.models.poly import Poly
from chartless.models.ppisp import Ppisp
from chartless.models.table import Table

__all__ = [
    "MODELS",
    "N_COMPONENTS",
    "UNIFORM_IRRADIANCE",
    "AbstractModel",
    "Ameegc",
    "AmeegcExact",
    "Basis",
    "ConPoly",
    "Eegc",
    "Emor",
    "EmorMonotone",
    "ExponentModel",
    "Gamma",
    "Ggc",
    "Gumbel",
    "InverseEmor",
    "LinearModel",
    "LogEmor",
    "Meegc",
    "Pegc",
    "Poly",
    "PolynomialExponentModel",
    "Ppisp",
    "PrincipalModel",
    "Property",
    "Table",
    "checked_brightness",
    "measured_basis",
    "principal_basis",
    "register_model",
]
