"""OpenCV's response curves: the output of CalibrateCRF, kept by FileStorage.

``cv2.createCalibrateDebevec().process(…)`` and its sisters return irradiance at the 256 levels,
float32 of 256 × 1 × 3 in the order of ``cv2.imread``, blue first, linear, about 1 at level 128.
The scale means nothing: of each channel alone it is set there, so that how channels compare is not
known.

There is no file format of its own; people store the matrix with ``cv2.FileStorage`` as YAML, XML or
JSON, under any name. Read here is what that class writes, not these languages: nodes that are
matrices, at the top of the file.
"""

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, final
from xml.etree import ElementTree as ET

import numpy as np
from typing_extensions import override

from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._tables import above_zero, calibration_of, inverse_table
from chartless.result.calibration import Calibration
from chartless.types import Floats

N_LEVELS = 256
"""Levels that OpenCV calibrates."""
UNIT_LEVEL = 128
"""Level of irradiance 1."""

_MOST_BYTES = 1 << 22  # 256 levels take some 10 kB
_MATRICES = ("opencv-matrix", "opencv-nd-matrix")
_NODE = re.compile(
    r"^([^\s#:]+):[ ]*!!(opencv-(?:nd-)?matrix)[ ]*\n((?:[ \t]+[^\n]*(?:\n|\Z))*)", re.MULTILINE
)
_FIELD = re.compile(r"^[ \t]+(rows|cols|dt|sizes):[ ]*([^\n]*)", re.MULTILINE)
_NOT_JSON = re.compile(r"(?<=[\s,\[])(-?)\.(?:(Nan)|Inf)\b")
_TYPE = re.compile(r"([1-4]?)([fd])")
_NAMES = {1: ("Y",), 3: ("B", "G", "R")}


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """A node of a file."""

    name: str
    values: Floats
    """Shape (rows, columns · channels); NaN and infinite where the file says so."""


@final
@dataclass(frozen=True, slots=True)
class OpenCv(AbstractFormat):
    """The ``response`` of ``cv2.MergeDebevec`` and ``cv2.MergeRobertson``."""

    name: ClassVar[str] = "opencv"
    title: ClassVar[str] = "OpenCV response"
    suffix: ClassVar[str] = ".yml"
    programs: ClassVar[str] = "OpenCV FileStorage; MergeDebevec, MergeRobertson (also .xml, .json)"
    tested_with: ClassVar[str] = "OpenCV"
    precision: ClassVar[float] = 1e-6
    keeps: ClassVar[Keeps] = Keeps(channels="each", scale="1 at level 128")
    takes: ClassVar[frozenset[str]] = frozenset()

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Matrix of 256 levels, every entry above 0, as MergeDebevec takes logarithms."""
        table = above_zero(inverse_table(calibration, N_LEVELS), calibration)[:, ::-1]
        values = (table / table[UNIT_LEVEL]).astype(np.float32)
        write = {".xml": _as_xml, ".json": _as_json}.get(settings.suffix, _as_yaml)
        n_channels = values.shape[1]
        dt = "f" if n_channels == 1 else f"{n_channels}f"
        return Encoded(write(dt, [f"{each:.9g}" for each in values.ravel()]).encode())

    @override
    def recognises(self, source: Source) -> bool:
        return source.head.lstrip()[:1] in ("%", "-", "<", "{") and any(
            each.encode() in source.content for each in _MATRICES
        )

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration in a file that ``cv2.FileStorage`` wrote.

        If there are several matrices, the one named "response" is taken, or the only one that can
        be it.
        """
        if len(source.content) > _MOST_BYTES:
            msg = "is larger than any response of OpenCV: give the file that holds it alone"
            raise ValueError(msg)
        table = _response_table(list(_matrices(source.text)))
        return calibration_of(table, source, self.name, names=_NAMES[table.shape[1]])


register_format(OpenCv())


def _as_yaml(dt: str, numbers: list[str]) -> str:
    data = ",\n       ".join(_joined(numbers, ", "))
    return (
        "%YAML:1.0\n---\nresponse: !!opencv-matrix\n"
        f'   rows: {N_LEVELS}\n   cols: 1\n   dt: "{dt}"\n   data: [ {data} ]\n'
    )


def _as_xml(dt: str, numbers: list[str]) -> str:
    data = "\n    ".join(_joined(numbers, " "))
    return (
        '<?xml version="1.0"?>\n<opencv_storage>\n<response type_id="opencv-matrix">\n'
        f'  <rows>{N_LEVELS}</rows>\n  <cols>1</cols>\n  <dt>"{dt}"</dt>\n'
        f"  <data>\n    {data}</data></response>\n</opencv_storage>\n"
    )


def _as_json(dt: str, numbers: list[str]) -> str:
    node = {"type_id": "opencv-matrix", "rows": N_LEVELS, "cols": 1, "dt": dt}
    data = ", ".join(numbers)
    return f'{{\n    "response": {json.dumps(node)[:-1]}, "data": [ {data} ]}}\n}}\n'


def _joined(numbers: list[str], between: str) -> list[str]:
    """Lines of four numbers."""
    return [between.join(numbers[at : at + 4]) for at in range(0, len(numbers), 4)]


def _response_table(matrices: list[Matrix]) -> Floats:
    """Shape (256, 1 or 3)."""
    shapes = [(N_LEVELS, n_channels) for n_channels in _NAMES]
    fitting = {each.name: each.values for each in matrices if each.values.shape in shapes}
    if not fitting:
        msg = "holds no response: give a matrix of 256 × 1 with 1 or 3 channels of floats"
        raise ValueError(msg)
    if len(fitting) > 1 and "response" not in fitting:
        msg = (
            f"{', '.join(fitting)} can each be a response: name the right one 'response' "
            "or keep it in a file of its own"
        )
        raise ValueError(msg)
    return fitting.get("response", next(iter(fitting.values())))


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
