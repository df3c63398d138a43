"""Shape-preserving interpolation, against SciPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from chartless._numeric.pchip import pchip

numbers = st.floats(-100, 100).map(lambda value: round(value, 3))


@given(
    st.lists(st.tuples(st.floats(0.01, 3), numbers), min_size=2, max_size=9),
    st.integers(0, 2**32 - 1),
)
def test_it_is_that_of_scipy(points: list[tuple[float, float]], seed: int) -> None:
    x = np.cumsum([step for step, _ in points])
    y = np.array([value for _, value in points])
    wanted = np.append(np.random.default_rng(seed).uniform(x[0], x[-1], 50), x)

    found = pchip(x, y, wanted)

    np.testing.assert_allclose(found, PchipInterpolator(x, y)(wanted), rtol=1e-9, atol=1e-9)
