"""Projects of Hugin, which hold a response as five coefficients of EMoR.

f = f0 + Ra h1 + … + Re h5, straight lines between the irradiances k/1023, one curve for red, green
and blue. Before Hugin inverts it, what lies above white is cut off and what falls is held at the
maximum so far. M. D. Grossberg and S. K. Nayar, *Modeling the space of camera response functions*
(TPAMI 2004), section 4, describe f0 and h. The numbers in ``hugin.npz`` are those inside the
program, measured by ``scripts/measure_hugin.py``, not those of `chartless.models.Emor`; their
licence is in ``hugin.LICENSE``.

A project is a text of one letter and parameters a line: ``p`` is the panorama, each ``i`` is a
picture, with ``Ra0.1`` for a value and ``Ra=0`` for that of picture 0, which comes before. ``Rt1``
means that the picture is linear.
"""

import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import islice
from typing import ClassVar, final

import numpy as np
from typing_extensions import override

from chartless._numeric.quadratic import constrained_step
from chartless.curves import SampledCurve
from chartless.errors import ParameterError
from chartless.formats._base import (
    AbstractFormat,
    Encoded,
    ExportSettings,
    Keeps,
    Source,
    register_format,
)
from chartless.formats._nearest import difference
from chartless.formats._tables import UNMEASURED_VIGNETTING, calibration_of_curves
from chartless.models import UNIFORM_IRRADIANCE, Basis, EmorMonotone
from chartless.result.calibration import Calibration
from chartless.types import Floats

COEFFICIENTS = ("Ra", "Rb", "Rc", "Rd", "Re")

_LEVELS = np.linspace(0.0, 1.0, 256)
_SIZE = (3000, 2000)
_PROJECT = """\
# hugin project file
#hugin_ptoversion 2
# For a picture of {width} x {height}: nona -o linear.tif THIS_PROJECT PICTURE
p f0 w{width} h{height} v50 E0 R1 T"FLOAT" n"TIFF c:LZW"
m i6
i w{width} h{height} f0 v50 {response} Eev0 Er1 Eb1 r0 p0 y0 Va1 Vb0 Vc0 Vd0 Vm5 n"photo.jpg"
"""

_PANORAMA = re.compile(r"^p[ \t][^\r\n]*\bf-?\d", re.MULTILINE)
_IMAGE = re.compile(r"^i[ \t][^\r\n]*", re.MULTILINE)
_PARAMETER = re.compile(r"(?<=[ \t])(R[a-et])(=?)([^ \t]*)")
_OTHER = re.compile(r"(?<=[ \t])(Eev|Er|Eb|V[a-d])([^ \t=]+)")
_DEFAULTS = {"Eev": 0.0, "Er": 1.0, "Eb": 1.0, "Va": 1.0, "Vb": 0.0, "Vc": 0.0, "Vd": 0.0}
_EMOR, _LINEAR = 0, 1  # of Rt
_MOST_IMAGES, _LONGEST_LINE = 10_000, 1 << 16
_LARGEST = 1e6
_RISE = 1e-9
_ROUNDING = 1e-7  # of float32
_SEEN = 5e-5  # what is less is 0.0000 in print


