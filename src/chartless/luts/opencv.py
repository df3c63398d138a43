"""OpenCV's response curves: the output of CalibrateCRF, kept by FileStorage.

``cv2.createCalibrateDebevec().process(…)`` and its sisters return irradiance at the 256 levels,
float32 of 256 × 1 × 3 in the order of ``cv2.imread``, blue first, linear, about 1 at level 128.
The scale means nothing: of each channel alone it is set there, so that how channels compare is not
known, and here each is scaled to 1 at white like any other calibration.

There is no file format of its own; people store the matrix with ``cv2.FileStorage`` as YAML, XML or
JSON, under any name. Read here is what that class writes, not these languages: nodes that are
matrices, at the top of the file.
"""

import hashlib
import json
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from chartless._version import __version__
from chartless.calibration import Calibration
from chartless.curves import SampledCurve
from chartless.errors import CalibrationFileError
from chartless.flags import Flag
from chartless.response import Response, Status
from chartless.types import Floats

N_LEVELS = 256
"""Levels that OpenCV calibrates."""
MOST_BYTES = 1 << 22
"""A file of 256 levels has some 10 kB."""

_RISE = 1e-9
_MATRICES = ("opencv-matrix", "opencv-nd-matrix")
_NODE = re.compile(
    r"^([^\s#:]+):[ ]*!!(opencv-(?:nd-)?matrix)[ ]*\n((?:[ \t]+[^\n]*(?:\n|\Z))*)", re.MULTILINE
)
_FIELD = re.compile(r"^[ \t]+(rows|cols|dt|sizes):[ ]*([^\n]*)", re.MULTILINE)
_NOT_JSON = re.compile(r"(?<=[\s,\[])(-?)\.(?:(Nan)|Inf)\b")
_TYPE = re.compile(r"([1-4]?)([fd])")
_NAMES = {1: ("Y",), 3: ("B", "G", "R")}
_FOREIGN = "holds no response of OpenCV: give a matrix of 256 × 1 with 1 or 3 channels of floats"


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """A node of a file."""

    name: str
    values: Floats
    """Shape (rows, columns · channels); NaN and infinite where the file says so."""


def recognised(path: str | os.PathLike[str]) -> bool:
    """Whether the file holds a matrix of OpenCV, by its content; False if it cannot be read."""
    try:
        text = _decoded(Path(path), _content(Path(path)))
    except CalibrationFileError:
        return False
    return text.lstrip()[:1] in "%-<{" and any(name in text for name in _MATRICES)


def read(path: str | os.PathLike[str]) -> Calibration:
    """Read a response of OpenCV.

    Parameters
    ----------
    path : path-like
        A file that ``cv2.FileStorage`` wrote. Of several matrices the one named "response" is
        taken, or the only one that can be a response.

    Returns
    -------
    Calibration
        Of method "opencv", without noise. Gaps (NaN) are filled by straight lines, above the
        highest level known by the value there, and `provenance` has a remark. A curve that falls
        somewhere is held at its maximum so far and flagged `Flag.NOT_MONOTONE`.

    Raises
    ------
    CalibrationFileError
        If the file cannot be read, is damaged or holds no response.
    """
    path = Path(path)
    content = _content(path)
    text = _decoded(path, content)
    try:
        matrices = list(_matrices(text))
    except (ValueError, TypeError, ArithmeticError, RecursionError, LookupError) as error:
        msg = f"{path}: damaged OpenCV file: {' '.join(str(error).split())[:120]}"
        raise CalibrationFileError(msg) from error
    except ET.ParseError as error:
        msg = f"{path}: damaged OpenCV file: not XML: {error}"
        raise CalibrationFileError(msg) from error
    table = _response_table(path, matrices)
    remarks: list[str] = []
    names = _NAMES[table.shape[1]]
    channels = tuple(
        _response(path, name, table[:, place], remarks) for place, name in enumerate(names)
    )
    return Calibration(
        channels=channels[::-1],
        bit_depth=8,
        provenance={
            "chartless": __version__,
            "inputs": [{"file": str(path), "sha256": hashlib.sha256(content).hexdigest()}],
            "settings": {"method": "opencv"},
            "remarks": remarks,
        },
    )


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror or error}"
        raise CalibrationFileError(msg) from error
    if len(content) > MOST_BYTES:
        msg = f"{path}: is larger than any response of OpenCV: give the file that holds it alone"
        raise CalibrationFileError(msg)
    return content


def _decoded(path: Path, content: bytes) -> str:
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        msg = f"{path}: is no text, as calibrations and the files of OpenCV are"
        raise CalibrationFileError(msg) from error


