"""Derivatives are those of differences; curve, matrix, gains and falloff come back from blocks."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import approx_fprime

from chartless.curves import AbstractCurve, SampledCurve, named_curve
from chartless.curves.populations import measured_prior
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, FreeCurve, free_curve
from chartless.evidence.raw.blocks import RawBlocks
from chartless.evidence.raw.channel import RawPairs
from chartless.evidence.raw.likelihood import RawModel
from chartless.evidence.raw.term import RawTerm, raw_name
from chartless.inference.block import curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import at_levels, covariance_of, deviations_at_levels
from chartless.methods._joint import searched
from chartless.models import MODELS
from chartless.result.response import rmse
from chartless.types import Floats

FILM = "ameegc2-exact:0.48,-2.26,0.37"
ROW = np.array([1.6, -0.5, -0.1])
GAINS = np.array([0.2, 0.15, 0.3])
FALLOFF = np.array([0.3, -0.1])
FAR = 3.0
"""Deviations beyond which squares count less."""
CURVE, OWN = curve_name("R"), raw_name("R")


def blocks_of(
    curve: AbstractCurve,
    *,
    n_blocks: int = 4000,
    scatter: float = 0.01,
    wild: float = 0.0,
    n_levels: int = 256,
    seed: int = 0,
) -> RawBlocks:
    """Blocks of three shots of a scene with greys and colours, red channel."""
    rng = np.random.default_rng(seed)
    light = np.exp(rng.uniform(np.log(0.002), np.log(0.9), (n_blocks, 1)))
    light = light * np.where(
        rng.uniform(size=light.shape) < 0.5, 1, rng.uniform(0.6, 1, (n_blocks, 3))
    )
    radius, shot = rng.uniform(0, 1, n_blocks), rng.integers(0, 3, n_blocks)
    bent = GAINS[shot] + FALLOFF[0] * radius**2 + FALLOFF[1] * radius**4
    irradiance = (light @ ROW) * np.exp(bent + scatter * rng.standard_normal(n_blocks))
    strange = rng.uniform(size=n_blocks) < wild
    irradiance[strange] *= rng.uniform(0.5, 2, np.count_nonzero(strange))
    seen = (irradiance > 0) & (irradiance < 0.99)
    level = (n_levels - 1) * curve.response(irradiance) + rng.uniform(-0.2, 0.2, n_blocks)
    seen &= (level > 0.5) & (level < n_levels - 1.5)
    largest = light.max(axis=1)
    return RawBlocks(
        level=level[seen],
        light=light[seen],
        chroma=((largest - light.min(axis=1)) / largest)[seen],
        radius=radius[seen],
        shot=shot[seen],
        base=np.array([1.0, 0.0, 0.0]),
        light_error=1e-4,
        n_levels=n_levels,
    )


def own_truth() -> Floats:
    """Gains, matrix, pedestal and falloff of these blocks."""
    return np.concatenate([GAINS, ROW[[0, 2]] - [1, 0], [0], FALLOFF])


def edges_of(curve: AbstractCurve, n_levels: int = 256) -> Floats:
    return np.asarray(curve.inverse((np.arange(n_levels - 1) + 0.5) / (n_levels - 1)))


def term_of(blocks: RawBlocks) -> RawTerm:
    return RawTerm(RawModel(blocks), "R")


# The term


def few_levels(n_blocks: int = 300) -> RawBlocks:
    """Of 32 levels, some blocks wild."""
    srgb = named_curve("srgb")
    return blocks_of(srgb, n_blocks=n_blocks, n_levels=32, scatter=0.02, wild=0.1)


def truth_of(n_levels: int = 32) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Edges and own unknowns of sRGB, by name."""
    return {CURVE: edges_of(named_curve("srgb"), n_levels)}, {OWN: own_truth()}


def truth_values(n_levels: int = 32) -> tuple[Floats, Floats]:
    """The same without names."""
    edges, own = truth_of(n_levels)
    return edges[CURVE], own[OWN]


