"""Level pairs of one exposure as a term: how much they are believed."""

import pytest
from gamma_camera import LEVELS, expected_counts, space_of

from chartless.curves.populations import measured_prior
from chartless.curves.space import free_curve
from chartless.evidence.noise.term import RIDGE_PAIRS, ridge_share


@pytest.mark.parametrize(
    ("n_pairs", "weight", "share"),
    [(RIDGE_PAIRS, 1.0, 1.0), (0, 0.2, 1.0), (4 * RIDGE_PAIRS, 0.5, 0.5), (1e9, 1.0, 1e-5)],
)
def test_many_pairs_tell_ratios_apart_no_better_than_some(
    n_pairs: float, weight: float, share: float
) -> None:
    counts = expected_counts(n_pairs, weight=weight)

    assert ridge_share(counts, free_curve(measured_prior(LEVELS))) == pytest.approx(share, rel=1e-6)
    assert ridge_share(counts, space_of("gamma")) == 0  # a family is not heard about it