def _response_table(path: Path, matrices: list[Matrix]) -> Floats:
    """Shape (256, 1 or 3)."""
    shapes = [(N_LEVELS, n_channels) for n_channels in _NAMES]
    fitting = {each.name: each.values for each in matrices if each.values.shape in shapes}
    if not fitting:
        msg = f"{path}: {_FOREIGN}"
    elif len(fitting) > 1 and "response" not in fitting:
        msg = (
            f"{path}: {', '.join(fitting)} can each be a response: name the right one 'response' "
            "or keep it in a file of its own"
        )
    else:
        return fitting.get("response", next(iter(fitting.values())))
    raise CalibrationFileError(msg)


def _response(path: Path, name: str, table: Floats, remarks: list[str]) -> Response:
    (known,) = np.nonzero(np.isfinite(table))
    if not known.size or not table[known].max() > 0:
        msg = f"{path}: channel {name} has no irradiance above 0"
        raise CalibrationFileError(msg)
    level = np.arange(N_LEVELS)
    if known.size < N_LEVELS:
        remarks.append(
            f"{path}: channel {name}: filled {N_LEVELS - known.size} levels without value"
        )
    # OpenCV's black is above 0, as it takes logarithms; ours is 0.
    inside = known[known > 0]
    filled = np.interp(level, [0, *inside], [0.0, *table[inside]])
    rising = np.maximum.accumulate(filled)
    # So little that it changes nothing keeps apart levels of one irradiance, which else would be
    # joined by a line to the next: white that begins below the top stays where it is.
    lut = rising / rising[-1] * (1 - _RISE) + _RISE * level / (N_LEVELS - 1)
    response = Response(
        name=name,
        curve=SampledCurve.from_inverse(lut),
        noise=None,
        n_levels=N_LEVELS,
        observed_levels=(int(known[0]), int(known[-1])),
        n_pairs=0,
        method="opencv",
        status=Status.CONVERGED,
    )
    return response.with_flags(*([Flag.NOT_MONOTONE] if np.any(np.diff(filled) < 0) else []))


def _matrices(text: str) -> Iterator[Matrix]:
    start = text.lstrip()[:1]
    if start == "<":
        yield from _from_xml(text)
    elif start == "{":
        yield from _from_json(text)
    else:
        yield from _from_yaml(text)


def _from_yaml(text: str) -> Iterator[Matrix]:
    for name, kind, body in _NODE.findall(text):
        head, found, rest = body.partition("data:")
        data, end, _ = rest.partition("]")
        if not (found and end):
            msg = f"the matrix {name} has no data, or they are cut short"
            raise ValueError(msg)
        numbers = data.replace(",", " ").replace("[", " ", 1).split()
        yield _matrix(name, kind, dict(_FIELD.findall(head)), numbers)


def _from_xml(text: str) -> Iterator[Matrix]:
    if re.search("<!(?!--)", text):
        msg = "it declares a document type, which OpenCV never writes"  # and which may be a bomb
        raise ValueError(msg)
    root = ET.fromstring(text)  # noqa: S314 - without a document type there are no entities
    for node in root:
        kind = node.get("type_id", "")
        if kind in _MATRICES:
            fields = {child.tag: child.text or "" for child in node}
            yield _matrix(node.tag, kind, fields, fields.get("data", "").split())


def _from_json(text: str) -> Iterator[Matrix]:
    legal = _NOT_JSON.sub(lambda found: "NaN" if found[2] else f"{found[1]}Infinity", text)
    content = json.loads(legal)
    for name, node in content.items():
        if isinstance(node, dict) and node.get("type_id") in _MATRICES:
            fields = {key: str(value) for key, value in node.items() if key != "data"}
            yield _matrix(name, node["type_id"], fields, node["data"])


def _matrix(name: str, kind: str, fields: dict[str, str], data: list[Any]) -> Matrix:
    """Matrix of the texts in a file; raises ValueError if they make none."""
    samples = _TYPE.fullmatch(fields.get("dt", "").strip().strip('"'))
    if samples is None:  # integers: no response
        return Matrix(name, np.zeros((0, 0)))
    if kind == "opencv-nd-matrix":
        sizes = [int(size) for size in re.findall(r"\d{1,9}", fields["sizes"])]
    else:
        sizes = [int(fields["rows"]), int(fields["cols"])]
    rows, columns = sizes[0], math.prod(sizes[1:]) * int(samples[1] or 1)
    if rows * columns != len(data):
        msg = f"the matrix {name} should have {rows} × {columns} numbers, not {len(data)}"
        raise ValueError(msg)
    return Matrix(name, np.array([_number(each) for each in data]).reshape(rows, columns))


def _number(text: Any) -> float:  # noqa: ANN401 - of JSON
    if isinstance(text, str) and text.lstrip("-").startswith((".Nan", ".Inf")):
        text = text.replace(".", "")
    return float(text)
