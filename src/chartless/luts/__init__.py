"""Response curves in the files of other programs, one file here for each format.

`export_response` writes a `chartless.calibration.Calibration` for another program,
`import_response` reads one; `FORMATS` lists what there is. A new format is one file beside these:
a leaf of `AbstractFormat` that ends in a call of `register_format`, and one import line here. The
order of these lines is that in which files are recognised: formats with marks of their own first.
"""

from chartless.luts._base import FORMATS as FORMATS
from chartless.luts._base import AbstractFormat as AbstractFormat
from chartless.luts._base import Encoded as Encoded
from chartless.luts._base import ExportSettings as ExportSettings
from chartless.luts._exchange import encode_response as encode_response
from chartless.luts._exchange import export_response as export_response
from chartless.luts._exchange import import_response as import_response
from chartless.luts._exchange import is_calibration as is_calibration
from chartless.luts._exchange import load_calibration as load_calibration

from chartless.luts.opencv import OpenCv as OpenCv  # isort: skip
from chartless.luts.clf import Clf as Clf  # isort: skip
from chartless.luts.icc import Icc as Icc  # isort: skip
from chartless.luts.csp import Csp as Csp  # isort: skip
from chartless.luts.spi1d import Spi1d as Spi1d  # isort: skip
from chartless.luts.resolve import Resolve as Resolve  # isort: skip
from chartless.luts.cube import Cube as Cube  # isort: skip
from chartless.luts.hugin import Hugin as Hugin  # isort: skip
from chartless.luts.npz import Npz as Npz  # isort: skip
from chartless.luts.radical import Radical as Radical  # isort: skip
from chartless.luts.hdrtoolbox import HdrToolbox as HdrToolbox  # isort: skip
from chartless.luts.pfstools import PfsTools as PfsTools  # isort: skip
from chartless.luts.luminance import Luminance as Luminance  # isort: skip
from chartless.luts.alicevision import AliceVision as AliceVision  # isort: skip
from chartless.luts.plain_csv import Csv as Csv  # isort: skip
from chartless.luts.curve import Curve as Curve  # isort: skip
from chartless.luts.dng import Dng as Dng  # isort: skip
from chartless.luts.dso import Dso as Dso  # isort: skip