def somewhere(n_blocks: int = 300) -> tuple[RawTerm, Floats, Floats]:
    """A term that was looked at, and edges and own unknowns off the truth."""
    term = term_of(few_levels(n_blocks)).first_look(*truth_of())
    rng = np.random.default_rng(3)
    edges = edges_of(named_curve("srgb"), 32)
    edges = edges + 0.3 * np.diff(edges, prepend=0) * rng.uniform(-1, 1, edges.size)
    return term, edges, own_truth() + rng.normal(0, 0.02, own_truth().size)


def test_the_gradient_is_that_of_differences() -> None:
    term, edges, own = somewhere()

    def log_likelihood(x: Floats) -> float:
        return term.fit({CURVE: x[: edges.size]}, {OWN: x[edges.size :]}).log_likelihood()

    fit = term.fit({CURVE: edges}, {OWN: own})
    expansion = fit.expand()
    expected = approx_fprime(np.concatenate([edges, own]), log_likelihood, 1e-8)

    assert expansion.value == fit.log_likelihood()
    np.testing.assert_allclose(
        expansion.gradient, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max()
    )


def test_information_is_that_of_residuals_by_their_weights() -> None:
    term, edges, own = somewhere()
    variance, share = term.variance, term.share
    assert variance is not None
    assert share is not None

    def residual(x: Floats) -> Floats:
        return term.model.shown(x[: edges.size], x[edges.size :]).residual

    there, step = np.concatenate([edges, own]), 1e-7
    changes = np.array(
        [(residual(there + each) - residual(there - each)) / 2 for each in step * np.eye(36 + 3)]
    )
    weight = share / (variance + (residual(there) / FAR) ** 2)
    information = term.fit({CURVE: edges}, {OWN: own}).expand().information

    np.testing.assert_allclose(information, information.T, rtol=1e-12, atol=1e-9)
    expected = (changes * weight) @ changes.T / step**2
    np.testing.assert_allclose(information, expected, rtol=1e-4, atol=1e-5 * expected.max())


def test_the_likelihood_is_that_of_residuals_with_long_tails() -> None:
    term, edges, own = somewhere()
    assert term.variance is not None
    assert term.share is not None
    residual = term.model.shown(edges, own).residual
    squares = residual**2 / term.variance
    assert squares.max() > 10 * FAR**2  # some are far

    expected = -0.5 * FAR**2 * np.sum(term.share * np.log(1 + squares / FAR**2))

    found = term.fit({CURVE: edges}, {OWN: own}).log_likelihood()
    assert found == pytest.approx(expected, rel=1e-9)


def test_a_wild_block_pulls_less_than_one_that_is_off() -> None:
    blocks = few_levels()
    term = term_of(blocks).first_look(*truth_of())
    assert term.variance is not None
    block = int(np.abs(blocks.level - 16).argmin())
    shown = blocks.level[block] - term.model.shown(*truth_values()).residual[block]

    def pull(deviations: float) -> float:
        """Of the block on the gain of its shot, all others as they are."""
        level = blocks.level.copy()
        level[block] = shown + deviations * np.sqrt(variance[block])
        off = replace(term, model=RawModel(replace(blocks, level=level)))
        return float(off.fit(*truth_of()).expand().gradient[31 + blocks.shot[block]])

    variance = term.variance
    pulls = {each: pull(each) - pull(0) for each in (-3, 1, 3, 30)}
    assert pulls[3] == pytest.approx(3 / (1 + 9 / FAR**2) * pulls[1] * (1 + 1 / FAR**2))
    assert pulls[30] == pytest.approx(30 / (1 + 900 / FAR**2) * pulls[1] * (1 + 1 / FAR**2))
    assert pulls[-3] == pytest.approx(-pulls[3])
    assert pulls[30] < 0.3 * pulls[3]


def test_scatter_is_measured_by_greys_as_the_curve_shows_them() -> None:
    blocks = blocks_of(named_curve("srgb"), scatter=0.03)
    irradiance = named_curve("srgb").inverse(blocks.level / 255)
    strange = irradiance * np.exp(0.3 * np.random.default_rng(1).standard_normal(irradiance.size))
    level = np.where(blocks.chroma > 0.1, 255 * named_curve("srgb").response(strange), blocks.level)
    for each in (blocks, replace(blocks, level=level)):
        assert term_of(each).first_look(*truth_of(256)).scatter == pytest.approx(0.03, rel=0.15)


