"""Exposures that channels share, and bands that know what they do not tell."""

from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from chartless.curves import named_curve
from chartless.curves.populations import PopulationWeights
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.gather import BracketEvidence, bracket_evidence
from chartless.evidence.bracket.likelihood import ExposureCounts
from chartless.evidence.bracket.term import EXPOSURES
from chartless.flags import Flag
from chartless.frames.compression import Blocks
from chartless.frames.frame import Frame
from chartless.inference.channel_mode import ChannelMode
from chartless.methods import LikelihoodSearch
from chartless.noise import AffineNoise
from chartless.result.account import Account
from chartless.result.response import Response, rmse
from chartless.simulate import simulate_frames
from chartless.types import Floats, Levels

one_population = partial(LikelihoodSearch, populations=PopulationWeights(dorf=1.0))
"""Else each channel alone may have another population than all together."""

TIMES = (1.0, 2.0, 4.0, 8.0)
CURVES = {"R": "srgb", "G": "gamma:0.45", "B": "gamma:0.6"}
FEW = 52
"""Levels, each of five of the file: quick."""


@cache
def frames(*, lossy: bool = False) -> list[Frame]:
    """Three channels of different curves before one scene of soft blobs, from 1 to 300."""
    rng = np.random.default_rng(3)
    soft = gaussian_filter(rng.standard_normal((160, 240)), 8)
    rank = soft.ravel().argsort().argsort().reshape(soft.shape) / soft.size
    light = 1.5 * np.exp(5.7 * (rank - 1))
    noise = AffineNoise.from_8bit(0.03, 4)
    taken = []
    for place, time in enumerate(TIMES):
        planes: list[Levels] = []
        for name in CURVES.values():
            curve = named_curve(name)
            planes += simulate_frames(light * time / 8, curve, noise, n_frames=1, seed=rng)
        levels: Levels = np.stack(planes, axis=-1).astype(np.uint8)
        blocks = Blocks(8, 8) if lossy else None
        taken.append(Frame(Path(f"{place}.png"), levels, blocks=blocks))
    return taken


@cache
def bracket(
    error: float, *, said: tuple[float, ...] | None = TIMES, lossy: bool = False
) -> BracketEvidence:
    return bracket_evidence(
        frames(lossy=lossy),
        None if said is None else np.log(said),
        exposure_error=error,
        n_levels=FEW,
    )


def counts(error: float, **how: Any) -> ExposureCounts:
    return bracket(error, **how).counts("G")


def mode_that_found(changes: tuple[float, ...], variance: float = 1e-6) -> ChannelMode:
    """A first search that found ln t so much off, each with a variance of its own."""
    size = len(changes)
    mode: Any = SimpleNamespace(
        values={EXPOSURES: np.array(changes)},
        places={EXPOSURES: slice(0, size)},
        factor=np.eye(size) / np.sqrt(variance),
    )
    return ChannelMode(mode, "G")


# What a first search settles

CHANGES = (0.0, 0.01, -0.02, 0.03)
EXTENT = np.log(8) + 0.03
TOLD = np.sqrt(2e-6) / EXTENT
"""Deviation of ln γ by the ends."""


def test_exposures_that_are_known_are_settled_already() -> None:
    exact = ExposurePairs(counts(0.0))
    held = ExposurePairs(replace(counts(0.02), held=True))

    for pairs in (exact, held):
        assert pairs.is_settled
        assert pairs.settled_by(mode_that_found(CHANGES), noise_known=False) is pairs


def test_exposures_are_held_as_found() -> None:
    pairs = ExposurePairs(counts(0.02))
    assert not pairs.is_settled

    settled = pairs.settled_by(mode_that_found(CHANGES), noise_known=False)

    assert settled.is_settled
    assert settled.counts.exposure_error == 0
    np.testing.assert_allclose(settled.counts.log_exposures, np.log(TIMES) + CHANGES)
    assert settled.noted == ()
    # Steps of exposure are no longer equal: nothing to add up.
    assert len(settled.counts.tables) == len(pairs.counts.tables)


