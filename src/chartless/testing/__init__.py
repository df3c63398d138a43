"""What holds of every kind of evidence, family of curves and file format, as checks.

They are run over all that chartless has, and over what you write: call them from a test. Each
raises AssertionError with one sentence if something does not hold.

    >>> from chartless.models import MODELS
    >>> from chartless.testing import check_family
    >>> check_family(MODELS["ameegc2-exact"])
"""

from chartless.testing._families import check_family
from chartless.testing._formats import check_format
from chartless.testing._kinds import check_kind, check_term

__all__ = ["check_family", "check_format", "check_kind", "check_term"]
