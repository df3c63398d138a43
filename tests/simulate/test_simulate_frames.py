import numpy as np
import pytest
from scipy.stats import binomtest, chi2, norm

from chartless.curves import named_curve
from chartless.errors import ParameterError
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames

LINEAR = named_curve("linear")
NOISE = AffineNoise.from_8bit(0.06, 9)


def flat(irradiance: float, shape: tuple[int, int] = (200, 300)) -> np.ndarray:
    return np.full(shape, irradiance)


def test_equal_seeds_give_equal_frames():
    once, again, other = (
        np.array(list(simulate_frames(flat(0.5), LINEAR, NOISE, seed=seed))) for seed in (3, 3, 4)
    )

    assert np.array_equal(once, again)
    assert not np.array_equal(once, other)


def test_a_generator_goes_on_where_it_was():
    rng = np.random.default_rng(3)

    (first,) = simulate_frames(flat(0.5), LINEAR, NOISE, n_frames=1, seed=rng)
    (second,) = simulate_frames(flat(0.5), LINEAR, NOISE, n_frames=1, seed=rng)

    pair = list(simulate_frames(flat(0.5), LINEAR, NOISE, n_frames=2, seed=3))
    assert np.array_equal(first, pair[0])
    assert np.array_equal(second, pair[1])


@pytest.mark.parametrize("n_frames", [0, 1, 5])
def test_as_many_frames_are_made_as_asked_for(n_frames: int):
    frames = list(simulate_frames(flat(0.5, (4, 5)), LINEAR, NOISE, n_frames=n_frames))

    assert len(frames) == n_frames


@pytest.mark.parametrize(("bit_depth", "dtype"), [(8, np.uint8), (16, np.uint16)])
@pytest.mark.parametrize("shape", [(4, 5), (4, 5, 3)])
def test_frames_have_the_type_and_shape_asked_for(bit_depth: int, dtype: type, shape):
    scene = np.full(shape, 0.5, dtype=np.float32)

    (frame,) = simulate_frames(scene, LINEAR, NOISE, n_frames=1, bit_depth=bit_depth)

    assert frame.dtype == dtype
    assert frame.shape == shape


@pytest.mark.parametrize("irradiance", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("bit_depth", [8, 16])
def test_noise_has_the_mean_and_variance_of_its_model(irradiance: float, bit_depth: int):
    top = 2**bit_depth - 1
    (frame,) = simulate_frames(
        flat(irradiance), LINEAR, NOISE, n_frames=1, bit_depth=bit_depth, seed=11
    )
    brightness = frame / top
    rounding = 1 / 12 / top**2
    variance = NOISE.variance(irradiance) + rounding
    n = frame.size

    assert abs(brightness.mean() - irradiance) < 4 * np.sqrt(variance / n)
    low, high = chi2.ppf([1e-5, 1 - 1e-5], n - 1) / (n - 1)
    assert low < brightness.var(ddof=1) / variance < high


def test_noise_is_drawn_anew_for_each_frame():
    first, second = simulate_frames(flat(0.5), LINEAR, NOISE, seed=5, bit_depth=16)

    correlation = np.corrcoef(first.ravel(), second.ravel())[0, 1]
    assert abs(correlation) < 4 / np.sqrt(first.size)


@pytest.mark.parametrize(("irradiance", "end"), [(0.0, 0), (1.0, 255)])
def test_clipped_noise_keeps_half_of_its_pixels_at_the_end(irradiance: float, end: int):
    (frame,) = simulate_frames(flat(irradiance), LINEAR, NOISE, n_frames=1, seed=2)

    # the bin of the end reaches half a level into the range
    share = norm.cdf(0.5 / 255 / NOISE.std(irradiance))
    assert binomtest(int(np.sum(frame == end)), frame.size, share).pvalue > 1e-5


def test_light_beyond_saturation_is_white():
    (frame,) = simulate_frames(flat(2.0), LINEAR, NOISE, n_frames=1)

    assert np.all(frame == 255)


@pytest.mark.parametrize("bit_depth", [8, 16])
@pytest.mark.parametrize("name", ["linear", "srgb", "gamma:0.45", "gamma:2.2"])
def test_without_noise_levels_are_the_rounded_response(name: str, bit_depth: int):
    curve, top = named_curve(name), 2**bit_depth - 1
    scene = np.linspace(0, 1, 5001) ** 3
    silent = AffineNoise(0.0, 1e-30)

    (frame,) = simulate_frames(scene, curve, silent, n_frames=1, bit_depth=bit_depth)

    exact = top * curve.response(scene)
    assert np.abs(frame - exact).max() <= 0.51
    assert np.mean(frame == np.rint(exact)) > 0.99


@pytest.mark.parametrize("bit_depth", [0, 7, 17, 32])
def test_other_bit_depths_are_refused(bit_depth: int):
    with pytest.raises(ParameterError, match=f"not {bit_depth}"):
        next(simulate_frames(flat(0.5), LINEAR, NOISE, bit_depth=bit_depth))


@pytest.mark.parametrize("scene", [[], [0.5, -1e-9], [0.5, np.nan], [np.inf]], ids=str)
def test_impossible_scenes_are_refused(scene: list[float]):
    with pytest.raises(ParameterError, match="finite and not negative"):
        next(simulate_frames(np.array(scene), LINEAR, NOISE))
