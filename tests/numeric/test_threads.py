"""Tasks on threads, their results in order."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st
from threadpoolctl import threadpool_info, threadpool_limits

from chartless._numeric.threads import in_order, one_blas_thread


@given(values=st.lists(st.integers(), max_size=20))
def test_results_come_in_the_order_of_the_tasks(values: list[int]) -> None:
    assert list(in_order(partial(abs, value) for value in values)) == [abs(each) for each in values]


def test_a_slow_task_does_not_lose_its_place() -> None:
    released = threading.Event()

    def slow() -> str:
        assert released.wait(10)
        return "slow"

    def quick() -> str:
        released.set()
        return "quick"

    assert list(in_order([slow, quick, quick])) == ["slow", "quick", "quick"]


def test_two_tasks_are_asked_for_ahead() -> None:
    asked = []

    def tasks() -> Iterator[Callable[[], int]]:
        for number in range(10):
            asked.append(number)
            yield partial(int, number)

    results = in_order(tasks())

    for number in range(8):
        assert next(results) == number
        assert asked == list(range(number + 3))
    results.close()
    assert asked == list(range(10))


def test_an_error_ends_the_loop_at_its_place() -> None:
    done = []

    def fail() -> None:
        msg = "second"
        raise ValueError(msg)

    results = in_order([partial(done.append, 1), fail, *[partial(done.append, 2)] * 50])

    next(results)
    with pytest.raises(ValueError, match="second"):
        next(results)
    assert len(done) <= 4


def n_blas_threads() -> set[int]:
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_blas_gets_its_threads_back_when_the_last_has_left() -> None:
    """Users overlap: the first to come is the first to go."""
    with threadpool_limits(limits=3, user_api="blas"), ExitStack() as last:
        with one_blas_thread():
            last.enter_context(one_blas_thread())
            both_inside = n_blas_threads()
        one_inside = n_blas_threads()
        last.close()
        assert (both_inside, one_inside, n_blas_threads()) == ({1}, {1}, {3})


def test_blas_gets_its_threads_back_after_an_error() -> None:
    with threadpool_limits(limits=3, user_api="blas"):
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            raise ZeroDivisionError
        assert n_blas_threads() == {3}
