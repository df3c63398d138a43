"""Inverse EMoR: principal components of the inverse responses of measured cameras."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import AbstractModel, Property, register_model
from chartless.models._inverse_nodes import InverseNodesModel
from chartless.models._principal import N_COMPONENTS, BasisModel
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class InverseEmor(BasisModel, InverseNodesModel):
    """g = mean + N + 1 principal components of measured inverse responses.

    Grossberg and Nayar (TPAMI 2004), section 4.5. Not every g increases; f, which is that of
    its running maximum, never decreases, but jumps where g falls.
    The basis is of inverse responses at uniform brightness.
    """

    family: ClassVar[str] = "inverse-emor"
    formula: ClassVar[str] = "inverse of g0 + c1 k1 + ... + cM kM, k from measured inverses"
    kind: ClassVar[str] = "inverse"

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.BOUNDED, Property.EXTENSIBLE, Property.COMPACT})

    @override
    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:
        level = np.linspace(0, 1, self.parts[0].size)
        measured = [
            np.interp(level, np.maximum.accumulate(each), irradiance) for each in brightness
        ]
        own = self.projected(np.array(measured))[:, np.newaxis, :]
        return np.concatenate([own, AbstractModel.starts(self, irradiance, brightness)], axis=1)

    @override
    def _nodes(self, parameters: Floats) -> Floats:
        mean, components = self.parts
        nodes: Floats = mean + parameters @ components
        return nodes

    @override
    def _node_gradient(self, parameters: Floats) -> Floats:
        return self.parts[1].T


register_model(*(InverseEmor(order) for order in range(N_COMPONENTS)))
