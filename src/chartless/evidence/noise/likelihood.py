r"""Exact likelihood of level pairs, given a curve, noise and a scene.

A pixel of true irradiance Ĩ shows level i with probability

.. math::
    A_i(Ĩ) = Φ\Bigl(\frac{e_{i+1} - Ĩ}{σ(Ĩ)}\Bigr) - Φ\Bigl(\frac{e_i - Ĩ}{σ(Ĩ)}\Bigr), \qquad
    σ^2(Ĩ) = u Ĩ + v,

where the *edges* e_i = g((i − ½)/(L − 1)) are the irradiances between the levels, e_0 = −∞ and
e_L = ∞: rounding and clipping are part of the model. With a scene of weights p at nodes Ĩ_k, two
frames show the pair (i, j) with probability Q = A diag(p) Aᵀ, and counts C have the
log-likelihood Σ C ln Q. Level counts c of dark frames, where Ĩ = 0, add Σ c ln A(0).

The curve enters through its L − 1 edges only. The functions here take the edges
directly, so they work with any family of curves or none; ln u, ln v and ln p complete
the unknowns.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.special import gammaln, ndtr, xlogy

from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.inference.stabilised import log_extent, on_even_scale
from chartless.inference.term import Expansion
from chartless.noise import AffineNoise
from chartless.types import Counts, Floats

# Least probability, so that its logarithm is finite.
_LEAST = 1e-14
# Probability of a level below which a node does not contribute to it.
_NO_PART = 1e-9
# Largest spacing of nodes in deviations of the noise, where time allows.
SPACING, _MOST_NODES = 0.67, 512
DARK_PIXELS = 20_000
"""Largest effective number of pixels of dark frames: more would determine the toe of
the curve so well that a family unable to follow it there would fit the rest badly."""
SCENE_NODES = 128
"""Least number of nodes of a scene."""
SCENE_STEP = 0.5
"""Deviation of ln p from one node to the next, at this number of nodes: the roughness
of scenes."""
_SCENE_LEVEL = 1e-3  # precision of ln p itself: immaterial, as p is normalised
_NORMAL = 1 / np.sqrt(2 * np.pi)


@dataclass(frozen=True, slots=True, eq=False)
class PairCounts:
    """Counts of level pairs and dark frames, prepared for the likelihood."""

    pairs: Floats
    """Symmetric counts C + Cᵀ of level pairs, shape (L, L)."""
    dark: Floats
    """Weighted counts of the levels of dark frames, shape (L,); zeros without such
    frames."""
    weight: float = 1.0
    """Weight of the pairs in the likelihood, for pairs that are not independent."""

    @classmethod
    def of(
        cls, table: Cooccurrence, *, dark: Counts | None = None, weight: float = 1.0
    ) -> "PairCounts":
        """Prepare a table and, if there are dark frames, their histogram."""
        black = np.zeros(table.n_levels) if dark is None else dark.astype(np.float64)
        black *= min(1.0, DARK_PIXELS / max(float(black.sum()), 1.0))
        return cls(table.symmetric.astype(np.float64), black, weight)

    @property
    def n_levels(self) -> int:
        """Number of levels L."""
        return len(self.dark)

    @property
    def n_pairs(self) -> float:
        """Number of pixel pairs, unweighted."""
        return float(self.pairs.sum()) / 2


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Distribution of true irradiance over the scene: weights at nodes."""

    nodes: Floats
    """Irradiance, increasing from 0 to 1, shape (K,)."""
    log_weights: Floats
    """ln p up to a constant, shape (K,)."""

    @property
    def weights(self) -> Floats:
        """p, shape (K,), of sum 1."""
        weights = np.exp(self.log_weights - self.log_weights.max())
        return np.asarray(weights / weights.sum())


def scene_precision(n_nodes: int) -> Floats:
    """Inverse prior covariance of the log-weights of a scene, shape (K, K)."""
    steps = np.diff(np.eye(n_nodes), axis=0) / (SCENE_STEP * np.sqrt(SCENE_NODES / n_nodes))
    return np.asarray(steps.T @ steps + _SCENE_LEVEL * np.eye(n_nodes))


