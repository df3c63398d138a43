"""Curve, matrix, gains and falloff come back from blocks; derivatives are those of differences."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import approx_fprime

from chartless.curves import AbstractCurve, SampledCurve, named_curve
from chartless.curves.prior import measured_prior
from chartless.curves.space import FamilyCurve, FreeCurve, free_curve
from chartless.evidence.raw.fit import RawFit, _Model, raw_fit
from chartless.evidence.raw.gather import RawBlocks
from chartless.inference.posterior import at_levels, deviations_at_levels
from chartless.models import MODELS
from chartless.result.response import rmse
from chartless.types import Floats

FILM = "ameegc2-exact:0.48,-2.26,0.37"
ROW = np.array([1.6, -0.5, -0.1])
GAINS = np.array([0.2, 0.15, 0.3])
FALLOFF = np.array([0.3, -0.1])


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


def curve_of(fit: RawFit, n_levels: int = 256) -> AbstractCurve:
    return SampledCurve.from_inverse(at_levels(free_curve(n_levels).edges(fit.coordinates)))


@pytest.mark.parametrize(
    ("name", "limit"),
    [("srgb", 0.004), ("gamma:0.4", 0.004), ("linear", 0.01), (FILM, 0.01)],
)
def test_everything_comes_back(name: str, limit: float) -> None:
    truth = named_curve(name)
    fit = raw_fit(blocks_of(truth), free_curve(256))

    assert fit.settled
    assert rmse(curve_of(fit), truth) < limit
    np.testing.assert_allclose(fit.matrix, ROW, atol=0.05)
    assert fit.matrix.sum() == pytest.approx(1)
    np.testing.assert_allclose(fit.log_gains - fit.log_gains[0], GAINS - GAINS[0], atol=0.01)
    np.testing.assert_allclose(fit.falloff.sum(), FALLOFF.sum(), atol=0.02)
    assert 0.005 <= fit.scatter < 0.03


def test_the_band_holds_the_truth() -> None:
    truth, held = named_curve("srgb"), []
    inverse = truth.inverse(np.arange(256) / 255)
    for seed in range(6):
        fit = raw_fit(blocks_of(truth, seed=seed, scatter=0.02), free_curve(256))
        pull = free_curve(256).pull(fit.coordinates)
        std = deviations_at_levels(pull, fit.covariance, 256)
        found = at_levels(free_curve(256).edges(fit.coordinates))
        held.append(np.abs(found - inverse)[5:250] < 2 * std[5:250])
        assert np.sqrt(np.mean(std**2)) < 0.01
    assert np.mean(held) > 0.9


def test_a_tenth_of_wild_blocks_changes_little() -> None:
    truth = named_curve("srgb")
    fit = raw_fit(blocks_of(truth, wild=0.1), free_curve(256))

    assert rmse(curve_of(fit), truth) < 0.006
    np.testing.assert_allclose(fit.matrix, ROW, atol=0.1)


def test_scatter_is_that_of_greys() -> None:
    few, many = (
        raw_fit(blocks_of(named_curve("srgb"), scatter=each), free_curve(256)).scatter
        for each in (0.01, 0.1)
    )

    assert few < 0.03
    assert many == pytest.approx(0.1, rel=0.25)


@pytest.mark.slow
@settings(max_examples=5)
@given(scale=st.floats(0.1, 10))
def test_the_unit_of_light_does_not_matter(scale: float) -> None:
    blocks = blocks_of(named_curve("srgb"), n_blocks=500)
    other = replace(blocks, light=scale * blocks.light, light_error=scale * blocks.light_error)
    first, second = (raw_fit(each, free_curve(256)) for each in (blocks, other))

    # But for the prior of the gain, a factor of e⁵ wide.
    np.testing.assert_allclose(
        at_levels(free_curve(256).edges(first.coordinates)),
        at_levels(free_curve(256).edges(second.coordinates)),
        atol=2e-3,
    )
    np.testing.assert_allclose(second.log_gains - first.log_gains, -np.log(scale), atol=0.02)


def test_without_colours_the_matrix_stays_what_it_is_taken_for() -> None:
    blocks = blocks_of(named_curve("srgb"))
    grey = replace(blocks, light=blocks.light[:, :1].repeat(3, axis=1), chroma=0 * blocks.chroma)
    fit = raw_fit(grey, free_curve(256))

    np.testing.assert_allclose(fit.matrix, [1, 0, 0], atol=1e-6)


def test_one_level_alone_leaves_the_prior() -> None:
    blocks = blocks_of(named_curve("srgb"))
    near = np.abs(blocks.level - 128) < 1
    few = {name: getattr(blocks, name)[near] for name in ("level", "light", "chroma", "radius")}
    fit = raw_fit(replace(blocks, **few, shot=blocks.shot[near]), free_curve(256))
    std = deviations_at_levels(free_curve(256).pull(fit.coordinates), fit.covariance, 256)

    assert np.sqrt(np.mean(std**2)) > 0.05


@pytest.mark.parametrize("name", ["ameegc2-exact", "gumbel3", "emor2"])
def test_members_of_families_come_back(name: str) -> None:
    truth = named_curve(FILM)
    space = FamilyCurve(MODELS[name], 256)
    fit = raw_fit(blocks_of(truth), space)

    assert fit.settled
    response = MODELS[name].response(np.linspace(0, 1, 200), space.parameters(fit.coordinates))
    error = np.sqrt(np.mean((response - truth.response(np.linspace(0, 1, 200))) ** 2))
    assert error < (0.004 if name == "ameegc2-exact" else 0.05)


def test_other_numbers_of_levels() -> None:
    truth = named_curve("srgb")
    fit = raw_fit(blocks_of(truth, n_levels=64), FreeCurve(measured_prior(64)))

    assert rmse(curve_of(fit, 64), truth) < 0.006


def test_the_gradient_is_that_of_differences() -> None:
    model = _Model(blocks_of(named_curve("srgb"), n_blocks=300, n_levels=32))
    rng = np.random.default_rng(3)
    edges = np.cumsum(rng.uniform(0.5, 1.5, 31))
    edges /= edges[-1] + 1
    own = model.start(edges) + rng.normal(0, 0.02, model.n_own)
    variance = model.variance(model.shown(edges, own), 0.05)

    def cost(x: Floats) -> Any:
        return model.cost(model.shown(x[: edges.size], x[edges.size :]), variance, model.share)

    now = model.shown(edges, own)
    by_edges, by_own, information = model.normal(now, variance, model.share)
    found = np.concatenate([by_edges, by_own])
    expected = approx_fprime(np.concatenate([edges, own]), cost, 1e-8)
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())
    np.testing.assert_allclose(information, information.T, rtol=1e-12, atol=1e-9)
    assert np.linalg.eigvalsh(information).min() > -1e-6 * np.abs(information).max()
