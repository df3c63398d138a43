import numpy as np
import pytest

from chartless.errors import ParameterError
from chartless.noise import AffineNoise


def test_variance_is_affine_in_the_irradiance():
    noise = AffineNoise(slope=2e-4, floor=5e-5)

    assert noise.variance([0.0, 0.25, 1.0]) == pytest.approx([5e-5, 1e-4, 2.5e-4])
    assert noise.std(0.25) == pytest.approx(0.01)


def test_8_bit_units_are_levels():
    noise = AffineNoise.from_8bit(slope=0.06, floor=9.0)

    # 3 levels at black; σ² = 0.06 · 100 + 9 levels² at level 100
    assert 255 * noise.std(0.0) == pytest.approx(3.0)
    assert 255**2 * noise.variance(100 / 255) == pytest.approx(15.0)
    assert (noise.slope_8bit, noise.floor_8bit) == pytest.approx((0.06, 9.0))


def test_noise_may_have_no_slope():
    assert AffineNoise(0.0, 1e-5).std([0.0, 1.0]) == pytest.approx([np.sqrt(1e-5)] * 2)


@pytest.mark.parametrize(
    ("slope", "floor"),
    [(-1e-9, 1e-5), (np.nan, 1e-5), (np.inf, 1e-5), (1e-4, 0.0), (1e-4, -1.0), (1e-4, np.nan)],
)
def test_impossible_noise_is_refused(slope: float, floor: float):
    with pytest.raises(ParameterError, match="slope >= 0 and a floor > 0"):
        AffineNoise(slope, floor)


@pytest.mark.parametrize("shape", [(), (0,), (2, 3)])
def test_shapes_are_kept(shape: tuple[int, ...]):
    noise = AffineNoise(1e-4, 1e-5)

    assert noise.variance(np.zeros(shape)).shape == shape
    assert noise.std(np.zeros(shape)).shape == shape