def test_blocks_of_one_level_count_as_three_at_most() -> None:
    blocks = few_levels(3000)
    share = term_of(blocks).first_look(*truth_of()).share
    assert share is not None
    per_level = np.bincount(np.rint(blocks.level).astype(int), share)

    assert per_level.max() == pytest.approx(3)
    assert share.max() <= 1


def test_looks_lower_the_scatter_and_come_to_an_end() -> None:
    _, edges, own = somewhere()
    far = {CURVE: edges}, {OWN: own}
    looks = [term_of(few_levels()).first_look(*far)]
    while len(looks) < 20:
        looks.append(looks[-1].informed(*truth_of()))

    assert looks[1].scatter < 0.9 * looks[0].scatter
    assert len({each.scatter for each in looks[1:]}) == 1
    assert looks[-1] is looks[3]
    assert looks[-1].informed(*far) is looks[-1]  # the scatter would rise


def test_in_the_end_what_may_be_black_or_white_tells_nothing() -> None:
    term = term_of(few_levels(3000)).first_look(*truth_of())
    whole = term.share
    looks: list[RawTerm] = []
    while not looks or looks[-1] is not term:
        looks.append(term)
        term = term.informed(*truth_of())
    assert whole is not None
    assert term.share is not None
    assert term.variance is not None

    shown = few_levels(3000).level - term.model.shown(*truth_values()).residual
    reach = 3 * np.sqrt(term.variance)
    near = (shown - reach < 0) | (shown + reach > 31)

    assert 0.01 < near.mean() < 0.5
    np.testing.assert_array_equal(term.share, np.where(near, 0.0, whole))


# What a search finds


@dataclass(frozen=True)
class Found:
    """Where a search of blocks alone ended."""

    mode: ChannelMode
    term: RawTerm

    @property
    def own(self) -> Floats:
        return self.mode.mode.values[OWN]

    @property
    def matrix(self) -> Floats:
        return self.term.model.matrix(self.own)

    @property
    def log_gains(self) -> Floats:
        return self.own[self.term.model.gains]

    @property
    def falloff(self) -> Floats:
        return self.own[self.term.model.falloff]

    @property
    def inverse(self) -> Floats:
        return at_levels(self.mode.edges)

    @property
    def curve(self) -> AbstractCurve:
        return SampledCurve.from_inverse(self.inverse)

    def std(self, space: AbstractCurveSpace) -> Floats:
        covariance = covariance_of(self.mode.mode, self.mode.curve_place)
        pull = space.pull(self.mode.coordinates)
        return deviations_at_levels(pull, covariance, self.inverse.size)


def found_in(blocks: RawBlocks, space: AbstractCurveSpace | None = None) -> Found:
    n_levels = blocks.n_levels
    space = space or free_curve(measured_prior(n_levels))
    result = searched({"R": [RawPairs(blocks)]}, space, measured_prior(n_levels))
    (term,) = result.terms["R"]
    assert isinstance(term, RawTerm)
    return Found(result.found["R"], term)


@pytest.mark.parametrize(
    ("name", "limit"),
    [("srgb", 0.004), ("gamma:0.4", 0.004), ("linear", 0.01), (FILM, 0.01)],
)
def test_everything_comes_back(name: str, limit: float) -> None:
    truth = named_curve(name)
    found = found_in(blocks_of(truth))

    assert found.mode.mode.settled
    assert rmse(found.curve, truth) < limit
    np.testing.assert_allclose(found.matrix, ROW, atol=0.05)
    assert found.matrix.sum() == pytest.approx(1)
    np.testing.assert_allclose(found.log_gains - found.log_gains[0], GAINS - GAINS[0], atol=0.01)
    np.testing.assert_allclose(found.falloff.sum(), FALLOFF.sum(), atol=0.02)
    assert 0.005 <= found.term.scatter < 0.03


