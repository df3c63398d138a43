"""Kinds of misfit: faults of a camera, planted one by one, and told apart."""

import io
from functools import cache

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter, median_filter
from slow_cases import slow_but

from chartless.curves import named_curve
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence, difference_moments
from chartless.evidence.noise.misfit import Pattern, _kurtosis, is_gaussian, misfit_pattern
from chartless.flags import Flag
from chartless.methods import CALIBRATORS, LikelihoodSearch
from chartless.models import MODELS
from chartless.noise import AffineNoise
from chartless.result.response import Response
from chartless.simulate import simulate_frames
from chartless.types import Floats, Levels

CURVE, NOISE = named_curve("srgb"), AffineNoise.from_8bit(0.03, 16)


@cache
def scene() -> Floats:
    """Smooth random light, as much of one irradiance as of another."""
    white = np.random.default_rng(7).standard_normal((700, 1000))
    smooth = gaussian_filter(white, 8, mode="wrap")
    return np.asarray(smooth.ravel().argsort().argsort().reshape(smooth.shape) / smooth.size)


def good() -> list[Levels]:
    return list(simulate_frames(scene(), CURVE, NOISE, seed=3))


def with_noise(draw: str) -> list[Levels]:
    """Noise of unit variance and another distribution, in place of the normal one."""
    rng = np.random.default_rng(3)
    draws = {
        "uniform": lambda: rng.uniform(-np.sqrt(3), np.sqrt(3), scene().shape),
        "laplace": lambda: rng.laplace(scale=np.sqrt(0.5), size=scene().shape),
    }
    light = [np.clip(scene() + NOISE.std(scene()) * draws[draw](), 0, 1) for _ in range(2)]
    return [np.rint(255 * CURVE.response(each)).astype(np.uint8) for each in light]


def compressed(frame: Levels, quality: int) -> Levels:
    file = io.BytesIO()
    Image.fromarray(frame).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def with_movers(share: float) -> list[Levels]:
    first, second = good()
    (elsewhere,) = simulate_frames(np.roll(scene(), (37, 53), (0, 1)), CURVE, NOISE, n_frames=1)
    moved = np.random.default_rng(5).random(first.shape) < share
    return [first, np.where(moved, elsewhere, second)]


def relabelled(table: Floats) -> list[Levels]:
    return [np.rint(table).clip(0, 255).astype(np.uint8)[frame] for frame in good()]


