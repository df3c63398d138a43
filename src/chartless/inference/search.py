"""Most probable curves and other unknowns, by Fisher scoring.

The problem is nearly quadratic in the coordinates of `chartless.curves.space`, so a few
steps solve it. Any number of curves is found at once; shared blocks tie them together.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, cholesky

from chartless._numeric.threads import in_order
from chartless.curves.space import AbstractCurveSpace, in_coordinates
from chartless.errors import ParameterError
from chartless.inference.block import Block, Values
from chartless.inference.term import AbstractFit, AbstractTerm
from chartless.types import Bools, Floats

_MOST_STEPS, _MOST_TRIALS = 40, 12
_SETTLED = 0.1  # gain in nats
_LONGEST = 3.0  # step of any coordinate
_ROUNDING = 1e-9

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """Most probable values of all unknowns."""

    values: Values
    edges: Mapping[str, Floats]
    """Edges of each curve, shape (L − 1,)."""
    terms: tuple[AbstractTerm, ...]
    """Terms whose log-likelihoods were added."""
    fits: tuple[AbstractFit, ...]
    """Fits of the terms at this state, in their order."""
    places: Mapping[str, slice]
    """Place of each block and of each curve's coordinates in `factor`."""
    blocks: Mapping[str, Block]
    """Blocks other than curves."""
    log_evidence: float
    """Log-probability of the counts, by Laplace's approximation, up to a constant."""
    information: Floats
    """Information on all unknowns, with that of the priors."""
    factor: Floats
    """Lower triangular R; R Rᵀ is `information`."""
    steps: int
    settled: bool
    """Whether the search converged."""

    @property
    def firm(self) -> float:
        """Part of the log-likelihood that always counts in full."""
        return sum(fit.firm for fit in self.fits)

    def log_prior(self, name: str) -> float:
        """Log prior density of a block at this state, up to a constant."""
        block = self.blocks[name]
        return _log_density(block.mean, block.precision, self.values[name])


def maximise(
    terms: Sequence[AbstractTerm],
    spaces: Mapping[str, AbstractCurveSpace],
    start: Values,
    *,
    tolerance: float = _SETTLED,
) -> Mode:
    """Most probable values of all unknowns.

    Parameters
    ----------
    terms : sequence of AbstractTerm
        Terms whose log-likelihoods are added.
    spaces : mapping from names of curves to AbstractCurveSpace
        Spaces of all curves that the terms read.
    start : mapping from names to ndarray
        Coordinates of curves and values of blocks; any others start at their means.
    tolerance : float
        Gain of a step, in nats, below which the search has converged.
    """
    unknowns = _Unknowns(terms, spaces)
    held = unknowns.held
    values = unknowns.begun(start)
    fits = unknowns.fits(values)
    value = _sum(fits) + unknowns.log_prior(values)
    damping, settled, wary = 1e-4, False, False
    for steps in range(1, _MOST_STEPS + 1):  # noqa: B007 - used after the loop
        gradient, information = unknowns.expanded(fits, values)
        # The unknowns after the curves are logarithms. Where one is pulled down, its
        # exponential adds a curvature as large as the pull, which the expected
        # information leaves out.
        bent = np.maximum(-gradient, 0.0)
        bent[: unknowns.n_coordinates] = 0.0
        gradient += unknowns.prior_gradient(values)
        information += unknowns.prior_precision
        whole = information
        gradient, information = _without(held, gradient, whole)
        diagonal = np.diag(information).copy()
        for _ in range(_MOST_TRIALS):
            damped = information.copy()
            damped[np.diag_indices_from(damped)] += damping * diagonal + wary * bent
            step = cho_solve(cho_factor(damped, lower=True, check_finite=False), gradient)
            scale = min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-9))
            trial = unknowns.moved(values, scale * step)
            try:
                trial_fits = unknowns.fits(trial)
            except ParameterError:  # no member of the family
                trial_value = -np.inf
            else:
                trial_value = _sum(trial_fits) + unknowns.log_prior(trial)
            if trial_value >= value - _ROUNDING:
                break
            damping, wary = max(8 * damping, 1e-6), True
        else:  # no nearby point is better, or rounding hides it
            settled = float(gradient @ step) < tolerance
            break
        settled = trial_value - value < tolerance and scale == 1.0
        values, fits, value = trial, trial_fits, trial_value
        if settled:  # the information has hardly changed since
            break
        damping = max(damping / 8, 1e-9)
    information = unknowns.discounted(whole)
    factor = cholesky(information, lower=True, check_finite=False)
    log_precision = 0.5 * sum(space.log_precision for space in unknowns.spaces.values())
    return Mode(
        values=values,
        edges=unknowns.edges(values),
        terms=tuple(terms),
        fits=fits,
        places=unknowns.places,
        blocks=unknowns.blocks,
        log_evidence=value + log_precision - float(np.log(np.diag(factor)).sum()),
        information=information,
        factor=factor,
        steps=steps,
        settled=settled,
    )


