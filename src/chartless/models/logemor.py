"""EMoR of logarithms: principal components of ln f of measured cameras."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import AbstractModel, Property, register_model
from chartless.models._principal import (
    N_COMPONENTS,
    BasisModel,
    interpolate,
    interpolated_slope,
    invert_nodes,
)
from chartless.types import Floats

_MOST_LOG = 700.0  # exp of it is finite


@final
@dataclass(frozen=True, slots=True)
class LogEmor(BasisModel):
    """logEMoR of order N: ln f = mean of ln f + N + 1 principal components.

    Grossberg and Nayar (TPAMI 2004), section 4.4: errors are relative ones. The curve goes
    in straight lines from black through the points of the basis. The
    basis is of ln f on a uniform grid without black.
    """

    family: ClassVar[str] = "logemor"
    formula: ClassVar[str] = "exp(l0 + c1 l1 + ... + cM lM), l from ln f of measured responses"
    kind: ClassVar[str] = "log_response"

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.EXTENSIBLE, Property.COMPACT})

    @property
    @override
    def identity(self) -> Floats:
        return self.projected(np.log(self._grid))

    @override
    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:
        measured = [np.interp(self._grid, irradiance, each) for each in brightness]
        own = self.projected(np.log(np.clip(measured, 1e-6, None)))[:, np.newaxis, :]
        return np.concatenate([own, AbstractModel.starts(self, irradiance, brightness)], axis=1)

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        return interpolate(self._nodes(parameters), x)

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        return interpolated_slope(self._nodes(parameters), x)

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        _, components = self.parts
        inner = self._nodes(parameters)[..., 1:]
        by_node = inner[..., np.newaxis, :] * components  # (..., P, n)
        with_black = np.concatenate([np.zeros((*by_node.shape[:-1], 1)), by_node], axis=-1)
        return np.moveaxis(interpolate(with_black, x), -2, -1)

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        return invert_nodes(self._nodes(parameters), y)

    @property
    def _grid(self) -> Floats:
        """Irradiances of the points of the basis, shape (n,)."""
        return np.linspace(0, 1, self.parts[0].size + 1)[1:]

    def _nodes(self, parameters: Floats) -> Floats:
        mean, components = self.parts
        inner = np.exp((mean + parameters @ components).clip(max=_MOST_LOG))
        return np.concatenate([np.zeros((*inner.shape[:-1], 1)), inner], axis=-1)


register_model(*(LogEmor(order) for order in range(N_COMPONENTS)))
