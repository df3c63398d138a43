from fractions import Fraction
from itertools import pairwise
from math import floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from chartless.errors import ParameterError
from chartless.evidence.noise.cooccurrence import Cooccurrence, noise_level_function
from chartless.frames.levels import MAX_LEVELS, MIN_LEVELS, level_table


def stacks(n_levels: int = 16) -> st.SearchStrategy[np.ndarray]:
    """Several small frames of one scene."""
    shape = st.tuples(st.integers(2, 5), st.integers(1, 12), st.integers(1, 12))
    return nps.arrays(np.uint8, shape, elements=st.integers(0, n_levels - 1))


@given(frames=stacks(), data=st.data())
def test_any_split_into_tiles_in_any_order_counts_the_same(frames: np.ndarray, data: st.DataObject):
    height, width = frames.shape[1:]
    row, column = data.draw(st.integers(0, height)), data.draw(st.integers(0, width))
    tiles = [
        (first[rows, columns], second[rows, columns])
        for first, second in pairwise(frames)
        for rows in (slice(row), slice(row, None))
        for columns in (slice(column), slice(column, None))
    ]
    order = data.draw(st.permutations(tiles))

    total = Cooccurrence.zeros(16)
    for first, second in order:
        total += Cooccurrence.of_pair(first, second, n_levels=16)

    whole = Cooccurrence.of_pair(frames[:-1], frames[1:], n_levels=16)
    assert np.array_equal(total.counts, whole.counts)
    assert total.n_pairs == frames[1:].size


@pytest.mark.parametrize(
    ("n_levels", "dtype"),
    [(256, np.uint8), (64, np.uint8), (256, np.uint16), (1024, np.uint16), (4096, np.uint16)],
)
def test_counts_agree_with_a_histogram_of_pairs(n_levels: int, dtype: type):
    rng = np.random.default_rng(3)
    first, second = rng.integers(0, n_levels, (2, 40, 50)).astype(dtype)
    first[0], second[0] = n_levels - 1, n_levels - 1  # the last cell too

    table = Cooccurrence.of_pair(first, second, n_levels=n_levels)

    edges = np.arange(n_levels + 1) - 0.5
    expected, _, _ = np.histogram2d(first.ravel(), second.ravel(), bins=(edges, edges))
    assert np.array_equal(table.counts, expected)
    assert table.counts.dtype == np.int64


def test_the_empty_table_adds_nothing():
    rng = np.random.default_rng(4)
    table = Cooccurrence.of_pair(*rng.integers(0, 256, (2, 9, 9), dtype=np.uint8))

    assert np.array_equal((table + Cooccurrence.zeros()).counts, table.counts)
    assert np.array_equal((Cooccurrence.zeros() + table).counts, table.counts)


def test_only_pixels_in_the_mask_are_counted():
    first, second = np.arange(32, dtype=np.uint8).reshape(2, 4, 4) % 16
    mask = np.zeros((4, 4), dtype=bool)
    mask[1, 2] = True

    table = Cooccurrence.of_pair(first, second, n_levels=16, mask=mask)

    assert table.n_pairs == 1
    assert table.counts[first[1, 2], second[1, 2]] == 1


def test_a_mask_and_its_complement_add_up():
    rng = np.random.default_rng(5)
    first, second = rng.integers(0, 256, (2, 20, 30), dtype=np.uint8)
    mask = rng.uniform(size=first.shape) < 0.4

    parts = Cooccurrence.of_pair(first, second, mask=mask) + Cooccurrence.of_pair(
        first, second, mask=~mask
    )

    assert np.array_equal(parts.counts, Cooccurrence.of_pair(first, second).counts)


@pytest.mark.parametrize(
    ("first", "second", "n_levels", "dtype"),
    [
        (63, 64, 64, np.uint8),
        (0, 100, 64, np.uint8),
        (64, 0, 64, np.uint8),
        (300, 0, 256, np.uint16),
        (0, 256, 256, np.uint16),
    ],
)
def test_levels_beyond_the_table_are_refused_not_counted_elsewhere(
    first: int, second: int, n_levels: int, dtype: type
):
    frames = np.full((2, 2), first, dtype=dtype), np.full((2, 2), second, dtype=dtype)

    with pytest.raises(ParameterError, match=f"is above {n_levels - 1}"):
        Cooccurrence.of_pair(*frames, n_levels=n_levels)


