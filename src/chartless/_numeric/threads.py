"""Threads of this process: work on the next files while one is waited for, and BLAS without any."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import TypeVar

from threadpoolctl import threadpool_limits

_T = TypeVar("_T")

_THREADS = 2  # decoders, encoders and large arrays let others run; more would take memory


def in_order(tasks: Iterable[Callable[[], _T]]) -> Generator[_T, None, None]:
    """Run tasks on two threads and yield their results in the order of the tasks.

    Parameters
    ----------
    tasks : iterable of callable
        Asked for one by one, two before the one whose result is due, so that not more results
        than these are in memory.

    Yields
    ------
    result
        Result of each task.

    Raises
    ------
    Exception
        Whatever a task raises ends the loop; those that have begun come to their end.

    Examples
    --------
    >>> list(in_order([lambda: 2, lambda: 3]))
    [2, 3]
    """
    waiting: deque[Future[_T]] = deque()
    with ThreadPoolExecutor(_THREADS) as pool:
        try:
            for task in tasks:
                waiting.append(pool.submit(task))
                if len(waiting) > _THREADS:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for each in waiting:
                each.cancel()


class _BlasThreads:
    """How many threads BLAS has, which is one number for the whole process."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._n_users = 0
        self._limits: threadpool_limits | None = None

    @contextmanager
    def limited(self) -> Iterator[None]:
        """Let BLAS work without threads of its own, as long as anybody is in here.

        Matrices of an estimate are small: threads would do little but wait for each other, on a
        busy computer for long.
        """
        with self._lock:
            self._limits = self._limits or threadpool_limits(limits=1, user_api="blas")
            self._n_users += 1
        try:
            yield
        finally:
            with self._lock:
                self._n_users -= 1
                if self._n_users == 0 and self._limits is not None:
                    self._limits.restore_original_limits()
                    self._limits = None


one_blas_thread = _BlasThreads().limited
