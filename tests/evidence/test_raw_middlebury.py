"""Raw files and JPEGs of real cameras: a chart whose light was measured in other exposures."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from chartless.evidence.raw.channel import RawPairs
from chartless.evidence.raw.gather import raw_evidence
from chartless.frames.frame import Frame, RawPicture
from chartless.images import read_frame
from chartless.methods import LikelihoodSearch
from chartless.result.response import Response
from chartless.types import Floats

CAMERAS = ("CanonEOS1DsMarkII", "CanonPowerShotG9", "OlympusE10")


@pytest.fixture(scope="module")
def folder(data_path: Path) -> Path:
    if not (data_path / "middlebury").is_dir() or not (data_path / "middlebury_response").is_dir():
        pytest.skip(f"no folders middlebury and middlebury_response in {data_path}")
    return data_path


def shot(folder: Path, camera: str, exposure: int) -> tuple[RawPicture, Frame]:
    """The raw crops are 8-bit pictures with three colours in each pixel."""
    stem = folder / "middlebury" / camera / f"wb1i1e{exposure}"
    raw = read_frame(f"{stem}-raw.png").levels[:260, :390].reshape(130, 2, 195, 2, 3)
    picture = RawPicture(
        path=Path(f"{stem}-raw.png"),
        light=(raw.mean(axis=(1, 3)) / 255).astype(np.float32),
        saturated=(raw >= 235).any(axis=(1, 3, 4)),
        cell=(2, 2),
        white_balance=np.ones(3),
        error=12**-0.5 / 255,
    )
    return picture, read_frame(f"{stem}-jpg.png")


def greys(folder: Path, camera: str, channel: str) -> Floats:
    """Light and brightness of the grey patches that are not clipped, shape (N, 2)."""
    with (folder / "middlebury_response" / "patch_levels.csv").open(newline="") as stream:
        rows = [
            (float(row["exposure_x_irradiance"]), float(row["jpg_mean"]) / 255)
            for row in csv.DictReader(stream)
            if (row["camera"], row["illuminant"], row["channel"]) == (camera, "1", channel)
            and row["is_gray"] == "1"
            and row["raw_saturated"] == "0"
            and 3 <= float(row["jpg_mean"]) <= 252
            and float(row["jpg_std"]) >= 0.1
        ]
    return np.array(rows)


def error(response: Response, truth: Floats) -> float:
    """Root mean square of f(s x) − y with the best scale."""

    def loss(log_scale: float) -> float:
        shown = response.curve.response(np.exp(log_scale) * truth[:, 0])
        return float(np.mean((shown - truth[:, 1]) ** 2))

    start = np.log(response.curve.inverse(truth[-1, 1]) / truth[-1, 0])
    best = minimize_scalar(loss, bracket=(start - 0.2, start + 0.2))
    return float(np.sqrt(best.fun))


@pytest.mark.slow
@pytest.mark.parametrize("camera", CAMERAS)
def test_curves_of_real_cameras_are_those_of_their_greys(folder: Path, camera: str) -> None:
    evidence = raw_evidence(shot(folder, camera, exposure) for exposure in (1, 2, 3, 4))
    errors = []
    for channel in "RGB":
        response = LikelihoodSearch().calibrate(RawPairs(evidence.blocks[channel]), channel=channel)
        truth = greys(folder, camera, channel)
        errors.append(error(response, truth))
        straight = np.polyfit(truth[:, 0], truth[:, 1], 1)
        assert np.std(np.polyval(straight, truth[:, 0]) - truth[:, 1]) > 0.03  # not for nothing
    assert np.median(errors) < 0.007
    assert max(errors) < 0.013
