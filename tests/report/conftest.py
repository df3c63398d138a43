"""Calibrations to report on, and a page to look at."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import html5lib
import numpy as np
import pytest

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response, named_curve
from chartless.evidence.bracket.account import (
    SeenTransfer,
    SeenTransfers,
    account_of_bracket,
    exposure_table,
)
from chartless.evidence.noise.account import account_of_pairs
from chartless.frames.frame import Frame
from chartless.noise import NoiseError
from chartless.report import render
from chartless.result.account import Reading
from chartless.result.response import Status
from chartless.simulate import simulate_frames

Element = Any
"""Of xml.etree, as html5lib builds it."""

CURVE, NOISE = ModelCurve("gamma", (0.5,)), AffineNoise.from_8bit(0.05, 9)
SPREAD = 0.01 * np.sin(np.linspace(0, np.pi, 256))
PROVENANCE: dict[str, Any] = {
    "chartless": "0.1.0",
    "created": "2026-01-02T03:04:05+00:00",
    "inputs": [{"file": f"frames/a{n}.png", "sha256": f"{n:x}" * 64} for n in range(12)],
    "settings": {"method": "likelihood", "evidence": "noise", "mask": None, "dark": ["d1", "d2"]},
    "remarks": ["a0.png: dropped the alpha channel"],
}


def bare(name: str, **changes: Any) -> Response:
    """A response of which no more is known than of one that another program made."""
    values: dict[str, Any] = {
        "name": name,
        "curve": CURVE,
        "noise": None,
        "n_levels": 256,
        "observed_levels": (3, 250),
        "n_pairs": 123_456,
        "method": "likelihood",
        "status": Status.CONVERGED,
    }
    return Response(**{**values, **changes})


@pytest.fixture(scope="session")
def of_noise() -> Calibration:
    """Three channels from the noise of two frames."""
    scene = np.random.default_rng(0).uniform(size=(200, 300))
    table = Cooccurrence.of_pair(*simulate_frames(scene, CURVE, NOISE))
    red, green, blue = (
        bare(
            name,
            noise=NOISE,
            noise_error=NoiseError(0.2, 0.1, -0.9),
            inverse_lut_std=SPREAD,
            accounts=(account_of_pairs(table, deviance=deviance, outliers=0.0025),),
        )
        for name, deviance in zip("RGB", (1.01, 1.02, 1.34), strict=True)
    )
    reading = Reading(
        kind="noise",
        title="noise of repeated frames",
        sentence="noise, as requested",
        inputs=tuple(range(12)),
        example=0,
    )
    return Calibration(
        channels=(red, green, blue), bit_depth=8, evidence=(reading,), provenance=PROVENANCE
    )


@pytest.fixture(scope="session")
def of_bracket() -> Calibration:
    """One channel from three exposures, twice as long one as the other."""
    upper = np.arange(100, 250)
    lower = 255 * CURVE.response(CURVE.inverse(upper / 255) / 2)
    transfer = SeenTransfer(2.0, tuple(upper.tolist()), tuple(lower.tolist()))
    account = account_of_bracket(
        "Y",
        CURVE,
        exposures=(1.0, 2.0, 4.0),
        transfers=SeenTransfers(256, (transfer, transfer)),
        scatter=0.03,
    )
    rows = [
        {
            "file": f"frames/e{n}.png", "relative": 2.0**n, "black": black, "white": 0.1,
            "overlap": None, "displacement": None,
        }
        for n, black in enumerate((0.25, 0.125, 0.5))
    ]  # fmt: skip
    inputs = [{"file": row["file"], "sha256": "e" * 64} for row in rows]
    reading = Reading(
        kind="bracket",
        title="exposures of one scene",
        sentence="three exposures by `times`",
        inputs=(0, 1, 2),
        tables=exposure_table(rows, {"Y": account}),
        example=1,
    )
    return Calibration(
        channels=(bare("Y", noise=NOISE, inverse_lut_std=SPREAD, accounts=(account,)),),
        bit_depth=8,
        evidence=(reading,),
        provenance={**PROVENANCE, "inputs": inputs},
    )


@pytest.fixture(scope="session")
def frame() -> Frame:
    """A coloured ramp, wider than a preview."""
    ramp = np.linspace(0, 1, 1000)[:, np.newaxis] * np.array([1.0, 0.5, 0.25])
    levels = np.rint(255 * np.broadcast_to(ramp, (500, 1000, 3))).astype(np.uint8)
    return Frame(Path("frames/a0.png"), levels.copy())


@pytest.fixture(scope="session")
def page(of_noise: Calibration, frame: Frame) -> str:
    return render(of_noise, frame)


@pytest.fixture(scope="session")
def bracket_page(of_bracket: Calibration) -> str:
    return render(of_bracket)


@pytest.fixture(scope="session")
def parsed() -> Callable[[str], Element]:
    """Parse a page; anything that the HTML standard calls an error fails."""

    def parse(page: str) -> Element:
        return html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(page)

    return parse


@pytest.fixture(scope="session")
def linear_camera() -> Calibration:
    return Calibration(channels=(bare("Y", curve=named_curve("linear")),), bit_depth=8)
