r"""How probable the levels of one exposure are, given those of a longer one of the same scene.

A pixel that shows level j in the longer exposure had the irradiance g_j there, up to rounding and
noise, and g_j/ρ in an exposure ρ times shorter. There it shows level i with probability

.. math::
    P(i | j) = Φ\Bigl(\frac{e_{i+1} - m_j}{s_j}\Bigr) - Φ\Bigl(\frac{e_i - m_j}{s_j}\Bigr), \qquad
    m_j = \frac{g_j}{ρ}, \quad
    s_j^2 = u m_j + v + \frac{u g_j + v + Δ_j^2/12}{ρ^2} + κ^2 m_j^2,

with edges e as in `chartless.likelihood`, Δ_j the irradiance that level j covers, and κ a relative
scatter of what neither curve nor noise explains: colours mapped into a gamut, edges a pixel off.
Rounding and clipping of the shorter exposure are part of the model; what is black or saturated in
the longer one is no condition, as its irradiance is unknown. A small share of pixels may show any
level: what moved.

The scene is eliminated. Given j it matters only where it is uneven over the width of the noise:
there the mean of the irradiance is not g_j but g_j + σ²(g_j) d ln h/dI + u, h the density of the
light that the longer exposure shows (Tweedie's formula; Efron 2011,
doi:10.1198/jasa.2011.tm11181; u because the noise itself grows with the light). And what κ stands
for does not shrink with the number of pixels. Both need a first estimate, after which
`ExposureModel.informed` tells them.

Where repeated exposures tell the noise, u and v here are only what fits: real noise is known
better, and must not be bent to what lies between exposures. Nor may they say which of the curves
f^γ it is, through how the spread grows with irradiance. So unless the exposures are exact, after
the first estimate the noise of a row is that share of m_j which it was there, times a common
factor: it turns with γ as all does.

A table of such counts is a comparagram (Mann 2000, "Comparametric equations with practical
applications in quantigraphic image processing", doi:10.1109/83.855434).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from chartless.likelihood import Expansion
from chartless.noise import TYPICAL_8BIT, TYPICAL_SPREAD, AffineNoise
from chartless.types import Floats, Indices

STRAY = 0.01
"""Share of pixels that may show any level."""
TYPICAL_SCATTER, SCATTER_SPREAD = 0.02, 1.0
"""Relative scatter κ of frames, and the deviation of its logarithm."""
_NORMAL = 1 / np.sqrt(2 * np.pi)
FIRST_PIXELS = 10.0
"""Pixels that a row counts as at most, before its scatter is known."""
_SHARED = 0.3  # of the variance of the scatter: common to all pixels of a level
_MOST_SHIFT = 0.5
_REACH = 4.5  # deviations from the expected level beyond which only stray pixels show


@dataclass(frozen=True, slots=True, eq=False)
class Comparagram:
    """How often pixels show level j in one exposure and level i in a shorter one.

    Those of one exact ratio add up to one.
    """

    shorter: int
    """Number of the shorter exposure."""
    longer: int
    """Number of the longer one."""
    counts: Floats
    """Weighted counts, shape (L, L): rows j of the longer, columns i of the shorter exposure."""
    trust: Floats
    """Of each row, 0 … 1, shape (L,): how far its pixels are grey."""
    histogram: Floats
    """How often each level occurs in the longer exposure, shape (L,)."""
    weight: Floats | None = None
    """Of each row in the likelihood, shape (L,); without, rows count as `FIRST_PIXELS` at most."""
    shift: Floats | None = None
    """Relative change of the irradiance of each row by the scene, shape (L,); without, none."""
    noise: Floats | None = None
    """Variance of the noise of each row as a share of m², shape (L,), up to the common factor;
    without, that of u and v."""


@dataclass(frozen=True, slots=True, eq=False)
class ExposureCounts:
    """Counted evidence of a bracket in one channel, as the likelihood takes it.

    Its own unknowns are ln κ; if it has noise of its own, ln u and ln v or, once informed, ln of
    the common factor; and, unless the exposures are exactly known, how far each ln t is from what
    it is said to be.
    """

    tables: tuple[Comparagram, ...]
    log_exposures: Floats
    """Logarithms ln t of the exposures, shape (K,), as far as known."""
    exposure_error: float = 0.0
    """Deviation of the logarithms of the exposures; 0 if they are exact."""
    own_noise: bool = False
    """Whether u and v here are not those of level pairs of one exposure."""

    @property
    def n_levels(self) -> int:
        """L."""
        return len(self.tables[0].counts)

    @property
    def n_pixels(self) -> int:
        """Pixels compared, weighted."""
        return round(sum(float(table.counts.sum()) for table in self.tables))

    @property
    def observed_levels(self) -> tuple[int, int]:
        """Lowest and highest level that is neither black nor white, of any exposure."""
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
        """Inverse of their prior covariance."""
        deviations = np.full(self.own_mean.size, self.exposure_error)
        deviations[0] = SCATTER_SPREAD
        deviations[1 : self.first_change] = TYPICAL_SPREAD
        return np.diag(1 / deviations**2)

    @property
    def first_change(self) -> int:
        """Place of the first exposure among the own unknowns."""
        if self.has_relative_noise:
            return 2
        return 3 if self.own_noise else 1

    @property
    def has_relative_noise(self) -> bool:
        """Whether the noise of its own is that of a first estimate, up to a factor."""
        return self.tables[0].noise is not None


class ExposureModel:
    """Probabilities of comparagrams for one state of knowledge; computed when asked for.

    Parameters
    ----------
    counts : ExposureCounts
    edges : ndarray, shape (L − 1,)
        Irradiance between the levels, increasing, within [0, 1].
    noise : AffineNoise
    own : ndarray, shape of `ExposureCounts.own_mean`
    """

    def __init__(
        self, counts: ExposureCounts, edges: Floats, noise: AffineNoise, own: Floats
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
        self._edges, self._noise, self._own = edges, noise, own

    def log_likelihood(self) -> float:
        """Σ C ln P over all tables."""
        return sum(rows.log_likelihood() for rows in self._rows)

    def expand(self, mix: Floats) -> Expansion:
        """Log-likelihood, gradient and expected information.

        Parameters
        ----------
        mix : ndarray, shape (D, 2)
            How (ln u, ln v) follow from the unknowns of the noise.

        Returns
        -------
        Expansion
            In (edges, unknowns of the noise, own unknowns).
        """
        n_inner = self._edges.size
        size = n_inner + len(mix) + self._own.size
        gradient, information = np.zeros(size), np.zeros((size, size))
        for table, rows in zip(self._counts.tables, self._rows, strict=True):
            # A table knows edges, ln u (or ln of the factor), ln v, ln κ and ln ρ.
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
            rows.add_to(gradient, information, turn)
        return Expansion(self.log_likelihood(), gradient, information)

    def informed(self) -> tuple[ExposureCounts, Floats]:
        """Counts with shifts, weights and noise of rows as this state asks for; own unknowns."""
        counts, own = self._counts, self._own
        keeps = counts.own_noise and counts.exposure_error > 0
        tables = [
            replace(
                table,
                weight=rows.weight(),
                shift=_shift(table.histogram, self._edges, self._noise),
                noise=rows.relative_noise() if keeps else None,
            )
            for table, rows in zip(counts.tables, self._rows, strict=True)
        ]
        if keeps:
            own = np.concatenate([own[:1], np.zeros(1), own[counts.first_change :]])
        return replace(counts, tables=tuple(tables)), own


def _shift(histogram: Floats, edges: Floats, noise: AffineNoise) -> Floats:
    """(σ²(g) d ln h/dI + u)/g at the levels, shape (L,); 0 at black and white.

    The density of light is that of the levels, smoothed over half the noise. It is divided by what
    an even scene would show: black and white are not seen, and beside them all densities fall.
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
    """Part of s² that is noise, and its derivatives; shape (J,)."""

    variance: Floats
    by_log_mean: Floats
    """While the irradiance of level j stays."""
    by_light: Floats
    """By that, while the mean stays."""
    by_log_ratio: Floats
    by_unknowns: tuple[Floats, Floats]
    """Ln u and ln v, or ln of the factor and nothing."""

    @classmethod
    def affine(cls, noise: AffineNoise, mean: Floats, light: Floats, ratio: float) -> "_RowNoise":
        """Of both exposures."""
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
        """A share of the mean, squared."""
        variance, zero = share * mean**2, np.zeros(mean.size)
        return cls(variance, 2 * variance, zero, zero, (variance, zero))


