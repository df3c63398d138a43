"""The warp that noise levels cannot see, by quadrature."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from chartless.inference.ridge import RATIOS
from chartless.inference.stabilised import log_extent, on_even_scale, warped

RATIO = st.floats(np.log(RATIOS[0]), np.log(RATIOS[-1])).map(lambda log: float(np.exp(log)))


def extent(end: float, ratio: float) -> float:
    """T = ∫ dI/σ from 0 to `end`, at v = 1."""
    return float(quad(lambda x: 1 / np.sqrt(1 + ratio * x), 0, end, epsabs=1e-13)[0])


@given(irradiance=st.floats(0, 1), ratio=RATIO, other=RATIO)
def test_the_warp_keeps_the_stabilised_scale(irradiance: float, ratio: float, other: float) -> None:
    moved = float(warped(np.array(irradiance), ratio, other))

    assert 0 <= moved <= 1 + 1e-12
    share = extent(irradiance, ratio) / extent(1, ratio)
    assert extent(moved, other) / extent(1, other) == pytest.approx(share, abs=1e-10)


@given(RATIO)
def test_the_whole_of_the_scale_is_its_integral(ratio: float) -> None:
    assert log_extent(ratio) == pytest.approx(np.log(extent(1, ratio)), abs=1e-9)


@given(ratio=RATIO, other=RATIO, third=RATIO)
def test_warps_keep_the_ends_compose_and_invert(ratio: float, other: float, third: float) -> None:
    grid = np.linspace(0, 1, 101)

    moved = warped(grid, ratio, other)

    assert moved[0] == 0
    assert moved[-1] == pytest.approx(1, abs=1e-12)
    assert np.all(np.diff(moved) > 0)
    np.testing.assert_allclose(warped(moved, other, third), warped(grid, ratio, third), atol=1e-11)
    np.testing.assert_allclose(warped(moved, other, ratio), grid, atol=1e-11)
    np.testing.assert_allclose(warped(grid, ratio, ratio), grid, atol=1e-12)


@given(RATIO, RATIO)
def test_even_places_of_one_ratio_are_those_of_another_warped(ratio: float, other: float) -> None:
    places = on_even_scale(33, ratio)

    assert (places[0], places[-1]) == (0.0, 1.0)
    np.testing.assert_allclose(warped(places, ratio, other), on_even_scale(33, other), atol=1e-12)


def test_even_places_without_photons_are_even() -> None:
    np.testing.assert_allclose(on_even_scale(5, 0.0), [0, 0.25, 0.5, 0.75, 1])
