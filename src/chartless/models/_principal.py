"""Principal components of measured curves, on which the EMoR families stand.

A basis is a mean curve and orthonormal components on a uniform grid; between two points of
the grid curves are straight lines. The basis of the package is computed from the Database of
Response Functions by ``scripts/fit_emor.py``; `principal_basis` makes one from other curves,
for instance without the camera on which a method is to be tested.
"""

from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import ClassVar

import numpy as np
from typing_extensions import override

from chartless.errors import ParameterError
from chartless.models._base import AbstractModel
from chartless.models._linear import LinearModel, coefficient_names
from chartless.types import Floats

N_COMPONENTS = 25
"""Number of components, as many as Grossberg and Nayar publish."""


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """Mean and principal components of curves on a uniform grid over [0, 1]."""

    mean: Floats
    """Shape (n,)."""
    components: Floats
    """Orthonormal rows, the one of greatest variance first, shape (K, n)."""
    deviations: Floats
    """Standard deviation of the curves along each component, shape (K,)."""


def principal_basis(curves: Floats, n_components: int = N_COMPONENTS) -> Basis:
    """Mean and principal components of curves.

    Parameters
    ----------
    curves : ndarray, shape (B, n)
        Values on a uniform grid; a row for each curve.
    n_components : int
        At most B − 1.

    Returns
    -------
    Basis
        The sign of a component is such that its largest entry is positive.
    """
    mean = curves.mean(axis=0)
    _, singular, rows = np.linalg.svd(curves - mean, full_matrices=False)
    components = rows[:n_components]
    largest = np.abs(components).argmax(axis=1)
    components = components * np.sign(components[range(len(components)), largest])[:, np.newaxis]
    return Basis(mean, components, singular[:n_components] / np.sqrt(len(curves)))


@cache
def measured_basis(kind: str) -> Basis:
    """Basis of 201 measured cameras: of ``"response"``, ``"inverse"`` or ``"log_response"``.

    The logarithm is that of the response on the grid without black, where it is infinite.
    """
    with resources.files("chartless.models").joinpath("emor.npz").open("rb") as file:
        data = np.load(file)
        rows = data[kind].astype(np.float64)
        return Basis(rows[0], rows[1:], data[f"{kind}_deviations"].astype(np.float64))


def interpolate(nodes: Floats, x: Floats) -> Floats:
    """Values at x (N,) of lines through nodes (..., n) on a uniform grid, shape (..., N)."""
    place = x * (nodes.shape[-1] - 1)
    below = np.minimum(place.astype(np.intp), nodes.shape[-1] - 2)
    share = place - below
    values: Floats = nodes[..., below] * (1 - share) + nodes[..., below + 1] * share
    return values


def interpolated_slope(nodes: Floats, x: Floats) -> Floats:
    """Slopes of these lines, shape (..., N); at a node that of the line above it."""
    below = np.minimum((x * (nodes.shape[-1] - 1)).astype(np.intp), nodes.shape[-1] - 2)
    slopes: Floats = (nodes[..., below + 1] - nodes[..., below]) * (nodes.shape[-1] - 1)
    return slopes


def invert_nodes(nodes: Floats, y: Floats) -> Floats:
    """Where the running maximum of lines through nodes (n,) takes values (N,)."""
    rising = np.maximum.accumulate(nodes)
    above = np.searchsorted(rising, y).clip(1, nodes.size - 1)
    low, high = rising[above - 1], rising[above]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(high > low, (y - low) / (high - low), 1.0).clip(0, 1)
    places: Floats = (above - 1 + share) / (nodes.size - 1)
    return places


@dataclass(frozen=True, slots=True)
class BasisModel(AbstractModel):
    """Coefficients of principal components; a leaf says what they are the components of.

    Parameters
    ----------
    order : int
        One less than the number of components.
    basis : Basis, optional
        Without, that of 201 measured cameras.
    """

    kind: ClassVar[str]
    """Kind of basis, as `measured_basis` names it."""
    order: int = 4
    basis: Basis | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        available = N_COMPONENTS if self.basis is None else len(self.basis.components)
        if not 0 <= self.order < available:
            msg = f"{self.family} has the orders 0 to {available - 1}, not {self.order}"
            raise ParameterError(msg)

    @property
    @override
    def parameter_names(self) -> tuple[str, ...]:
        return coefficient_names(self.order)

    @property
    @override
    def identity(self) -> Floats:
        return self.projected(np.linspace(0, 1, self.parts[0].size))

    @property
    def parts(self) -> tuple[Floats, Floats]:
        """Mean (n,) and as many components (P, n) as there are parameters."""
        basis = self._basis
        return basis.mean, basis.components[: self.order + 1]

    @property
    def deviations(self) -> Floats:
        """Standard deviations of the parameters over the curves of the basis, shape (P,)."""
        return self._basis.deviations[: self.order + 1]

    def projected(self, curves: Floats) -> Floats:
        """Coefficients (..., P) of the members nearest to curves (..., n) on the grid."""
        mean, components = self.parts
        coefficients: Floats = (curves - mean) @ components.T
        return coefficients

    @property
    def _basis(self) -> Basis:
        return self.basis or measured_basis(self.kind)


@dataclass(frozen=True, slots=True)
class PrincipalModel(BasisModel, LinearModel):
    """f = mean + Σ_j c_j component_j of measured responses."""

    kind: ClassVar[str] = "response"

    @override
    def design(self, x: Floats) -> tuple[Floats, Floats]:
        mean, components = self.parts
        return interpolate(mean, x), interpolate(components, x).T

    @override
    def design_slope(self, x: Floats) -> tuple[Floats, Floats]:
        mean, components = self.parts
        return interpolated_slope(mean, x), interpolated_slope(components, x).T

    @override
    def _inverse(self, y: Floats, parameters: Floats) -> Floats:
        mean, components = self.parts
        return invert_nodes(mean + parameters @ components, y)
