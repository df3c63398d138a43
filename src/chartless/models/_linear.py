"""Shared by the families that are linear in their parameters: f(I) = offset(I) + Σ_j c_j φ_j(I).

A fit of such a family is one linear system, with one minimum.
"""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from chartless.models._base import AbstractModel
from chartless.types import Floats


def coefficient_names(order: int) -> tuple[str, ...]:
    """Names of N + 1 parameters, from ``c1``."""
    return tuple(f"c{j}" for j in range(1, order + 2))


@dataclass(frozen=True, slots=True)
class LinearModel(AbstractModel):
    """f = offset + parameters · basis; a leaf writes both, and their slopes."""

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return coefficient_names(self.order)

    @abstractmethod
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        """Offset, shape (N,), and basis functions, shape (N, P), at irradiances (N,)."""

    @abstractmethod
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        """Derivatives of both with respect to the irradiance."""

    @override
    def _response(self, x: Floats, parameters: Floats) -> Floats:
        offset, basis = self.design(x)
        response: Floats = offset + parameters @ basis.T
        return response

    @override
    def _derivative(self, x: Floats, parameters: Floats) -> Floats:
        offset, basis = self.design_slope(x)
        slope: Floats = offset + basis @ parameters
        return slope

    @override
    def _gradient(self, x: Floats, parameters: Floats) -> Floats:
        _, basis = self.design(x)
        return np.broadcast_to(basis, (*parameters.shape[:-1], *basis.shape))


@dataclass(frozen=True, slots=True)
class PowersModel(LinearModel):
    """The basis is made of I, I², … I^(N+1)."""

    @property
    @override
    def identity(self) -> Floats:
        return np.asarray(np.eye(self.order + 1)[0])

    def powers(self, x: Floats) -> Floats:
        """Return x, x², …, shape (N, P)."""
        powers: Floats = x[:, np.newaxis] ** np.arange(1, self.order + 2)
        return powers

    def power_slopes(self, x: Floats) -> Floats:
        """Return 1, 2x, …, shape (N, P)."""
        exponents = np.arange(1, self.order + 2)
        slopes: Floats = exponents * x[:, np.newaxis] ** (exponents - 1)
        return slopes