class PairModel:
    """Probabilities of level pairs at one state of the unknowns, found on demand.

    Parameters
    ----------
    edges : ndarray, shape (L − 1,)
        Irradiance between the levels, increasing, within [0, 1].
    noise : AffineNoise
    scene : Scene
    """

    def __init__(self, edges: Floats, noise: AffineNoise, scene: Scene) -> None:
        self.edges, self.noise, self.scene = edges, noise, scene
        self.weights = scene.weights
        self.deviation = noise.std(scene.nodes)

    @cached_property
    def _distance(self) -> Floats:
        """Distance of each edge from each node in deviations, shape (L − 1, K)."""
        return (self.edges[:, np.newaxis] - self.scene.nodes) / self.deviation

    @cached_property
    def _density(self) -> Floats:
        """Normal density at each edge from each node, shape (L − 1, K)."""
        return np.asarray(_NORMAL * np.exp(-0.5 * self._distance**2))

    @cached_property
    def _by_edge(self) -> Floats:
        """Derivative of the share below each edge by the edge, shape (L − 1, K)."""
        return np.asarray(self._density / self.deviation)

    @cached_property
    def _by_variance(self) -> Floats:
        """Derivative of the share below each edge by the variance, shape (L − 1, K)."""
        return np.asarray(self._density * self._distance / (-2 * self.deviation**2))

    @cached_property
    def shares(self) -> Floats:
        """A: probability of each level at each node, shape (L, K)."""
        return _differences(ndtr(self._distance), last=1.0)

    @cached_property
    def pairs(self) -> Floats:
        """Q: probability of each pair of levels, shape (L, L), of sum 1."""
        return np.asarray((self.shares * self.weights) @ self.shares.T + _LEAST)

    @cached_property
    def _log_pairs(self) -> Floats:
        return np.log(self.pairs)

    @cached_property
    def dark(self) -> Floats:
        """Probability of each level in a dark frame, shape (L,)."""
        below = ndtr(self.edges / np.sqrt(self.noise.floor))
        return _differences(below, last=1.0) + _LEAST

    def log_likelihood(self, counts: PairCounts) -> float:
        """Σ C ln Q, weighted, and Σ c ln A(0) of dark frames."""
        value = 0.5 * counts.weight * float(np.vdot(counts.pairs, self._log_pairs))
        return value + (float(counts.dark @ np.log(self.dark)) if counts.dark.any() else 0.0)

    def relative_deviance(self, counts: PairCounts) -> float:
        """Deviance of the pairs from the saturated model, over its mean by chance.

        It is 1 if the model is right. Cells are Poisson counts, whose mean deviance is
        1 only for large expectations.
        """
        upper = np.triu_indices(counts.n_levels)
        seen = counts.pairs[upper]
        expected = self.pairs[upper] * (2 * counts.n_pairs)
        diagonal = upper[0] == upper[1]
        seen[diagonal] /= 2
        expected[diagonal] /= 2
        deviance = 2 * (xlogy(seen, seen / expected) - seen + expected)
        return float(deviance.sum() / _mean_deviance(expected).sum())

    def improved_scene(self, counts: PairCounts) -> Scene:
        """Scene after one step of expectation maximisation."""
        ratio = counts.pairs / self.pairs
        grown = self.weights * _quadratic(self.shares, ratio) / counts.pairs.sum()
        return Scene(self.scene.nodes, np.log(grown + 1e-7))

    @property
    def noise_directions(self) -> Floats:
        """Derivatives of the variance at the nodes by ln u and ln v, shape (2, K)."""
        return np.stack(
            [
                self.noise.slope * self.scene.nodes,
                np.full(self.scene.nodes.size, self.noise.floor),
            ]
        )

    def expand(self, counts: PairCounts, directions: Floats | None = None) -> Expansion:
        """Log-likelihood, gradient and expected information.

        The information has a closed form: an edge touches two rows and two columns of
        Q, so no table of L² × (L + K) derivatives is needed.

        Parameters
        ----------
        counts : PairCounts
        directions : ndarray, shape (D, K), optional
            Derivatives of the variance at the nodes by each unknown of the noise,
            instead of `noise_directions`; the first node is at black.
        """
        if directions is None:
            directions = self.noise_directions
        gradient = self._gradient(counts, directions)
        information = self.information(directions)
        information *= counts.n_pairs * counts.weight
        if counts.dark.any():
            rates = directions[:, 0]
            affected = slice(self.edges.size + rates.size)
            gradient[affected] += self._dark_changes(rates).T @ (counts.dark / self.dark)
            information[affected, affected] += self.dark_information(
                float(counts.dark.sum()), rates
            )
        return Expansion(self.log_likelihood(counts), gradient, information)

    def _gradient(self, counts: PairCounts, directions: Floats) -> Floats:
        a, p = self.shares, self.weights
        ratio = counts.pairs / self.pairs
        ratio_a = ratio @ a
        drop = ratio_a[:-1] - ratio_a[1:]
        drop *= p
        by_edge = np.einsum("ek,ek->e", drop, self._by_edge)
        by_variance = np.einsum("ek,ek->k", drop, self._by_variance)
        by_scene = p * (0.5 * np.einsum("ak,ak->k", a, ratio_a) - counts.n_pairs)
        return counts.weight * np.concatenate([by_edge, directions @ by_variance, by_scene])

    def information(self, directions: Floats | None = None) -> Floats:
        """Expected Fisher information of one pair; arguments and order as for `expand`."""
        if directions is None:
            directions = self.noise_directions
        a, p = self.shares, self.weights
        inverse = 1 / self.pairs
        n_inner, n_noise = self.edges.size, len(directions)
        edge, scene = slice(n_inner), slice(n_inner + n_noise, None)
        size = n_inner + n_noise + p.size
        information = np.empty((size, size))
        moved = (self._by_edge * p) @ a.T
        upper, lower = moved * inverse[:-1], moved * inverse[1:]
        information[edge, edge] = _of_edges(moved, upper, lower, inverse)
        crossed = upper @ a
        crossed *= a[:-1]
        crossed_lower = lower @ a
        crossed_lower *= a[1:]
        crossed -= crossed_lower
        crossed *= 2 * p
        information[edge, scene] = crossed
        by_variance = _differences(self._by_variance)
        changes = [_symmetric((by_variance * (p * rate)) @ a.T) for rate in directions]
        for column, change in enumerate(changes, start=n_inner):
            relative = change * inverse
            information[edge, column] = 2 * np.einsum(
                "el,el->e", moved, relative[:-1] - relative[1:]
            )
            information[column, scene] = p * _quadratic(a, relative)
            for other, its in enumerate(changes, start=n_inner):
                information[column, other] = np.vdot(relative, its)
        information[n_inner : n_inner + n_noise, edge] = information[
            edge, n_inner : n_inner + n_noise
        ].T
        information[scene, : n_inner + n_noise] = information[: n_inner + n_noise, scene].T
        information[scene, scene] = _of_scene(a, p, inverse)
        return information

    def dark_information(self, n_pixels: float, rates: Floats) -> Floats:
        """Expected Fisher information of dark pixels on the edges and on the noise.

        Parameters
        ----------
        n_pixels : float
        rates : ndarray, shape (D,)
            Derivatives of the variance at black by each unknown of the noise.

        Returns
        -------
        ndarray, shape (L − 1 + D, L − 1 + D)
        """
        change = self._dark_changes(rates)
        return np.asarray(n_pixels * change.T @ (change / self.dark[:, np.newaxis]))

    def _dark_changes(self, rates: Floats) -> Floats:
        """Derivatives of `dark` by the edges and the noise, shape (L, L − 1 + D)."""
        deviation = np.sqrt(self.noise.floor)
        distance = self.edges / deviation
        density = _NORMAL * np.exp(-0.5 * distance**2)
        by_variance = _differences(density * distance / (-2 * self.noise.floor))
        by_edge = _differences(np.diag(density / deviation))
        return np.hstack([by_edge, by_variance[:, np.newaxis] * rates])


