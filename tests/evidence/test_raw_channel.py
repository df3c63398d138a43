"""Raw files beside JPEGs as the only evidence: what is found, and what the result says."""

from dataclasses import replace

import numpy as np
import pytest
from raw_cameras import Camera, patches
from scipy.ndimage import gaussian_filter

from chartless.curves import ModelCurve, SampledCurve, named_curve
from chartless.errors import ParameterError
from chartless.evidence.noise.channel import LevelPairs
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.raw.channel import RawPairs
from chartless.evidence.raw.gather import RawEvidence, raw_evidence
from chartless.flags import Flag
from chartless.methods import CALIBRATORS, LikelihoodSearch
from chartless.models import MODELS
from chartless.result.response import Response, Status, rmse


@pytest.fixture(scope="module")
def evidence() -> RawEvidence:
    return raw_evidence([Camera().pair(patches())])


@pytest.fixture(scope="module")
def found(evidence: RawEvidence) -> dict[str, Response]:
    channels = {name: [evidence.channel(name)] for name in "RGB"}
    return dict(zip("RGB", LikelihoodSearch().calibrate_channels(channels), strict=True))


@pytest.mark.parametrize("channel", ["R", "G", "B"])
def test_the_camera_is_found_in_one_shot(found: dict[str, Response], channel: str) -> None:
    response, camera = found[channel], Camera()

    assert rmse(response.curve, camera.curve) < 0.01
    assert response.inverse_lut_std is not None
    row = camera.matrix["RGB".index(channel)]
    np.testing.assert_allclose(response.account("raw")["matrix"], row, atol=0.2)
    assert response.account("raw")["corner_gain"] == pytest.approx(np.exp(camera.falloff), rel=0.03)
    assert response.account("raw")["gains"] == (1.0,)
    assert response.account("raw")["scatter"] < 0.04
    inverse = camera.curve.inverse(np.arange(256) / 255)
    near = np.abs(response.inverse_lut - inverse) <= 3 * response.inverse_lut_std + 1e-4
    assert near[5:250].mean() > 0.9
    assert response.method == "likelihood"
    assert (response.name, response.status) == (channel, Status.CONVERGED)
    assert (response.noise, response.flags) == (None, ())
    assert isinstance(response.curve, SampledCurve)


@pytest.mark.parametrize("channel", ["R", "G", "B"])
def test_the_band_divides_into_shape_and_light_at_white(
    found: dict[str, Response], channel: str
) -> None:
    """As far as the blocks reach the shape is surer than the light at white."""
    response = found[channel]
    inverse = Camera().curve.inverse(np.arange(256) / 255)
    lut, std = response.inverse_lut, response.inverse_lut_std
    assert std is not None
    assert response.shape_std is not None
    assert response.white_std is not None

    scale = (lut @ inverse) / (lut @ lut)
    off = np.sqrt(np.mean((scale * lut - inverse) ** 2))
    assert off < 2 * np.sqrt(np.mean(response.shape_std**2)) < 0.01
    assert abs(scale - 1) < 2 * response.white_std < 0.1
    assert np.median(response.shape_std[100:200] / std[100:200]) < 0.7
    together = np.hypot(response.shape_std, response.white_std * lut)
    np.testing.assert_allclose(together[50:200], std[50:200], rtol=0.3)


def test_a_channel_is_estimated_as_if_it_were_alone(
    evidence: RawEvidence, found: dict[str, Response]
) -> None:
    alone = LikelihoodSearch().calibrate(evidence.channel("G"), channel="G")

    # But for what a further look moves, while other channels take theirs.
    np.testing.assert_allclose(alone.inverse_lut, found["G"].inverse_lut, atol=1e-4)
    np.testing.assert_allclose(
        alone.account("raw")["matrix"], found["G"].account("raw")["matrix"], atol=1e-3
    )
    assert alone.n_pairs == evidence.blocks["G"].level.size
    assert alone.observed_levels == evidence.blocks["G"].observed_levels
    assert alone.kinds == ("raw",)


