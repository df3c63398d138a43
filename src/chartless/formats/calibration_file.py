"""Calibrations as JSON files: readable, without pickle, meant to be read in ten years.

The layout is documented in docs/calibration-file.md. A curve is stored three times: as model
and parameters, which this program reads back; as ``inverse_lut`` and ``response_lut`` for
everybody else. A file whose model is null (another method, another program) is read from its
``inverse_lut``.
"""

import json
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from chartless._files import write_text
from chartless._files.given import why_unreadable
from chartless.curves import AbstractCurve, ModelCurve, SampledCurve
from chartless.errors import CalibrationFileError, ChartlessError
from chartless.evidence.registry import KINDS
from chartless.flags import Flag
from chartless.frames.levels import MIN_LEVELS
from chartless.models import MODELS
from chartless.noise import AffineNoise, NoiseError
from chartless.result.account import (
    AbstractRecord,
    Account,
    Column,
    Fact,
    Fit,
    Reading,
    Table,
    UnknownRecord,
    Value,
    require_form,
)
from chartless.result.calibration import Calibration
from chartless.result.provenance import require_sound
from chartless.result.response import Response, SearchHistory, Status
from chartless.result.verdict import verdict
from chartless.types import Floats, JsonObject

FORMAT, VERSION = "chartless-calibration", 2
MOST_LEVELS = 1 << 16
"""Levels of the deepest pictures; other programs may write as many."""
_MOST_BITS = 16
_LARGEST_ERROR = 1e6  # of irradiance and of ln of noise: any larger is damage

_DAMAGE = (
    TypeError, ValueError, LookupError, ArithmeticError, RecursionError, ChartlessError,
)  # fmt: skip

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
        "evidence": [_reading_to_json(each) for each in calibration.evidence],
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
    try:
        return from_json(content)
    except CalibrationFileError as error:
        msg = f"{path}: {error}"
        raise CalibrationFileError(msg) from error


def from_json(content: object) -> Calibration:
    """Calibration from the content of its file, as JSON types.

    Raises
    ------
    CalibrationFileError
        If it is no calibration, is damaged or of another version.
    """
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        msg = f"not a calibration file: no format {FORMAT!r}; give one by calibrate -o"
        raise CalibrationFileError(msg)
    version = content.get("version")
    if type(version) is not int or not 1 <= version <= VERSION:
        msg = (
            f"written in version {version} of the format; this chartless reads versions 1 to "
            f"{VERSION}: install the newer chartless that wrote it"
        )
        raise CalibrationFileError(msg)
    try:
        return _calibration(content)
    except _DAMAGE as error:
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        msg = f"damaged calibration file: {what}; calibrate again"
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
    if content["version"] == 1:
        evidence = _readings_of_version_1(known, channels)
    else:
        evidence = tuple(_reading(each) for each in content["evidence"])
    if any(not 0 <= place < len(known.get("inputs", [])) for place in _places(evidence)):
        msg = "its evidence names inputs that are not in its provenance"
        raise ValueError(msg)
    return Calibration(channels=channels, bit_depth=bit_depth, evidence=evidence, provenance=known)


def _places(evidence: Sequence[Reading]) -> list[int]:
    """Numbers of all inputs that are named."""
    examples = [each.example for each in evidence if each.example is not None]
    return [*(place for each in evidence for place in each.inputs), *examples]


