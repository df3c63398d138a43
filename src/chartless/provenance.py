"""Where a calibration is from: what its file says besides the curves."""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

from chartless._version import __version__
from chartless.curves import ModelCurve
from chartless.frame import FrameSource
from chartless.response import Response, rmse
from chartless.types import JsonObject

_LINEAR = 0.01  # RMSE from a straight line


def provenance(
    sources: Sequence[FrameSource],
    settings: JsonObject,
    responses: Sequence[Response],
    *,
    exposures: list[JsonObject] | None = None,
    remarks: Iterable[str] = (),
) -> JsonObject:
    """Version, time, inputs, settings, and remarks on what was read and what came out.

    Parameters
    ----------
    sources : sequence of FrameSource
        Of the frames that were used.
    settings : JsonObject
        Of evidence and method.
    responses : sequence of Response
        The result.
    exposures : list of JsonObject, optional
        Of a bracket.
    remarks : iterable of str
        More of them.
    """
    return {
        "chartless": __version__,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "inputs": [_input(source) for source in sources],
        "settings": settings,
        "exposures": exposures,
        "remarks": [
            *(f"{each.path}: {remark}" for each in sources for remark in each.remarks),
            *_linear(responses),
            *remarks,
        ],
    }


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
