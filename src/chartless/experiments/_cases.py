"""Independent cases, run by several processes, each recorded when it is done."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from chartless._files import make_folder, write_text
from chartless.errors import ParameterError
from chartless.types import JsonObject

Case = Callable[[], JsonObject]
"""A case knows its arguments (`functools.partial`), can be pickled, and returns its result."""

_PATIENCE = 10  # seconds to wait for a scheduler
_RETRIES = 3

OnCase = Callable[[int, int], None]
"""Called with the number of cases done and the number in all."""


def run_cases(
    cases: Mapping[str, Case],
    folder: Path,
    *,
    fingerprint: str,
    jobs: int = 1,
    scheduler: str | None = None,
    on_case: OnCase | None = None,
) -> dict[str, JsonObject]:
    """Run the cases that are not on record yet.

    Parameters
    ----------
    cases : mapping of str to Case
        The names serve as file names.
    folder : Path
        Where results are recorded, one JSON file for each case; made if it is missing.
    fingerprint : str
        Of everything that decides the results; a record with another one is done again.
    jobs : int
        Processes. Results do not depend on their number: each case computes with one thread.
    scheduler : str, optional
        Address of a Dask scheduler, on whose workers the cases run instead.
    on_case : OnCase, optional

    Returns
    -------
    dict of str to JSON object
        All results, in the order of `cases`.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    ParameterError
        If the scheduler does not answer, or Dask is not installed.
    """
    make_folder(folder)
    results = {name: _recorded(folder, name, fingerprint) for name in cases}
    missing = {name: case for name, case in cases.items() if results[name] is None}
    done = len(cases) - len(missing)
    if on_case is not None:
        on_case(done, len(cases))
    computed = _on_processes(missing, jobs) if scheduler is None else _on_dask(missing, scheduler)
    for name, result in computed:
        content = {"fingerprint": fingerprint, "result": result}
        write_text(folder / f"{name}.json", json.dumps(content))
        results[name] = result
        done += 1
        if on_case is not None:
            on_case(done, len(cases))
    return {name: result for name, result in results.items() if result is not None}


def fingerprint_of(*parts: object) -> str:
    """Digest of arrays, texts and numbers."""
    digest = hashlib.sha256()
    for part in parts:
        content = part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode()
        digest.update(content + b"\0")
    return digest.hexdigest()[:16]


def _recorded(folder: Path, name: str, fingerprint: str) -> JsonObject | None:
    path = folder / f"{name}.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # not there, or not one of ours: the case is done again
    if not isinstance(content, dict) or content.get("fingerprint") != fingerprint:
        return None
    result = content.get("result")
    return result if isinstance(result, dict) else None


def _on_processes(cases: Mapping[str, Case], jobs: int) -> Iterator[tuple[str, JsonObject]]:
    if jobs == 1 or len(cases) <= 1:
        yield from (_single_threaded(name, case) for name, case in cases.items())
        return
    from joblib import Parallel, delayed

    pool = Parallel(n_jobs=jobs, return_as="generator_unordered", max_nbytes=None)
    yield from pool(delayed(_single_threaded)(name, case) for name, case in cases.items())


def _on_dask(cases: Mapping[str, Case], scheduler: str) -> Iterator[tuple[str, JsonObject]]:
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        msg = "a scheduler needs Dask: pip install 'chartless[dask]'"
        raise ParameterError(msg) from error
    try:
        client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        msg = f"no Dask scheduler answers at {scheduler}: start one with `dask scheduler`"
        raise ParameterError(msg) from error
    with client:
        # A worker that dies takes its running case along; Dask gives it to another.
        futures = client.map(
            _single_threaded, *zip(*cases.items(), strict=True), pure=False, retries=_RETRIES
        )
        for future in as_completed(futures):
            yield future.result()
            future.release()


def _single_threaded(name: str, case: Case) -> tuple[str, JsonObject]:
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return name, case()
