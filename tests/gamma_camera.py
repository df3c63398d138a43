"""A camera of 32 levels, a gamma of 0.45 and noise of one to three levels, and searches for it.

Counts are what it is expected to give. The density that is maximised is written anew here, from its
description.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from chartless.curves.populations import measured_prior
from chartless.curves.prior import bin_edges
from chartless.curves.space import AbstractCurveSpace, FamilyCurve, free_curve
from chartless.evidence.noise.likelihood import SCENE_STEP, PairCounts, PairModel, Scene
from chartless.evidence.noise.term import PairTerm, ridge_share, scene_name
from chartless.inference.block import Values, curve_name
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.noise_block import NoiseBlock, affine, noise_name
from chartless.inference.posterior import Posterior
from chartless.inference.ridge import at_ratio, ridge
from chartless.inference.search import maximise
from chartless.inference.stabilised import on_even_scale
from chartless.models import MODELS
from chartless.noise import CAMERAS_OF_2008, TYPICAL_8BIT, TYPICAL_SPREAD, AffineNoise
from chartless.types import Floats

LEVELS, NODES = 32, 128
NOISE = AffineNoise(5e-4, 1e-3)
USUAL_RATIO = CAMERAS_OF_2008.centre.ratio
EDGES = bin_edges(LEVELS)[1:-1] ** (1 / 0.45)
SPACES = ["any", "ameegc2-exact", "gamma"]
CURVE, OF_NOISE, SCENE = curve_name("Y"), noise_name("Y"), scene_name("Y")


def camera(n_nodes: int = NODES) -> PairModel:
    nodes = on_even_scale(n_nodes, NOISE.ratio)
    return PairModel(EDGES, NOISE, Scene(nodes, -1.5 * nodes))


def expected_counts(n_pairs: float = 1e5, *, n_dark: float = 0, weight: float = 0.2) -> PairCounts:
    model = camera()
    return PairCounts(2 * n_pairs * model.pairs, n_dark * model.dark, weight)


def space_of(name: str) -> AbstractCurveSpace:
    return (
        free_curve(measured_prior(LEVELS)) if name == "any" else FamilyCurve(MODELS[name], LEVELS)
    )


def start_of(space: AbstractCurveSpace, ratio: float = USUAL_RATIO, n_nodes: int = NODES) -> Values:
    """The mean camera before an even scene: nothing of the counts."""
    return {
        CURVE: space.mean.copy(),
        OF_NOISE: at_ratio(ratio, float(np.log(2e-3))),
        SCENE: np.zeros(n_nodes),
    }


def term_of(counts: PairCounts, n_nodes: int = NODES) -> PairTerm:
    return PairTerm(counts, n_nodes, NoiseBlock("Y", CAMERAS_OF_2008, holds_ratio=True))


def mode_from(
    counts: PairCounts, space: AbstractCurveSpace, start: Values, n_nodes: int = NODES
) -> ChannelMode:
    return ChannelMode(maximise([term_of(counts, n_nodes)], {CURVE: space}, start), "Y")


def mode_at(
    counts: PairCounts, space: AbstractCurveSpace, ratio: float, n_nodes: int = NODES
) -> ChannelMode:
    return mode_from(counts, space, start_of(space, ratio, n_nodes), n_nodes)


def ridge_of(
    counts: PairCounts,
    space: AbstractCurveSpace,
    start: Values,
    on_mode: Callable[[int], None] | None = None,
) -> list[ChannelMode]:
    share = ridge_share(counts, space)
    return ridge([term_of(counts)], "Y", space, start, share, on_mode=on_mode)


def more_evident(found: ChannelMode, nats: float) -> ChannelMode:
    """A mode whose evidence is so much higher."""
    mode = replace(found.mode, log_evidence=found.mode.log_evidence + nats)
    return replace(found, mode=mode)


def scene_of(values: Values) -> Scene:
    log_weights = values[SCENE]
    return Scene(on_even_scale(log_weights.size, affine(values[OF_NOISE]).ratio), log_weights)


def unknowns(values: Values) -> Floats:
    """In the order of the factor of a mode; ln u and ln v are one as they move together."""
    return np.concatenate([values[CURVE], values[OF_NOISE][1:], values[SCENE]])


def log_posterior(
    counts: PairCounts, space: AbstractCurveSpace, ratio: float, numbers: Floats
) -> float:
    """Log-likelihood and priors of coordinates, noise and scene, up to a constant."""
    size = space.mean.size
    coordinates, log_floor, log_weights = numbers[:size], numbers[size], numbers[size + 1 :]
    floor = float(np.exp(log_floor))
    scene = Scene(on_even_scale(log_weights.size, ratio), log_weights)
    model = PairModel(space.edges(coordinates), AffineNoise(ratio * floor, floor), scene)
    away = coordinates - space.mean
    typical = np.log(TYPICAL_8BIT) - np.log([255, 255**2])
    away_noise = np.array([np.log(ratio) + log_floor, log_floor]) - typical
    step = SCENE_STEP * np.sqrt(128 / log_weights.size)
    rough = np.sum(np.diff(log_weights) ** 2) / step**2 + 1e-3 * np.sum(log_weights**2)
    squares = away @ space.precision @ away + rough + np.sum((away_noise / TYPICAL_SPREAD) ** 2)
    return model.log_likelihood(counts) - 0.5 * float(squares)


def noise_known(posterior: Posterior) -> tuple[Floats, Floats]:
    """Mean and covariance of (ln u, ln v)."""
    assert posterior.log_noise is not None
    assert posterior.log_noise_covariance is not None
    return posterior.log_noise, posterior.log_noise_covariance
