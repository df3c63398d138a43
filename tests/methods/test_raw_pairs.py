"""The method ``raw``: what it needs, and what its result says."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from raw_cameras import Camera, Pixels, patches
from scipy.ndimage import gaussian_filter

from chartless.curves import ModelCurve, SampledCurve, named_curve
from chartless.errors import ParameterError
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.raw.gather import RawBlocks, raw_evidence
from chartless.flags import Flag
from chartless.frames.frame import Frame, RawPicture
from chartless.images import through_jpeg
from chartless.methods import CALIBRATORS
from chartless.models import MODELS
from chartless.result.response import Response, Status, rmse


def shot(camera: Camera, scene: Pixels, **how: Any) -> tuple[RawPicture, Frame]:
    """A shot in memory, its picture compressed channel by channel."""
    mosaic, finished = camera.shoot(scene, **how)
    light = (mosaic.astype(np.float64) - camera.black) / (camera.white - camera.black)
    green = (light[::2, 1::2] + light[1::2, ::2]) / 2
    cells = np.stack([light[::2, ::2], green, light[1::2, 1::2]], axis=-1)
    raw = RawPicture(
        path=Path("a.dng"),
        light=cells.astype(np.float32),
        saturated=(cells > 0.95).any(axis=-1),
        cell=(2, 2),
        white_balance=np.array(camera.balance),
        error=1e-4,
    )
    planes = [through_jpeg(np.ascontiguousarray(finished[..., c]), 90) for c in range(3)]
    return raw, Frame(Path("a.jpg"), np.stack(planes, axis=-1))


def blocks_of(camera: Camera, **how: Any) -> dict[str, RawBlocks]:
    return raw_evidence([shot(camera, patches(), **how)]).blocks


@pytest.fixture(scope="module")
def found() -> dict[str, Response]:
    blocks = blocks_of(Camera())
    return {name: CALIBRATORS["raw"]().calibrate(raw=blocks[name], channel=name) for name in "RGB"}


@pytest.mark.parametrize("channel", ["R", "G", "B"])
def test_the_camera_is_found_in_one_shot(found: dict[str, Response], channel: str) -> None:
    response, camera = found[channel], Camera()

    assert rmse(response.curve, camera.curve) < 0.01
    assert response.raw is not None
    assert response.inverse_lut_std is not None
    row = camera.matrix["RGB".index(channel)]
    np.testing.assert_allclose(response.raw.matrix, row, atol=0.2)
    assert response.raw.corner_gain == pytest.approx(np.exp(camera.falloff), rel=0.03)
    assert response.raw.gains == (1.0,)
    assert response.raw.scatter < 0.04
    inverse = camera.curve.inverse(np.arange(256) / 255)
    near = np.abs(response.inverse_lut - inverse) <= 3 * response.inverse_lut_std + 1e-4
    assert near[5:250].mean() > 0.9
    assert (response.method, response.name, response.status) == ("raw", channel, Status.CONVERGED)
    assert (response.noise, response.flags) == (None, ())
    assert isinstance(response.curve, SampledCurve)


def test_a_second_shot_tells_its_gain() -> None:
    first, second = patches(), patches(seed=1)
    evidence = raw_evidence([shot(Camera(), first), shot(Camera(gain=1.1), second, exposure=0.7)])
    response = CALIBRATORS["raw"]().calibrate(raw=evidence.blocks["G"], channel="G")

    assert response.raw is not None
    assert response.raw.gains == (1.0, pytest.approx(1.1 / 1.2, rel=0.02))
    assert rmse(response.curve, named_curve("srgb")) < 0.01


def test_a_family_is_taken_on_request() -> None:
    calibrator = CALIBRATORS["raw"](model=MODELS["ameegc2-exact"])
    response = calibrator.calibrate(raw=blocks_of(Camera())["G"])

    assert calibrator.family == "ameegc2-exact"
    assert isinstance(response.curve, ModelCurve)
    assert response.parameter_covariance is not None
    assert response.parameter_covariance.shape == (3, 3)
    assert rmse(response.curve, named_curve("srgb")) < 0.02


def test_tones_that_depend_on_the_surroundings_are_flagged() -> None:
    scene = patches()
    raw, _ = shot(Camera(), scene)
    local = np.exp(0.25 * np.sin(np.arange(512) / 15))[:, np.newaxis]
    _, lifted = shot(Camera(), scene * gaussian_filter(local, (2, 0)))
    blocks = raw_evidence([(raw, lifted)]).blocks["G"]

    assert Flag.UNEVEN_TONES in CALIBRATORS["raw"]().calibrate(raw=blocks).flags


def test_it_takes_raw_files_and_nothing_else() -> None:
    table = Cooccurrence(np.eye(256, dtype=np.int64))
    with pytest.raises(ParameterError, match="raw estimates from raw, not from noise"):
        CALIBRATORS["raw"]().calibrate(table)
    blocks = blocks_of(Camera())["G"]
    with pytest.raises(ParameterError, match="likelihood estimates from exposures or noise, not"):
        CALIBRATORS["likelihood"]().calibrate(raw=blocks)
    with pytest.raises(ParameterError, match="raw makes no use of dark frames"):
        CALIBRATORS["raw"]().calibrate(raw=blocks, dark=np.ones(256, dtype=np.int64))


def test_progress_ends() -> None:
    told: list[float] = []
    CALIBRATORS["raw"]().calibrate(raw=blocks_of(Camera())["G"], progress=told.append)

    assert told == [1.0]