def test_exposures_whose_ratios_are_found_equal_are_compared_once() -> None:
    pairs = ExposurePairs(counts(0.02))

    settled = pairs.settled_by(mode_that_found((0.0, 0.01, 0.02, 0.03)), noise_known=False)

    assert len(pairs.counts.tables) == 6
    assert len(settled.counts.tables) == 3  # of one step, of two and of three
    totals = [sum(table.counts.sum() for table in each.counts.tables) for each in (pairs, settled)]
    assert totals[1] == pytest.approx(totals[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "noise_known", "least"),
    [
        ({"error": 0.02}, False, 0.003),
        ({"error": 0.02}, True, 0.003),
        ({"error": 0.1, "lossy": True}, False, 0.03),
        ({"error": 1.0, "said": None}, True, 0.03),
        ({"error": 1.0, "said": None}, False, 0.3),
    ],
    ids=str,
)
def test_the_exponent_is_no_surer_than_brackets_have_been_found_to_be(
    how: dict[str, Any], noise_known: bool, least: float
) -> None:
    pairs = ExposurePairs(counts(**how))
    found = mode_that_found(CHANGES, 1e-4)
    ends = pairs.counts.log_exposures + CHANGES

    settled = pairs.settled_by(found, noise_known=noise_known)

    told = np.sqrt(2e-4) / (ends[-1] - ends[0])
    assert settled.exponent_error == pytest.approx(np.hypot(told, least))


def test_lossy_files_do_not_move_exposures_that_are_nearly_known() -> None:
    pairs = ExposurePairs(counts(0.02, lossy=True))

    settled = pairs.settled_by(mode_that_found((0.0, 0.1, 0.2, 0.3)), noise_known=False)

    assert settled.counts.held
    assert settled.exponent_error == 0  # the term has it
    np.testing.assert_array_equal(settled.counts.log_exposures, pairs.counts.log_exposures)
    assert settled.noted == (Flag.EXPOSURES_OFF,)


@pytest.mark.parametrize(
    ("how", "changes", "noise_known", "noted"),
    [
        ({"error": 0.02}, (0, 0, 0, 0.04), False, ()),
        ({"error": 0.02}, (0, 0, 0, 0.06), False, (Flag.EXPOSURES_OFF,)),
        ({"error": 1.0, "said": None}, (0, 0, 0, 0.06), False, ()),
        ({"error": 1.0, "said": None}, (0, 0, 0, 0.06), True, ()),
    ],
    ids=str,
)
def test_what_a_search_said_of_exposures_is_noted(
    how: dict[str, Any],
    changes: tuple[float, ...],
    noise_known: bool,
    noted: tuple[Flag, ...],
) -> None:
    pairs = ExposurePairs(counts(**how))

    assert pairs.settled_by(mode_that_found(changes), noise_known=noise_known).noted == noted


def test_what_is_noted_is_in_the_result() -> None:
    exact = counts(0.0)
    plain, noted = (
        one_population().calibrate(ExposurePairs(exact, noted=flags))
        for flags in ((), (Flag.EXPOSURES_OFF,))
    )

    assert plain.flags == ()
    assert noted.flags == (Flag.EXPOSURES_OFF,)


# Bands


