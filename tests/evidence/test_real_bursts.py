"""Bursts of real cameras: a flagged calibration or a clear refusal, never nonsense.

There is no measured truth for these; each burst says in its test what is known about it.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calibration_content import fact_of

from chartless import load_calibration
from chartless.cli import main

pytestmark = pytest.mark.slow


def burst(data_path: Path, folder: str, pattern: str) -> list[Path]:
    frames = sorted((data_path / folder).glob(pattern))
    if not frames:
        pytest.skip(f"{data_path / folder} is not there")
    return frames


@pytest.fixture
def outcome(capsys: pytest.CaptureFixture[str]) -> Any:
    """Run ``calibrate --json``; its status and what it printed, and say so on the terminal."""

    def calibrate(*arguments: object) -> tuple[int, Any]:
        status = main(["calibrate", "--json", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        content = json.loads(out)
        with capsys.disabled():
            sys.stdout.write("\n" + "".join(f"    {line}\n" for line in summary(content)))
        return status, content

    return calibrate


def summary(content: Any) -> list[str]:
    if "error" in content:
        return [f"refused: {content['error']}"]
    lines = []
    irradiance = np.linspace(0, 1, 1024)
    for channel in content["channels"]:
        at = np.interp([0.18, 0.5], irradiance, channel["response_lut"])
        lines.append(
            f"{channel['name']}: U {channel['noise']['U']:.4f} V {channel['noise']['V']:.2f} "
            f"{_fit_of(channel)} "
            f"f(0.18) {at[0]:.3f} f(0.5) {at[1]:.3f} {channel['flags']}"
        )
    return lines


def _fit_of(channel: Any) -> str:
    discounted = "noise-discounted" in channel["flags"]
    code = "counts_as" if discounted else "deviance"
    return f"{code} {fact_of(channel, 'noise', code):.2f}"


def assert_sound(content: Any) -> None:
    """What holds of every calibration, however doubtful."""
    for channel in content["channels"]:
        for key in ("inverse_lut", "response_lut"):
            values = np.array(channel[key], dtype=float)
            assert np.isfinite(values).all()
            assert (values[0], values[-1]) == (0, 1)
            assert (np.diff(values) >= 0).all()
        assert np.ptp(np.interp([0.1, 0.9], np.linspace(0, 1, 1024), channel["response_lut"])) > 0.1
        assert 0 < channel["noise"]["U"] < np.inf
        assert 0 < channel["noise"]["V"] < np.inf
        low, high = channel["observed_levels"]
        assert 0 <= low < high < content["levels"]


def test_canon_at_high_iso_is_calibrated_with_doubt(data_path: Path, outcome: Any) -> None:
    """In-camera denoising makes neighbours share their noise; lamps flicker by 1 to 3 %."""
    frames = burst(data_path, "burst_canon_s95_static", "*.JPG")

    status, content = outcome(*frames, "--strict")

    assert status == 3
    assert_sound(content)
    typical = load_calibration("typical").channels[0].inverse_lut
    for channel in content["channels"]:
        assert {"correlated-noise", "brightness-drift"} <= set(channel["flags"])
        # The noise is the denoiser's: the curve is the typical one, not a nearly linear one.
        assert "noise-discounted" in channel["flags"]
        off = np.abs(np.array(channel["inverse_lut"]) - typical)
        assert np.all(off <= np.array(channel["inverse_lut_std"]))
        assert off.max() < 0.02
    assert content["verdict"]["grade"] == "do not trust"
    assert not any("linear" in remark for remark in content["provenance"]["remarks"])


def test_canon_frames_tell_the_same_in_either_half(data_path: Path, outcome: Any) -> None:
    frames = burst(data_path, "burst_canon_s95_static", "*.JPG")

    curves = []
    for half in (frames[:3], frames[3:]):
        _, content = outcome(*half, "--channels", "luma", "--levels", 128)
        assert_sound(content)
        curves.append(content["channels"][0]["response_lut"])

    assert np.abs(np.subtract(*curves)).max() < 0.1


def test_nikon_before_an_even_wall_is_refused(data_path: Path, outcome: Any) -> None:
    """Levels 83 to 134 of 255: a fifth of the range tells no curve."""
    frames = burst(data_path, "burst_nikon_d70_flat", "*.JPG")

    status, content = outcome(*frames[:3])

    assert status == 2
    assert "% of the range, too little for a curve" in content["error"]


def test_surveillance_video_is_doubted_or_refused(data_path: Path, outcome: Any) -> None:
    """People walk through, and the video was compressed twice."""
    frames = burst(data_path, "video_pets2001", "*.jpg")

    status, content = outcome(*frames, "--strict", "--levels", 128)

    assert status in (2, 3)
    if status == 3:
        assert_sound(content)
        for channel in content["channels"]:
            assert {"movers", "correlated-channels", "noise-discounted"} <= set(channel["flags"])
