"""Work on the next files while one is waited for, in threads of this process."""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

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
        Of each task.

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