@final
@dataclass(frozen=True, slots=True)
class Hugin(AbstractFormat):
    """Coefficients Ra … Re of every picture of a project."""

    name: ClassVar[str] = "hugin"
    title: ClassVar[str] = "Hugin project"
    suffix: ClassVar[str] = ".pto"
    programs: ClassVar[str] = "Hugin, nona"
    tested_with: ClassVar[str] = "nona"
    precision: ClassVar[float] = 1e-5
    keeps: ClassVar[Keeps] = Keeps(
        channels="their mean response", scale="1 at white", curves="nearest of EMoR-5"
    )
    takes: ClassVar[frozenset[str]] = frozenset({"size", "project"})

    @override
    def encode(self, calibration: Calibration, settings: ExportSettings) -> Encoded:
        """Project of one picture, or a copy of one that exists with this response in it.

        In a copy each picture gets the coefficients, but for links to others, which stay. Names of
        files stay too, so that a copy belongs beside the project.
        """
        curves = np.array([each.response_lut for each in calibration.channels])
        mean = curves.mean(axis=0)
        coefficients = _nearest(mean)
        values = {
            name: f"{value:.9g}" for name, value in zip(COEFFICIENTS, coefficients, strict=True)
        }
        if settings.project is None:
            width, height = settings.size or _SIZE
            response = " ".join(name + value for name, value in values.items())
            text = _PROJECT.format(width=width, height=height, response=response)
            vignetting = [UNMEASURED_VIGNETTING]
        else:
            text = _copied(Source.read(settings.project), values)
            vignetting = []  # that of the project stays
        sized = settings.project or settings.size
        lost = [] if sized else ["the size of the pictures, give `size` or `project`"]
        lost += [*vignetting, *_differing(curves), _residual(mean, _nodes(coefficients))]
        return Encoded(text.encode("latin-1"), tuple(lost))

    @override
    def recognises(self, source: Source) -> bool:
        return bool(_PANORAMA.search(source.head) and _IMAGE.search(_text(source)))

    @override
    def decode(self, source: Source) -> Calibration:
        """Calibration of the response that the pictures of a project share."""
        lines = _image_lines(source)
        nodes = _nodes_of(lines)
        return calibration_of_curves(
            [_as_applied(nodes)],
            source,
            self.name,
            remarks=_ignored(lines),
            falls=bool(np.any(np.diff(nodes) < -_ROUNDING)),
        )


register_format(Hugin())


@cache
def _family() -> EmorMonotone:
    with resources.files("chartless.formats").joinpath("hugin.npz").open("rb") as file:
        rows = np.load(file)["response"].astype(np.float64)
    unknown = np.full(len(COEFFICIENTS), np.nan)
    return EmorMonotone(len(COEFFICIENTS) - 1, Basis(rows[0], rows[1:], unknown))


def _nodes(coefficients: Floats) -> Floats:
    """Brightness f at the irradiances k/1023, shape (1024,)."""
    mean, components = _family().parts
    nodes: Floats = mean + coefficients @ components
    return nodes


def _nearest(curve: Floats) -> Floats:
    """Coefficients (5,) of the increasing member nearest to f at the irradiances k/1023."""
    family = _family()
    mean, components = family.parts
    inequalities = family.inequalities(family.projected(mean))
    coefficients = constrained_step(components.T, mean - curve, *inequalities)
    return coefficients.astype(np.float32).astype(np.float64)  # as Hugin keeps them


def _as_applied(nodes: Floats) -> SampledCurve:
    """Curve through brightnesses at the irradiances k/1023, as Hugin inverts it."""
    rising = np.maximum.accumulate(np.minimum(nodes, 1))
    # So little that it changes nothing keeps white at irradiance 1 where the curve ends level.
    brightness = rising * (1 - _RISE) + _RISE * UNIFORM_IRRADIANCE
    return SampledCurve(tuple(UNIFORM_IRRADIANCE.tolist()), tuple(brightness.tolist()))


def _differing(curves: Floats) -> list[str]:
    """How channels differ, if they do."""
    most = np.abs(curves - curves.mean(axis=0)).max()
    loss = f"that channels differ from their mean, by up to {most:.4f} of brightness"
    return [loss] if most > _SEEN else []


def _residual(wanted: Floats, nodes: Floats) -> str:
    """How far the curve of the file is from the one wanted, both at the irradiances k/1023."""
    wanted_inverse, inverse = (_as_applied(each).inverse(_LEVELS) for each in (wanted, nodes))
    family = _family()
    monotone = "increasing" if family.admits(family.projected(wanted)) else "kept from falling"
    off = difference(wanted - nodes, wanted_inverse - inverse)
    return f"what 5 coefficients of EMoR cannot follow: {off} ({monotone})"


