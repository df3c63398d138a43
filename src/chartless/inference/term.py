"""The terms of which a log-likelihood is the sum: what any kind of evidence gives the search.

A term reads curves, by their edges, and blocks of other unknowns. It says how probable its counts
are, with gradient and expected information; it knows neither the coordinates of the curves nor
what else is in the sum.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

from chartless.inference.block import Block, Values
from chartless.types import Floats


class Expansion(NamedTuple):
    """A log-likelihood and how it changes with N unknowns."""

    value: float
    gradient: Floats
    """Shape (N,)."""
    information: Floats
    """Expected Fisher information, shape (N, N)."""


class AbstractFit(ABC):
    """A term at one state of knowledge."""

    @abstractmethod
    def log_likelihood(self) -> float:
        """Logarithm of the probability of what was counted."""

    @property
    def firm(self) -> float:
        """The part of it that counts in full where the ratio of the noise parameters is weighed."""
        return self.log_likelihood()

    @abstractmethod
    def expand(self) -> Expansion:
        """Log-likelihood, gradient and information.

        The unknowns are the edges of the term's curves and, in the directions in which they move,
        its blocks, in their order.
        """


class AbstractTerm(ABC):
    """One kind of evidence, counted, of one camera."""

    @property
    @abstractmethod
    def curves(self) -> tuple[str, ...]:
        """Names of the curves that it reads."""

    @property
    @abstractmethod
    def blocks(self) -> tuple[Block, ...]:
        """Other unknowns that it reads."""

    @abstractmethod
    def fit(self, edges: Mapping[str, Floats], values: Values) -> AbstractFit:
        """Term at a state.

        Parameters
        ----------
        edges : mapping from names of curves to ndarray, shape (L − 1,)
            Irradiance between the levels.
        values : mapping from names of blocks to ndarray

        Raises
        ------
        ParameterError
            If there is no such state.
        """

    def first_look(self, edges: Mapping[str, Floats], values: Values) -> "AbstractTerm":
        """Term as a first look uses it, which begins at a state."""
        del edges, values
        return self

    def informed(self, edges: Mapping[str, Floats], values: Values) -> "AbstractTerm":
        """Term with what only a look can tell, such as weights; itself once that no longer changes.

        Parameters
        ----------
        edges, values
            Where the look ended, as for `fit`.
        """
        del edges, values
        return self
