"""Raw files, a bracket and repeats of one simulated camera, given together."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from raw_cameras import Camera, patches

from chartless.curves import ModelCurve, named_curve
from chartless.curves.populations import PopulationWeights
from chartless.evidence.base import AbstractChannelEvidence
from chartless.evidence.bracket.channel import ExposurePairs
from chartless.evidence.bracket.gather import BracketEvidence, bracket_evidence
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.raw.channel import RawPairs
from chartless.evidence.raw.gather import RawEvidence, raw_evidence
from chartless.flags import Flag
from chartless.frames.frame import Frame
from chartless.methods import LikelihoodSearch
from chartless.models import MODELS
from chartless.result.response import Response
from chartless.result.verdict import Grade, verdict
from chartless.types import Floats

TIMES = (0.125, 0.25, 0.5, 1.0)
"""The sensor does not saturate: what is red then may come out as green."""
CURVES = ("srgb", "gamma:0.6")
LEVELS = np.arange(256) / 255


@cache
def shots(curve: str) -> RawEvidence:
    return raw_evidence([Camera(curve=named_curve(curve)).pair(patches())])


@cache
def bracket(curve: str, *, known: bool = True) -> BracketEvidence:
    camera, scene = Camera(curve=named_curve(curve)), patches(seed=5)
    frames = [
        Frame(Path(f"{place}.png"), camera.shoot(scene, exposure=time, seed=10 + place)[1])
        for place, time in enumerate(TIMES)
    ]
    if known:
        return bracket_evidence(frames, np.log(TIMES))
    return bracket_evidence(frames, None, exposure_error=1.0)


@cache
def repeats(curve: str) -> LevelPairs:
    camera, scene = Camera(curve=named_curve(curve)), patches(seed=5)
    first, second = (camera.shoot(scene, exposure=0.5, seed=seed)[1][..., 1] for seed in (20, 21))
    return LevelPairs(Cooccurrence.of_pair(first, second))


def found(*evidence: AbstractChannelEvidence) -> Response:
    search = LikelihoodSearch(populations=PopulationWeights(dorf=1.0))  # one for all
    return search.calibrate(*evidence, channel="G")


def shape_error(response: Response, curve: str) -> float:
    """Root mean square of g − truth where g is brought closest by one factor."""
    truth, light = named_curve(curve).inverse(LEVELS), response.inverse_lut
    return float(np.sqrt(np.mean((light * (light @ truth) / (light @ light) - truth) ** 2)))


def shape_std(response: Response) -> Floats:
    assert response.shape_std is not None
    return response.shape_std


@pytest.mark.parametrize("channel", ["R", "G", "B"])
@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.slow
def test_raw_files_and_a_bracket_together_are_no_worse_than_the_better(
    curve: str, channel: str
) -> None:
    of_raw, of_bracket = shots(curve).channel(channel), bracket(curve).channel(channel)
    assert isinstance(of_raw, RawPairs)
    assert isinstance(of_bracket, ExposurePairs)

    errors = [shape_error(found(each), curve) for each in (of_raw, of_bracket)]
    both = found(of_raw, of_bracket)

    assert shape_error(both, curve) < 1.1 * min(errors) + 1e-4
    assert both.flags == ()


def test_what_both_tell_is_in_the_result() -> None:
    of_raw, of_bracket = shots("srgb").channel("G"), bracket("srgb").channel("G")

    both = found(of_raw, of_bracket)

    assert both.method == "likelihood"
    assert both.n_pairs == of_raw.n_pixels + of_bracket.n_pixels
    lowest, highest = zip(of_raw.observed_levels, of_bracket.observed_levels, strict=True)
    assert both.observed_levels == (min(lowest), max(highest))
    np.testing.assert_allclose(both.account("raw")["matrix"], Camera().matrix[1], atol=0.2)
    assert both.account("raw")["corner_gain"] == pytest.approx(np.exp(Camera().falloff), rel=0.03)
    assert both.account("bracket")["exposures"] == pytest.approx((1, 2, 4, 8))
    assert both.account("bracket")["exponent_error"] == 0
    assert set(both.kinds) == {"raw", "bracket"}


@pytest.mark.slow
def test_shares_of_the_information_add_up_to_one() -> None:
    of_raw, of_bracket = shots("srgb").channel("G"), bracket("srgb").channel("G")

    both, alone = found(of_raw, of_bracket), found(of_raw)
    with_noise = found(of_raw, of_bracket, repeats("srgb"))

    shares = [both.account(kind).share for kind in ("raw", "bracket")]
    assert sum(shares) == pytest.approx(1)
    assert min(shares) > 0.1
    assert alone.account("raw").share is None
    assert with_noise.account("noise").share == 0
    assert with_noise.account("raw").share == pytest.approx(shares[0])


@pytest.mark.slow
def test_the_order_of_kinds_makes_no_difference() -> None:
    """But for the curves that are drawn for mean and deviation."""
    of_raw, of_bracket = shots("srgb").channel("G"), bracket("srgb").channel("G")

    one, other = found(of_raw, of_bracket), found(of_bracket, of_raw)

    assert one.inverse_lut_std is not None
    assert np.all(np.abs(one.inverse_lut - other.inverse_lut) <= 0.1 * one.inverse_lut_std)
    np.testing.assert_allclose(shape_std(one), shape_std(other), rtol=0.2, atol=1e-5)
    np.testing.assert_allclose(
        one.account("raw")["matrix"], other.account("raw")["matrix"], atol=1e-3
    )


@pytest.mark.slow
def test_the_shape_is_surer_by_both_than_by_raw_files() -> None:
    of_raw, of_bracket = shots("srgb").channel("G"), bracket("srgb").channel("G")
    claims = [
        np.sqrt(np.mean(shape_std(found(*each)) ** 2))
        for each in ((of_raw,), (of_bracket,), (of_raw, of_bracket))
    ]

    # Errors that blocks of raw files share are half of what is added to both.
    assert claims[2] < claims[0]
    assert claims[2] < 1.4 * claims[1]


# Unknown exposures


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.slow
def test_beside_raw_files_the_exponent_of_unknown_exposures_is_known(curve: str) -> None:
    of_raw, unknown = shots(curve).channel("G"), bracket(curve, known=False).channel("G")
    alone = found(unknown)

    both = found(of_raw, unknown)

    assert Flag.EXPONENT_UNKNOWN in alone.flags
    assert Flag.EXPONENT_UNKNOWN not in both.flags
    errors = [
        abs(np.log(np.log(each.account("bracket")["exposures"][-1]) / np.log(8)))
        for each in (alone, both)
    ]
    assert errors[1] < 0.02
    assert errors[1] < 0.5 * errors[0]
    assert shape_error(both, curve) < 1.1 * shape_error(found(of_raw), curve) + 1e-4
    assert np.sqrt(np.mean(shape_std(both) ** 2)) < 0.01  # not g ln g times 0.3


# Repeats


@pytest.mark.slow
def test_repeats_beside_raw_files_tell_the_noise_and_leave_the_curve() -> None:
    of_raw, pairs = shots("srgb").channel("G"), repeats("srgb")
    alone = found(of_raw)

    both = found(of_raw, pairs)

    np.testing.assert_array_equal(both.inverse_lut, alone.inverse_lut)
    np.testing.assert_array_equal(shape_std(both), shape_std(alone))
    assert alone.noise is None
    assert both.noise is not None
    assert both.noise_error is not None
    assert both.account("noise").record is not None
    assert both.n_pairs == alone.n_pairs + pairs.n_pixels


@pytest.mark.slow
def test_all_three_kinds_are_taken() -> None:
    parts = shots("srgb").channel("G"), bracket("srgb").channel("G"), repeats("srgb")

    everything, without = found(*parts), found(*parts[:2])

    np.testing.assert_array_equal(everything.inverse_lut, without.inverse_lut)
    for kind in ("raw", "bracket"):
        assert everything.account(kind).values == without.account(kind).values
    assert everything.noise is not None


@pytest.mark.slow
def test_a_family_is_taken_for_both() -> None:
    parts = shots("gamma:0.6").channel("G"), bracket("gamma:0.6").channel("G")

    response = LikelihoodSearch(model=MODELS["gamma"]).calibrate(*parts)

    assert isinstance(response.curve, ModelCurve)
    assert response.curve.parameters == pytest.approx((0.6,), abs=0.005)
    assert Flag.MISFIT not in response.flags


# Kinds that disagree


@pytest.mark.slow
def test_kinds_that_show_different_curves_are_flagged_and_the_band_holds_both() -> None:
    of_raw, right = shots("srgb").channel("G"), bracket("srgb")
    off = np.array([0.0, 0.6, 0.7, 2.0])[: right.log_exposures.size]
    wrong = replace(right, log_exposures=right.log_exposures + off).channel("G")

    both, agreed = found(of_raw, wrong), found(of_raw, right.channel("G"))

    assert Flag.DISAGREEMENT in both.flags
    assert verdict([both]).grade is Grade.DISTRUST
    assert Flag.DISAGREEMENT not in agreed.flags
    alone = found(of_raw)
    assert both.inverse_lut_std is not None
    apart = np.abs(both.inverse_lut - alone.inverse_lut)
    assert np.mean(apart <= 2 * both.inverse_lut_std + 1e-3) > 0.8
