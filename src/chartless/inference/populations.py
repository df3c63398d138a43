r"""Populations of cameras, weighed by the evidence.

A search takes a mixture of Gaussian priors (`chartless.curves.prior.mixed`) for one Gaussian
of the same mean and covariance. About the mode the log-likelihood is nearly quadratic, so
the mode under any other Gaussian prior of the curve, such as that of one population, follows
without another search. With the information J, in which the precision Λ of the curve's prior
is contained,

.. math::
    J_k = J + Λ_k - Λ, \qquad
    x_k = x + J_k^{-1} [Λ (x - μ) - Λ_k (x - μ_k)],

and the evidence of population k is Laplace's approximation about x_k. The weights of the
populations times their evidence are a new mixture, which is again taken for one Gaussian.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky
from scipy.special import logsumexp

from chartless.curves.prior import mixed
from chartless.curves.space import FreeCurve
from chartless.inference.search import Mode
from chartless.types import Bools, Floats

_NEGLIGIBLE = 1e-3  # weight of a population


def gains(mode: Mode, space: FreeCurve) -> Floats:
    """Log-evidence of each population, relative to that of the Gaussian of the search.

    Parameters
    ----------
    mode : Mode
        Of free curves, all of one space.
    space : FreeCurve
        That space, whose prior is a mixture of K populations.

    Returns
    -------
    ndarray, shape (K,)
        Mean over the curves of the mode: those of one camera are alike, and show its
        population no better than one.
    """
    of_curve = _is_of_curve(mode)
    information = mode.information[np.ix_(of_curve, of_curve)]
    if not of_curve.all():
        cross = mode.information[np.ix_(~of_curve, of_curve)]
        rest = cho_factor(mode.information[np.ix_(~of_curve, ~of_curve)], lower=True)
        information = information - cross.T @ cho_solve(rest, cross)
    places = _places(mode, of_curve)
    before = _log_determinant(information)
    found = []
    for population in space.populations:
        precision, pull, gained = _exchanged(mode, information, places, space, population)
        factor = _factor(precision, population)
        gained += 0.5 * float(pull @ cho_solve((factor, True), pull, check_finite=False))
        found.append(gained + before - float(np.log(np.diag(factor)).sum()))
    return np.array(found) / len(mode.edges)


def with_evidence(space: FreeCurve, log_evidence: Floats) -> FreeCurve:
    """Space whose mixture is weighed by the evidence of its populations, shape (K,).

    The most probable population is its centre: without evidence, the curve is its typical
    one, not a mean over populations, which is that of no camera.
    """
    log_weights = np.log([weight for weight, _ in space.prior.parts]) + log_evidence
    weights = np.exp(log_weights - logsumexp(log_weights))
    kept = np.flatnonzero(weights > _NEGLIGIBLE)
    if kept.size == 1:
        return space.populations[int(kept[0])]
    parts = [(float(weights[k]), space.prior.parts[k][1]) for k in kept]
    return FreeCurve(mixed(parts, centre=space.prior.parts[int(weights.argmax())][1]))


def in_space(mode: Mode, before: FreeCurve, after: FreeCurve) -> Mode:
    """Mode that a search in another space would have found, nearly.

    Parameters
    ----------
    mode : Mode
    before, after : FreeCurve
        Space of all curves of the mode, and the other one.
    """
    everything = np.ones(len(mode.information), dtype=bool)
    information, pull, gained = _exchanged(
        mode, mode.information, _places(mode, everything), before, after
    )
    factor = _factor(information, after)
    free = everything.copy()
    for name, block in mode.blocks.items():
        free[mode.places[name]] = not block.held
    step = np.zeros(pull.size)
    if free.all():
        step = cho_solve((factor, True), pull, check_finite=False)
    else:
        step[free] = np.linalg.solve(information[np.ix_(free, free)], pull[free])
    gained += 0.5 * float(pull @ step)
    gained += float(np.log(np.diag(mode.factor) / np.diag(factor)).sum())
    values = {
        name: mode.blocks[name].moved(value, step[mode.places[name]])
        if name in mode.blocks
        else value + step[mode.places[name]]
        for name, value in mode.values.items()
    }
    edges = {name: after.edges(values[name]) for name in mode.edges}
    return replace(
        mode,
        values=values,
        edges=edges,
        fits=tuple(term.fit(edges, values) for term in mode.terms),
        log_evidence=mode.log_evidence + gained,
        information=information,
        factor=factor,
    )


def _exchanged(
    mode: Mode,
    information: Floats,
    places: Mapping[str, slice],
    before: FreeCurve,
    after: FreeCurve,
) -> tuple[Floats, Floats, float]:
    """Information with another prior of the curves, the gradient, and the gain at the mode."""
    exchanged, pull, gained = information.copy(), np.zeros(len(information)), 0.0
    for name, place in places.items():
        exchanged[place, place] += after.precision - before.precision
        away, other = mode.values[name] - before.mean, mode.values[name] - after.mean
        old, new = before.precision @ away, after.precision @ other
        pull[place] = old - new
        gained += 0.5 * float(old @ away - new @ other + after.log_precision - before.log_precision)
    return exchanged, pull, gained


def _factor(information: Floats, space: FreeCurve) -> Floats:
    """Lower triangular root of an information.

    Where that of shared unknowns was discounted (`Mode.information`), less than the prior may
    be left of it in some direction. No direction is then known less than the prior knows any.
    """
    try:
        return np.asarray(cholesky(information, lower=True, check_finite=False))
    except LinAlgError:
        values, vectors = np.linalg.eigh(information)
        least = float(np.linalg.eigvalsh(space.precision)[0])
        raised = (vectors * np.maximum(values, least)) @ vectors.T
        return np.asarray(cholesky(raised, lower=True, check_finite=False))


def _is_of_curve(mode: Mode) -> Bools:
    """Whether each unknown is a coordinate of a curve."""
    of_curve = np.zeros(len(mode.information), dtype=bool)
    for name in mode.edges:
        of_curve[mode.places[name]] = True
    return of_curve


def _places(mode: Mode, kept: Bools) -> dict[str, slice]:
    """Places of the curves among the unknowns that are kept."""
    before = np.concatenate([[0], np.cumsum(kept)])
    return {
        name: slice(int(before[mode.places[name].start]), int(before[mode.places[name].stop]))
        for name in mode.edges
    }


def _log_determinant(matrix: Floats) -> float:
    """Half the logarithm of the determinant."""
    return float(np.log(np.diag(cholesky(matrix, lower=True, check_finite=False))).sum())
