"""Calibrations by name: what ``srgb`` or ``icc`` is where a file is taken.

`named_calibration` finds one. Published transfer functions and families of curves are known to
`chartless.curves.named_curve`; a name that makes a whole calibration, with a band or a curve for
each channel, is one file beside these that ends in a call of `register_named`, and one import line
here.
"""

from chartless.formats.named._base import NAMED as NAMED
from chartless.formats.named._base import NamedCalibration as NamedCalibration
from chartless.formats.named._base import Request as Request
from chartless.formats.named._find import known_names as known_names
from chartless.formats.named._find import named_calibration as named_calibration
from chartless.formats.named._find import require_name as require_name

from chartless.formats.named import embedded as embedded  # isort: skip
from chartless.formats.named import typical as typical  # isort: skip
