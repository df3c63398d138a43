"""Independent cases, run by several processes, each recorded when it is done."""

import hashlib
import json
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import numpy as np

from chartless._files import make_folder, write_text
from chartless._numeric.parallel import WorkerError, run_all
from chartless.types import JsonObject

Case = Callable[[], JsonObject]
"""A case knows its arguments (`functools.partial`), can be pickled, and returns its result."""

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
        Fingerprint of everything that decides the results; a record with another one is done again.
    jobs : int
        Processes. Results do not depend on their number: each case computes with one thread.
    scheduler : str, optional
        Address of a Dask scheduler, on whose workers the cases run instead; a case whose worker
        dies is given to another one.
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
    WorkerError
        If a worker process was killed; on Dask, if one case took several workers along.
    Exception
        Whatever a case raises. What is on record stays there after any of these.
    """
    make_folder(folder)
    results = {name: _recorded(folder, name, fingerprint) for name in cases}
    missing = {name: case for name, case in cases.items() if results[name] is None}
    done = len(cases) - len(missing)
    if on_case is not None:
        on_case(done, len(cases))
    try:
        with closing(run_all(missing, jobs=jobs, scheduler=scheduler)) as computed:
            for name, result in computed:
                content = {"fingerprint": fingerprint, "result": result}
                write_text(folder / f"{name}.json", json.dumps(content))
                results[name] = result
                done += 1
                if on_case is not None:
                    on_case(done, len(cases))
    except WorkerError as error:
        msg = f"{error}; {done} of {len(cases)} cases are recorded in {folder}: run it again"
        raise WorkerError(msg) from error
    return {name: result for name, result in results.items() if result is not None}


def fingerprint_of(*parts: object) -> str:
    """Digest of arrays, texts and numbers."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype} {part.shape} ".encode() + part.tobytes())
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
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
