"""Calibrations to save and load again, and what files of them hold, to damage."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chartless import AffineNoise, Calibration, Cooccurrence, ModelCurve, Response
from chartless.errors import CalibrationFileError
from chartless.evidence.bracket.account import SeenTransfer, SeenTransfers, account_of_bracket
from chartless.evidence.noise.account import account_of_pairs
from chartless.evidence.raw.account import account_of_raw
from chartless.flags import Flag
from chartless.formats.calibration_file import from_json, to_json, to_text
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
VALUES: dict[str, tuple[Any, ...]] = {
    "usual": (MISSING, None, "x"),
    "odd": (True, 0, 0.5, "", [None], ["x"], [{}], *ODD),
}
"""What stands where something else should."""

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


@contextmanager
def about(case: object) -> Iterator[None]:
    """Name the case, of several in one test, in what goes wrong with it."""
    try:
        yield
    except BaseException as error:
        error.add_note(f"about {case!r}")
        raise


def again(calibration: Calibration) -> Calibration:
    """The calibration from the text of its file, but for the file."""
    return from_json(json.loads(to_text(calibration)))


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


def changed(content: Any, place: Place, value: Any) -> Any:
    """The content of a file with another value at a place; the rest is shared, not copied."""
    key, *rest = place
    content = content.copy()
    if rest:
        content[key] = changed(content[key], tuple(rest), value)
    elif value is MISSING:
        del content[key]
    else:
        content[key] = value
    return content


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


def refused(content: Any) -> str:
    """Why a file with this content is not read."""
    with pytest.raises(CalibrationFileError) as caught:
        from_json(content)
    return str(caught.value)


def refused_as_damaged(content: Any, word: str = "") -> None:
    """In one line, with what is wrong and what to do."""
    message = refused(content)
    assert message.startswith("damaged calibration file: "), message
    assert message.endswith("; calibrate again"), message
    assert "\n" not in message, message
    assert word in message, f"{word!r} is not in {message!r}"


def kept_or_refused(content: Any) -> None:
    """A file is refused; or it is loaded, and loaded again when it was saved."""
    try:
        calibration = from_json(content)
    except CalibrationFileError:
        return
    again(calibration)
