"""Independent cases: recorded one by one, never done twice, the same on every number of jobs."""

import errno
import json
import math
import os
import signal
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless._numeric.parallel import WorkerError
from chartless.errors import ImageError, OutputError, ParameterError
from chartless.experiments import fingerprint_of, run_cases


class Counted:
    """Cases that note their names when they run."""

    def __init__(self, *names: str) -> None:
        self.ran: list[str] = []
        self.cases: dict[str, partial[Any]] = {name: partial(self, name) for name in names}

    def __call__(self, name: str) -> Any:
        self.ran.append(name)
        return {"name": name, "third": 1 / 3}


@pytest.fixture
def counted() -> Counted:
    return Counted("c", "a", "b")


def results_of(counted: Counted) -> dict[str, Any]:
    return {name: {"name": name, "third": 1 / 3} for name in counted.cases}


def test_each_case_is_recorded(counted: Counted, tmp_path: Path) -> None:
    folder = tmp_path / "cases"

    results = run_cases(counted.cases, folder, fingerprint="f")

    assert results == results_of(counted)
    assert list(results) == ["c", "a", "b"]
    assert sorted(path.name for path in folder.iterdir()) == ["a.json", "b.json", "c.json"]
    assert json.loads((folder / "a.json").read_text())["result"] == results["a"]


def test_what_is_on_record_is_not_done_again(counted: Counted, tmp_path: Path) -> None:
    first = run_cases(counted.cases, tmp_path, fingerprint="f")
    counted.ran.clear()

    again = run_cases(counted.cases, tmp_path, fingerprint="f")

    assert counted.ran == []
    assert again == first
    assert list(again) == list(first)


def test_records_give_numbers_back_exactly(tmp_path: Path) -> None:
    values = [1 / 3, math.pi * 1e-300, 5e-324, 0.1 + 0.2, -0.0]
    cases = {"a": partial(dict, values=values)}

    run_cases(cases, tmp_path, fingerprint="f")
    recorded = run_cases(cases, tmp_path, fingerprint="f")["a"]["values"]

    assert [value.hex() for value in recorded] == [value.hex() for value in values]


@pytest.mark.parametrize("how_many", [0, 1, 2])
@pytest.mark.parametrize("where", ["in a case", "between cases"])
def test_an_interrupted_run_goes_on_where_it_stopped(
    where: str, how_many: int, counted: Counted, tmp_path: Path
) -> None:
    done_before = ["c", "a", "b"][:how_many]

    def interrupt() -> Any:
        raise KeyboardInterrupt

    def on_case(done: int, total: int) -> None:
        if where == "between cases" and done == how_many:
            raise KeyboardInterrupt

    cases = dict(counted.cases)
    if where == "in a case":
        cases["cab"[how_many]] = interrupt
    with pytest.raises(KeyboardInterrupt):
        run_cases(cases, tmp_path, fingerprint="f", on_case=on_case)
    assert counted.ran == done_before
    counted.ran.clear()

    results = run_cases(counted.cases, tmp_path, fingerprint="f")

    assert counted.ran == ["c", "a", "b"][how_many:]
    assert results == results_of(counted)
    assert list(results) == ["c", "a", "b"]


def test_a_failing_case_keeps_what_was_done_before(counted: Counted, tmp_path: Path) -> None:
    def fail() -> Any:
        msg = "no"
        raise ValueError(msg)

    with pytest.raises(ValueError, match="no"):
        run_cases({**counted.cases, "a": fail}, tmp_path, fingerprint="f")

    assert [path.name for path in tmp_path.iterdir()] == ["c.json"]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"5",
        b"{}",
        b'{"fingerprint": "f"}',
        b'{"fingerprint": "f", "result": null}',
        b'{"fingerprint": "f", "result": [1]}',
        b'{"fingerprint": "other", "result": {"name": "old"}}',
        b'{"result": {"name": "old"}}',
        b"\x89PNG\xff\xff",
    ],
)
def test_a_record_that_is_none_of_this_run_is_done_again(
    content: bytes, counted: Counted, tmp_path: Path
) -> None:
    run_cases(counted.cases, tmp_path, fingerprint="f")
    (tmp_path / "a.json").write_bytes(content)
    counted.ran.clear()

    results = run_cases(counted.cases, tmp_path, fingerprint="f")

    assert counted.ran == ["a"]
    assert results == results_of(counted)
    assert json.loads((tmp_path / "a.json").read_text())["result"] == results["a"]