def test_frames_of_different_sizes_are_refused():
    first, second = np.zeros((4, 6), dtype=np.uint8), np.zeros((6, 4), dtype=np.uint8)

    with pytest.raises(ParameterError, match="one size"):
        Cooccurrence.of_pair(first, second)


def test_the_noise_level_function_is_the_deviation_of_one_frame():
    rng = np.random.default_rng(12)
    scene = rng.uniform(40, 200, 400_000)
    deviation = 2 + scene / 50
    first, second = np.rint(scene + deviation * rng.normal(size=(2, scene.size))).astype(np.uint8)

    measured = noise_level_function(Cooccurrence.of_pair(first, second).counts)

    levels = np.arange(70, 160)
    expected = np.sqrt((2 + levels / 50) ** 2 + 1 / 12)  # rounding included
    np.testing.assert_allclose(measured[levels], expected, rtol=0.1)
    assert np.mean(measured[levels] / expected) == pytest.approx(1, abs=0.01)
    assert np.isnan(measured[[0, 255]]).all()  # too few pairs


def test_frames_are_left_as_they_were():
    first, second = np.full((2, 3, 3), 7, dtype=np.uint8)

    Cooccurrence.of_pair(first, second)

    assert np.all(first == 7)
    assert np.all(second == 7)


def test_what_a_table_tells():
    first = np.array([1, 1, 2, 9], dtype=np.uint8)
    second = np.array([2, 1, 2, 4], dtype=np.uint8)

    table = Cooccurrence.of_pair(first, second, n_levels=16)

    assert table.n_levels == 16
    assert table.observed_levels == (1, 9)
    histogram = np.bincount(np.concatenate([first, second]), minlength=16)
    assert np.array_equal(table.histogram, histogram)
    assert np.array_equal(table.symmetric, table.symmetric.T)
    assert table.symmetric.sum() == 2 * table.n_pairs
    assert table.symmetric[1, 1] == 2


def test_nothing_is_observed_in_an_empty_table():
    assert Cooccurrence.zeros(16).observed_levels == (0, -1)
    assert Cooccurrence.zeros(16).n_pairs == 0


@pytest.mark.parametrize("shape", [(16,), (16, 17), (16, 16, 16)])
def test_a_table_is_square(shape: tuple[int, ...]):
    with pytest.raises(ParameterError, match="square"):
        Cooccurrence(np.zeros(shape, dtype=np.int64))


def test_tables_of_different_levels_do_not_add():
    with pytest.raises(ParameterError, match="16 and 64 levels"):
        Cooccurrence.zeros(16) + Cooccurrence.zeros(64)


@pytest.mark.parametrize(
    ("bit_depth", "n_levels"), [(8, 64), (8, 16), (8, 256), (16, 256), (16, 1024), (10, 1000)]
)
def test_levels_are_reduced_to_the_nearest(bit_depth: int, n_levels: int):
    top = 2**bit_depth - 1

    table = level_table(2**bit_depth - 1, n_levels)

    expected = [floor(Fraction(k * (n_levels - 1), top) + Fraction(1, 2)) for k in range(top + 1)]
    assert np.array_equal(table, expected)
    assert (table[0], table[-1]) == (0, n_levels - 1)
    assert table.dtype == (np.uint8 if n_levels <= 256 else np.uint16)


@pytest.mark.parametrize(("bit_depth", "n_levels"), [(8, 64), (16, 256), (16, 1024)])
def test_reduced_levels_keep_their_brightness(bit_depth: int, n_levels: int):
    brightness = np.arange(2**bit_depth) / (2**bit_depth - 1)

    reduced = level_table(2**bit_depth - 1, n_levels) / (n_levels - 1)

    assert np.abs(reduced - brightness).max() <= 0.5 / (n_levels - 1) + 1e-15


def test_all_levels_are_kept_where_none_need_to_be_lost():
    assert np.array_equal(level_table(255, 256), np.arange(256))


@pytest.mark.parametrize(
    ("bit_depth", "n_levels"),
    [(8, MIN_LEVELS - 1), (8, 257), (16, MAX_LEVELS + 1), (16, 65536), (8, 0), (8, -64)],
)
def test_too_few_or_too_many_levels_are_refused(bit_depth: int, n_levels: int):
    with pytest.raises(ParameterError, match=f"not {n_levels}$"):
        level_table(2**bit_depth - 1, n_levels)
