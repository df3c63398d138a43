"""Calibrations as JSON files: readable, without pickle, meant to be read in ten years.

The layout is documented in docs/calibration-file.md. A curve is stored three times: as model
and parameters, which this program reads back; as ``inverse_lut`` and ``response_lut`` for
everybody else. A file whose model is null (another method, another program) is read from its
``inverse_lut``.
"""

import json
import math
import os
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from chartless._addresses import why_unreadable
from chartless._files import write_text
from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.errors import CalibrationFileError, ChartlessError
from chartless.evidence.bracket.estimates import ExposureEstimate, SeenTransfer
from chartless.evidence.noise.cooccurrence import Cooccurrence
from chartless.evidence.noise.estimates import NoiseError
from chartless.evidence.raw.estimates import RawEstimate
from chartless.flags import Flag, Pattern
from chartless.frames.levels import MAX_LEVELS, MIN_LEVELS
from chartless.models import MODELS
from chartless.noise import AffineNoise
from chartless.result.calibration import Calibration
from chartless.result.provenance import require_sound
from chartless.result.response import Response, SearchHistory, Status
from chartless.result.verdict import verdict
from chartless.types import Floats, JsonObject

FORMAT, VERSION = "chartless-calibration", 1
MOST_LEVELS = 1 << 16
"""Levels of the deepest pictures; other programs may write as many."""
_MOST_BITS = 16
# A table with more cells than this is left out of the file: it would take megabytes.
_MOST_CELLS = 200_000
_LARGEST_ERROR = 1e6  # of irradiance and of ln of noise: any larger is damage

T = TypeVar("T")


def to_json(calibration: Calibration) -> JsonObject:
    """Return the content of the calibration's file as JSON types."""
    first = calibration.channels[0]
    return {
        "format": FORMAT,
        "version": VERSION,
        "bit_depth": calibration.bit_depth,
        "levels": first.n_levels,
        "method": first.method,
        "model": first.curve.model if isinstance(first.curve, ModelCurve) else None,
        "verdict": verdict(calibration.channels).to_json(),
        "channels": [_response_to_json(response) for response in calibration.channels],
        "provenance": calibration.provenance,
    }


def to_text(calibration: Calibration) -> str:
    """Return the calibration's file as text."""
    return json.dumps(to_json(calibration), ensure_ascii=False, allow_nan=False) + "\n"


def save(calibration: Calibration, path: str | os.PathLike[str]) -> None:
    """Write a calibration; the file appears whole or not at all.

    Raises
    ------
    OutputError
        If the folder is missing or not writable.
    """
    write_text(path, to_text(calibration))


