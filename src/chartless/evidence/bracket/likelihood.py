r"""Likelihood of the levels of one exposure given those of a longer one.

A pixel of a scene that shows level j in the longer exposure had the irradiance g_j
there, up to rounding and noise, and g_j/ρ in an exposure ρ times shorter. There it
shows level i with probability

.. math::
    P(i | j) = Φ\Bigl(\frac{e_{i+1} - m_j}{s_j}\Bigr) - Φ\Bigl(\frac{e_i - m_j}{s_j}\Bigr), \qquad
    m_j = \frac{g_j}{ρ}, \quad
    s_j^2 = u m_j + v + \frac{u g_j + v + Δ_j^2/12}{ρ^2} + κ^2 m_j^2,

with edges e as in `chartless.evidence.noise.likelihood`, Δ_j the range of irradiance of
level j, and κ a relative scatter that neither curve nor noise explains: colours mapped
into a gamut, edges a pixel off. Rounding and clipping of the shorter exposure are part
of the model; black and saturated levels of the longer one are not conditioned on, as
their irradiance is unknown. A small share of pixels may show any level, as something
moved.

The scene is eliminated. Given j, it matters only where it is uneven over the width of
the noise: there the mean of the irradiance is not g_j but g_j + σ²(g_j) d ln h/dI + u,
with h the density of the light in the longer exposure (Tweedie's formula; Efron 2011,
doi:10.1198/jasa.2011.tm11181; u because the noise itself grows with the light). And the
errors described by κ do not average out over pixels. Both corrections need a first
estimate, from which `ExposureModel.informed` computes them.

Where repeated exposures determine the noise, u and v here are only effective values:
the real noise is known better, and must not be distorted by the scatter between
exposures. Nor may u and v select one of the curves f^γ through the growth of the spread
with irradiance. So unless the exposures are exact, after the first estimate the noise
of a row is a fixed share of m_j, that of this estimate, times a common factor: it
changes with γ like everything else.

A table of such counts is a comparagram (Mann 2000, "Comparametric equations with practical
applications in quantigraphic image processing", doi:10.1109/83.855434).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import ndtr

from chartless.inference.term import Expansion
from chartless.noise import TYPICAL_8BIT, TYPICAL_SPREAD, AffineNoise
from chartless.types import Bools, Floats, Indices

STRAY = 0.01
"""Share of pixels that may show any level."""
TYPICAL_SCATTER, SCATTER_SPREAD = 0.02, 1.0
"""Prior median of the relative scatter κ of frames, and deviation of its logarithm."""
_NORMAL = 1 / np.sqrt(2 * np.pi)
FIRST_PIXELS = 10.0
"""Largest number of pixels that a row counts as before its scatter is known."""
_SHARED = 0.3  # share of the variance of the scatter common to all pixels of a level
_MOST_SHIFT = 0.5
_SAME_RATIO = 1e-3  # relative
_UNKNOWN = 0.5  # error of exposures above which they count as unknown
# Relative deviation that the pixels of a row of lossy files share, as a multiple of its
# shift, conditioned on the longer exposure and on the shorter: compression selects the
# pixels compared, which the shift does not include. Measured, benchmarks/files.py at
# 10,000 and 1,000 electrons.
_LOSSY_DOUBT, _LOSSY_DOUBT_REVERSED = 5.0, 20.0
_NEVER = 1e3  # deviations that no pixel reaches
_REACH = 4.5  # deviations from the expected level beyond which only stray pixels show


class Conditions(NamedTuple):
    """The J rows of a table that have counts, weighted as they enter the likelihood."""

    upper: Indices
    """Index of the edge above the level j of each row, shape (J,); the one before is
    below it."""
    counts: Floats
    """Weighted counts, shape (J, L)."""
    n: Floats
    """Sums of the weighted counts, shape (J,)."""
    n_pixels: Floats
    """Sums of the unweighted counts, shape (J,)."""
    trust: Floats
    """Trust of each row, shape (J,)."""
    stray: Floats
    """Share of stray pixels at each level, shape (L,)."""
    clipped: Bools
    """Whether edges lie within black or within white, shape (L − 1,), where no pixel
    distinguishes their sides."""
    far: float
    """Log-likelihood if all pixels were stray."""


@dataclass(frozen=True, eq=False)
class Comparagram:
    """Counts of pixels with level j in one exposure and level i in a shorter one.

    Tables of the same exact ratio are added. A table may be reversed: then its longer
    exposure is the shorter of the two, and the ratio ρ is below 1.
    """

    shorter: int
    """Number of the exposure whose levels are explained, usually the shorter one."""
    longer: int
    """Number of the exposure whose levels are given."""
    counts: Floats
    """Weighted counts, shape (L, L): rows j of the longer, columns i of the shorter exposure."""
    trust: Floats
    """Trust of each row, 0 … 1, shape (L,), by how grey its pixels are."""
    histogram: Floats
    """Counts of each level in the longer exposure, shape (L,)."""
    weight: Floats | None = None
    """Weight of each row in the likelihood, shape (L,); if None, rows count as
    `FIRST_PIXELS` at most."""
    shift: Floats | None = None
    """Relative change of the irradiance of each row by the scene, shape (L,); if None,
    no change."""
    noise: Floats | None = None
    """Variance of the noise of each row as a share of m², shape (L,), up to the common
    factor; if None, that of u and v."""
    margin: int = 0
    """Number of levels next to black and to white that may be clipped or not, as lossy
    files blur clipping. They are not conditioned on, and count as clipped in the
    shorter exposure."""

    @cached_property
    def conditions(self) -> Conditions:
        """Rows prepared for the likelihood, the same for any curve."""
        black, white = self.margin, len(self.counts) - 1 - self.margin
        seen: Bools = np.any(self.counts, axis=1, keepdims=True)[:, 0]
        seen[: black + 1] = seen[white:] = False
        upper = np.flatnonzero(seen)  # edge j is above level j
        counts, trust = self.counts[upper], self.trust[upper]
        if self.margin > 0:
            counts[:, black] = counts[:, : black + 1].sum(axis=1)
            counts[:, white] = counts[:, white:].sum(axis=1)
            counts[:, :black] = counts[:, white + 1 :] = 0.0
        edge = np.arange(len(self.counts) - 1)
        clipped = (edge < black) | (edge >= white)
        n_pixels = counts.sum(axis=1)
        weight = trust * np.minimum(1.0, FIRST_PIXELS / n_pixels)
        if self.weight is not None:
            weight = self.weight[upper]
        counts = counts * weight[:, np.newaxis]
        seen = counts.sum(axis=0)
        stray = STRAY * (seen + 1.0) / (seen.sum() + seen.size)
        far = float(seen @ np.log(stray))
        return Conditions(upper, counts, counts.sum(axis=1), n_pixels, trust, stray, clipped, far)


@dataclass(frozen=True, slots=True, eq=False)
class ExposureCounts:
    """Counts of a bracket in one channel, prepared for the likelihood.

    Its own unknowns are ln κ; if it has noise of its own, ln u and ln v or, once
    informed, ln of the common factor; and, unless the exposures are exact, the change
    of each ln t from its given value.
    """

    tables: tuple[Comparagram, ...]
    log_exposures: Floats
    """Logarithms ln t of the exposures, shape (K,), as far as known."""
    exposure_error: float = 0.0
    """Deviation of the logarithms of the exposures; 0 if they are exact."""
    held: bool = False
    """Whether exposures are kept as given although they err, as counts of lossy files
    determine them worse."""
    white_error: float = 0.0
    """Relative deviation of the light at white beyond that of the counts, where
    clipping could not be separated from levels."""
    aligned: bool = True
    """Whether levels were compared pixel by pixel, not by rank."""
    own_noise: bool = False
    """Whether u and v differ from those of level pairs of one exposure."""

    @property
    def n_levels(self) -> int:
        """Number of levels L."""
        return len(self.tables[0].counts)

    @property
    def margin(self) -> int:
        """Margin of all tables, see `Comparagram.margin`."""
        return self.tables[0].margin

    @property
    def lossy(self) -> bool:
        """Whether files were compressed with loss."""
        return self.margin > 0

    @property
    def unknown(self) -> bool:
        """Whether exposures are unknown."""
        return self.exposure_error > _UNKNOWN

    @property
    def settled(self) -> bool:
        """Whether exposures are fixed, so that counts do not change them."""
        return self.exposure_error == 0 or self.held

    def held_at(self, log_exposures: Floats) -> "ExposureCounts":
        """Return the same counts with other exposures that count as exact."""
        tables = pooled(self.tables, log_exposures)
        return replace(self, tables=tables, log_exposures=log_exposures, exposure_error=0.0)

    @property
    def forward(self) -> tuple[Comparagram, ...]:
        """Tables conditioned on the longer exposure."""
        return tuple(
            table
            for table in self.tables
            if self.log_exposures[table.longer] >= self.log_exposures[table.shorter]
        )

    @property
    def n_pixels(self) -> int:
        """Weighted number of pixels compared."""
        return round(sum(float(table.counts.sum()) for table in self.forward))

    @property
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level between black and white in any exposure."""
        seen = np.zeros(self.n_levels, dtype=bool)
        for table in self.tables:
            seen |= table.counts.any(axis=0) | table.counts.any(axis=1)
        (levels,) = np.nonzero(seen[1:-1])
        return (int(levels[0]) + 1, int(levels[-1]) + 1) if levels.size else (0, self.n_levels - 1)

    @property
    def own_mean(self) -> Floats:
        """Prior mean of the own unknowns, shape (N,)."""
        typical = AffineNoise.from_8bit(*TYPICAL_8BIT)
        log_noise = np.log([typical.slope, typical.floor]) if self.own_noise else np.empty(0)
        if self.has_relative_noise:
            log_noise = np.zeros(1)
        changes = np.zeros(self.log_exposures.size if self.exposure_error > 0 else 0)
        return np.concatenate([[np.log(TYPICAL_SCATTER)], log_noise, changes])

    @property
    def own_precision(self) -> Floats:
        """Inverse of the prior covariance of the own unknowns."""
        deviations = np.full(self.own_mean.size, self.exposure_error)
        deviations[0] = SCATTER_SPREAD
        deviations[1 : self.first_change] = TYPICAL_SPREAD
        return np.diag(1 / deviations**2)

    @property
    def own_held(self) -> Bools:
        """Whether each own unknown is held fixed, shape (N,)."""
        return self.held & (np.arange(self.own_mean.size) >= self.first_change)

    @property
    def first_change(self) -> int:
        """Place of the first exposure among the own unknowns."""
        if self.has_relative_noise:
            return 2
        return 3 if self.own_noise else 1

    @property
    def has_relative_noise(self) -> bool:
        """Whether the own noise is that of a first estimate, up to a factor."""
        return self.tables[0].noise is not None