@pytest.mark.slow
def test_a_second_shot_tells_its_gain() -> None:
    first, second = patches(), patches(seed=1)
    evidence = raw_evidence([Camera().pair(first), Camera(gain=1.1).pair(second, exposure=0.7)])
    response = LikelihoodSearch().calibrate(evidence.channel("G"), channel="G")

    assert response.account("raw")["gains"] == pytest.approx((1.0, 1.1 / 1.2), rel=0.02)
    assert rmse(response.curve, named_curve("srgb")) < 0.01


def test_a_family_is_taken_on_request(evidence: RawEvidence) -> None:
    calibrator = CALIBRATORS["likelihood"](model=MODELS["ameegc2-exact"])
    response = calibrator.calibrate(evidence.channel("G"))

    assert calibrator.family == "ameegc2-exact"
    assert isinstance(response.curve, ModelCurve)
    assert response.parameter_covariance is not None
    assert response.parameter_covariance.shape == (3, 3)
    assert rmse(response.curve, named_curve("srgb")) < 0.02


@pytest.mark.slow
def test_a_family_that_misses_the_camera_is_flagged() -> None:
    film = Camera(curve=named_curve("ameegc2-exact:0.48,-2.26,0.37"))
    pairs = raw_evidence([film.pair(patches())]).channel("G")
    held, missed = (
        LikelihoodSearch(model=MODELS[name]).calibrate(pairs) for name in ("ameegc2-exact", "gamma")
    )

    off = np.abs(missed.inverse_lut - film.curve.inverse(np.arange(256) / 255))
    assert missed.inverse_lut_std is not None
    assert Flag.MISFIT not in held.flags
    assert Flag.MISFIT in missed.flags
    assert np.mean(off <= 2 * missed.inverse_lut_std + 1e-3) > 0.9


def test_few_blocks_leave_the_prior(evidence: RawEvidence) -> None:
    blocks = evidence.blocks["G"]
    few = np.random.default_rng(4).choice(blocks.level.size, 12, replace=False)
    names = ("level", "light", "chroma", "radius", "shot")
    kept = replace(blocks, **{name: getattr(blocks, name)[few] for name in names})

    response = LikelihoodSearch().calibrate(RawPairs(kept))
    whole = LikelihoodSearch().calibrate(RawPairs(blocks))

    assert response.status is Status.CONVERGED
    assert response.n_pairs == 12
    assert response.inverse_lut_std is not None
    assert whole.inverse_lut_std is not None
    assert np.median(response.inverse_lut_std[50:200] / whole.inverse_lut_std[50:200]) > 2
    off = np.abs(response.inverse_lut - Camera().curve.inverse(np.arange(256) / 255))
    assert np.mean(off <= 2 * response.inverse_lut_std + 1e-3) > 0.9


def test_tones_that_depend_on_the_surroundings_are_flagged() -> None:
    scene = patches()
    raw, _ = Camera().pair(scene)
    local = np.exp(0.25 * np.sin(np.arange(512) / 15))[:, np.newaxis]
    _, lifted = Camera().pair(scene * gaussian_filter(local, (2, 0)))
    pairs = raw_evidence([(raw, lifted)]).channel("G")

    assert Flag.UNEVEN_TONES in LikelihoodSearch().calibrate(pairs).flags


def test_other_methods_take_no_raw_files(evidence: RawEvidence) -> None:
    for method, wanted in (("nlf", "noise"), ("debevec", "bracket")):
        with pytest.raises(ParameterError, match=f"{method} uses {wanted} only, and was given raw"):
            CALIBRATORS[method]().calibrate(evidence.channel("G"))
    pairs = LevelPairs(Cooccurrence(np.eye(256, dtype=np.int64)))
    with pytest.raises(ParameterError, match="nlf uses noise only, and was given noise and raw"):
        CALIBRATORS["nlf"]().calibrate(evidence.channel("G"), pairs)


def test_two_runs_are_equal_to_the_last_bit(evidence: RawEvidence) -> None:
    once, again = (LikelihoodSearch().calibrate(evidence.channel("R")) for _ in range(2))

    assert once.curve == again.curve
    assert once.account("raw").values == again.account("raw").values
    np.testing.assert_array_equal(once.inverse_lut_std, again.inverse_lut_std)


def test_progress_ends(evidence: RawEvidence) -> None:
    told: list[float] = []
    LikelihoodSearch().calibrate(evidence.channel("G"), progress=told.append)

    assert told == [1.0]
