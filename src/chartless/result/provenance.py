"""Where a calibration is from: what its file says besides the curves."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from types import UnionType
from typing import Any, TypeAlias

from chartless._version import __version__
from chartless.curves import ModelCurve
from chartless.frames.frame import FrameSource
from chartless.result.response import Response, rmse
from chartless.types import JsonObject

_Kinds: TypeAlias = Mapping[str, type | UnionType]

_LINEAR = 0.01  # RMSE from a straight line
_INPUT: _Kinds = {"file": str, "sha256": str}


def provenance(
    sources: Sequence[FrameSource],
    settings: JsonObject,
    responses: Sequence[Response],
    *,
    remarks: Iterable[str] = (),
) -> JsonObject:
    """Version, time, inputs, settings, and remarks on what was read and what came out.

    Parameters
    ----------
    sources : sequence of FrameSource
        Sources of the frames that were used.
    settings : JsonObject
        Settings of evidence and method.
    responses : sequence of Response
        The result.
    remarks : iterable of str
        More of them.
    """
    return {
        "chartless": __version__,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "inputs": [_input(source) for source in sources],
        "settings": settings,
        "remarks": [
            *(f"{each.path}: {remark}" for each in sources for remark in each.remarks),
            *_linear(responses),
            *remarks,
        ],
    }


def require_sound(known: JsonObject) -> None:
    """Raise ValueError if something is not as `provenance` makes it; anything may be missing."""
    settings, remarks = known.get("settings", {}), known.get("remarks", [])
    if not _are(dict, settings):
        msg = "its settings should be an object"
        raise ValueError(msg)
    if not (_are(list, remarks) and _are(str, *remarks)):
        msg = "its remarks should be texts"
        raise ValueError(msg)
    _require_entries("inputs", known.get("inputs", []), _INPUT)
    for each in known.get("inputs", []):
        first, last = each.get("frames", (1, 1))
        if not _are(int, first, last, each.get("used", 1)):
            msg = "frames of its inputs should be numbers"
            raise ValueError(msg)


def _require_entries(name: str, entries: Any, kinds: _Kinds) -> None:  # noqa: ANN401 - JSON
    if not (_are(list, entries) and _are(dict, *entries)) or not all(
        _are(kind, each.get(key)) for each in entries for key, kind in kinds.items()
    ):
        msg = f"its {name} should each have {', '.join(kinds)}"
        raise ValueError(msg)


def _are(kind: type | UnionType, *values: Any) -> bool:  # noqa: ANN401 - JSON
    return all(isinstance(value, kind) for value in values)


def _input(source: FrameSource) -> JsonObject:
    """Provenance of a file."""
    span = {} if source.span is None else {"frames": list(source.span)}
    used = {} if source.n_used is None else {"used": source.n_used}
    return {"file": str(source.path), "sha256": source.sha256, **span, **used}


def _linear(responses: Sequence[Response]) -> list[str]:
    """Remark that the pictures may hold light already."""
    line = ModelCurve("gamma", (1.0,))
    if any(rmse(response.curve, line) > _LINEAR for response in responses):
        return []
    return [f"the response is linear within {_LINEAR:g}: these pictures may hold light already"]
