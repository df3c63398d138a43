"""Where real cameras lie in the parameter space of a family, so that searches start well.

Whitened parameters q are the raw ones in units of their spread over measured cameras:
p = mean + matrix q, with q of mean 0 and unit covariance over the curves of the Database of
Response Functions (DoRF). The numbers in ``whitening.json`` are fitted by
``scripts/fit_whitening.py``, which records where they come from.
"""

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from chartless.models import AbstractModel, PrincipalModel
from chartless.types import Floats, JsonObject


@dataclass(frozen=True, slots=True, eq=False)
class Whitening:
    """Affine map between raw and whitened parameters of a family of P parameters."""

    mean: Floats
    """Mean over cameras, shape (P,)."""
    matrix: Floats
    """Columns are the principal axes times their deviations, shape (P, P)."""

    def colour(self, whitened: Floats) -> Floats:
        """Raw parameters, shape (P,)."""
        parameters: Floats = self.mean + self.matrix @ whitened
        return parameters

    def whiten(self, parameters: Floats) -> Floats:
        """Whitened parameters, shape (P,)."""
        return np.asarray(np.linalg.solve(self.matrix, parameters - self.mean), np.float64)


@cache
def _file() -> JsonObject:
    stored = resources.files("chartless.curves").joinpath("whitening.json")
    text = stored.read_text(encoding="utf-8")
    loaded: JsonObject = json.loads(text)
    return loaded


def whitening(model: AbstractModel) -> Whitening:
    """Whitening of a family; for one without fitted numbers, the raw parameters themselves.

    The coefficients of a principal-component family have mean 0 and are uncorrelated over
    the curves that its basis is made from.
    """
    if isinstance(model, PrincipalModel):
        return Whitening(np.zeros(model.n_parameters), np.diag(model.deviations))
    fitted = _file()["families"].get(model.name)
    if fitted is None:
        return Whitening(model.identity, np.eye(model.n_parameters))
    return Whitening(np.array(fitted["mean"]), np.array(fitted["matrix"]))
