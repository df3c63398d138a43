"""Measured response curves in text files: two columns, irradiance and brightness."""

import json
import os
from pathlib import Path

import numpy as np

from chartless._files.given import read_text
from chartless.curves import SampledCurve
from chartless.errors import ParameterError
from chartless.types import Floats


def read_curve(path: str | os.PathLike[str]) -> SampledCurve:
    """Read a response curve, from (0, 0) to (1, 1) and never decreasing.

    Parameters
    ----------
    path : Path
        As for `read_samples`.

    Returns
    -------
    SampledCurve

    Raises
    ------
    ParameterError
        If the file cannot be read or holds no response curve.
    """
    irradiance, brightness = read_samples(path)
    try:
        return SampledCurve(tuple(irradiance.tolist()), tuple(brightness.tolist()))
    except ParameterError as error:
        msg = f"{path}: {error}"
        raise ParameterError(msg) from error


def read_samples(path: str | os.PathLike[str]) -> tuple[Floats, Floats]:
    """Read samples of a measured curve, whatever their range and order.

    Parameters
    ----------
    path : Path
        Either ``.json`` as ``chartless simulate`` writes it, or text with a sample in each
        line: irradiance and brightness, separated by comma, semicolon or white space.
        Lines that begin with ``#``, and one line of column names at the top, are skipped.

    Returns
    -------
    (ndarray of float, ndarray of float), each of shape (N,)
        Irradiance and brightness.

    Raises
    ------
    ParameterError
        If the file cannot be read or holds no numbers.
    """
    path = Path(path)
    text = read_text(path)
    try:
        samples = _from_json(text) if path.suffix.lower() == ".json" else samples_of(text)
    except (TypeError, ValueError, RecursionError) as error:
        msg = f"{path}: {error}"
        raise ParameterError(msg) from error
    if not samples.size:
        msg = f"{path}: holds no samples; give two rows or more, each of irradiance and brightness"
        raise ParameterError(msg)
    return samples[:, 0], samples[:, 1]


def samples_of(text: str) -> Floats:
    """Samples in the text of a file, shape (N, 2); ValueError if a line is none."""
    rows: list[list[float]] = []
    lines = (line.strip() for line in text.splitlines())
    for number, line in enumerate(lines, start=1):
        if not line or line.startswith("#"):
            continue
        cells = line.replace(",", " ").replace(";", " ").split()
        try:
            irradiance, brightness = map(float, cells)
        except ValueError:
            if not rows and not any(cell[:1].isdigit() for cell in cells):
                continue  # names of the columns
            msg = f"line {number} is not two numbers, irradiance and brightness: {line[:40]!r}"
            raise ValueError(msg) from None
        rows.append([irradiance, brightness])
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def _from_json(text: str) -> Floats:
    content = json.loads(text)
    if not isinstance(content, dict) or "response_lut" not in content:
        msg = "holds no response_lut; give the truth.json of chartless simulate, or a CSV file"
        raise ValueError(msg)
    brightness = np.asarray(content["response_lut"], dtype=np.float64)
    return np.column_stack([np.linspace(0.0, 1.0, brightness.size), brightness])
