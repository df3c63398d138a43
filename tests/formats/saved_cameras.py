"""Calibrations to save and load again, and files of them to damage."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response, load, save
from chartless.errors import CalibrationFileError, ChartlessError
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers, account_of_bracket
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.raw.account import account_of_raw
from chartless.flags import Flag
from chartless.formats.calibration_file import to_json
from chartless.noise import NoiseError
from chartless.result.account import AbstractRecord, Account, Column, Reading, Table
from chartless.result.response import SearchHistory, Status

Place = tuple[str | int, ...]
"""Keys that lead to a value in a file."""
MISSING = object()
"""No value, and no key either."""
ODD: tuple[Any, ...] = (
    float("nan"),
    float("inf"),
    -1,
    10**30,
    [],
    {},
    [float("nan")],
    [[]],
    [-1, 1],
    "\n",
)
"""Values that are no good in most places."""

CURVE = ModelCurve("ameegc2-exact", (-0.8, 1.5, -0.6))
PAIRS = replace(
    account_of_pairs(
        Cooccurrence(np.eye(16, dtype=np.int64) * 5), similarity=0.987654321, outliers=0.02
    ),
    details={"clipped": "the lamp is white"},
    share=0.25,
)
EXPOSURES = account_of_bracket(
    "Y",
    CURVE,
    exposures=(1.0, 2.0 + 1 / 3, 16.0),
    exponent_error=1 / 7,
    scatter=0.012345678901234567,
    transfers=SeenTransfers(16, (SeenTransfer(2 + 1 / 3, (5.0, 9.0), (3.25, 6.1)),)),
)
RAW = account_of_raw(
    matrix=(1.5, -1 / 3, -1 / 6), gains=(1.0, 1.1), corner_gain=1.23456789012345678, scatter=1e-3
)
READING = Reading(
    kind="bracket",
    title="exposures of one scene",
    sentence="a bracket of 2 exposures, 1 to 4 by EXIF",
    inputs=(1, 0),
    tables=(
        Table(
            "exposures",
            "Exposures as given",
            (Column("file", "Exposure", "file"), Column("relative", "Relative", ".4g")),
            (("ä.png", 1 / 3), ("b.png", None)),
        ),
    ),
    example=1,
)


def response_of(name: str = "Y", **changes: Any) -> Response:
    values: dict[str, Any] = {
        "name": name,
        "curve": CURVE,
        "noise": AffineNoise.from_8bit(0.03, 16),
        "n_levels": 16,
        "observed_levels": (1, 14),
        "n_pairs": 1234,
        "method": "ism-bin",
        "status": Status.LIMIT_REACHED,
        "flags": (Flag.CLIPPED, Flag.SEARCH_UNFINISHED),
        "history": SearchHistory("bin", (0.1, 1 / 3, 0.9), 77),
        "accounts": (EXPOSURES, PAIRS),
    }
    return Response(**{**values, **changes})


def one(response: Response, *evidence: Reading) -> Calibration:
    provenance = {
        "chartless": "0.1.0",
        "inputs": [
            {"file": "ä.png", "sha256": "0"},
            {"file": "b.png", "sha256": "1", "frames": [1, 9], "used": 3},
        ],
        "settings": {"method": "ism-bin"},
        "remarks": ["b.png: a remark"],
    }
    return Calibration(channels=(response,), bit_depth=8, evidence=evidence, provenance=provenance)


def again(calibration: Calibration, path: Path) -> Calibration:
    save(calibration, path)
    return load(path)


def same(first: Response, second: Response) -> None:
    for field in (
        *("name", "curve", "noise", "n_levels", "observed_levels", "n_pairs"),
        *("method", "status", "flags", "history"),
    ):
        assert getattr(first, field) == getattr(second, field), field
    assert np.array_equal(first.inverse_lut, second.inverse_lut)
    assert np.array_equal(first.response_lut, second.response_lut)
    assert first.kinds == second.kinds
    for before, after in zip(first.accounts, second.accounts, strict=True):
        same_account(before, after)


def same_account(first: Account, second: Account) -> None:
    for field in ("kind", "facts", "fits", "details", "share"):
        assert getattr(first, field) == getattr(second, field), field
    same_record(first.record, second.record)


def same_record(first: AbstractRecord | None, second: AbstractRecord | None) -> None:
    if isinstance(first, Cooccurrence) and isinstance(second, Cooccurrence):
        assert second.counts.dtype == np.int64
        assert np.array_equal(first.counts, second.counts)
    else:
        assert first == second


def record_of(calibration: Calibration, kind: str = "noise") -> AbstractRecord | None:
    return calibration.channels[0].account(kind).record


def same_reading(first: Reading, second: Reading) -> None:
    for field in ("kind", "title", "sentence", "inputs", "tables", "example"):
        assert getattr(first, field) == getattr(second, field), field


SURE = response_of(
    inverse_lut_std=np.linspace(0, 0.01, 16),
    shape_std=np.linspace(0, 0.009, 16),
    white_std=0.01,
    noise_error=NoiseError(0.1, 0.2, -0.5),
    log_evidence=-1234.5,
)
WHOLE: Any = json.loads(json.dumps(to_json(one(SURE, READING))))
"""What a file may hold, once: errors, accounts with records, a reading with a table."""


def put(place: Place, content: Any, value: Any) -> None:
    """Set a value in the content of a file."""
    for key in place[:-1]:
        content = content[key]
    if value is MISSING:
        del content[place[-1]]
    else:
        content[place[-1]] = value


def places_in(value: Any, place: Place = ()) -> Iterator[Place]:
    """Places of everything in a file; of lists of anything but objects only the first."""
    entries: list[tuple[str | int, Any]] = []
    if isinstance(value, dict):
        entries = list(value.items())
    elif isinstance(value, list):
        objects = any(isinstance(each, dict) for each in value)
        entries = list(enumerate(value if objects else value[:1]))
    for key, each in entries:
        yield (*place, key)
        yield from places_in(each, (*place, key))


def refused(content: Any, path: Path) -> str:
    """Why a file with this content is not read."""
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(CalibrationFileError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert isinstance(caught.value, ChartlessError)
    return message.removeprefix(f"{path}: ")


def kept_or_refused(content: Any, path: Path) -> None:
    """A file is refused; or it is loaded, and loaded again when it was saved."""
    path.write_text(json.dumps(content))
    try:
        calibration = load(path)
    except CalibrationFileError:
        return
    again(calibration, path)