def shares(
    mode: Mode, terms: Sequence[AbstractTerm], spaces: Mapping[str, AbstractCurveSpace]
) -> dict[str, Floats]:
    r"""Share of each term in the information on each curve.

    With the covariance C of the coordinates of a curve and the information S_t of a
    term on them, all other unknowns of the term being estimated too,
    :math:`\operatorname{tr}(C S_t)` is the number of directions that the term
    determines. Over all terms and the prior these numbers add up to the number of
    coordinates, if terms share nothing else.

    Parameters
    ----------
    mode : Mode
    terms : sequence of AbstractTerm
        All terms of the search.
    spaces : mapping from names of curves to AbstractCurveSpace

    Returns
    -------
    dict from names of curves to ndarray, shape (number of terms,)
        Shares with a sum of 1.
    """
    unknowns = _Unknowns(terms, spaces)
    determined: dict[str, list[float]] = {name: [] for name in unknowns.spaces}
    for term in terms:
        fit = term.fit(mode.edges, mode.values)
        _, information = unknowns.expanded([fit], mode.values, [term])
        with_prior = information + unknowns.prior_precision
        for name, numbers in determined.items():
            own = np.zeros(len(information), dtype=bool)
            own[unknowns.places[name]] = True
            cross = information[np.ix_(~own, own)]
            rest = cho_factor(with_prior[np.ix_(~own, ~own)], lower=True, check_finite=False)
            alone = information[np.ix_(own, own)] - cross.T @ cho_solve(rest, cross)
            covariance = cho_solve((mode.factor, True), np.eye(own.size)[:, own])[own]
            numbers.append(float(np.sum(covariance * alone)))
    return {name: np.array(numbers) / sum(numbers) for name, numbers in determined.items()}


def connected(terms: Sequence[AbstractTerm]) -> list[list[AbstractTerm]]:
    """Divide terms into groups that share no unknowns, apart from held blocks."""
    groups: list[tuple[set[str], list[AbstractTerm]]] = []
    for term in terms:
        names = {*term.curves, *(block.name for block in term.blocks if not block.held)}
        tied = [group for group in groups if group[0] & names]
        groups = [group for group in groups if not group[0] & names]
        groups.append(
            (
                names.union(*(its_names for its_names, _ in tied)),
                [*(other for _, others in tied for other in others), term],
            )
        )
    return [group for _, group in groups]


