"""Response curves in the files of other programs, one file here for each format.

`export_response` writes a `chartless.result.calibration.Calibration` for another program,
`import_response` reads one; `FORMATS` lists what there is. A new format is one file beside these:
a leaf of `AbstractFormat` that ends in a call of `register_format`, and one import line here. The
order of these lines is that in which files are recognised: formats with marks of their own first.
"""

from chartless.formats._base import FORMATS as FORMATS
from chartless.formats._base import AbstractFormat as AbstractFormat
from chartless.formats._base import Encoded as Encoded
from chartless.formats._base import ExportSettings as ExportSettings
from chartless.formats._exchange import encode_response as encode_response
from chartless.formats._exchange import export_response as export_response
from chartless.formats._exchange import import_response as import_response
from chartless.formats._exchange import is_calibration as is_calibration
from chartless.formats._exchange import load_calibration as load_calibration
from chartless.formats.named import known_names as known_names

from chartless.formats.opencv import OpenCv as OpenCv  # isort: skip
from chartless.formats.clf import Clf as Clf  # isort: skip
from chartless.formats.icc import Icc as Icc  # isort: skip
from chartless.formats.csp import Csp as Csp  # isort: skip
from chartless.formats.spi1d import Spi1d as Spi1d  # isort: skip
from chartless.formats.resolve import Resolve as Resolve  # isort: skip
from chartless.formats.cube import Cube as Cube  # isort: skip
from chartless.formats.hugin import Hugin as Hugin  # isort: skip
from chartless.formats.ppisp import Ppisp as Ppisp  # isort: skip
from chartless.formats.hdrgen import HdrGen as HdrGen  # isort: skip
from chartless.formats.npz import Npz as Npz  # isort: skip
from chartless.formats.radical import Radical as Radical  # isort: skip
from chartless.formats.hdrtoolbox import HdrToolbox as HdrToolbox  # isort: skip
from chartless.formats.pfstools import PfsTools as PfsTools  # isort: skip
from chartless.formats.luminance import Luminance as Luminance  # isort: skip
from chartless.formats.alicevision import AliceVision as AliceVision  # isort: skip
from chartless.formats.plain_csv import Csv as Csv  # isort: skip
from chartless.formats.curve import Curve as Curve  # isort: skip
from chartless.formats.dng import Dng as Dng  # isort: skip
from chartless.formats.dso import Dso as Dso  # isort: skip