def pooled(tables: tuple[Comparagram, ...], log_exposures: Floats) -> tuple[Comparagram, ...]:
    """Add up tables of one ratio: the cost no longer grows with the exposures."""
    groups: dict[int, list[Comparagram]] = {}
    for table in tables:
        step = log_exposures[table.longer] - log_exposures[table.shorter]
        groups.setdefault(round(step / _SAME_RATIO), []).append(table)
    return tuple(each[0] if len(each) == 1 else _added(each) for each in groups.values())


def _added(tables: list[Comparagram]) -> Comparagram:
    n_pixels = np.array([table.counts.sum(axis=1) for table in tables])
    trusted = n_pixels * np.array([table.trust for table in tables])
    return replace(
        tables[0],
        counts=np.sum([table.counts for table in tables], axis=0),
        trust=trusted.sum(axis=0) / np.maximum(n_pixels.sum(axis=0), 1e-9),
        histogram=np.sum([table.histogram for table in tables], axis=0),
    )


class ExposureModel:
    """Probabilities of comparagrams at one state of the unknowns, found on demand.

    Parameters
    ----------
    counts : ExposureCounts
    edges : ndarray, shape (L − 1,)
        Irradiance between the levels, increasing, within [0, 1].
    noise : AffineNoise or None
        Noise of frames; None where the counts have noise of their own.
    own : ndarray, shape of `ExposureCounts.own_mean`
    """

    def __init__(
        self, counts: ExposureCounts, edges: Floats, noise: AffineNoise | None, own: Floats
    ) -> None:
        self._counts = counts
        changes = own[counts.first_change :]
        log_exposures = counts.log_exposures + (changes if changes.size else 0.0)
        factor = 1.0
        if counts.has_relative_noise:
            factor = float(np.exp(own[1]))
        elif counts.own_noise:
            slope, floor = np.exp(own[1:3])
            noise = AffineNoise(float(slope), float(floor))
        self._rows = [
            _Rows(
                table,
                edges,
                noise,
                factor=factor,
                scatter=float(np.exp(own[0])),
                ratio=float(np.exp(log_exposures[table.longer] - log_exposures[table.shorter])),
            )
            for table in counts.tables
        ]
        self._edges, self._own = edges, own
        self.noise = noise

    def log_likelihood(self) -> float:
        """Σ C ln P over all tables."""
        return sum(rows.log_likelihood for rows in self._rows)

    def expand(self, mix: Floats) -> Expansion:
        """Log-likelihood, gradient and expected information.

        Parameters
        ----------
        mix : ndarray, shape (D, 2)
            Derivatives of (ln u, ln v) by the unknowns of the noise.

        Returns
        -------
        Expansion
            With respect to edges, unknowns of the noise and own unknowns.
        """
        n_inner = self._edges.size
        size = n_inner + len(mix) + self._own.size
        gradient, half = np.zeros(size), np.zeros((size, size))
        for table, rows in zip(self._counts.tables, self._rows, strict=True):
            # A table depends on edges, ln u (or ln of the factor), ln v, ln κ and ln ρ.
            turn = np.zeros((4, size - n_inner))
            turn[2, len(mix)] = 1.0
            if self._counts.own_noise:
                own_noise = np.arange(self._counts.first_change - 1)
                turn[own_noise, len(mix) + 1 + own_noise] = 1.0
            else:
                turn[:2, : len(mix)] = mix.T
            first = len(mix) + self._counts.first_change
            if first < size - n_inner:
                turn[3, first + table.longer], turn[3, first + table.shorter] = 1.0, -1.0
            rows.add_to(gradient, half, turn)
        return Expansion(self.log_likelihood(), gradient, half + half.T)

    def informed(self) -> ExposureCounts:
        """Return the counts with shifts, weights and noise of rows from this state."""
        counts = self._counts
        keeps = counts.own_noise and counts.exposure_error > 0
        assert self.noise is not None
        shifts = [_shift(table.histogram, self._edges, self.noise) for table in counts.tables]
        tables = [
            replace(
                table,
                weight=rows.weight(rows.doubt(shift) if counts.lossy else np.zeros(shift.size)),
                shift=shift,
                noise=rows.relative_noise() if keeps else None,
            )
            for table, rows, shift in zip(counts.tables, self._rows, shifts, strict=True)
        ]
        return replace(counts, tables=tuple(tables))


