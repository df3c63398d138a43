"""Responses of digital cameras, to stand beside DoRF, which is mostly film.

A folder ``modern_curves`` with the file ``responses_1024.npz`` holds them: arrays ``E``
(irradiance, N numbers from 0 to 1), ``names`` and ``f`` (brightness, a row for each camera).
Most are base curves of darktable, which come under the GPL, so they are no part of this
package.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chartless.datasets._base import DatasetError
from chartless.types import Floats

FILE = Path("modern_curves", "responses_1024.npz")
MEASURED = (
    "dt_Nikon D750",
    "dt_Nikon D5100",
    "dt_Nikon D7000",
    "dt_Nikon D7200",
    "dt_Nikon D90",
    "dt_Canon EOS 6D",
    "dt_Pentax K-5",
    "raw_S40",
)
"""Names of the curves that were measured, not drawn by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class DigitalCameras:
    """Responses of B digital cameras."""

    irradiance: Floats
    """Increasing from 0 to 1, shape (N,)."""
    curves: Floats
    """Brightness, from 0 to 1 and never decreasing, shape (B, N)."""
    names: tuple[str, ...]


def load_digital(path: str | os.PathLike[str]) -> DigitalCameras:
    """Read the responses of digital cameras.

    Parameters
    ----------
    path : path-like
        The file.

    Raises
    ------
    DatasetError
        If it is missing or holds anything else.
    """
    path = Path(path)
    try:
        with np.load(path, allow_pickle=False) as stored:
            irradiance, rows = stored["E"].astype(np.float64), stored["f"].astype(np.float64)
            names = tuple(map(str, stored["names"]))
    except (OSError, ValueError, KeyError) as error:
        msg = f"{path}: cannot be read as responses of digital cameras: {error}"
        raise DatasetError(msg) from error
    if rows.shape != (len(names), irradiance.size) or not np.all(np.diff(irradiance) > 0):
        msg = f"{path}: holds no responses f at increasing irradiances E, one for each of names"
        raise DatasetError(msg)
    rising = np.maximum.accumulate(rows, axis=1)
    low, high = rising[:, :1], rising[:, -1:]
    if not np.all(high > low):
        msg = f"{path}: holds a response that does not increase"
        raise DatasetError(msg)
    return DigitalCameras(irradiance, (rising - low) / (high - low), names)


def find_digital() -> DigitalCameras | None:
    """Read them from the folder that CHARTLESS_DATA names; None if it has none.

    Raises
    ------
    DatasetError
        If the file holds anything else.
    """
    path = Path(os.environ.get("CHARTLESS_DATA", ""), FILE)
    return load_digital(path) if path.is_file() else None