def load(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration.

    Raises
    ------
    CalibrationFileError
        If the file cannot be read, is no calibration, is damaged or of another version.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationFileError(why_unreadable(path, error)) from error
    except (ValueError, RecursionError) as error:
        msg = (
            f"{path}: not a calibration file: not JSON; give a file that calibrate -o wrote, or a "
            "response of another program"
        )
        raise CalibrationFileError(msg) from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        msg = f"{path}: not a calibration file: no format {FORMAT!r}; give one by calibrate -o"
        raise CalibrationFileError(msg)
    if content.get("version") != VERSION:
        msg = (
            f"{path}: written in version {content.get('version')} of the format, this chartless "
            f"reads version {VERSION}: install the newer chartless that wrote it"
        )
        raise CalibrationFileError(msg)
    try:
        return _calibration(content)
    except (TypeError, ValueError, LookupError, ArithmeticError, ChartlessError) as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        msg = f"{path}: damaged calibration file: {what}; calibrate again"
        raise CalibrationFileError(msg) from error


def _calibration(content: JsonObject) -> Calibration:
    channels = tuple(_response(content, entry) for entry in content["channels"])
    if tuple(response.name for response in channels) not in (("Y",), ("R", "G", "B")):
        msg = "its channels are neither Y nor R, G and B"
        raise ValueError(msg)
    bit_depth = int(content["bit_depth"])
    if not 1 <= bit_depth <= _MOST_BITS:
        msg = f"bit_depth {bit_depth}"
        raise ValueError(msg)
    known = dict(content["provenance"])
    require_sound(known)
    if _any_infinite(content):
        msg = "one of its numbers is not finite"
        raise ValueError(msg)
    return Calibration(channels=channels, bit_depth=bit_depth, provenance=known)


def _any_infinite(value: object) -> bool:
    """Whether a number anywhere in the content is not finite, which JSON does not have."""
    if isinstance(value, dict):
        return any(map(_any_infinite, value.values()))
    if isinstance(value, list):
        return any(map(_any_infinite, value))
    return isinstance(value, float) and not math.isfinite(value)


def _response_to_json(response: Response) -> JsonObject:
    curve = response.curve
    return {
        "name": response.name,
        "parameters": _parameters(curve),
        "parameters_covariance": _maybe(response.parameter_covariance, np.ndarray.tolist),
        "inverse_lut": response.inverse_lut.tolist(),
        "inverse_lut_std": _maybe(response.inverse_lut_std, np.ndarray.tolist),
        "shape_std": _maybe(response.shape_std, np.ndarray.tolist),
        "white_std": response.white_std,
        "inverse_lut_std_with_dark": _maybe(response.inverse_lut_std_with_dark, np.ndarray.tolist),
        "response_lut": response.response_lut.tolist(),
        "noise": _maybe(
            response.noise,
            lambda noise: {
                "u": noise.slope,
                "v": noise.floor,
                "U": noise.slope_8bit,
                "V": noise.floor_8bit,
                "std": _maybe(response.noise_error, asdict),
            },
        ),
        "observed_levels": list(response.observed_levels),
        "pairs": response.n_pairs,
        "status": response.status.value,
        "outliers": response.outliers,
        "exposures": _maybe(response.exposures, asdict),
        "raw": _maybe(response.raw, asdict),
        "similarity": response.similarity,
        "deviance": response.deviance,
        "pattern": _maybe(response.pattern, lambda pattern: pattern.code),
        "log_evidence": response.log_evidence,
        "flags": [flag.code for flag in response.flags],
        "search": _maybe(
            response.history,
            lambda history: {
                "objective": history.objective,
                "values": list(history.values),
                "evaluations": history.evaluations,
            },
        ),
        "cooccurrence": _maybe(response.table, _table_to_json),
    }


def _response(content: JsonObject, entry: JsonObject) -> Response:
    n_levels = int(content["levels"])
    if not MIN_LEVELS <= n_levels <= MOST_LEVELS:
        msg = f"levels should lie between {MIN_LEVELS} and {MOST_LEVELS}, not {n_levels}"
        raise ValueError(msg)
    inverse_lut = _numbers(entry, "inverse_lut", n_levels)
    noise = entry["noise"]
    low, high = (int(level) for level in entry["observed_levels"])
    if not 0 <= low <= high < n_levels:
        msg = f"observed_levels {low} to {high} of {n_levels}"
        raise ValueError(msg)
    return Response(
        name=str(entry["name"]),
        curve=_curve(content["model"], entry["parameters"], inverse_lut),
        noise=_maybe(noise, lambda told: AffineNoise(float(told["u"]), float(told["v"]))),
        n_levels=n_levels,
        observed_levels=(low, high),
        n_pairs=int(entry["pairs"]),
        method=str(content["method"]),
        status=Status(entry["status"]),
        outliers=_maybe(entry.get("outliers"), float),
        exposures=_maybe(entry.get("exposures"), partial(_exposures, n_levels=n_levels)),
        raw=_maybe(entry.get("raw"), _raw),
        similarity=_maybe(entry.get("similarity"), float),
        deviance=_maybe(entry.get("deviance"), float),
        pattern=_maybe(entry.get("pattern"), Pattern.from_code),
        log_evidence=_maybe(entry.get("log_evidence"), float),
        noise_error=_maybe((noise or {}).get("std"), _noise_error),
        flags=tuple(Flag.from_code(code) for code in entry["flags"]),
        inverse_lut_std=_maybe(
            entry["inverse_lut_std"], lambda _: _deviations(entry, "inverse_lut_std", n_levels)
        ),
        shape_std=_maybe(
            entry.get("shape_std"), lambda _: _deviations(entry, "shape_std", n_levels)
        ),
        white_std=_maybe(entry.get("white_std"), float),
        inverse_lut_std_with_dark=_maybe(
            entry.get("inverse_lut_std_with_dark"),
            lambda _: _deviations(entry, "inverse_lut_std_with_dark", n_levels),
        ),
        parameter_covariance=_maybe(
            entry.get("parameters_covariance"),
            lambda _: _numbers(entry, "parameters_covariance", *2 * (len(entry["parameters"]),)),
        ),
        history=_maybe(entry.get("search"), _history),
        table=_maybe(entry.get("cooccurrence"), lambda table: _table(table, n_levels)),
    )


def _curve(
    model: str | None, parameters: dict[str, float] | None, inverse_lut: Floats
) -> AbstractCurve:
    if model is not None and parameters is not None:
        names = MODELS[model].parameter_names
        return ModelCurve(model, tuple(float(parameters[name]) for name in names))
    return SampledCurve.from_inverse(inverse_lut)


def _parameters(curve: AbstractCurve) -> dict[str, float] | None:
    if not isinstance(curve, ModelCurve):
        return None
    names = MODELS[curve.model].parameter_names
    return dict(zip(names, curve.parameters, strict=True))


def _numbers(entry: JsonObject, key: str, *shape: int) -> Floats:
    values = np.asarray(entry[key], dtype=np.float64)
    if values.shape != shape or not np.isfinite(values).all():
        msg = f"{key} should be {' × '.join(map(str, shape))} numbers"
        raise ValueError(msg)
    return values


def _deviations(entry: JsonObject, key: str, *shape: int) -> Floats:
    values = _numbers(entry, key, *shape)
    if np.any((values < 0) | (values > _LARGEST_ERROR)):
        msg = f"{key} should be errors of irradiance, 0 and above"
        raise ValueError(msg)
    return values


def _noise_error(entry: JsonObject) -> NoiseError:
    slope, floor, correlation = (
        float(entry[key]) for key in ("log_slope", "log_floor", "correlation")
    )
    if not (0 <= slope <= _LARGEST_ERROR and 0 <= floor <= _LARGEST_ERROR):
        msg = f"errors of its noise are {slope:g} and {floor:g}"
        raise ValueError(msg)
    return NoiseError(slope, floor, correlation)


def _table_to_json(table: Cooccurrence) -> JsonObject | None:
    """Each row as its first level with counts and the counts from there to the last."""
    first, rows = [], []
    for row in table.counts:
        (seen,) = np.nonzero(row)
        span = slice(seen[0], seen[-1] + 1) if seen.size else slice(0)
        first.append(int(span.start or 0))
        rows.append(row[span].tolist())
    if sum(map(len, rows)) > _MOST_CELLS:
        return None
    return {"first": first, "counts": rows}


def _table(entry: JsonObject, n_levels: int) -> Cooccurrence:
    if n_levels > MAX_LEVELS:
        msg = f"a co-occurrence table has {MAX_LEVELS} levels at most, not {n_levels}"
        raise ValueError(msg)
    table = np.zeros((n_levels, n_levels), dtype=np.int64)
    for row, first, counts in zip(table, entry["first"], entry["counts"], strict=True):
        values = np.asarray(counts, dtype=np.int64)
        if not 0 <= first <= first + values.size <= n_levels or np.any(values < 0):
            msg = "its co-occurrence table holds impossible counts"
            raise ValueError(msg)
        row[first : first + values.size] = values
    return Cooccurrence(table)


def _exposures(entry: JsonObject, n_levels: int) -> ExposureEstimate:
    return ExposureEstimate(
        tuple(float(value) for value in entry["relative"]),
        float(entry["exponent_error"]),
        float(entry["scatter"]),
        tuple(_transfer(each, n_levels) for each in entry["transfers"]),
    )


def _transfer(entry: JsonObject, n_levels: int) -> SeenTransfer:
    ratio = float(entry["ratio"])
    upper, lower = (tuple(map(float, entry[key])) for key in ("upper", "lower"))
    if not 0 < ratio < math.inf or len(upper) != len(lower):
        msg = f"a ratio of its exposures is {ratio:g}, of {len(upper)} and {len(lower)} levels"
        raise ValueError(msg)
    if not all(0 <= level < n_levels for level in (*upper, *lower)):
        msg = f"levels of its exposures are not those of {n_levels}"
        raise ValueError(msg)
    return SeenTransfer(ratio, upper, lower)


def _raw(entry: JsonObject) -> RawEstimate:
    red, green, blue = (float(weight) for weight in entry["matrix"])
    return RawEstimate(
        (red, green, blue),
        tuple(float(gain) for gain in entry["gains"]),
        float(entry["corner_gain"]),
        float(entry["scatter"]),
    )


def _history(entry: JsonObject) -> SearchHistory:
    values = tuple(float(value) for value in entry["values"])
    if not values or not np.isfinite(values).all():
        msg = "the values of its search should be numbers"
        raise ValueError(msg)
    return SearchHistory(str(entry["objective"]), values, int(entry["evaluations"]))


def _maybe(value: Any, convert: Callable[[Any], T]) -> T | None:  # noqa: ANN401 - JSON
    return None if value is None else convert(value)