@pytest.mark.slow
def test_the_band_holds_the_truth() -> None:
    truth, held = named_curve("srgb"), []
    inverse = truth.inverse(np.arange(256) / 255)
    for seed in range(6):
        found = found_in(blocks_of(truth, seed=seed, scatter=0.02))
        std = found.std(free_curve(measured_prior(256)))
        held.append(np.abs(found.inverse - inverse)[5:250] < 2 * std[5:250])
        assert np.sqrt(np.mean(std**2)) < 0.01
    assert np.mean(held) > 0.9


def test_a_tenth_of_wild_blocks_changes_little() -> None:
    truth = named_curve("srgb")
    found = found_in(blocks_of(truth, wild=0.1))

    assert rmse(found.curve, truth) < 0.006
    np.testing.assert_allclose(found.matrix, ROW, atol=0.1)


def test_scatter_is_that_of_greys() -> None:
    few, many = (
        found_in(blocks_of(named_curve("srgb"), scatter=each)).term.scatter for each in (0.01, 0.1)
    )

    assert few < 0.03
    assert many == pytest.approx(0.1, rel=0.25)


@pytest.mark.slow
@settings(max_examples=5)
@given(scale=st.floats(0.1, 10))
def test_the_unit_of_light_does_not_matter(scale: float) -> None:
    blocks = blocks_of(named_curve("srgb"), n_blocks=500)
    other = replace(blocks, light=scale * blocks.light, light_error=scale * blocks.light_error)
    first, second = found_in(blocks), found_in(other)

    # But for the prior of the gain, a factor of e⁵ wide.
    np.testing.assert_allclose(first.inverse, second.inverse, atol=2e-3)
    np.testing.assert_allclose(second.log_gains - first.log_gains, -np.log(scale), atol=0.02)


def test_without_colours_the_matrix_stays_what_it_is_taken_for() -> None:
    blocks = blocks_of(named_curve("srgb"))
    grey = replace(blocks, light=blocks.light[:, :1].repeat(3, axis=1), chroma=0 * blocks.chroma)

    np.testing.assert_allclose(found_in(grey).matrix, [1, 0, 0], atol=1e-6)


def test_one_level_alone_leaves_the_prior() -> None:
    blocks = blocks_of(named_curve("srgb"))
    near = np.abs(blocks.level - 128) < 1
    few = {name: getattr(blocks, name)[near] for name in ("level", "light", "chroma", "radius")}
    std = found_in(replace(blocks, **few, shot=blocks.shot[near])).std(
        free_curve(measured_prior(256))
    )

    assert np.sqrt(np.mean(std**2)) > 0.05


@pytest.mark.parametrize(("name", "limit"), [("ameegc2-exact", 0.004), ("gumbel3", 0.02)])
def test_members_of_families_come_back(name: str, limit: float) -> None:
    truth = named_curve(FILM)
    space = FamilyCurve(MODELS[name], 256)
    found = found_in(blocks_of(truth), space)

    assert found.mode.mode.settled
    parameters = space.parameters(found.mode.coordinates)
    response = MODELS[name].response(np.linspace(0, 1, 200), parameters)
    error = np.sqrt(np.mean((response - truth.response(np.linspace(0, 1, 200))) ** 2))
    assert error < limit


def test_a_family_that_misses_the_camera_shows_the_levels_of_the_blocks() -> None:
    """Of light that no block has it may say anything, and with it of all up to a factor."""
    truth = named_curve(FILM).inverse(np.arange(256) / 255)
    found = found_in(blocks_of(named_curve(FILM)), FamilyCurve(MODELS["emor2"], 256))

    assert found.mode.mode.settled
    assert found.term.scatter < 0.03
    scale = (found.inverse @ truth) / (found.inverse @ found.inverse)
    assert np.sqrt(np.mean((scale * found.inverse - truth)[5:250] ** 2)) < 0.03


def test_other_numbers_of_levels() -> None:
    truth = named_curve("srgb")
    found = found_in(blocks_of(truth, n_levels=64), FreeCurve(measured_prior(64)))

    assert rmse(found.curve, truth) < 0.006
