"""Response curves: what they are, which are likely, files of them, and fits of families to them."""

from chartless.curves.curve import AbstractCurve as AbstractCurve
from chartless.curves.curve import ModelCurve as ModelCurve
from chartless.curves.curve import SampledCurve as SampledCurve
from chartless.curves.curve import SrgbCurve as SrgbCurve
from chartless.curves.named import named_curve as named_curve
