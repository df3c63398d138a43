"""Cases on a Dask cluster: whatever happens to workers, each is there exactly once."""

import logging
import os
import signal
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distributed import LocalCluster

from chartless._numeric import parallel as _parallel
from chartless._numeric.parallel import WorkerError
from chartless.errors import ImageError, ParameterError
from chartless.experiments import run_cases


def case(number: int, pause: float, log: Path | None = None) -> dict[str, Any]:
    """Compute something that rounding would change; note when and where."""
    if log is not None:
        with log.open("a") as file:
            file.write(f"{number} {os.getpid()}\n")
    time.sleep(pause)
    matrix = np.random.default_rng(number).normal(size=(60, 60))
    return {"values": np.linalg.svd(matrix)[1].tolist()}


def kill_worker() -> dict[str, Any]:
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def refuse() -> dict[str, Any]:
    raise ImageError("a.png", "no such file")  # noqa: EM101 - a path


def threads() -> dict[str, Any]:
    from threadpoolctl import threadpool_info

    return {"most": max((each["num_threads"] for each in threadpool_info()), default=1)}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster


def wait_until_idle(cluster: Any) -> None:
    for _ in range(100):
        if not cluster.scheduler.tasks:
            return
        time.sleep(0.05)
    pytest.fail(f"left on the scheduler: {list(cluster.scheduler.tasks)}")


@pytest.mark.slow
def test_a_killed_worker_costs_its_running_case_only(cluster: Any, tmp_path: Path) -> None:
    log = tmp_path / "log"
    cases = {f"{n:02d}": partial(case, n, 0.15, log) for n in range(12)}
    alone = run_cases(
        {f"{n:02d}": partial(case, n, 0) for n in range(12)}, tmp_path / "alone", fingerprint="f"
    )
    calls: list[tuple[int, int]] = []

    def on_case(done: int, total: int) -> None:
        calls.append((done, total))
        if done == 4:
            _, worker = log.read_text().splitlines()[-1].split()
            os.kill(int(worker), signal.SIGKILL)

    results = run_cases(
        cases,
        tmp_path / "dask",
        fingerprint="f",
        scheduler=cluster.scheduler_address,
        on_case=on_case,
    )

    assert results == alone
    assert list(results) == list(alone)
    assert calls == [(done, 12) for done in range(13)]
    records = sorted((tmp_path / "dask").iterdir())
    assert [path.name for path in records] == [f"{name}.json" for name in cases]
    for path in records:
        assert path.read_bytes() == (tmp_path / "alone" / path.name).read_bytes()
    begun = [int(line.split()[0]) for line in log.read_text().splitlines()]
    assert set(begun) == set(range(12))
    # The one that ran, and at most one that was done but not fetched yet.
    assert 12 <= len(begun) <= 14
    wait_until_idle(cluster)


@pytest.mark.slow
def test_a_case_that_kills_every_worker_is_named(
    cluster: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    cluster.scheduler.allowed_failures, before = 0, cluster.scheduler.allowed_failures
    cases = {"good": partial(case, 1, 0), "fatal": kill_worker}
    recorded = []
    try:
        with pytest.raises(
            WorkerError, match=r"fatal: 1 Dask workers? died .* of 2 cases are recorded in .*again"
        ):
            run_cases(
                cases,
                tmp_path,
                fingerprint="f",
                scheduler=cluster.scheduler_address,
                on_case=lambda done, _: recorded.append(done),
            )
    finally:
        cluster.scheduler.allowed_failures = before

    assert len(list(tmp_path.iterdir())) == recorded[-1]
    assert "distributed.client" not in capfd.readouterr().err


@pytest.mark.slow
def test_the_error_of_a_case_is_its_own(cluster: Any, tmp_path: Path) -> None:
    cases = {
        "a": partial(case, 1, 0),
        "b": partial(case, 2, 0),
        "bad": refuse,
        **{f"{n}": partial(case, n, 0.3) for n in range(20)},
    }

    with pytest.raises(ImageError, match=r"^a\.png: no such file$"):
        run_cases(cases, tmp_path, fingerprint="f", scheduler=cluster.scheduler_address)

    assert len(list(tmp_path.iterdir())) < 10
    wait_until_idle(cluster)  # the others were dropped


@pytest.mark.slow
def test_an_interrupted_run_on_a_cluster_goes_on(cluster: Any, tmp_path: Path) -> None:
    cases = {f"{n}": partial(case, n, 0.1) for n in range(6)}
    address = cluster.scheduler_address
    calls: list[int] = []

    def interrupt(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_cases(cases, tmp_path, fingerprint="f", scheduler=address, on_case=interrupt)
    wait_until_idle(cluster)
    assert len(list(tmp_path.iterdir())) == 2

    results = run_cases(
        cases,
        tmp_path,
        fingerprint="f",
        scheduler=address,
        on_case=lambda done, _: calls.append(done),
    )

    assert calls == [2, 3, 4, 5, 6]
    assert results == {name: run() for name, run in cases.items()}


@pytest.mark.slow
def test_a_case_on_a_cluster_computes_with_one_thread(cluster: Any, tmp_path: Path) -> None:
    address = cluster.scheduler_address

    results = run_cases({"a": threads}, tmp_path, fingerprint="f", scheduler=address)

    assert results == {"a": {"most": 1}}


# Schedulers that are none


@pytest.mark.slow
def test_a_worker_is_no_scheduler(cluster: Any, tmp_path: Path) -> None:
    worker = next(iter(cluster.scheduler.workers))

    with pytest.raises(ParameterError, match=r"there is a Dask worker: give the address of the s"):
        run_cases({"a": threads}, tmp_path, fingerprint="f", scheduler=worker)


def test_nothing_left_to_do_needs_no_scheduler(tmp_path: Path) -> None:
    run_cases({"a": threads}, tmp_path, fingerprint="f")

    run_cases({"a": threads}, tmp_path, fingerprint="f", scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:1", r"no Dask scheduler answers at tcp://127\.0\.0\.1:1: start one"),
        ("nonsense", r"'nonsense' is not the address of a Dask scheduler, .* missing port"),
        ("http://localhost:8786", r"such as tcp://host:8786: unknown address scheme"),
        ("tls://localhost:8786", r"is not the address .* TLS"),
    ],
)
def test_a_scheduler_that_does_not_answer(
    address: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(_parallel, "_PATIENCE", 0.5)

    with pytest.raises(ParameterError, match=message) as caught:
        run_cases({"a": threads}, tmp_path, fingerprint="f", scheduler=address)

    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_scheduler_needs_dask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)

    with pytest.raises(ParameterError, match=r"needs Dask: .* pip install '\.\[dask\]'"):
        run_cases({"a": threads}, tmp_path, fingerprint="f", scheduler="tcp://127.0.0.1:1")
