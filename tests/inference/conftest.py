import pytest
from gamma_camera import SPACES, USUAL_RATIO, expected_counts, mode_at, ridge_of, space_of

from chartless.curves.space import AbstractCurveSpace
from chartless.evidence.noise.likelihood import PairCounts
from chartless.evidence.noise.term import ridge_share
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import Posterior, integrated


@pytest.fixture(scope="module", params=SPACES)
def space(request: pytest.FixtureRequest) -> AbstractCurveSpace:
    return space_of(request.param)


@pytest.fixture(scope="module")
def counts() -> PairCounts:
    return expected_counts()


@pytest.fixture(scope="module")
def found(space: AbstractCurveSpace, counts: PairCounts) -> ChannelMode:
    return mode_at(counts, space, USUAL_RATIO)


@pytest.fixture(scope="module")
def modes(space: AbstractCurveSpace, counts: PairCounts, found: ChannelMode) -> list[ChannelMode]:
    return ridge_of(counts, space, found.mode.values)


@pytest.fixture(scope="module")
def posterior(space: AbstractCurveSpace, counts: PairCounts, modes: list[ChannelMode]) -> Posterior:
    return integrated(modes, space, ridge_share(counts, space))