def _shift(histogram: Floats, edges: Floats, noise: AffineNoise) -> Floats:
    """(σ²(g) d ln h/dI + u)/g at the levels, shape (L,); 0 at black and white.

    The density of light is that of the levels, smoothed over half the noise. It is
    divided by that of a uniform scene: black and white are not seen, and near them all
    densities fall.
    """
    light, width = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    spread = np.sqrt(noise.variance(light) / 4 + width**2)[:, np.newaxis]
    distance = (light[:, np.newaxis] - light) / spread
    kernel = np.exp(-0.5 * distance**2)
    falling = kernel * distance / spread
    density = np.maximum(kernel @ histogram[1:-1], 1e-9)
    log_slope = (falling @ width) / (kernel @ width) - (falling @ histogram[1:-1]) / density
    relative = (noise.variance(light) * log_slope + noise.slope) / light
    return np.concatenate([[0.0], relative.clip(-_MOST_SHIFT, _MOST_SHIFT), [0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class _RowNoise:
    """Noise part of s² and its derivatives, shape (J,)."""

    variance: Floats
    by_log_mean: Floats
    """Derivative by ln m, at constant irradiance of level j."""
    by_light: Floats
    """Derivative by the irradiance of level j, at constant mean."""
    by_log_ratio: Floats
    by_unknowns: tuple[Floats, Floats]
    """Derivatives by ln u and ln v, or by ln of the factor and 0."""

    @classmethod
    def affine(cls, noise: AffineNoise, mean: Floats, light: Floats, ratio: float) -> "_RowNoise":
        """Return the noise of both exposures."""
        of_longer = noise.variance(light) / ratio**2
        return cls(
            variance=noise.variance(mean) + of_longer,
            by_log_mean=noise.slope * mean,
            by_light=np.full(mean.size, noise.slope / ratio**2),
            by_log_ratio=-2 * of_longer,
            by_unknowns=(
                noise.slope * (mean + light / ratio**2),
                np.full(mean.size, noise.floor * (1 + 1 / ratio**2)),
            ),
        )

    @classmethod
    def relative(cls, share: Floats, mean: Floats) -> "_RowNoise":
        """Return noise with a variance that is a share of the squared mean."""
        variance, zero = share * mean**2, np.zeros(mean.size)
        return cls(variance, 2 * variance, zero, zero, (variance, zero))


class _Rows:
    """Rows of one table, one for each level j of the longer exposure with counts.

    Only edges within reach of the expected level are used: W edges of each row, and the
    W + 1 levels between and beside them.
    """

    def __init__(
        self,
        table: Comparagram,
        edges: Floats,
        noise: AffineNoise | None,
        *,
        factor: float,
        scatter: float,
        ratio: float,
    ) -> None:
        self._given = given = table.conditions
        self._upper, self._n = given.upper, given.n
        self._scatter, self._ratio = scatter, ratio
        self._width = edges[self._upper] - edges[self._upper - 1]
        self._light = (edges[self._upper] + edges[self._upper - 1]) / 2
        shift = 0.0 if table.shift is None else table.shift[self._upper]
        self._share = np.full(self._upper.size, 1.0 / ratio) * (1.0 + shift)
        self._mean = self._light * self._share
        self._rounding = self._width**2 / 12 / ratio**2
        if table.noise is None:
            assert noise is not None
            self._noise = _RowNoise.affine(noise, self._mean, self._light, ratio)
        else:
            self._noise = _RowNoise.relative(factor * table.noise[self._upper], self._mean)
        self._variance = self._noise.variance + self._rounding + (scatter * self._mean) ** 2
        deviation = np.sqrt(self._variance)
        self._deviation = deviation[:, np.newaxis]
        first = np.searchsorted(edges, self._mean - _REACH * deviation)
        last = np.searchsorted(edges, self._mean + _REACH * deviation)
        n_near = min(int((last - first).max(initial=0)) + 1, edges.size)
        self._first: Indices = np.minimum(first, edges.size - n_near)
        near = sliding_window_view(edges, n_near)[self._first]
        self._distance = (near - self._mean[:, np.newaxis]) / self._deviation
        if given.clipped.any():
            edge = np.arange(edges.size)
            beyond = np.where(given.clipped, np.where(edge < edge.size // 2, -_NEVER, _NEVER), 0.0)
            self._distance += sliding_window_view(beyond, n_near)[self._first]
        self._stray = sliding_window_view(given.stray, n_near + 1)[self._first]
        rows = np.arange(self._upper.size)
        self._counts = _windows(given.counts, n_near + 1)[rows, self._first]
        shares = _differences(ndtr(self._distance))
        shares[:, -1] += 1.0
        self._shares = (1 - STRAY) * np.maximum(shares, 0.0) + self._stray

    @property
    def _edge(self) -> Indices:
        """Number of each edge within reach, shape (J, W)."""
        return self._first[:, np.newaxis] + np.arange(self._distance.shape[1])

    def doubt(self, shift: Floats) -> Floats:
        """Further relative deviation of lossy rows by their shift, shape (L,)."""
        return (_LOSSY_DOUBT_REVERSED if self._ratio < 1 else _LOSSY_DOUBT) * np.abs(shift)

    def weight(self, doubt: Floats) -> Floats:
        """Weight of each row, shape (L,): its pixels share doubt and a part of the scatter."""
        relative = _SHARED * self._scatter**2 + doubt[self._upper] ** 2
        shared = relative * self._mean**2 / self._variance
        weight = np.zeros(self._given.stray.size)
        weight[self._upper] = self._given.trust / (1 + self._given.n_pixels * shared)
        return weight

    def relative_noise(self) -> Floats:
        """Variance of the noise of each row as a share of m², shape (L,)."""
        noise = np.zeros(self._given.stray.size)
        noise[self._upper] = self._noise.variance / self._mean**2
        return noise

    @cached_property
    def log_likelihood(self) -> float:
        """Σ C ln P."""
        gain = float(np.vdot(self._counts, np.log(self._shares / self._stray)))
        return gain + self._given.far

    def add_to(self, gradient: Floats, half: Floats, turn: Floats) -> None:
        """Accumulate gradient and half the information: edges, then unknowns mapped by `turn`.

        The probabilities of a row depend on the edges within reach directly, and
        through its mean m and variance s² on the edges of level j and on ln u, ln v, ln
        κ, ln ρ. A change of m acts as if all edges fell, one of s² as if they came
        nearer to m, so all derivatives of a row follow from those by its edges. Half of
        the information is added; the other half is its transpose.
        """
        n_inner, edge = len(gradient) - turn.shape[1], self._edge
        by_edge = ((1 - STRAY) * _NORMAL / self._deviation) * np.exp(-0.5 * self._distance**2)
        inverse = 1 / self._shares
        ratio = self._counts * inverse
        pull = by_edge * (ratio[:, :-1] - ratio[:, 1:])
        weighted = self._n[:, np.newaxis] * by_edge
        own = weighted * by_edge * (inverse[:, :-1] + inverse[:, 1:])
        beside = -weighted[:, :-1] * by_edge[:, 1:] * inverse[:, 1:-1]  # with the next edge

        number = np.arange(n_inner)
        gradient[:n_inner] += np.bincount(edge.ravel(), pull.ravel(), n_inner)
        half[number, number] += 0.5 * np.bincount(edge.ravel(), own.ravel(), n_inner)
        half[number[:-1], number[1:]] += np.bincount(
            edge[:, :-1].ravel(), beside.ravel(), n_inner - 1
        )

        # Information shared by m or s² and each edge. In einsum, a and b are m or s², j
        # rows, k edges within reach and r the unknowns after the edges.
        nearer = self._distance / (-2 * self._deviation)
        cross = np.stack([-own, own * nearer])
        cross[0, :, :-1] -= beside
        cross[0, :, 1:] -= beside
        cross[1, :, :-1] += beside * nearer[:, 1:]
        cross[1, :, 1:] += beside * nearer[:, :-1]
        pulls = np.array([-pull.sum(axis=1), _dot(pull, nearer)])
        both = _dot(cross[0], nearer)
        among = np.array([[-cross[0].sum(axis=1), both], [both, _dot(cross[1], nearer)]])

        by_ends, by_unknowns = self._chain()
        by_rest = by_unknowns @ turn
        with_rest = np.einsum("abj,bjr->ajr", among, by_rest)
        ends = list(zip((self._upper - 1, self._upper), by_ends, strict=True))
        for place, by_end in ends:
            gradient[place] += np.einsum("aj,aj->j", by_end, pulls)
            _windows(half, edge.shape[1])[place, self._first] += np.einsum(
                "aj,ajk->jk", by_end, cross
            )
            for other, by_other in ends:
                half[place, other] += 0.5 * np.einsum("aj,abj,bj->j", by_end, among, by_other)
            half[place, n_inner:] += np.einsum("aj,ajr->jr", by_end, with_rest)
        gradient[n_inner:] += np.einsum("aj,ajr->r", pulls, by_rest)
        half[n_inner:, n_inner:] += 0.5 * np.einsum("ajr,ajs->rs", by_rest, with_rest)
        crossed = [
            np.bincount(edge.ravel(), np.einsum("aj,ajk->jk", by_one, cross).ravel(), n_inner)
            for by_one in np.moveaxis(by_unknowns, 2, 0)
        ]
        half[:n_inner, n_inner:] += np.stack(crossed, axis=1) @ turn

    def _chain(self) -> tuple[Floats, Floats]:
        """Derivatives of m and s² of each row.

        The first are by the edges below and above level j, shape (2, 2, J), edges
        first; the second by ln u, ln v, ln κ and ln ρ, shape (2, J, 4).
        """
        noise, mean = self._noise, self._mean
        scattered = (self._scatter * mean) ** 2
        half = 0.5 * self._share
        along = noise.by_log_mean + 2 * scattered  # ∂s²/∂ln m
        middle = 0.5 * (along / self._light + noise.by_light)
        apart = self._width / (6 * self._ratio**2)
        zero = np.zeros(mean.size)
        by_log_ratio = noise.by_log_ratio - along - 2 * self._rounding
        by_unknowns = np.array(
            [
                [zero, zero, zero, -mean],
                [*noise.by_unknowns, 2 * scattered, by_log_ratio],
            ]
        )
        by_ends = np.array([[half, middle - apart], [half, middle + apart]])
        return by_ends, np.moveaxis(by_unknowns, 1, 2)


def _windows(rows: Floats, width: int) -> Floats:
    """View of all windows on each row, shape (J, N − width + 1, width); writable."""
    return sliding_window_view(rows, width, axis=1, writeable=True)


def _dot(a: Floats, b: Floats) -> Floats:
    """Dot product of each row."""
    return np.asarray(np.einsum("jk,jk->j", a, b))


def _differences(below: Floats) -> Floats:
    """Shares of the W + 1 levels of a row from those below its W edges, but for 1."""
    result = np.empty((below.shape[0], below.shape[1] + 1))
    result[:, 0] = below[:, 0]
    np.subtract(below[:, 1:], below[:, :-1], out=result[:, 1:-1])
    result[:, -1] = -below[:, -1]  # NumPy 2.4's np.negative errs with out= and rows of 8
    return result