LEVEL = np.arange(256.0)
FAULTS = {
    "uniform": (lambda: with_noise("uniform"), Pattern.FLAT_TOPPED),
    "laplace": (lambda: with_noise("laplace"), Pattern.PEAKED),
    "jpeg": (lambda: [compressed(frame, 60) for frame in good()], Pattern.PEAKED),
    "median": (lambda: [median_filter(frame, 3) for frame in good()], Pattern.PEAKED),
    "few movers": (lambda: with_movers(0.01), Pattern.FAR_TAILS),
    "many movers": (lambda: with_movers(0.1), Pattern.FAR_TAILS),
    "six bits": (lambda: relabelled(4 * (LEVEL // 4)), Pattern.LEVEL_WISE),
    "stretched": (lambda: relabelled(1.25 * LEVEL), Pattern.LEVEL_WISE),
    "tone-mapped": (lambda: relabelled(LEVEL + 6 * np.sin(LEVEL / 10)), Pattern.LEVEL_WISE),
}


def found_in(frames: list[Levels], model: str | None = None) -> Response:
    family = None if model is None else MODELS[model]
    return LikelihoodSearch(model=family).calibrate(LevelPairs(Cooccurrence.of_pair(*frames)))


@pytest.mark.slow
@pytest.mark.parametrize("fault", slow_but(FAULTS, "laplace", "jpeg"))
def test_a_fault_has_its_pattern(fault: str) -> None:
    make, pattern = FAULTS[fault]

    found = found_in(make())

    account = found.account("noise")
    if Flag.NOISE_DISCOUNTED in found.flags:  # of which a fit would say nothing
        assert fault in {"six bits", "stretched", "tone-mapped"}
        assert "pattern" not in account
        return
    assert Flag.MISFIT in found.flags
    assert account["pattern"] == pattern.code
    assert account.details["misfit"] == f"the pattern is {pattern.code}: {pattern.advice}"


def test_a_good_camera_has_none() -> None:
    found = found_in(good())

    assert "pattern" not in found.account("noise")
    assert "misfit" not in found.account("noise").details
    assert found.flags == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    slow_but(
        ["none", *(name for name, (_, kind) in FAULTS.items() if kind != Pattern.LEVEL_WISE)],
        *("none", "median", "laplace"),
    ),
)
def test_the_noise_level_alone_notices_what_is_not_gaussian(fault: str) -> None:
    frames = good() if fault == "none" else FAULTS[fault][0]()

    found = CALIBRATORS["nlf"]().calibrate(LevelPairs(Cooccurrence.of_pair(*frames)))

    assert (Flag.MISFIT in found.flags) == (fault != "none")


@pytest.mark.slow
def test_a_family_too_stiff_is_wrong_about_the_noise_of_levels() -> None:
    light = 1 / (1 + (0.18 / (scene() + 1e-3)) ** 1.6)  # as film: seen through a linear camera
    rng = np.random.default_rng(4)
    frames = []
    for _ in range(2):
        seen = scene() + NOISE.std(scene()) * rng.standard_normal(scene().shape)
        film = 1 / (1 + (0.18 / (seen.clip(0, 1) + 1e-3)) ** 1.6)
        frames.append(np.rint(255 * film / light.max()).clip(0, 255).astype(np.uint8))

    found = found_in(frames, "ameegc1")

    assert Flag.MISFIT in found.flags
    assert found.account("noise")["pattern"] == Pattern.NOISE_LEVEL.code


# By the numbers


def pairs_of(density: Floats) -> Floats:
    """A million pairs whose differences, far from black and white, are distributed so."""
    level = np.arange(256)
    share = np.where(np.abs(level[:, np.newaxis] + level - 255) < 60, 1.0, 0.0)
    pairs = share * density[np.abs(level[:, np.newaxis] - level)]
    return np.asarray(1e6 * pairs / pairs.sum() + 1e-9)


DISTANCE = np.arange(256.0)
# Differences of two draws of deviation 8 each.
NORMAL = np.exp(-(DISTANCE**2) / (4 * 64))
TRIANGULAR = np.maximum(0, 2 * 8 * np.sqrt(3) - DISTANCE)
LAPLACE = (1 + DISTANCE / (8 / np.sqrt(2))) * np.exp(-DISTANCE / (8 / np.sqrt(2)))
MOVERS = NORMAL + 2e-4 * np.exp(-(DISTANCE**2) / (4 * 40**2))


def test_gaussian_is_what_has_the_kurtosis_of_the_model() -> None:
    normal = pairs_of(NORMAL)

    assert is_gaussian(normal, 3 * normal)
    # A scene of another histogram makes no difference.
    assert is_gaussian(
        normal * np.linspace(1, 5, 256) * np.linspace(1, 5, 256)[:, np.newaxis], normal
    )
    assert not is_gaussian(pairs_of(TRIANGULAR), normal)
    assert not is_gaussian(pairs_of(LAPLACE), normal)
    assert not is_gaussian(pairs_of(MOVERS), normal)
    # A hundred pixels prove nothing.
    assert is_gaussian(pairs_of(LAPLACE) * 1e-4, normal)


@pytest.mark.parametrize(
    ("density", "kurtosis"),
    [(NORMAL, 3.0), (TRIANGULAR, 2.4), (LAPLACE, 4.5)],
    ids=["normal", "uniform", "laplace"],
)
def test_kurtosis_is_that_of_the_distribution(density: Floats, kurtosis: float) -> None:
    """The excess of a difference of two draws is half of theirs: 0, −1.2 and 3."""
    pairs = pairs_of(density)
    pixels = difference_moments(pairs).pairs

    measured, far = _kurtosis(pairs, np.where(pixels > 100, pixels, 0))

    assert measured == pytest.approx(kurtosis, abs=0.04)
    assert 0 <= far < measured


def test_the_far_part_is_that_beyond_four_and_a_half_deviations() -> None:
    """E z⁴ beyond a is 2 (a³ + 3a) φ(a) + 6 Φ(−a), 0.0034 at 4.5."""
    pairs = pairs_of(NORMAL)
    pixels = difference_moments(pairs).pairs

    far = _kurtosis(pairs, np.where(pixels > 100, pixels, 0))[1]

    assert far == pytest.approx(0.0034, abs=0.0005)


@pytest.mark.parametrize(
    ("density", "pattern"),
    [
        (TRIANGULAR, Pattern.FLAT_TOPPED),
        (LAPLACE, Pattern.PEAKED),
        (MOVERS, Pattern.FAR_TAILS),
        (np.exp(-(DISTANCE**2) / (4 * 100)), Pattern.NOISE_LEVEL),
    ],
    ids=["uniform", "laplace", "movers", "stronger"],
)
def test_distributions_against_a_normal_one(density: Floats, pattern: Pattern) -> None:
    assert misfit_pattern(pairs_of(density), pairs_of(NORMAL)) is pattern


@pytest.mark.parametrize("expected", [TRIANGULAR, LAPLACE], ids=["uniform", "laplace"])
def test_a_model_that_is_wrong_about_the_shape_is_no_proof(expected: Floats) -> None:
    """What is seen is normal: the family is too stiff, not the noise strange."""
    assert misfit_pattern(pairs_of(NORMAL), pairs_of(expected)) is Pattern.NOISE_LEVEL


def test_clipped_pairs_tell_no_shape() -> None:
    """A hundred thousand pixels jump between black and level 180, as much from 75 to white."""
    seen = pairs_of(NORMAL)
    seen[0, 180] = seen[180, 0] = seen[75, 255] = seen[255, 75] = 1e5

    pixels = difference_moments(pairs_of(NORMAL)).pairs
    pixels[pixels < 100] = 0

    kurtosis, far = _kurtosis(seen, pixels)

    assert (kurtosis, far) == pytest.approx(_kurtosis(pairs_of(NORMAL), pixels))


def test_a_level_that_is_skipped_is_level_wise() -> None:
    expected = pairs_of(NORMAL)
    single = 1 + 0.5 * np.cos(np.pi * np.arange(256))
    seen = expected * single * single[:, np.newaxis]

    pattern = misfit_pattern(seen * expected.sum() / seen.sum(), expected)

    assert pattern is Pattern.LEVEL_WISE


def test_a_handful_of_pairs_tells_no_shape() -> None:
    expected = pairs_of(NORMAL) * 1e-4

    assert misfit_pattern(expected.copy(), expected) is Pattern.NOISE_LEVEL


@pytest.mark.parametrize("kind", [Flag, Pattern])
def test_words_have_names_of_their_own(kind: type[Flag] | type[Pattern]) -> None:
    assert len({each.code for each in kind}) == len(kind)
    for each in kind:
        assert kind.from_code(each.code) is each
        assert repr(each) == f"<{kind.__name__} {each.code}>"
        assert ": " in each.advice
    with pytest.raises(ValueError, match=rf"^the {kind.__name__.lower()} 'x' is unknown to this"):
        kind.from_code("x")
