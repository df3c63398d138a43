"""Checks of file formats."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chartless.curves import ModelCurve
from chartless.formats import AbstractFormat, ExportSettings
from chartless.formats._base import Source
from chartless.result.calibration import Calibration
from chartless.result.response import Response, Status

_SIZE = (64, 48)
_BRIGHTNESS = np.linspace(0.0, 1.0, 256)
_CURVES = {"R": 0.4, "G": 0.5, "B": 0.6}


def check_format(each: AbstractFormat) -> None:
    """Check the promises of `chartless.formats.AbstractFormat`: words, and a round trip.

    Parameters
    ----------
    each : AbstractFormat

    Raises
    ------
    AssertionError
        With the promise that does not hold.
    """
    name = each.name
    assert name, "a format needs a name"
    assert each.suffix.startswith("."), f"{name}: suffix should begin with a dot"
    assert each.title, f"{name}: title should describe it"
    assert each.is_written or each.is_read, f"{name}: is neither read nor written"
    if not (each.is_written and each.is_read):
        return
    # For a format that holds a family alone, take what a first round trip makes of a camera.
    camera = _again(each, _camera()) if each.keeps.curves else _camera()
    again = _again(each, camera)
    for response in again.channels:
        assert np.all(np.diff(response.inverse_lut) > 0), f"{name}: reads a curve that falls"
    if len(again.channels) == len(camera.channels) and each.keeps.channels == "each":
        for had, has in zip(camera.channels, again.channels, strict=True):
            apart = had.curve.inverse(_BRIGHTNESS) - has.curve.inverse(_BRIGHTNESS)
            worst = float(np.abs(apart).max())
            assert worst <= each.precision, f"{name}: off by {worst:.1g} after a round trip"


def _again(each: AbstractFormat, camera: Calibration) -> Calibration:
    content = each.encode(camera, ExportSettings(size=_SIZE)).content
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"camera{each.suffix}"
        path.write_bytes(content)
        source = Source(path, content)
        assert each.recognises(source), f"{each.name}: does not recognise its own file"
        return each.decode(source)


def _camera() -> Calibration:
    channels = tuple(
        Response(
            name=name,
            curve=ModelCurve("gamma", (exponent,)),
            noise=None,
            n_levels=256,
            observed_levels=(0, 255),
            n_pairs=1,
            method="likelihood",
            status=Status.CONVERGED,
        )
        for name, exponent in _CURVES.items()
    )
    return Calibration(channels=channels, bit_depth=8)
