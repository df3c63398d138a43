"""How much evidence counts whose model is known to be wrong: one rule for all kinds.

A likelihood takes its model for exact, and enough pixels make it sure of anything. Where
the data show that what is measured is off by a relative error s, no number of pixels is
better than the 2/s² independent differences that would determine a variance to ± s. The
likelihood is scaled to that number: with a small one, the result is the typical curve with
its band. docs/design/0015-never-worse.md has the measurements.
"""

from collections.abc import Iterable

import numpy as np

NEARLY_NOTHING = 200.0
"""Number of observations below which the result is mostly that of the prior."""


def counts_as(errors: Iterable[float]) -> float:
    """Largest number of independent observations that evidence counts as.

    Parameters
    ----------
    errors : iterable of float
        Relative errors of a measured variance, 0 and above, one for each thing that is
        wrong with the model.

    Returns
    -------
    float
        Infinite without errors.
    """
    total = sum(error**2 for error in errors)
    return 2 / total if total else np.inf
