"""Inverse EMoR: principal components of the inverse responses of measured cameras."""

from dataclasses import dataclass, field
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import AbstractModel, Property, register_model
from chartless.models._inverse_nodes import InverseNodesModel
from chartless.models._principal import (
    N_COMPONENTS,
    Basis,
    checked_order,
    coefficient_names,
    measured_basis,
)
from chartless.types import Floats


@final
@dataclass(frozen=True, slots=True)
class InverseEmor(InverseNodesModel):
    """g = mean + N + 1 principal components of measured inverse responses.

    Grossberg and Nayar (TPAMI 2004), section 4.5. Not every g increases; f, which is that of
    its running maximum, never decreases, but jumps where g falls.

    Parameters
    ----------
    order : int
    basis : Basis, optional
        Of inverse responses at uniform brightness.
    """

    family: ClassVar[str] = "inverse-emor"
    formula: ClassVar[str] = "inverse of g0 + c1 k1 + ... + cM kM, k from measured inverses"
    order: int = 4
    basis: Basis | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        checked_order(self.family, self.order, self.basis)

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset({Property.ENDS, Property.BOUNDED, Property.EXTENSIBLE, Property.COMPACT})

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return coefficient_names(self.order)

    @property
    @override
    def identity(self) -> Floats:
        mean, components = self._parts()
        nearest: Floats = components @ (np.linspace(0, 1, mean.size) - mean)
        return nearest

    @property
    @override
    def lower(self) -> "InverseEmor | None":
        return InverseEmor(self.order - 1, self.basis) if self.order else None

    @override
    def starts(self, irradiance: Floats, brightness: Floats) -> Floats:
        mean, components = self._parts()
        level = np.linspace(0, 1, mean.size)
        measured = [
            np.interp(level, np.maximum.accumulate(each), irradiance) for each in brightness
        ]
        own: Floats = ((np.array(measured) - mean) @ components.T)[:, np.newaxis, :]
        return np.concatenate([own, AbstractModel.starts(self, irradiance, brightness)], axis=1)

    @override
    def _nodes(self, parameters: Floats) -> Floats:
        mean, components = self._parts()
        nodes: Floats = mean + parameters @ components
        return nodes

    @override
    def _node_gradient(self, parameters: Floats) -> Floats:
        return self._parts()[1].T

    def _parts(self) -> tuple[Floats, Floats]:
        basis = self.basis or measured_basis("inverse")
        return basis.mean, basis.components[: self.order + 1]


register_model(*(InverseEmor(order) for order in range(N_COMPONENTS)))