class _Unknowns:
    """Unknowns of a sum of terms as one vector: coordinates of curves, then blocks."""

    def __init__(
        self, terms: Sequence[AbstractTerm], spaces: Mapping[str, AbstractCurveSpace]
    ) -> None:
        self._terms = terms
        names = dict.fromkeys(name for term in terms for name in term.curves)
        self.spaces = {name: spaces[name] for name in names}
        self.blocks: dict[str, Block] = {}
        readers: dict[str, set[tuple[str, ...]]] = {}
        for term in terms:
            for block in term.blocks:
                first = self.blocks.setdefault(block.name, block)
                assert np.array_equal(first.mean, block.mean), block.name
                readers.setdefault(block.name, set()).add(term.curves)
        self._n_readers = {name: len(curves) for name, curves in readers.items()}
        self._centres = {name: space.mean for name, space in self.spaces.items()}
        block_sizes = {name: block.size for name, block in self.blocks.items()}
        sizes = {name: mean.size for name, mean in self._centres.items()}
        n_edges = {name: self.spaces[name].edges(mean).size for name, mean in self._centres.items()}
        self.n_coordinates = sum(sizes.values())
        self.places = _places({**sizes, **block_sizes})
        self._edge_places = _places({**n_edges, **block_sizes})
        self._n_with_edges = sum(n_edges.values()) + sum(block_sizes.values())
        self.prior_precision = block_diag(
            *(space.precision for space in self.spaces.values()),
            *(self._n_readers[name] * each.precision_along for name, each in self.blocks.items()),
        )

    def begun(self, start: Values) -> dict[str, Floats]:
        """Values at which a search starts."""
        means = {name: block.mean for name, block in self.blocks.items()}
        held = {name: block.mean for name, block in self.blocks.items() if block.held}
        begun = {**self._centres, **means, **start, **held}
        return {name: begun[name] for name in (*self._centres, *means)}

    @property
    def held(self) -> Bools:
        """Whether each unknown stays at its mean."""
        held = np.zeros(len(self.prior_precision), dtype=bool)
        for name, block in self.blocks.items():
            held[self.places[name]] = block.held
        return held

    @property
    def _share(self) -> Floats:
        """Share of one channel in each unknown's information, shape (N,), in (0, 1].

        Channels show one scene by one model. They make the same error in an unknown
        that they share, and together determine it no better than one
        (docs/design/0012-house.md).
        """
        share = np.ones(len(self.prior_precision))
        for name, n_readers in self._n_readers.items():
            share[self.places[name]] = 1 / n_readers
        return share

    def discounted(self, information: Floats) -> Floats:
        r"""Precision of all unknowns, from the sum of all information.

        If t are the shared and held unknowns, with the prior precision Λ, and c the
        others, the information of the evidence on t is
        :math:`S = H_{tt} - H_{tc} H_{cc}^{-1} H_{ct}`. Only the share of one channel
        counts, and nothing where t is held; c follows from t. It is as if the
        information on t were :math:`Λ + S + H_{tc} H_{cc}^{-1} H_{ct}`. Without S this
        is "cutting feedback" (Plummer 2015, doi:10.1007/s11222-014-9503-z).
        """
        share = self._share
        doubted = self.held | (share < 1)
        if not doubted.any():
            return information
        square, rest = np.ix_(doubted, doubted), ~doubted
        with_rest = information[np.ix_(rest, doubted)]
        chosen = cho_factor(information[np.ix_(rest, rest)], lower=True)
        followed = with_rest.T @ cho_solve(chosen, with_rest)
        gained = information[square] - self.prior_precision[square] - followed
        values, vectors = np.linalg.eigh(gained)
        gained = (vectors * np.maximum(values, 0.0)) @ vectors.T  # rounding
        of_one = np.sqrt(np.outer(share, share))[square]
        counted = np.where(self.held, 0.0, 1.0)[doubted]
        precision = information.copy()
        gained *= np.outer(counted, counted)
        precision[square] = (self.prior_precision[square] + gained) * of_one + followed
        return precision

    def edges(self, values: Values) -> dict[str, Floats]:
        return {name: space.edges(values[name]) for name, space in self.spaces.items()}

    def fits(self, values: Values) -> tuple[AbstractFit, ...]:
        edges = self.edges(values)

        def fitted(term: AbstractTerm) -> AbstractFit:
            fit = term.fit(edges, values)
            fit.log_likelihood()  # most fits cache what this computes
            return fit

        return tuple(_on_threads(partial(fitted, term) for term in self._terms))

    def log_prior(self, values: Values) -> float:
        """Log prior density, up to a constant."""
        of_curves = (
            _log_density(space.mean, space.precision, values[name])
            for name, space in self.spaces.items()
        )
        of_blocks = (
            self._n_readers[name] * _log_density(block.mean, block.precision, values[name])
            for name, block in self.blocks.items()
        )
        return sum(of_curves) + sum(of_blocks)

    def prior_gradient(self, values: Values) -> Floats:
        of_curves = (
            space.precision @ (values[name] - space.mean) for name, space in self.spaces.items()
        )
        of_blocks = (
            self._n_readers[name] * block.along(block.precision @ (values[name] - block.mean))
            for name, block in self.blocks.items()
        )
        return -np.concatenate([*of_curves, *of_blocks])

    def moved(self, values: Values, step: Floats) -> dict[str, Floats]:
        coordinates = {name: values[name] + step[self.places[name]] for name in self.spaces}
        others = {
            name: block.moved(values[name], step[self.places[name]])
            for name, block in self.blocks.items()
        }
        return {**coordinates, **others}

    def expanded(
        self,
        fits: Sequence[AbstractFit],
        values: Values,
        terms: Sequence[AbstractTerm] | None = None,
    ) -> tuple[Floats, Floats]:
        """Gradient and information of the log-likelihood of all terms, or of some."""
        pulls = {name: space.pull(values[name]) for name, space in self.spaces.items()}
        places, size = self._edge_places, self._n_with_edges
        gradient, information = np.zeros(size), np.zeros((size, size))
        expansions = _on_threads(fit.expand for fit in fits)
        for term, expansion in zip(terms or self._terms, expansions, strict=True):
            own = _runs([places[name] for name in (*term.curves, *(b.name for b in term.blocks))])
            for row, its_row in own:
                gradient[row] += expansion.gradient[its_row]
                for column, its_column in own:
                    information[row, column] += expansion.information[its_row, its_column]
        for name in reversed(self.spaces):  # later places stay, counted from the end
            gradient, information = _pulled(gradient, information, places[name], pulls[name])
        return gradient, information