def _text(source: Source) -> str:
    """Content with a character for each byte: names of files may be in any encoding."""
    return source.content.decode("latin-1")


def _copied(source: Source, values: dict[str, str]) -> str:
    """Text of a project with these coefficients in it."""
    try:
        _image_lines(source)
    except ValueError as error:
        msg = f"{source.path}: no Hugin project to copy: {error}"
        raise ParameterError(msg) from error
    return _IMAGE.sub(lambda found: _with_response(found[0], values), _text(source))


def _with_response(line: str, values: dict[str, str]) -> str:
    """Line of a picture with these coefficients, but for links."""
    parts = line.split('"')  # every second one is the name of a file
    held = {found[1] for part in parts[::2] for found in _PARAMETER.finditer(part)}
    known = {**values, "Rt": str(_EMOR)}

    def replaced(found: re.Match[str]) -> str:
        return found[0] if found[2] else found[1] + known[found[1]]

    parts[::2] = [_PARAMETER.sub(replaced, part) for part in parts[::2]]
    missing = [f" {name}{value}" for name, value in values.items() if name not in held]
    return "".join(["i", *missing, '"'.join(parts)[1:]])


def _image_lines(source: Source) -> list[str]:
    """Lines of pictures without names of files; raises ValueError if there are none."""
    found = islice(_IMAGE.finditer(_text(source)), _MOST_IMAGES + 1)
    lines = [each[0] for each in found]
    if not lines:
        msg = "it has no picture, a line that begins with i"
        raise ValueError(msg)
    if len(lines) > _MOST_IMAGES or max(map(len, lines)) > _LONGEST_LINE:
        msg = f"it has more than {_MOST_IMAGES} pictures, or more on a line than Hugin writes"
        raise ValueError(msg)
    return ['""'.join(line.split('"')[::2]) for line in lines]


def _nodes_of(lines: list[str]) -> Floats:
    """Nodes of the response that all pictures share; raises ValueError if they do not."""
    first = _parameters(lines[0], 0, {})
    for number, line in enumerate(lines[1:], start=1):
        if _parameters(line, number, first) != first:
            msg = (
                f"picture {number} has a different response from picture 0: keep the pictures "
                "of one camera"
            )
            raise ValueError(msg)
    if first["Rt"] == _LINEAR:
        return UNIFORM_IRRADIANCE
    if first["Rt"] != _EMOR:
        msg = f"it has a response of type Rt{first['Rt']:g}, for which a project holds no curve"
        raise ValueError(msg)
    return _nodes(np.array([first[name] for name in COEFFICIENTS]))


def _parameters(line: str, number: int, first: dict[str, float]) -> dict[str, float]:
    """Parameters of the response of a picture; those before it all have the parameters `first`."""
    values = dict.fromkeys((*COEFFICIENTS, "Rt"), 0.0)
    for name, link, text in _PARAMETER.findall(line):
        if link and not (text.isdecimal() and int(text[:9]) < number):
            msg = f"{name}={text[:20]} of picture {number} is not an earlier picture"
            raise ValueError(msg)
        values[name] = first[name] if link else _number(name, text)
    return values


def _number(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not abs(value) <= _LARGEST:
        msg = f"{name} must be a number up to {_LARGEST:g}, not {text[:20]!r}"
        raise ValueError(msg)
    return value


def _ignored(lines: list[str]) -> list[str]:
    """What else the project records of a picture's light, if anything."""
    recorded = {
        name
        for line in lines
        for name, text in _OTHER.findall(line)
        if _number(name, text) != _DEFAULTS[name]
    }
    shown = ", ".join(name for name in _DEFAULTS if name in recorded)
    return (
        [f"exposure, white balance and vignetting ({shown}) are not part of it"] if recorded else []
    )
