r"""Image similarity: how well a curve and a noise model explain a co-occurrence table.

The objective of Takamatsu & Matsushita (CVPR 2008),

.. math::
    L = \frac{1}{Z} \iint \frac{C(O_2, O_1)}{\sum_{O_2} C(O_2, O_1)}
        \, g'(O_2) \, S(g(O_1), g(O_2)) \, dO_1 \, dO_2 ,
    \qquad Z^2 = \iint S^2 \, dI_1 \, dI_2 ,

to be maximised over the inverse response g and the noise, is the cosine between the
counted level pairs and those that a model expects. It is discretised in two ways:

`image_similarity`
    integrates g' S over the bin of each level O₂, and takes Z over the same bins. A true
    cosine, in [0, 1], aware of quantisation and clipping: the default.
`sampled_image_similarity`
    samples S at the centres of the levels and takes Z in closed form, as published. It
    grows without bound, as σ^(−1/2), when the noise goes to zero, which traps searches;
    it is kept for comparison.

Both are pure functions of a prepared table, the inverse response and the noise. Only cells
with counts are ever evaluated. docs/design/0002-image-similarity.md has the figures behind
the choice of Z and of the bounded light.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from chartless.methods.ism.similarity import (
    black_end,
    bounded_similarity,
    pair_variances,
    self_similarity,
    white_end,
)
from chartless.noise import AffineNoise
from chartless.types import Counts, Floats

# Cells with a smaller part of the largest share in their row are left out: they hold 1e-4 of
# the sum of squares, take a fifth of the time, and in real frames are outliers.
_NEGLIGIBLE = 0.02
# Further than this many noise deviations from an end of [0, 1] the end has no effect:
# it concerns less than 1e-5 of a row.
_END_ZONE = 4.5
# Bins narrower than this many deviations of the difference are integrated by three terms,
# good to 5e-5 of the bin even 4 deviations out.
_NARROW = 0.5
# The bins of the clipped levels reach to infinity; their factor h is taken between their
# edge and a point this many deviations beyond black or white, which is right to 4.1 % of a row.
_CLIPPED_REACH = 2.1
_INFINITY = 40.0


def half_levels(n_levels: int) -> Floats:
    """Brightness at the levels and at the edges between them, shape (2L − 1,).

    Element 2k is level k, element 2k + 1 the edge between levels k and k + 1.
    Objectives need the inverse of the curve at these places.
    """
    return np.arange(2 * n_levels - 1) / (2.0 * (n_levels - 1))


def _conditional(counts: Counts) -> Floats:
    """Share of level j among the partners of level i, shape (L, L); rows 0 and L − 1 empty.

    Pixels at a clipped level have no known irradiance, so these two rows are not used.
    The columns are kept, as censored values.
    """
    totals = counts.sum(axis=1, dtype=np.float64)
    totals[[0, -1]] = np.inf
    shares: Floats = counts / np.maximum(totals, 1.0)[:, np.newaxis]
    return shares


@dataclass(frozen=True, slots=True, eq=False)
class BinnedPairs:
    """A co-occurrence table prepared for `image_similarity`: the bins with counts, by row.

    Every cell (i, j) lies between two edges of level j, and neighbours share an edge.
    The table is stored as the sequence of (row, edge) pairs that bound its cells, each
    cell at its left edge.
    """

    rows: npt.NDArray[np.intp]
    """Level i of the first frame, shape (E,), increasing."""
    edges: npt.NDArray[np.intp]
    """Edge k, between levels k − 1 and k, shape (E,), increasing in each row."""
    shares: Floats
    """Share of level j = edges[e] among the partners of rows[e], scaled to a sum of squares
    of 1; shape (E − 1,). 0 in gaps."""
    gaps: npt.NDArray[np.intp]
    """Indices e where edge e + 1 does not close a cell with counts."""
    row_starts: npt.NDArray[np.intp]
    """First index e of each row, shape (L + 1,)."""
    lowest: npt.NDArray[np.intp]
    """Indices of the open edge of the lowest level."""
    highest: npt.NDArray[np.intp]
    """Indices of the open edge of the highest level."""
    ceiling: float
    """Expected cosine of the true model: below 1, as counts are random."""

    @classmethod
    def from_counts(cls, counts: Counts) -> "BinnedPairs":
        """Prepare symmetric counts of shape (L, L); cells with very few counts are left out."""
        n_levels = counts.shape[0]
        shares = np.zeros((n_levels, n_levels + 1))
        shares[:, :-1] = _conditional(counts)
        shares[shares < _NEGLIGIBLE * shares.max(axis=1, keepdims=True)] = 0.0
        bounds = shares > 0
        bounds[:, 1:] |= bounds[:, :-1]
        rows, edges = np.nonzero(bounds)
        run = shares[rows, edges][:-1]
        energy = _dot(run, run)
        # For c counts among n, c (c − 1)/(n (n − 1)) estimates the square of the true
        # share.
        n = np.maximum(counts.sum(axis=1), 2.0)[rows[:-1]]
        true_energy = float((run * (run * n - 1.0) / (n - 1.0)).sum())
        return cls(
            rows=rows,
            edges=edges,
            shares=run / max(energy, 1e-300) ** 0.5,
            gaps=np.flatnonzero(run == 0),
            row_starts=np.searchsorted(rows, np.arange(n_levels + 1)),
            lowest=np.flatnonzero(edges == 0),
            highest=np.flatnonzero(edges == n_levels),
            ceiling=max(0.0, true_energy / energy) ** 0.5 if energy > 0 else 0.0,
        )


def image_similarity(pairs: BinnedPairs, inverse: Floats, noise: AffineNoise) -> float:
    """Image similarity with each level integrated over its bin.

    Parameters
    ----------
    pairs : BinnedPairs
        Counted level pairs.
    inverse : ndarray of float, shape (2L − 1,)
        Inverse response g at `half_levels`, increasing from 0 to 1.
    noise : AffineNoise

    Returns
    -------
    float
        Cosine between the counted and the expected shares over the cells with counts,
        0 … 1. Expected shares of cells without counts have no effect, so a table needs
        many more pixels than cells.

    Notes
    -----
    In w = (I₂ − I₁) √(2/spread) the similarity is a normal density times a factor h that
    varies over many deviations, so a bin holds the difference of two normal distribution
    functions times the mean of h at its two edges. The clipped levels reach to infinity.
    The series in 1/z of `chartless.methods.ism.similarity` is cut after its leading term, 1: it is
    nearly the same for all cells, and a common factor does not change a cosine.
    """
    expected = expected_shares(pairs, inverse, noise)
    norm = np.sqrt(_dot(expected, expected))
    return float(_dot(pairs.shares, expected) / norm) if norm > 0 else 0.0


def expected_shares(pairs: BinnedPairs, inverse: Floats, noise: AffineNoise) -> Floats:
    """Share ∫ S(g(O₁), I) dI of each cell's bin, 0 where there is no cell.

    A whole row has a sum of 1, less near black and white, where light beyond the end is
    missing. Shape of `pairs.shares`; arguments as for `image_similarity`.
    """
    reach = _CLIPPED_REACH * noise.std(np.array([0.0, 1.0]))
    levels = inverse[::2]
    edges = np.concatenate([[-reach[0]], inverse[1::2], [1.0 + reach[1]]])
    x, y = levels[pairs.rows], edges[pairs.edges]
    variance_y = noise.variance(y)
    rho, spread = pair_variances(noise.variance(x), variance_y)
    distance = y - x
    # Arrays of this size are cheap to fill but expensive to allocate: many steps are in place.
    w = 2.0 / spread
    np.sqrt(w, out=w)
    w *= distance
    w[pairs.lowest] = -_INFINITY
    w[pairs.highest] = _INFINITY
    # S dI₂ = h φ(w) dw; twice 1/h is √(ρ/spread) (2 − u distance (B₂/ρ + 1)/spread)
    bend = np.divide(variance_y, rho, out=variance_y)
    bend += 1.0
    bend *= distance
    bend *= noise.slope
    bend /= spread
    factor = np.divide(spread, rho, out=spread)
    np.sqrt(factor, out=factor)
    factor /= np.subtract(2.0, bend, out=bend)
    black, white = _end_zones(pairs, levels, noise)
    factor[black] *= ndtr(-black_end(x[black], y[black], rho[black], noise))
    factor[white] *= ndtr(white_end(x[white], y[white], rho[white], noise))
    width = w[1:] - w[:-1]
    width[pairs.gaps] = 0.0
    shares = _normal_mass(w, width)
    shares *= 0.5 * (factor[1:] + factor[:-1])
    return shares


def expected_table(inverse: Floats, noise: AffineNoise) -> Floats:
    """Expected shares of all cells, shape (L, L), for plots and simulations.

    Rows 0 and L − 1 are 0, see `BinnedPairs`; arguments as for `image_similarity`.
    """
    n_levels = (inverse.size + 1) // 2
    everywhere = BinnedPairs.from_counts(np.ones((n_levels, n_levels), dtype=np.int64))
    shares = expected_shares(everywhere, inverse, noise)
    cells = np.flatnonzero(everywhere.shares)
    table = np.zeros((n_levels, n_levels))
    table[everywhere.rows[cells], everywhere.edges[cells]] = shares[cells]
    return table


def _normal_mass(w: Floats, width: Floats) -> Floats:
    """Mass of the normal distribution from each w to the next, `width` further, or 0 for 0.

    Bins are narrow compared with the noise of cameras, so three terms of the expansion
    around their middle suffice, in a tenth of the time of the distribution function.
    """
    squared = w[1:] + w[:-1]
    squared *= 0.5
    squared *= squared
    area = width * width
    # 1 + area H₂/24 + area² H₄/1920 with the Hermite polynomials of the middle
    mass = squared - 6.0
    mass *= squared
    mass += 3.0
    mass *= area / 80.0
    mass += squared
    mass -= 1.0
    mass *= area / 24.0
    mass += 1.0
    mass *= width
    squared *= -0.5
    mass *= np.exp(squared, out=squared)
    mass /= np.sqrt(2 * np.pi)
    wide = np.flatnonzero(width > _NARROW)
    mass[wide] = ndtr(w[wide + 1]) - ndtr(w[wide])
    return mass


def _end_zones(pairs: BinnedPairs, levels: Floats, noise: AffineNoise) -> tuple[slice, slice]:
    """Ranges of (row, edge) pairs whose light is cut at 0, and at 1."""
    half = 0.5 * _END_ZONE**2 * noise.slope
    near_black = half + np.sqrt(half**2 + _END_ZONE**2 * noise.floor)  # solves x = zone σ(x)
    near_white = 1.0 - _END_ZONE * float(noise.std(1.0))
    first, last = np.searchsorted(levels, [near_black, near_white])
    return slice(0, pairs.row_starts[first]), slice(pairs.row_starts[last], None)


@dataclass(frozen=True, slots=True, eq=False)
class SampledPairs:
    """A co-occurrence table prepared for `sampled_image_similarity`: its upper triangle.

    S is symmetric, so the cells (i, j) and (j, i) are evaluated once.
    """

    rows: npt.NDArray[np.intp]
    """Level i ≤ j of the cells with counts, shape (N,)."""
    columns: npt.NDArray[np.intp]
    """Level j, shape (N,)."""
    shares: Floats
    """Share of level j among the partners of level i, shape (N,)."""
    shares_back: Floats
    """Share of level i among the partners of level j, shape (N,); 0 on the diagonal."""

    @classmethod
    def from_counts(cls, counts: Counts) -> "SampledPairs":
        """Prepare symmetric counts of shape (L, L)."""
        shares = _conditional(counts)
        rows, columns = np.nonzero(np.triu(shares + shares.T))
        back = np.where(rows == columns, 0.0, shares[columns, rows])
        return cls(rows, columns, shares[rows, columns], back)


def sampled_image_similarity(pairs: SampledPairs, inverse: Floats, noise: AffineNoise) -> float:
    """Image similarity with S sampled at the centres of the levels, as published.

    g' is the mean slope of g over the bin: at black the derivative itself may be infinite.

    Parameters
    ----------
    pairs : SampledPairs
    inverse : ndarray of float, shape (2L − 1,)
        Inverse response g at `half_levels`, increasing from 0 to 1.
    noise : AffineNoise

    Returns
    -------
    float
        L as above; unbounded when the noise goes to zero.
    """
    levels = inverse[::2]
    widths = np.diff(inverse[1::2], prepend=0.0, append=1.0)
    similar = bounded_similarity(levels[pairs.rows], levels[pairs.columns], noise)
    weights = pairs.shares * widths[pairs.columns] + pairs.shares_back * widths[pairs.rows]
    z = float(np.sqrt(self_similarity(noise)))
    return _dot(weights, similar) / (levels.size - 1) / z


def _dot(a: Floats, b: Floats) -> float:
    """Sum of products without BLAS, whose threads cost more time than 10⁴ products.

    Threads also make the last bit depend on the number of cores.
    """
    return float(np.einsum("i,i->", a, b))


class Objective(NamedTuple):
    """Objective with the preparation of its table."""

    prepare: Callable[[Counts], Any]
    """Function from symmetric counts of shape (L, L) to prepared pairs."""
    evaluate: Callable[[Any, Floats, AffineNoise], float]
    """Function from prepared pairs, g at `half_levels` and noise to the objective."""


OBJECTIVES = {
    "bin": Objective(BinnedPairs.from_counts, image_similarity),
    "sampled": Objective(SampledPairs.from_counts, sampled_image_similarity),
}
"""The two discretisations, by their name in methods."""
