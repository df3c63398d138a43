"""Movers are left out of a table, noise is left alone."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from skimage.data import camera
from slow_cases import slow_but

from chartless import CALIBRATORS, AffineNoise, Cooccurrence, named_curve
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.outliers import outlying, without_outliers
from chartless.flags import Flag
from chartless.simulate import simulate_frames

Levels = npt.NDArray[Any]
NOISE = AffineNoise.from_8bit(0.02, 6)


def soft(shape: tuple[int, int] = (300, 400)) -> Levels:
    """Blobs, every irradiance equally frequent."""
    blobs = gaussian_filter(np.random.default_rng(1).standard_normal(shape), 6, mode="wrap")
    return blobs.ravel().argsort().argsort().reshape(shape) / blobs.size


SCENES = {
    "photograph": 0.9 * named_curve("srgb").inverse(camera() / 255),
    "soft": soft(),
    "clipped at both ends": (3 * soft() - 1).clip(0, 2),
    "two tones": np.where(soft() > 0.5, 0.8, 0.1),
}


def pair_of(
    first: Levels, second: Levels, response: str = "srgb", noise: AffineNoise = NOISE
) -> tuple[Levels, Levels]:
    one, other = (
        next(simulate_frames(scene, named_curve(response), noise, n_frames=1, seed=seed))
        for seed, scene in ((11, first), (12, second))
    )
    return one, other


def root_mean_square(table: Cooccurrence) -> float:
    earlier, later = np.nonzero(table.counts)
    squares = table.counts[earlier, later] @ (earlier - later) ** 2.0
    return float(np.sqrt(squares / table.n_pairs))


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("response", ["srgb", "linear", "gamma:0.35"])
@pytest.mark.parametrize(("slope", "floor"), [(0.0, 0.05), (0.01, 9), (0.06, 25)])
def test_noise_is_left_alone(scene: str, response: str, slope: float, floor: float) -> None:
    noise = AffineNoise.from_8bit(slope, floor)
    table = Cooccurrence.of_pair(*pair_of(SCENES[scene], SCENES[scene], response, noise))

    cleaned = without_outliers(table)

    assert cleaned.fraction == 0
    assert np.array_equal(cleaned.table.counts, table.counts)
    assert cleaned.table.counts.dtype == table.counts.dtype


@pytest.mark.parametrize(("shape", "n_levels"), [((40, 50), 256), ((40, 50), 16), ((300, 400), 16)])
def test_few_pixels_and_few_levels_are_left_alone(shape: tuple[int, int], n_levels: int) -> None:
    scene = np.linspace(0, 1, shape[0] * shape[1]).reshape(shape)
    for frames in (pair_of(scene, scene), pair_of(scene, scene, noise=AffineNoise(0.01, 0.01))):
        reduced = [np.rint(frame / 255 * (n_levels - 1)).astype(np.uint8) for frame in frames]

        assert without_outliers(Cooccurrence.of_pair(*reduced, n_levels=n_levels)).fraction == 0


@pytest.mark.parametrize("deviation", [0.02, 0.3, 1.0, 3.0])
def test_six_bits_in_eight_are_left_alone(deviation: float) -> None:
    """Neighbouring levels are four apart."""
    ramp = np.linspace(0, 255, 200_000)
    frames = [
        4 * np.rint((ramp + rng.normal(0, deviation, ramp.size)) / 4).clip(0, 63).astype(np.uint8)
        for rng in map(np.random.default_rng, (1, 2))
    ]

    assert without_outliers(Cooccurrence.of_pair(*frames)).fraction == 0


@pytest.mark.parametrize("share", [0.001, 0.1, 0.4])
def test_movers_are_left_out(share: float) -> None:
    still = SCENES["two tones"]
    moved = still.copy()
    moved[:, : max(1, int(share * 400))] = 0.9 - moved[:, : max(1, int(share * 400))]
    table = Cooccurrence.of_pair(*pair_of(still, moved))
    clean = Cooccurrence.of_pair(*pair_of(still, still))

    cleaned = without_outliers(table)

    assert cleaned.fraction == pytest.approx(max(1, int(share * 400)) / 400, rel=0.02)
    assert cleaned.table.n_pairs == pytest.approx((1 - cleaned.fraction) * table.n_pairs)
    assert root_mean_square(table) > 1.5 * root_mean_square(clean)
    assert root_mean_square(cleaned.table) == pytest.approx(root_mean_square(clean), rel=0.03)


def test_movers_alone_at_a_sum_of_levels_are_found() -> None:
    """Levels 40 and 200 become each other; no pixel of the scene is near their mean."""
    rng = np.random.default_rng(3)
    tone = np.where(rng.uniform(size=(200, 200)) < 0.5, 40.0, 200.0)
    other = tone.copy()
    other[:40] = 240 - other[:40]
    frames = [np.rint(x + rng.normal(0, 3, tone.shape)).astype(np.uint8) for x in (tone, other)]

    assert without_outliers(Cooccurrence.of_pair(*frames)).fraction == pytest.approx(0.2, abs=1e-9)


@given(seed=st.integers(0, 99), n_levels=st.integers(2, 40), filled=st.floats(0, 1))
def test_any_table_keeps_what_is_near(seed: int, n_levels: int, filled: float) -> None:
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 50, (n_levels, n_levels)) * (
        rng.uniform(size=(n_levels,) * 2) < filled
    )
    table = Cooccurrence(counts)

    far = outlying(table)
    cleaned = without_outliers(table)

    assert np.array_equal(far, far.T)
    assert not far[np.abs(np.subtract.outer(*[np.arange(n_levels)] * 2)) <= 2].any()
    assert 0 <= cleaned.fraction <= 1
    assert np.array_equal(cleaned.table.counts, np.where(far, 0, counts))


@pytest.mark.parametrize("table", [Cooccurrence.zeros(), Cooccurrence(np.diag(np.arange(256)))])
def test_tables_without_differences_have_no_outliers(table: Cooccurrence) -> None:
    assert without_outliers(table).fraction == 0


@pytest.mark.parametrize("method", slow_but(["likelihood", "nlf"], "nlf"))
def test_estimates_are_spared_the_movers(method: str) -> None:
    still = SCENES["two tones"] * 0.5 + 0.5 * soft()
    moved = still.copy()
    moved[:, :40] = np.where(moved[:, :40] > 0.45, 0.05, 0.9)
    clean, disturbed = (Cooccurrence.of_pair(*pair_of(still, second)) for second in (still, moved))
    calibrator = CALIBRATORS[method]()

    reference, found = (
        calibrator.calibrate(LevelPairs(clean)),
        calibrator.calibrate(LevelPairs(disturbed)),
    )

    assert reference.account("noise")["outliers"] == 0
    assert Flag.MOVERS not in reference.flags
    assert found.account("noise")["outliers"] == pytest.approx(0.1, abs=0.01)
    assert Flag.MOVERS in found.flags
    assert np.abs(found.response_lut - reference.response_lut).max() < 0.03
