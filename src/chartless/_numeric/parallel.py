"""Independent tasks on one process, on several or on a Dask cluster; no science.

The only module that knows joblib and Dask. A task computes with one thread wherever it runs,
so results do not depend on where that is.
"""

import asyncio
import logging
import os
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from chartless.errors import ChartlessError, ParameterError, how_to_install

_T = TypeVar("_T")

_MOST_PROCESSES = 64  # each takes 100 MB, and 100,000 never start
_PATIENCE = 10  # seconds to wait for a scheduler


class WorkerError(ChartlessError, RuntimeError):
    """A process that was computing is gone."""


def run_all(
    tasks: Mapping[str, Callable[[], _T]], *, jobs: int = 1, scheduler: str | None = None
) -> Generator[tuple[str, _T], None, None]:
    """Run tasks and yield each name and result as soon as it is there.

    Close the generator (`contextlib.closing`) to drop what has not begun when the loop over it
    ends early.

    Parameters
    ----------
    tasks : mapping of str to callable
        Each can be pickled and takes no argument.
    jobs : int
        Processes on this computer, of which no more are started than there are tasks, nor more
        than 64 or the processors; one is this process itself.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``, on whose workers the tasks
        run instead. It gives the task of a worker that dies to another one, and waits if there
        is no worker. Workers need the package in this version and see files under the same
        names.

    Yields
    ------
    tuple of str and result
        In the order in which tasks end.

    Raises
    ------
    ParameterError
        If `jobs` is less than one, the scheduler does not answer or Dask is not installed.
    WorkerError
        If a worker process was killed or, on Dask, every worker that tried one of the tasks;
        or if the scheduler is gone.
    Exception
        Whatever a task raises ends the loop.
    """
    if jobs < 1:
        msg = f"jobs must be 1 or more, not {jobs}"
        raise ParameterError(msg)
    if not tasks:
        return
    if scheduler is not None:
        yield from _on_dask(tasks, scheduler)
    elif jobs == 1 or len(tasks) == 1:
        for name, task in tasks.items():
            yield _with_one_thread(name, task)
    else:
        yield from _on_processes(tasks, jobs)


def _on_processes(
    tasks: Mapping[str, Callable[[], _T]], jobs: int
) -> Generator[tuple[str, _T], None, None]:
    from joblib import Parallel, delayed

    jobs = min(jobs, len(tasks), max(_MOST_PROCESSES, os.cpu_count() or 1))
    # Batches would lose several tasks with one worker.
    pool = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1, max_nbytes=None)
    results = pool(delayed(_with_one_thread)(name, task) for name, task in tasks.items())
    try:
        for result in results:  # noqa: UP028 - "yield from" would close it, with warnings
            yield result
    except BrokenProcessPool as error:
        msg = "a worker process was killed, perhaps for lack of memory: use fewer jobs"
        raise WorkerError(msg) from error
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # joblib says what was left undone
            results.close()


def _on_dask(
    tasks: Mapping[str, Callable[[], _T]], scheduler: str
) -> Generator[tuple[str, _T], None, None]:
    _require_scheduler(scheduler)
    from distributed import Client, as_completed

    with _quiet_client(), Client(scheduler, timeout=_PATIENCE, set_as_default=False) as client:
        # One graph: what the tasks share travels to the scheduler once.
        futures = client.map(_on_worker, list(tasks), list(tasks.values()), pure=False)
        names = {future.key: name for future, name in zip(futures, tasks, strict=True)}
        for future in as_completed(futures, loop=client.loop):
            yield _result(future, names[future.key], scheduler)
            future.release()


@contextmanager
def _quiet_client() -> Iterator[None]:
    """Keep the log of lost workers and schedulers off the terminal: errors say it."""
    logger = logging.getLogger("distributed.client")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def _result(future: Any, name: str, scheduler: str) -> Any:  # noqa: ANN401 - Dask has no types
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        msg = (
            f"{name}: {error.allowed_failures + 1} Dask workers died while running it, "
            "perhaps for lack of memory: see their logs"
        )
        raise WorkerError(msg) from error
    except CancelledError as error:
        msg = f"the Dask scheduler at {scheduler} is gone or dropped this run: see its log"
        raise WorkerError(msg) from error


def _require_scheduler(scheduler: str) -> None:
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        msg = f"a scheduler needs Dask: {how_to_install('dask')}"
        raise ParameterError(msg) from error
    # A client that fails to connect prints tracebacks when it is collected, and waits for ever
    # for a server of another kind. The thread: this one may have an event loop of its own.
    try:
        with ThreadPoolExecutor(1) as thread:
            kind = thread.submit(asyncio.run, _kind_of_server(scheduler)).result()
    except (OSError, TimeoutError) as error:
        msg = f"no Dask scheduler answers at {scheduler}: start one with the command dask scheduler"
        raise ParameterError(msg) from error
    except (ValueError, TypeError) as error:
        msg = (
            f"{scheduler!r} is not the address of a Dask scheduler, such as tcp://host:8786: "
            f"{error}"
        )
        raise ParameterError(msg) from error
    if kind != "Scheduler":
        msg = f"at {scheduler} there is a Dask {kind.lower()}: give the address of the scheduler"
        raise ParameterError(msg)


async def _kind_of_server(address: str) -> str:
    from distributed import Security, rpc

    how = Security().get_connection_args("client")
    async with rpc(address, timeout=_PATIENCE, connection_args=how) as server:
        identity = await asyncio.wait_for(server.identity(), _PATIENCE)
    return str(identity["type"])


def _with_one_thread(name: str, task: Callable[[], _T]) -> tuple[str, _T]:
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return name, task()


def _on_worker(name: str, task: Callable[[], _T]) -> tuple[str, _T]:
    from threadpoolctl import threadpool_limits

    # For good: with several tasks in threads of one worker, the first to end would lift the
    # limit for the others.
    threadpool_limits(limits=1)
    return name, task()
