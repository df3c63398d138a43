"""Pixels around saturated ones: against a plain loop over discs."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless.errors import ParameterError
from chartless.frames.bloom import near_saturated

Truth = npt.NDArray[np.bool_]


def by_hand(saturated: Truth, radius: int) -> Truth:
    near = np.zeros_like(saturated)
    rows, columns = np.indices(saturated.shape)
    for row, column in np.argwhere(saturated):
        near |= (rows - row) ** 2 + (columns - column) ** 2 <= radius**2
    return near


@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.integers(2, 30), st.integers(2, 30)),
    st.sampled_from([0.0, 0.003, 0.05, 1.0]),
    st.floats(0, 1),
)
def test_what_is_near_is_in_a_disc(
    seed: int, shape: tuple[int, int], share: float, size: float
) -> None:
    saturated = np.random.default_rng(seed).uniform(size=shape) < share
    before = saturated.copy()
    radius = int(size * (min(shape) // 2))

    np.testing.assert_array_equal(near_saturated(saturated, radius), by_hand(saturated, radius))
    np.testing.assert_array_equal(saturated, before)


def test_the_largest_radius_takes_no_memory_of_its_own() -> None:
    saturated = np.zeros((1200, 1600), dtype=bool)
    saturated[600, 800] = True

    near = near_saturated(saturated, 600)

    assert near.sum() == pytest.approx(np.pi * 600**2, rel=1e-3)


@pytest.mark.parametrize("radius", [-1, 6, 10**9, 1.5])
def test_a_radius_beyond_half_the_smaller_side_is_refused(radius: int) -> None:
    with pytest.raises(ParameterError, match=r"between 0 and 5 pixels, .* of these 20 × 10, not"):
        near_saturated(np.zeros((10, 20), dtype=bool), radius)
