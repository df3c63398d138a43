"""Made-up evidence of which everything is known: numbers seen with normal errors of deviation 1."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np
from typing_extensions import override

from chartless.curves.space import AbstractCurveSpace
from chartless.errors import ParameterError
from chartless.inference.block import Block, Values
from chartless.inference.term import AbstractFit, AbstractTerm, Expansion
from chartless.types import Floats


@final
class StraightSpace(AbstractCurveSpace):
    """Edges that are linear in P coordinates, which have a dense prior."""

    uses_ratio = True

    def __init__(self, n_inner: int, size: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self._middle = np.linspace(0.1, 0.9, n_inner)
        self.jacobian = 0.1 * rng.normal(size=(n_inner, size))
        self.mean = rng.normal(size=size)
        self.precision = dense_precision(rng, size)
        self.log_precision = float(np.linalg.slogdet(self.precision)[1])

    @override
    def edges(self, coordinates: Floats) -> Floats:
        return np.asarray(self._middle + self.jacobian @ coordinates)

    @override
    def pull(self, coordinates: Floats) -> "StraightPull":
        return StraightPull(self.jacobian)

    @override
    def nearest(self, edges: Floats) -> Floats:
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class StraightPull:
    jacobian: Floats

    def __call__(self, rows: Floats) -> Floats:
        return np.asarray(self.jacobian.T @ rows)


@final
@dataclass(frozen=True, eq=False)
class GaussianTerm(AbstractTerm):
    """Numbers x + bend · tanh x, seen with normal errors, x linear in edges and blocks."""

    its_curves: tuple[str, ...]
    its_blocks: tuple[Block, ...]
    matrices: Mapping[str, Floats]
    """By curve or block, shape (N, L − 1) or (N, D)."""
    seen: Floats
    """Shape (N,)."""
    bend: float = 0.0
    most: float = np.inf
    """Above it x is refused."""

    @classmethod
    def random(
        cls,
        seed: int,
        curves: Mapping[str, AbstractCurveSpace],
        blocks: Sequence[Block],
        *,
        n_seen: int = 12,
        bend: float = 0.0,
    ) -> Self:
        """What a camera off the middle of all priors would show."""
        rng = np.random.default_rng(seed)
        truth = {name: space.edges(space.mean + 0.3) for name, space in curves.items()}
        truth |= {block.name: block.mean + 0.3 for block in blocks}
        matrices = {name: rng.normal(size=(n_seen, each.size)) for name, each in truth.items()}
        linear = np.sum([matrices[name] @ each for name, each in truth.items()], axis=0)
        seen = linear + bend * np.tanh(linear) + 0.5 * rng.normal(size=n_seen)
        return cls(tuple(curves), tuple(blocks), matrices, seen, bend)

    @property
    @override
    def curves(self) -> tuple[str, ...]:
        return self.its_curves

    @property
    @override
    def blocks(self) -> tuple[Block, ...]:
        return self.its_blocks

    @override
    def fit(self, edges: Mapping[str, Floats], values: Values) -> "GaussianFit":
        state = {**{name: values[name] for name in self._block_names}, **edges}
        names = (*self.its_curves, *self._block_names)
        linear = np.sum([self.matrices[name] @ state[name] for name in names], axis=0)
        if linear.max() > self.most:
            msg = "there is no such state"
            raise ParameterError(msg)
        return GaussianFit(self, linear)

    @property
    def _block_names(self) -> tuple[str, ...]:
        return tuple(block.name for block in self.its_blocks)

    def with_block(self, block: Block) -> Self:
        """The same with another block of that name."""
        blocks = (block if each.name == block.name else each for each in self.its_blocks)
        return replace(self, its_blocks=tuple(blocks))

    def moving(self, name: str) -> Floats:
        """How x changes with the unknowns of a curve's edges or of a block, shape (N, D)."""
        basis = next((each.basis for each in self.its_blocks if each.name == name), None)
        return self.matrices[name] if basis is None else self.matrices[name] @ basis.T


@final
@dataclass(frozen=True, eq=False)
class GaussianFit(AbstractFit):
    term: GaussianTerm
    linear: Floats

    @property
    def _residual(self) -> Floats:
        return self.term.seen - self.linear - self.term.bend * np.tanh(self.linear)

    @override
    def log_likelihood(self) -> float:
        return -0.5 * float(self._residual @ self._residual)

    @override
    def expand(self) -> Expansion:
        names = (*self.term.its_curves, *(block.name for block in self.term.its_blocks))
        steep = 1 + self.term.bend / np.cosh(self.linear) ** 2
        rows = np.concatenate([self.term.moving(name) for name in names], axis=1)
        jacobian = steep[:, np.newaxis] * rows
        return Expansion(self.log_likelihood(), jacobian.T @ self._residual, jacobian.T @ jacobian)


def dense_precision(rng: np.random.Generator, size: int) -> Floats:
    root = rng.normal(size=(size, size))
    return np.asarray(root @ root.T + 0.5 * np.eye(size))


def dense_block(name: str, size: int, seed: int) -> Block:
    """A block about a mean that is not 0."""
    rng = np.random.default_rng(seed)
    return Block(name, rng.normal(size=size), dense_precision(rng, size))
