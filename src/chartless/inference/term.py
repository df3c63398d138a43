"""Terms of a log-likelihood: the interface between kinds of evidence and the search.

A term reads curves, by their edges, and blocks of other unknowns. It computes the
log-likelihood of its counts, with gradient and expected information; it depends neither
on the coordinates of the curves nor on the other terms.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

from chartless.inference.block import Block, Values
from chartless.types import Floats


class Expansion(NamedTuple):
    """Log-likelihood and its derivatives by N unknowns."""

    value: float
    gradient: Floats
    """Gradient, shape (N,)."""
    information: Floats
    """Expected Fisher information, shape (N, N)."""


class AbstractFit(ABC):
    """Term evaluated at given values of its unknowns."""

    @abstractmethod
    def log_likelihood(self) -> float:
        """Log-probability of the counts."""

    @property
    def firm(self) -> float:
        """Part of the log-likelihood that counts in full in comparing noise ratios."""
        return self.log_likelihood()

    @abstractmethod
    def expand(self) -> Expansion:
        """Log-likelihood, gradient and information.

        The unknowns are the edges of the term's curves, then its blocks in the
        directions in which they can move, in order.
        """


class AbstractTerm(ABC):
    """Counts of one kind of evidence from one camera."""

    @property
    @abstractmethod
    def curves(self) -> tuple[str, ...]:
        """Names of the curves that the term reads."""

    @property
    @abstractmethod
    def blocks(self) -> tuple[Block, ...]:
        """Other unknowns that the term reads."""

    @abstractmethod
    def fit(self, edges: Mapping[str, Floats], values: Values) -> AbstractFit:
        """Evaluate the term at given values.

        Parameters
        ----------
        edges : mapping from names of curves to ndarray, shape (L − 1,)
            Irradiance between the levels.
        values : mapping from names of blocks to ndarray

        Raises
        ------
        ParameterError
            If the values are not possible.
        """

    def first_look(self, edges: Mapping[str, Floats], values: Values) -> "AbstractTerm":
        """Term for a first, rough search that starts at these values."""
        del edges, values
        return self

    def informed(self, edges: Mapping[str, Floats], values: Values) -> "AbstractTerm":
        """Term with weights and the like updated; itself once nothing changes.

        Parameters
        ----------
        edges, values
            Result of the search, as for `fit`.
        """
        del edges, values
        return self