def _pulled(
    gradient: Floats, information: Floats, edge: slice, pull: Callable[[Floats], Floats]
) -> tuple[Floats, Floats]:
    """Gradient and information with a curve's edges replaced by its coordinates."""
    before, after = slice(edge.start), slice(edge.stop, None)
    turned = np.concatenate([gradient[before], pull(gradient[edge]), gradient[after]])
    if edge.start == 0:
        return turned, in_coordinates(information, edge.stop, pull)
    rows = np.concatenate([information[before], pull(information[edge]), information[after]])
    columns = [rows[:, before], pull(rows[:, edge].T).T, rows[:, after]]
    return turned, np.concatenate(columns, axis=1)


def _places(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Slices of blocks of these sizes, one after the other."""
    ends = list(accumulate(sizes.values(), initial=0))
    return {name: slice(*ends[place : place + 2]) for place, name in enumerate(sizes)}


def _runs(places: Sequence[slice]) -> list[tuple[slice, slice]]:
    """Places in a whole and in a part of it, merged where adjacent in both."""
    runs: list[tuple[slice, slice]] = []
    done = 0
    for place in places:
        end = done + place.stop - place.start
        if runs and runs[-1][0].stop == place.start:
            first, its_first = runs.pop()
            runs.append((slice(first.start, place.stop), slice(its_first.start, end)))
        else:
            runs.append((place, slice(done, end)))
        done = end
    return runs


def _on_threads(tasks: Iterable[Callable[[], T]]) -> list[T]:
    """Results of tasks, run in parallel threads."""
    tasks = list(tasks)
    return [tasks[0]()] if len(tasks) == 1 else list(in_order(tasks))


def _log_density(mean: Floats, precision: Floats, values: Floats) -> float:
    away = values - mean
    return -0.5 * float(away @ precision @ away)


def _sum(fits: Sequence[AbstractFit]) -> float:
    return sum(fit.log_likelihood() for fit in fits)


def _without(held: Bools, gradient: Floats, information: Floats) -> tuple[Floats, Floats]:
    """Gradient and information in which held unknowns stay fixed and uncoupled."""
    if not held.any():
        return gradient, information
    free = ~held
    return np.where(free, gradient, 0.0), np.where(
        np.logical_and.outer(free, free), information, np.diag(np.diag(information))
    )