def n_nodes_for(noise: AffineNoise) -> int:
    """Number of nodes of a scene that is fine enough for the noise."""
    extent = float(np.exp(log_extent(noise.ratio))) / np.sqrt(noise.floor)
    return max(SCENE_NODES, int(np.ceil(extent / SPACING)))


def even_scene(noise: AffineNoise) -> Scene:
    """Scene of equal weights, with nodes fine enough for the noise if time allows."""
    n_nodes = min(n_nodes_for(noise), _MOST_NODES)
    return Scene(on_even_scale(n_nodes, noise.ratio), np.zeros(n_nodes))


def with_scene(edges: Floats, noise: AffineNoise, counts: PairCounts, steps: int) -> PairModel:
    """Model of a curve and noise with the scene fitted to the counts.

    Parameters
    ----------
    edges : ndarray, shape (L − 1,)
    noise : AffineNoise
    counts : PairCounts
    steps : int
        Number of steps of expectation maximisation, from an even scene.
    """
    model = PairModel(edges, noise, even_scene(noise))
    for _ in range(steps):
        model = PairModel(edges, noise, model.improved_scene(counts))
    return model


def _mean_deviance(expected: Floats) -> Floats:
    """Mean of 2 (n ln(n/m) − n + m) over Poisson counts n of mean m, shape of m."""
    grid, values = _deviance_table()
    return np.interp(np.log(expected), grid, values)


