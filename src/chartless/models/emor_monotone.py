"""The members of EMoR that increase."""

from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless.models._base import Property, register_model
from chartless.models._principal import N_COMPONENTS, PrincipalModel
from chartless.types import Bools, Floats

_LEAST_SLOPE = 1e-6  # of f; keeps the rounding of a solver away from a decreasing curve
_LOOSE = 0.5  # share of it that is still admitted


@final
@dataclass(frozen=True, slots=True)
class EmorMonotone(PrincipalModel):
    """EMoR of order N with the side constraint that f never decreases.

    Curves are straight lines between the points of the basis, so one inequality for each
    line says it exactly. Grossberg and Nayar (TPAMI 2004), section 4.3.
    """

    family: ClassVar[str] = "emor-monotone"
    constrained: ClassVar[bool] = True
    condition: ClassVar[str] = "of a curve that never decreases"
    formula: ClassVar[str] = "f0 + c1 h1 + ... + cM hM with f' > 0"

    @property
    @override
    def name(self) -> str:
        return f"emor{self.order}-monotone"

    @property
    @override
    def properties(self) -> frozenset[Property]:
        return frozenset(
            {Property.ENDS, Property.MONOTONE, Property.BOUNDED, Property.EXTENSIBLE,
             Property.COMPACT}
        )  # fmt: skip

    @property
    @override
    def identity(self) -> Floats:
        nearest = self.projected(np.linspace(0, 1, self.parts[0].size))
        # The mean increases, so that a step from it towards the nearest member is allowed.
        steps = 0.9 ** np.arange(200)
        allowed = steps[self.admits(steps[:, np.newaxis] * nearest)]
        return allowed[0] * nearest if allowed.size else 0 * nearest

    @override
    def repaired(self, parameters: Floats) -> Floats:
        # The mean increases, so that one step in a million towards it makes up for rounding.
        admitted = self.admits(parameters)[..., np.newaxis]
        return np.where(admitted, parameters, (1 - 1e-6) * parameters)

    @override
    def admits(self, parameters: Floats) -> Bools:
        mean, components = self.parts
        with np.errstate(invalid="ignore"):
            slopes = np.diff(mean + parameters @ components) * (mean.size - 1)
        return np.asarray(np.all(slopes >= _LOOSE * _LEAST_SLOPE, axis=-1))

    @override
    def inequalities(self, parameters: Floats) -> tuple[Floats, Floats]:
        mean, components = self.parts
        return -np.diff(components).T, np.diff(mean) - _LEAST_SLOPE / (mean.size - 1)


register_model(*(EmorMonotone(order) for order in range(N_COMPONENTS)))