def test_half_a_record_is_done_again(counted: Counted, tmp_path: Path) -> None:
    run_cases(counted.cases, tmp_path, fingerprint="f")
    record = tmp_path / "b.json"
    whole = record.read_bytes()
    record.write_bytes(whole[: len(whole) // 2])
    counted.ran.clear()

    run_cases(counted.cases, tmp_path, fingerprint="f")

    assert counted.ran == ["b"]
    assert record.read_bytes() == whole


def test_another_fingerprint_does_everything_again(counted: Counted, tmp_path: Path) -> None:
    run_cases(counted.cases, tmp_path, fingerprint="f")
    run_cases(counted.cases, tmp_path, fingerprint="g")

    assert counted.ran == ["c", "a", "b"] * 2


def test_other_files_in_the_folder_are_left_alone(counted: Counted, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "z.json").write_text('{"fingerprint": "f", "result": {}}')

    results = run_cases(counted.cases, tmp_path, fingerprint="f")

    assert "z" not in results
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert (tmp_path / "z.json").exists()


def test_progress_counts_what_was_done_before(counted: Counted, tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []

    def on_case(done: int, total: int) -> None:
        calls.append((done, total))

    run_cases({"a": counted.cases["a"]}, tmp_path, fingerprint="f", on_case=on_case)
    assert calls == [(0, 1), (1, 1)]

    calls.clear()
    run_cases(counted.cases, tmp_path, fingerprint="f", on_case=on_case)
    assert calls == [(1, 3), (2, 3), (3, 3)]


def test_no_cases_are_no_error(tmp_path: Path) -> None:
    assert run_cases({}, tmp_path / "cases", fingerprint="f", jobs=2) == {}


def test_results_do_not_depend_on_the_number_of_processes(tmp_path: Path) -> None:
    cases = {f"{n}": partial(dict, value=n / 7) for n in range(5)}
    calls: list[tuple[int, int]] = []

    one = run_cases(cases, tmp_path / "one", fingerprint="f")
    two = run_cases(
        cases,
        tmp_path / "two",
        fingerprint="f",
        jobs=2,
        on_case=lambda *call: calls.append(call),
    )

    assert one == two
    assert list(one) == list(two)
    assert calls == [(done, 5) for done in range(6)]
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


@pytest.mark.slow
def test_several_processes_take_up_where_one_stopped(tmp_path: Path) -> None:
    cases = {f"{n}": partial(dict, value=n) for n in range(4)}
    run_cases({"2": cases["2"]}, tmp_path, fingerprint="f")
    before = (tmp_path / "2.json").stat().st_mtime_ns

    results = run_cases(cases, tmp_path, fingerprint="f", jobs=2)

    assert results == {f"{n}": {"value": n} for n in range(4)}
    assert (tmp_path / "2.json").stat().st_mtime_ns == before


@pytest.mark.slow
def test_a_case_computes_with_one_thread(tmp_path: Path) -> None:
    from threadpoolctl import threadpool_info

    def threads() -> Any:
        return {"most": max((each["num_threads"] for each in threadpool_info()), default=1)}

    assert run_cases({"a": threads}, tmp_path, fingerprint="f") == {"a": {"most": 1}}


def killed() -> Any:
    os.kill(os.getpid(), signal.SIGKILL)


def refused() -> Any:
    time.sleep(0.2)
    raise ImageError("a.png", "no such file")  # noqa: EM101 - a path


@pytest.mark.slow
def test_a_killed_process_is_one_line_and_costs_no_record(tmp_path: Path) -> None:
    cases: dict[str, Any] = {f"{n}": partial(dict, value=n) for n in range(20)}
    calls: list[int] = []

    with pytest.raises(WorkerError, match=r"killed.*recorded in .*run it again") as caught:
        run_cases(
            {**cases, "fatal": killed},
            tmp_path,
            fingerprint="f",
            jobs=2,
            on_case=lambda done, _: calls.append(done),
        )
    assert f"; {calls[-1]} of 21 cases are recorded" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(list(tmp_path.iterdir())) == calls[-1]

    results = run_cases({**cases, "fatal": dict}, tmp_path, fingerprint="f", jobs=2)

    assert len(results) == 21


@pytest.mark.slow
def test_an_error_in_another_process_is_its_own(tmp_path: Path) -> None:
    cases: dict[str, Any] = {f"{n}": partial(dict, value=n) for n in range(2)}

    with pytest.raises(ImageError, match=r"^a\.png: no such file$"):
        run_cases({**cases, "bad": refused}, tmp_path, fingerprint="f", jobs=2)

    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.json", "1.json"]


@pytest.mark.slow
@pytest.mark.filterwarnings("error")  # joblib tells what it leaves undone
def test_several_processes_are_interrupted_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupt(done: int, _: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    cases = {f"{n}": partial(dict, value=n) for n in range(50)}
    with pytest.raises(KeyboardInterrupt):
        run_cases(cases, tmp_path, fingerprint="f", jobs=2, on_case=interrupt)

    assert len(list(tmp_path.iterdir())) == 3
    assert capfd.readouterr() == ("", "")


def test_no_processes_run_nothing(counted: Counted, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="jobs must be 1 or more, not 0"):
        run_cases(counted.cases, tmp_path, fingerprint="f", jobs=0)


# Folders


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_ends_the_run(
    jobs: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_text

    def full(path: Path, *arguments: Any, **settings: Any) -> int:
        if len(list(tmp_path.glob("*.json"))) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, *arguments, **settings)

    monkeypatch.setattr(Path, "write_text", full)
    cases = {f"{n}": partial(dict, value=n) for n in range(6)}

    with pytest.raises(OutputError, match=r"cannot be written \(No space left on device\)"):
        run_cases(cases, tmp_path, fingerprint="f", jobs=jobs)

    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_that_cannot_be_made(counted: Counted, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="create it first"):
        run_cases(counted.cases, tmp_path / "missing" / "cases", fingerprint="f")

    (tmp_path / "cases").touch()
    with pytest.raises(OutputError, match="is a file"):
        run_cases(counted.cases, tmp_path / "cases", fingerprint="f")

    assert counted.ran == []


def test_a_folder_that_is_not_writable(
    counted: Counted, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(0o500)
    if os.geteuid() == 0:  # whom permissions do not stop
        monkeypatch.setattr(os, "access", lambda *_: False)

    with pytest.raises(OutputError, match="is not writable"):
        run_cases(counted.cases, tmp_path, fingerprint="f")

    tmp_path.chmod(0o700)
    assert list(tmp_path.iterdir()) == []


# Fingerprints


def test_equal_parts_have_equal_fingerprints() -> None:
    def parts() -> tuple[Any, ...]:
        return np.linspace(0, 1, 5), "text", (1, 2.5), ["a", "b"], None

    assert fingerprint_of(*parts()) == fingerprint_of(*parts())
    assert fingerprint_of(*parts()).isalnum()


@pytest.mark.parametrize(
    "other",
    [
        (np.linspace(0, 1, 6), "text", 3),
        (np.linspace(0, 1 + 1e-15, 5), "text", 3),
        (np.linspace(0, 1, 5), "texts", 3),
        (np.linspace(0, 1, 5), "text", 4),
        (np.linspace(0, 1, 5), "text", "3"),
        (np.linspace(0, 1, 5), "text"),
        ("text", np.linspace(0, 1, 5), 3),
    ],
)
def test_whatever_decides_the_result_changes_the_fingerprint(other: tuple[Any, ...]) -> None:
    assert fingerprint_of(*other) != fingerprint_of(np.linspace(0, 1, 5), "text", 3)