@pytest.mark.parametrize("error", [0.01, 0.1])
def test_bands_widen_with_the_error_of_the_exponent(error: float) -> None:
    exact = counts(0.0)
    sure = one_population().calibrate(ExposurePairs(exact))
    unsure = one_population().calibrate(ExposurePairs(exact, exponent_error=error))

    light = sure.inverse_lut
    log_light = np.log(np.maximum(light, 1e-300))
    bent = error * light * log_light
    assert sure.shape_std is not None
    assert unsure.shape_std is not None
    assert sure.white_std is not None
    assert unsure.white_std is not None
    assert (told(sure)["exponent_error"], told(unsure)["exponent_error"]) == (0, error)
    np.testing.assert_array_equal(unsure.inverse_lut, light)
    np.testing.assert_allclose(std(unsure), np.hypot(std(sure), bent))
    np.testing.assert_allclose(unsure.shape_std, np.hypot(sure.shape_std, bent))
    scaled = error * (light**2 @ log_light) / (light @ light)
    assert unsure.white_std == pytest.approx(np.hypot(sure.white_std, scaled))


def std(response: Response) -> Floats:
    assert response.inverse_lut_std is not None
    return response.inverse_lut_std


def told(response: Response) -> Account:
    return response.account("bracket")


def test_nearly_known_exposures_are_as_sure_as_they_are_said_to_be() -> None:
    found = one_population().calibrate(ExposurePairs(counts(0.02)))

    error = told(found)["exponent_error"]
    assert 0.003 <= error < 0.02
    gamma = np.log(told(found)["exposures"][-1]) / np.log(8)
    assert abs(np.log(gamma)) < 3 * error
    assert found.flags == ()


# Channels


@cache
def together(error: float, said: tuple[float, ...] | None = TIMES) -> tuple[Response, ...]:
    evidence = bracket(error, said=said)
    return one_population().calibrate_channels({name: [evidence.channel(name)] for name in CURVES})


SAID = (1.0, 2 * 1.02, 4 / 1.02, 8.0)


@pytest.mark.parametrize(("error", "said"), [(0.02, SAID), (1.0, None)])
def test_channels_find_one_set_of_exposures(error: float, said: tuple[float, ...] | None) -> None:
    evidence = bracket(error, said=said)
    search = one_population()
    alone = [told(search.calibrate(evidence.channel(name))) for name in CURVES]
    first, *others = (told(response) for response in together(error, said))

    for each in others:
        assert each["exposures"] == first["exposures"]
        assert each["exponent_error"] == pytest.approx(first["exponent_error"])
    by_themselves, shared = (
        np.log([each["exposures"] for each in alone]),
        np.log(first["exposures"]),
    )
    assert np.ptp(by_themselves, axis=0).max() > 1e-3  # each finds others
    assert np.all(shared >= by_themselves.min(axis=0) - 0.01)
    assert np.all(shared <= by_themselves.max(axis=0) + 0.01)
    if said is not None:
        np.testing.assert_allclose(shared, np.log(TIMES), atol=0.03)


def test_channels_that_share_exposures_have_curves_of_their_own() -> None:
    for response, (name, curve) in zip(together(0.02, SAID), CURVES.items(), strict=True):
        assert response.name == name
        assert rmse(response.curve, named_curve(curve)) < 0.01


@pytest.mark.slow
def test_channels_that_agree_are_as_sure_as_one() -> None:
    pairs = ExposurePairs(counts(0.02))
    alone = one_population().calibrate(pairs)
    alike = one_population().calibrate_channels({name: [pairs] for name in CURVES})

    error = told(alone)["exponent_error"]
    for each in alike:
        np.testing.assert_allclose(told(each)["exposures"], told(alone)["exposures"], rtol=2e-3)
        assert told(each)["exponent_error"] == pytest.approx(error, rel=0.05)
        np.testing.assert_allclose(each.inverse_lut, alone.inverse_lut, atol=1e-3)
        np.testing.assert_allclose(std(each)[5:-2], std(alone)[5:-2], rtol=0.25)


@pytest.mark.slow
def test_where_exposures_are_known_each_channel_is_as_if_it_were_alone() -> None:
    evidence = bracket(0.0)
    for response in together(0.0):
        alone = one_population().calibrate(evidence.channel(response.name))

        np.testing.assert_array_equal(response.inverse_lut, alone.inverse_lut)
        assert told(response).values == told(alone).values
