"""Shifts are found again, and pictures of different things do not match."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from chartless.frames.registration import register
from chartless.types import Floats32


def scene(height: int, width: int, seed: int = 0) -> Floats32:
    white = np.random.default_rng(seed).standard_normal((height, width))
    return gaussian_filter(white, 2).astype(np.float32)


@settings(max_examples=30)
@given(
    down=st.integers(0, 12),
    right=st.integers(0, 9),
    gain=st.floats(0.1, 100),
    offset=st.floats(-5, 5),
)
def test_a_part_is_found_in_the_whole(down: int, right: int, gain: float, offset: float) -> None:
    whole = scene(72, 89)
    part = gain * whole[down : down + 60, right : right + 80] + offset

    found = register(part.astype(np.float32), whole)

    assert (found.down, found.right) == (down, right)
    assert found.correlation > 0.9


@pytest.mark.parametrize("shift", [-4, -1])
def test_a_picture_may_stick_out(shift: int) -> None:
    both = scene(70, 70)

    found = register(both[:64, :64], both[-shift:, -shift:])

    assert (found.down, found.right) == (shift, shift)
    assert found.correlation > 0.95


def test_noise_and_another_response_do_not_hide_a_shift() -> None:
    whole = scene(80, 100) / 3 + 0.5
    part = np.sqrt(whole[5:69, 7:91].clip(0)) + np.random.default_rng(1).normal(0, 0.03, (64, 84))

    found = register(part.astype(np.float32), whole)

    assert (found.down, found.right) == (5, 7)
    assert found.correlation > 0.5


def test_different_scenes_do_not_correlate() -> None:
    assert register(scene(128, 128), scene(136, 130, seed=1)).correlation < 0.3


def test_a_picture_without_detail_has_no_correlation() -> None:
    assert register(np.zeros((20, 20), np.float32), scene(24, 24)).correlation == 0
