"""How many observations evidence counts as whose model is wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chartless.evidence.trust import counts_as

ERRORS = st.lists(st.floats(1e-3, 10), min_size=1, max_size=5)


def test_without_errors_there_is_no_limit() -> None:
    assert counts_as(()) == np.inf


@given(ERRORS, st.floats(1e-3, 10))
def test_every_error_lowers_the_number(errors: list[float], other: float) -> None:
    assert counts_as([*errors, other]) < counts_as(errors)
    assert counts_as(errors) == pytest.approx(counts_as(errors[::-1]))


@pytest.mark.parametrize("error", [0.05, 0.1, 0.2])
def test_so_many_differences_determine_a_variance_to_the_error(error: float) -> None:
    rng = np.random.default_rng(4)
    number = round(counts_as([error]))

    squares = rng.standard_normal((4000, number)) ** 2

    assert squares.mean(axis=1).std() == pytest.approx(error, rel=0.05)
