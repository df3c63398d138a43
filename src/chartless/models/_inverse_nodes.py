"""Shared by the families that describe g, not f, by its values at uniform brightness."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from chartless.models._base import AbstractModel
from chartless.models._principal import interpolate, invert_nodes
from chartless.types import Floats

_LEAST_SLOPE = 1e-9  # of g, where f would be vertical


@dataclass(frozen=True, slots=True)
class InverseNodesModel(AbstractModel):
    """g in straight lines between n points; f is its inverse.

    Where g decreases, f is that of its running maximum; so f never decreases.
    """

    @abstractmethod
    def _nodes(self, parameters: Floats) -> Floats:
        """Irradiance g at uniform brightness from 0 to 1, shape (n,), for parameters (P,)."""

    @abstractmethod
    def _node_gradient(self, parameters: Floats) -> Floats:
        """Derivatives of the nodes in the parameters, shape (n, P)."""

    @override
    def evaluate(self, irradiance: Floats, parameters: Floats) -> tuple[Floats, Floats]:
        if parameters.ndim > 1:
            each = [
                self.evaluate(irradiance, one) for one in parameters.reshape(-1, self.n_parameters)
            ]
            shape = (*parameters.shape[:-1], irradiance.size)
            response = np.reshape([one[0] for one in each], shape)
            return response, np.reshape([one[1] for one in each], (*shape, self.n_parameters))
        response = self._response(irradiance, parameters)
        slope = self._derivative(irradiance, parameters)
        by_node = interpolate(self._node_gradient(parameters).T, response).T
        return response, -slope[:, np.newaxis] * by_node

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        if parameters.ndim > 1:
            each = [self._response(x, one) for one in parameters.reshape(-1, self.n_parameters)]
            return np.reshape(each, (*parameters.shape[:-1], x.size))
        # Where g stays at 0 or 1 for a while, f jumps there and no line leads to its end.
        inside = invert_nodes(self._nodes(parameters), x)
        return np.where(x == 0, 0.0, np.where(x == 1, 1.0, inside))

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        nodes = np.maximum.accumulate(self._nodes(parameters))
        above = np.searchsorted(nodes, x).clip(1, nodes.size - 1)
        slope: Floats = (nodes[above] - nodes[above - 1]) * (nodes.size - 1)
        return 1 / np.maximum(slope, _LEAST_SLOPE)

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        return self.evaluate(x, parameters)[1]

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        nodes = np.maximum.accumulate(self._nodes(parameters))
        return interpolate(nodes, y).clip(0, 1)

    @override
    def _defining_values(self, parameters: Floats) -> Floats:
        return self._nodes(parameters)
