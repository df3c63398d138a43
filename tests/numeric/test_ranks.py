"""Rank correlation, by the definition that SciPy has."""

import numpy as np
import pytest
from scipy.stats import spearmanr

from chartless._numeric.ranks import rank_correlation


@pytest.mark.parametrize("n_values", [3, 40, 10_000])
def test_it_is_that_of_scipy_with_ties_and_without(n_values: int) -> None:
    rng = np.random.default_rng(n_values)
    one = rng.integers(0, n_values, 500).astype(np.uint8)
    other = one + rng.normal(0, n_values / 3, 500)

    assert rank_correlation(one, other) == pytest.approx(spearmanr(one, other).statistic, abs=1e-12)
    assert rank_correlation(one, -other) == pytest.approx(-rank_correlation(one, other), abs=1e-12)


@pytest.mark.parametrize("values", [[], [3], [2, 2, 2]])
def test_what_is_constant_or_empty_is_not_in_another_order(values: list[int]) -> None:
    assert rank_correlation(values, list(range(len(values)))) == 1
