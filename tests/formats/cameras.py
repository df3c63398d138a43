"""Cameras to write and read again."""

import numpy as np

from chartless.curves import AbstractCurve, ModelCurve, SrgbCurve
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status

CURVES = (SrgbCurve(), ModelCurve("gamma", (0.5,)), ModelCurve("ameegc2-exact", (0.0, 1.2, 0.4)))


def make_camera(
    *curves: AbstractCurve, n_levels: int = 256, seen: tuple[int, int] | None = None
) -> Calibration:
    """Calibration of one curve (Y) or of three (R, G, B), with a band of 0.01 · g."""
    names = ("Y",) if len(curves) == 1 else ("R", "G", "B")
    brightness = np.linspace(0, 1, n_levels)
    channels = tuple(
        Response(
            name=name,
            curve=curve,
            noise=None,
            n_levels=n_levels,
            observed_levels=seen or (0, n_levels - 1),
            n_pairs=1000,
            method="likelihood",
            status=Status.CONVERGED,
            inverse_lut_std=0.01 * curve.inverse(brightness),
        )
        for name, curve in zip(names, curves, strict=True)
    )
    return Calibration(channels=channels, bit_depth=8, provenance={"inputs": []})
