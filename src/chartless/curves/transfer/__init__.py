"""Transfer functions by the names of their standards and makers.

`TRANSFER_FUNCTIONS` lists them; `chartless.curves.named_curve` finds one by what a user calls it.
A new one is an entry in the module of its kind here: display standards in `video`, curves of
cameras in `logarithmic`, which for one without a formula of its own needs numbers alone.
"""

from chartless.curves.transfer._base import TRANSFER_FUNCTIONS as TRANSFER_FUNCTIONS
from chartless.curves.transfer._base import AbstractFormula as AbstractFormula
from chartless.curves.transfer._base import PublishedCurve as PublishedCurve
from chartless.curves.transfer._base import TransferFunction as TransferFunction
from chartless.curves.transfer._base import find_transfer_function as find_transfer_function

from chartless.curves.transfer import video as video  # isort: skip
from chartless.curves.transfer import logarithmic as logarithmic  # isort: skip
