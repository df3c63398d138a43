"""Modes along the ratio of the noise parameters."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from gamma_camera import (
    CURVE,
    LEVELS,
    NOISE,
    OF_NOISE,
    USUAL_RATIO,
    expected_counts,
    mode_at,
    ridge_of,
    scene_of,
    space_of,
    start_of,
)

from chartless.curves.populations import measured_prior
from chartless.curves.space import AbstractCurveSpace, free_curve
from chartless.evidence.noise.likelihood import PairCounts, PairModel
from chartless.evidence.noise.term import ridge_share
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.noise_block import affine
from chartless.inference.ridge import RATIOS, belief, predicted
from chartless.noise import AffineNoise
from chartless.types import Floats


@pytest.mark.parametrize("ratio", [0.05, 5.0])
def test_the_state_predicted_at_another_ratio_shows_the_same_noise(ratio: float) -> None:
    space, counts = free_curve(measured_prior(LEVELS)), expected_counts()
    found = mode_at(counts, space, USUAL_RATIO)

    state = predicted(space, found, ratio)

    def seen(edges: Floats, noise: AffineNoise) -> Floats:
        """Deviation in levels where a level lies."""
        return noise.std((edges[1:] + edges[:-1]) / 2) / np.diff(edges)

    edges, noise = space.edges(state[CURVE]), affine(state[OF_NOISE])
    assert noise.ratio == pytest.approx(ratio)
    here = seen(found.edges, found.noise)
    np.testing.assert_allclose(seen(edges, noise), here, rtol=0.01)
    before = PairModel(found.edges, found.noise, scene_of(found.mode.values))
    after = PairModel(edges, noise, scene_of(state))
    # As many pixels at each level as before, and nearly the same pairs.
    assert np.abs(after.pairs - before.pairs).sum() < 0.02
    np.testing.assert_allclose(after.pairs.sum(axis=1), before.pairs.sum(axis=1), atol=4e-3)


def test_modes_follow_each_other_along_the_ridge(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[ChannelMode]
) -> None:
    ratios = [found.ratio for found in modes]

    assert all(a < b for a, b in pairwise(ratios))
    assert any(ratio == pytest.approx(USUAL_RATIO) for ratio in ratios)
    assert len(modes) >= 3
    assert all(np.isfinite([found.mode.log_evidence, found.known]).all() for found in modes)
    assert all(found.mode.settled for found in modes)
    # The walk went past the best both ways.
    share = ridge_share(counts, space)
    heard = [share * (found.mode.log_evidence - found.known) + found.known for found in modes]
    assert heard == pytest.approx([found.weighted(share) for found in modes])
    assert 0 < int(np.argmax(heard)) < len(modes) - 1


@pytest.mark.slow
def test_modes_of_the_ridge_do_not_depend_on_the_way_to_them(
    space: AbstractCurveSpace, counts: PairCounts, modes: list[ChannelMode]
) -> None:
    for found in modes:
        direct = mode_at(counts, space, found.ratio)

        assert direct.mode.log_evidence == pytest.approx(found.mode.log_evidence, abs=0.1)
        np.testing.assert_allclose(direct.edges, found.edges, atol=2e-3)


def test_the_number_of_modes_is_told() -> None:
    told: list[int] = []
    space = space_of("gamma")

    ridge_of(expected_counts(), space, start_of(space), on_mode=told.append)

    assert told == list(range(2, len(told) + 2))
    assert told[-1] <= len(RATIOS)


def test_a_narrow_ridge_gets_modes_where_its_evidence_is() -> None:
    space = space_of("gamma")

    modes = ridge_of(expected_counts(n_dark=2e6), space, start_of(space))

    # The evidence for the true ratio, 0.5, is narrower than the steps of `RATIOS`.
    logs = np.array([found.mode.log_evidence for found in modes])
    likely = [found.ratio for found in modes if found.mode.log_evidence > logs.max() - 2]
    assert len(likely) >= 2
    assert any(min(abs(np.log(RATIOS) - np.log(ratio))) > 0.01 for ratio in likely)
    assert likely == pytest.approx([NOISE.slope / NOISE.floor] * len(likely), rel=0.2)


@pytest.mark.parametrize(("deviations", "believed"), [(0.0, 1.0), (1.0, 1.0), (4.0, 1 / 16)])
def test_curves_that_the_prior_does_not_know_are_believed_less(
    deviations: float, believed: float, counts: PairCounts
) -> None:
    """So many deviations away in each direction."""
    space = free_curve(measured_prior(LEVELS))
    found = mode_at(counts, space, USUAL_RATIO)
    root = np.linalg.cholesky(np.linalg.inv(space.precision))
    coordinates = space.mean + root @ np.full(space.mean.size, deviations)
    values = {**found.mode.values, CURVE: coordinates}
    there = replace(found, mode=replace(found.mode, values=values))

    assert belief(there, space) == pytest.approx(believed)