def _readings_of_version_1(known: JsonObject, channels: Sequence[Response]) -> tuple[Reading, ...]:
    """What was read, of version 1 of the file, whose provenance holds exposures."""
    n_inputs, found = len(known.get("inputs", [])), []
    for name, kind in KINDS.items():
        tables = kind.tables_from_version_1(known, channels)
        if tables or any(name in response.kinds for response in channels):
            sentence = str(known.get("settings", {}).get("evidence", ""))
            found.append(
                Reading(
                    kind=name,
                    title=kind.title,
                    sentence=sentence,
                    inputs=tuple(range(n_inputs)),
                    tables=tables,
                    example=0 if n_inputs else None,
                )
            )
    known.pop("exposures", None)
    return tuple(found)


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
        "parameters_covariance": None
        if _parameters(curve) is None
        else _maybe(response.parameter_covariance, np.ndarray.tolist),
        "inverse_lut": response.inverse_lut.tolist(),
        "inverse_lut_std": _maybe(response.inverse_lut_std, np.ndarray.tolist),
        "shape_std": _maybe(response.shape_std, np.ndarray.tolist),
        "white_std": response.white_std,
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
        "accounts": [_account_to_json(each) for each in response.accounts],
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
    name, curve = str(entry["name"]), _curve(content["model"], entry["parameters"], inverse_lut)
    if content["version"] == 1:
        restored = (each.from_version_1(entry, name, curve, n_levels) for each in KINDS.values())
        accounts = tuple(account for account in restored if account is not None)
    else:
        accounts = tuple(_account(each, n_levels) for each in entry["accounts"])
    return Response(
        name=name,
        curve=curve,
        noise=_maybe(noise, lambda values: AffineNoise(float(values["u"]), float(values["v"]))),
        n_levels=n_levels,
        observed_levels=(low, high),
        n_pairs=int(entry["pairs"]),
        method=str(content["method"]),
        status=Status(entry["status"]),
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
        parameter_covariance=_maybe(
            entry.get("parameters_covariance"),
            lambda _: _numbers(entry, "parameters_covariance", *2 * (len(entry["parameters"]),)),
        ),
        history=_maybe(entry.get("search"), _history),
        accounts=accounts,
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


def _account_to_json(account: Account) -> JsonObject:
    return {
        "kind": account.kind,
        "facts": [each._asdict() for each in account.facts],
        "fits": [each._asdict() for each in account.fits],
        "details": dict(account.details),
        "share": account.share,
        "record": _maybe(account.record, lambda record: record.to_json()),
    }


def _account(entry: JsonObject, n_levels: int) -> Account:
    kind = str(entry["kind"])
    return Account(
        kind=kind,
        facts=tuple(
            Fact(str(each["code"]), str(each["label"]), _value(each["value"]), _form(each))
            for each in entry["facts"]
        ),
        fits=tuple(map(_fit, entry["fits"])),
        details={str(code): str(text) for code, text in _object(entry, "details").items()},
        share=_maybe(entry["share"], float),
        record=_maybe(entry["record"], lambda record: _record(kind, record, n_levels)),
    )


def _record(kind: str, content: JsonObject, n_levels: int) -> AbstractRecord:
    """Record of a kind; of one that is not known here, as it is."""
    return KINDS[kind].restored(content, n_levels) if kind in KINDS else UnknownRecord(content)


def _fit(entry: JsonObject) -> Fit:
    return Fit(
        str(entry["code"]),
        str(entry["label"]),
        float(entry["value"]),
        _form(entry),
        _maybe(entry["good"], float),
        _maybe(entry["bad"], float),
        str(entry["remark"]),
    )


def _reading_to_json(reading: Reading) -> JsonObject:
    tables = [
        {
            "code": table.code,
            "title": table.title,
            "columns": [column._asdict() for column in table.columns],
            "rows": [list(row) for row in table.rows],
        }
        for table in reading.tables
    ]
    return {
        "kind": reading.kind,
        "title": reading.title,
        "sentence": reading.sentence,
        "inputs": list(reading.inputs),
        "example": reading.example,
        "tables": tables,
    }


def _reading(entry: JsonObject) -> Reading:
    return Reading(
        kind=str(entry["kind"]),
        title=str(entry["title"]),
        sentence=str(entry["sentence"]),
        inputs=tuple(int(place) for place in entry["inputs"]),
        tables=tuple(map(_table, entry["tables"])),
        example=_maybe(entry["example"], int),
    )


def _table(entry: JsonObject) -> Table:
    columns = tuple(
        Column(str(each["code"]), str(each["label"]), _form(each)) for each in entry["columns"]
    )
    rows = tuple(tuple(_maybe(cell, _value) for cell in row) for row in entry["rows"])
    if any(len(row) != len(columns) for row in rows):
        msg = f"rows of its table {entry['code']} should have {len(columns)} cells"
        raise ValueError(msg)
    return Table(str(entry["code"]), str(entry["title"]), columns, rows)


def _object(entry: JsonObject, key: str) -> JsonObject:
    value = entry[key]
    if not isinstance(value, dict):
        msg = f"{key} should be an object"
        raise ValueError(msg)  # noqa: TRY004 - of a file
    return value


def _value(value: Any) -> Value:  # noqa: ANN401 - JSON
    if isinstance(value, str):
        return value
    return tuple(map(float, value)) if isinstance(value, list) else float(value)


def _form(entry: JsonObject) -> str:
    return require_form(str(entry["form"]))


def _history(entry: JsonObject) -> SearchHistory:
    values = tuple(float(value) for value in entry["values"])
    if not values or not np.isfinite(values).all():
        msg = "the values of its search should be numbers"
        raise ValueError(msg)
    return SearchHistory(str(entry["objective"]), values, int(entry["evaluations"]))


def _maybe(value: Any, convert: Callable[[Any], T]) -> T | None:  # noqa: ANN401 - JSON
    return None if value is None else convert(value)