@cache
def _deviance_table() -> tuple[Floats, Floats]:
    logs = np.linspace(np.log(1e-9), np.log(300.0), 400)
    means = np.exp(logs)[:, np.newaxis]
    counts = np.arange(600.0)
    probability = np.exp(xlogy(counts, means) - means - gammaln(counts + 1))
    deviance = 2 * (xlogy(counts, counts / means) - counts + means)
    return logs, np.asarray((probability * deviance).sum(axis=1))


def _differences(below: Floats, last: float = 0.0) -> Floats:
    """Values of levels from those below the inner edges, along the first axis."""
    result = np.empty((len(below) + 1, *below.shape[1:]))
    result[0] = below[0]
    np.subtract(below[1:], below[:-1], out=result[1:-1])
    result[-1] = last - below[-1]
    return np.maximum(result, 0.0, out=result) if last else result


def _symmetric(matrix: Floats) -> Floats:
    return matrix + matrix.T


def _quadratic(shares: Floats, matrix: Floats) -> Floats:
    """A_kᵀ M A_k of each node, shape (K,)."""
    return np.asarray(np.einsum("ak,ak->k", shares, matrix @ shares))


def _of_edges(moved: Floats, upper: Floats, lower: Floats, inverse: Floats) -> Floats:
    """Information on the edges from one pair, shape (L − 1, L − 1).

    Edge j moves probability B_j, a row of `moved`, from row j + 1 of Q to row j, and
    likewise for columns; `upper` and `lower` are B/Q in these two rows.
    """
    left, right = moved[:, :-1], moved[:, 1:]
    cross = left.T * right * inverse[:-1, 1:]
    information = left * left.T * inverse[:-1, :-1] + right * right.T * inverse[1:, 1:]
    information -= cross + cross.T
    own = np.einsum("el,el->e", moved, upper + lower)
    shared = np.einsum("el,el->e", moved[1:], lower[:-1])
    places = np.arange(len(moved))
    information[places, places] += own
    information[places[:-1], places[1:]] -= shared
    information[places[1:], places[:-1]] -= shared
    return 2 * information


def _of_scene(shares: Floats, weights: Floats, inverse: Floats) -> Floats:
    """Information on the log-weights from one pair, shape (K, K)."""
    n_nodes = weights.size
    active = shares > _NO_PART
    first = active.argmax(axis=0)
    end = len(shares) - active[::-1].argmax(axis=0)
    information = np.zeros((n_nodes, n_nodes))
    for k in range(n_nodes):
        # Levels, and further nodes that share levels with node k; both are contiguous.
        levels = slice(first[k], end[k])
        others = slice(k, k + int(np.searchsorted(first[k:], end[k])))
        both = shares[levels, others] * shares[levels, k, np.newaxis]
        information[k, others] = np.einsum("al,al->l", both, inverse[levels, levels] @ both)
    information += np.triu(information, 1).T
    information -= 1.0
    return information * np.outer(weights, weights)
