import numpy as np
import pytest

from chartless.errors import ParameterError
from chartless.images import through_jpeg

SMOOTH = np.add.outer(np.arange(48), np.arange(64)).astype(np.uint8)


def test_the_best_quality_changes_levels_by_a_step_or_so():
    noisy = np.random.default_rng(0).integers(0, 256, (40, 56), dtype=np.uint8)

    difference = through_jpeg(noisy, 100).astype(int) - noisy

    assert np.abs(difference).max() <= 3


def test_less_quality_changes_more():
    noisy = np.random.default_rng(1).integers(0, 256, (40, 56), dtype=np.uint8)

    errors = [np.std(through_jpeg(noisy, quality) - noisy.astype(int)) for quality in (95, 70, 30)]

    assert errors[0] < errors[1] < errors[2]


def test_shape_and_type_stay():
    back = through_jpeg(SMOOTH, 90)

    assert back.shape == SMOOTH.shape
    assert back.dtype == np.uint8


@pytest.mark.parametrize("quality", [0, 101, -5])
def test_a_quality_out_of_range_is_refused(quality: int):
    with pytest.raises(ParameterError, match=f"from 1 to 100, not {quality}"):
        through_jpeg(SMOOTH, quality)