class _Rows:
    """One table: a row for each level j of the longer exposure that has counts.

    Only what lies within reach of the expected level is computed: W edges of each row and the
    W + 1 levels between and beside them.
    """

    def __init__(
        self,
        table: Comparagram,
        edges: Floats,
        noise: AffineNoise,
        *,
        factor: float,
        scatter: float,
        ratio: float,
    ) -> None:
        counts = table.counts
        (inner,) = np.nonzero(counts[1:-1].any(axis=1))
        self._upper: Indices = inner + 1  # edge above level j; below it is the one before
        self._scatter, self._ratio = scatter, ratio
        self._width = edges[self._upper] - edges[self._upper - 1]
        self._light = (edges[self._upper] + edges[self._upper - 1]) / 2
        shift = 0.0 if table.shift is None else table.shift[self._upper]
        self._share = np.full(self._upper.size, 1.0 / ratio) * (1.0 + shift)
        self._mean = self._light * self._share
        self._rounding = self._width**2 / 12 / ratio**2
        if table.noise is None:
            self._noise = _RowNoise.affine(noise, self._mean, self._light, ratio)
        else:
            self._noise = _RowNoise.relative(factor * table.noise[self._upper], self._mean)
        variance = self._noise.variance + self._rounding + (scatter * self._mean) ** 2
        self._variance = variance[:, np.newaxis]
        self._deviation = np.sqrt(self._variance)
        reach = _REACH * self._deviation[:, 0]
        first = np.searchsorted(edges, self._mean - reach)
        last = np.searchsorted(edges, self._mean + reach)
        n_near = min(int((last - first).max(initial=0)) + 1, edges.size)
        first = np.minimum(first, edges.size - n_near)
        self._edge: Indices = first[:, np.newaxis] + np.arange(n_near)
        self._distance = (edges[self._edge] - self._mean[:, np.newaxis]) / self._deviation
        near = first[:, np.newaxis] + np.arange(n_near + 1)
        own = counts[self._upper]
        n_pixels = own.sum(axis=1)
        self._trust = table.trust[self._upper]
        weight = self._trust * np.minimum(1.0, FIRST_PIXELS / n_pixels)
        if table.weight is not None:
            weight = table.weight[self._upper]
        own = own * weight[:, np.newaxis]
        self._n_pixels, self._n, self._n_levels = n_pixels, own.sum(axis=1), len(counts)
        stray = STRAY * (own.sum(axis=0) + 1.0) / (own.sum() + counts.shape[1])
        self._counts = np.take_along_axis(own, near, axis=1)
        self._stray = stray[near]
        self._far = float((own.sum(axis=0)) @ np.log(stray))
        below = ndtr(self._distance)
        shares = _differences(below)
        shares[:, -1] += 1.0
        self._shares = (1 - STRAY) * np.maximum(shares, 0.0) + self._stray

    def weight(self) -> Floats:
        """Weight of each row, shape (L,): a part of the scatter is shared by its pixels."""
        shared = _SHARED * (self._scatter * self._mean) ** 2 / self._variance[:, 0]
        weight = np.zeros(self._n_levels)
        weight[self._upper] = self._trust / (1 + self._n_pixels * shared)
        return weight

    def relative_noise(self) -> Floats:
        """Variance of the noise of each row as a share of m², shape (L,)."""
        noise = np.zeros(self._n_levels)
        noise[self._upper] = self._noise.variance / self._mean**2
        return noise

    def log_likelihood(self) -> float:
        gain = float(np.vdot(self._counts, np.log(self._shares / self._stray)))
        return gain + self._far

    def add_to(self, gradient: Floats, information: Floats, turn: Floats) -> None:
        """Add what the table tells of edges and, by `turn`, of what follows them.

        Edges within reach move the probabilities of a row by themselves; through the mean m and
        the variance s² of the row, the edges of level j do, and ln u, ln v, ln κ, ln ρ.
        """
        n_inner = len(gradient) - turn.shape[1]
        density = (1 - STRAY) * _NORMAL * np.exp(-0.5 * self._distance**2)
        by_edge = density / self._deviation
        by_variance = density * self._distance / (-2 * self._variance)
        ratio = self._counts / self._shares
        drop = ratio[:, :-1] - ratio[:, 1:]
        inverse = 1 / self._shares
        n = self._n[:, np.newaxis]

        changes = _differences(-by_edge), _differences(by_variance)  # with m, with s²
        relative = [change * inverse for change in changes]
        pulls = [-(drop * by_edge).sum(axis=1), (drop * by_variance).sum(axis=1)]
        crossed = [n * by_edge * (each[:, :-1] - each[:, 1:]) for each in relative]
        own = [[self._n * (a * b).sum(axis=1) for b in changes] for a in relative]
        by_level, by_rest = self._chain()

        def spread(values: Floats) -> Floats:
            return np.asarray(
                np.bincount(self._edge.ravel(), values.ravel(), minlength=n_inner), np.float64
            )

        gradient[:n_inner] += spread(drop * by_edge)
        gradient[n_inner:] += turn.T @ sum(
            pull @ rest for pull, rest in zip(pulls, by_rest, strict=True)
        )
        edges = information[:n_inner, :n_inner]
        diagonal = np.arange(n_inner)
        edges[diagonal, diagonal] += spread(n * by_edge**2 * (inverse[:, :-1] + inverse[:, 1:]))
        shared = np.zeros_like(by_edge)
        shared[:, :-1] = -n * by_edge[:, :-1] * by_edge[:, 1:] * inverse[:, 1:-1]
        beside = spread(shared)[:-1]
        edges[diagonal[:-1], diagonal[1:]] += beside
        edges[diagonal[1:], diagonal[:-1]] += beside

        to_rest = np.zeros((n_inner, 4))
        for what in range(2):
            for column in range(4):
                if by_rest[what][:, column].any():
                    to_rest[:, column] += spread(
                        crossed[what] * by_rest[what][:, column, np.newaxis]
                    )
        among_rest = np.zeros((4, 4))
        for end, place in enumerate((self._upper - 1, self._upper)):
            np.add.at(
                gradient, place, sum(p * b[end] for p, b in zip(pulls, by_level, strict=True))
            )
            moved = sum(c * b[end][:, np.newaxis] for c, b in zip(crossed, by_level, strict=True))
            both = np.bincount(
                (self._edge * n_inner + place[:, np.newaxis]).ravel(),
                moved.ravel(),
                minlength=n_inner**2,
            ).reshape(n_inner, n_inner)
            edges += both
            edges += both.T
            # What m and s² of a row tell together, with the other edge of the level and the rest.
            told = [sum(own[a][b] * by_level[a][end] for a in range(2)) for b in range(2)]
            for other, its in enumerate((self._upper - 1, self._upper)):
                np.add.at(edges, (place, its), sum(told[b] * by_level[b][other] for b in range(2)))
            np.add.at(to_rest, place, sum(told[b][:, np.newaxis] * by_rest[b] for b in range(2)))
        for a in range(2):
            for b in range(2):
                among_rest += (by_rest[a] * own[a][b][:, np.newaxis]).T @ by_rest[b]
        cross = to_rest @ turn
        information[:n_inner, n_inner:] += cross
        information[n_inner:, :n_inner] += cross.T
        information[n_inner:, n_inner:] += turn.T @ among_rest @ turn

    def _chain(self) -> tuple[list[tuple[Floats, Floats]], list[Floats]]:
        """Derivatives of m and s² of each row: in the edges below and above level j; in the rest.

        The rest is ln u, ln v, ln κ, ln ρ, shape (J, 4).
        """
        noise, mean = self._noise, self._mean
        scattered = (self._scatter * mean) ** 2
        half = 0.5 * self._share
        along = noise.by_log_mean + 2 * scattered  # ∂s²/∂ln m
        middle = 0.5 * (along / self._light + noise.by_light)
        apart = self._width / (6 * self._ratio**2)
        zero = np.zeros(mean.size)
        mean_by_rest = np.stack([zero, zero, zero, -mean], axis=1)
        variance_by_rest = np.stack(
            [*noise.by_unknowns, 2 * scattered, noise.by_log_ratio - along - 2 * self._rounding],
            axis=1,
        )
        return (
            [(half, half), (middle - apart, middle + apart)],
            [mean_by_rest, variance_by_rest],
        )


def _differences(below: Floats) -> Floats:
    """From what lies below the W edges of a row to what lies in its W + 1 levels, but for 1."""
    result = np.empty((below.shape[0], below.shape[1] + 1))
    result[:, 0] = below[:, 0]
    np.subtract(below[:, 1:], below[:, :-1], out=result[:, 1:-1])
    result[:, -1] = -below[:, -1]  # NumPy 2.4's np.negative errs with out= and rows of 8
    return result
