"""Processes that open files for the server: which are used again, and what becomes of the rest."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from web_client import serving

from chartless.web import _worker, _workers
from chartless.web._workers import TaskError, Workers

Use = Callable[[Workers], Awaitable[Any]]
_ECHO = (
    "import json, sys, os\n"
    "for line in sys.stdin:\n"
    "    answers = json.loads(line)['answers']\n"
    "    for each in answers:\n"
    "        print(each.replace('PID', str(os.getpid())), flush=True)\n"
    "    if not answers:\n"
    "        break\n"
)


def run(use: Use, folder: Path) -> Any:
    async def whole() -> Any:
        workers = Workers(folder, 1 << 40)
        await workers.start()
        try:
            return await use(workers)
        finally:
            await workers.stop()

    return asyncio.run(whole())


@pytest.fixture
def puppets(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Processes that answer what the task says, and end if that is nothing."""
    program = tmp_path / "puppet"
    program.write_text(f"#!/usr/bin/env python3\n{_ECHO}")
    program.chmod(0o700)
    monkeypatch.setattr(_workers.sys, "executable", str(program))


def task(*answers: dict[str, Any] | str) -> dict[str, Any]:
    texts = [each if isinstance(each, str) else json.dumps(each) for each in answers]
    return {"answers": texts}


def pid() -> dict[str, Any]:
    return task({"done": {"pid": "PID"}})


@pytest.mark.usefixtures("puppets")
class TestPuppets:
    def test_a_process_is_used_again(self, tmp_path: Path) -> None:
        async def use(workers: Workers) -> list[Any]:
            first = await workers.run_briefly(pid())
            with pytest.raises(TaskError, match=r"^no$"):
                await workers.run_briefly(task({"failed": "no"}))
            return [first, await workers.run(pid(), print), await workers.run_briefly(pid())]

        first, *others = run(use, tmp_path)

        assert others == [first, first]

    @pytest.mark.parametrize(
        "answers", [[], [{"failed": "no memory", "broken": True}]], ids=["ended", "broken"]
    )
    def test_one_that_broke_is_not_used_again(self, tmp_path: Path, answers: list[Any]) -> None:
        async def use(workers: Workers) -> tuple[Any, Any]:
            first = await workers.run_briefly(pid())
            with pytest.raises(TaskError, match="memory"):
                await workers.run_briefly(task(*answers))
            return first, await workers.run_briefly(pid())

        first, second = run(use, tmp_path)

        assert first != second

    @pytest.mark.parametrize("line", ["no JSON", "[" * 100_000, "x" * 1_000_000])
    def test_one_that_says_nonsense_is_ended(self, tmp_path: Path, line: str) -> None:
        async def use(workers: Workers) -> Any:
            with pytest.raises((ValueError, RecursionError)):
                await workers.run(task(line), print)
            return await workers.run_briefly(pid())

        assert run(use, tmp_path)["pid"]

    def test_one_that_takes_long_for_something_brief_is_ended(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        async def use(workers: Workers) -> Any:
            monkeypatch.setattr(_workers, "_LONGEST", 0.1)
            with pytest.raises(TaskError, match="takes more than"):
                await workers.run_briefly(task({"stage": "looking", "share": 0.5}))
            monkeypatch.setattr(_workers, "_LONGEST", 60.0)
            return await workers.run_briefly(pid())

        assert run(use, tmp_path)["pid"]

    def test_none_is_forgotten_when_another_breaks_at_the_same_time(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        started, start = [], asyncio.create_subprocess_exec

        async def slow_from_the_third(*arguments: str, **settings: Any) -> Any:
            started.append(await start(*arguments, **settings))
            await asyncio.sleep(1 if len(started) > 2 else 0)
            return started[-1]

        async def use(workers: Workers) -> None:
            await workers.run_briefly(pid())  # the one that breaks is quick, the other begins
            broken = task({"failed": "no memory", "broken": True})
            await asyncio.gather(
                workers.run(broken, print), workers.run_briefly(pid()), return_exceptions=True
            )

        monkeypatch.setattr(_workers.asyncio, "create_subprocess_exec", slow_from_the_third)
        run(use, tmp_path)

        assert len(started) > 1
        assert all(each.returncode is not None for each in started)

    def test_one_that_ended_while_it_waited_is_not_missed(self, tmp_path: Path) -> None:
        async def use(workers: Workers) -> Any:
            waiting = workers._waiting
            assert waiting is not None
            waiting.kill()
            await waiting.wait()
            return await workers.run_briefly(pid())

        assert run(use, tmp_path)["pid"]

    def test_what_is_given_up_is_ended(self, tmp_path: Path) -> None:
        async def use(workers: Workers) -> int | None:
            process = workers._waiting
            assert process is not None
            is_running = asyncio.Event()
            running = asyncio.create_task(
                workers.run(task({"stage": "reading", "share": 0}), lambda _, __: is_running.set())
            )
            await is_running.wait()
            running.cancel()
            await asyncio.wait([running])
            return process.returncode

        assert run(use, tmp_path) == -9


def test_what_the_computer_cannot_do_is_told_without_its_paths(tmp_path: Path) -> None:
    answer = _worker._answer({"task": "inspect", "folder": str(tmp_path / "gone")}, print)

    assert "No such file" in answer["failed"]
    assert str(tmp_path) not in answer["failed"]


@pytest.mark.slow
def test_without_processes_a_calibration_fails_and_says_so(
    tmp_path: Path, frames: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving(tmp_path) as nobody:
        client = nobody.begin()
        for path in frames:
            client.put(path.name, path.read_bytes())

        def start(*_: object, **__: object) -> None:
            msg = "no more processes"
            raise BlockingIOError(msg)

        monkeypatch.setattr(_workers.asyncio, "create_subprocess_exec", start)
        stopped = client.ask("POST", "/api/cameras", {"method": "ism-bin"}).json["id"]
        client.ask("DELETE", f"/api/cameras/{stopped}")
        key = client.ask("POST", "/api/cameras", {"method": "nlf"}).json["id"]

        assert "no more processes" in client.finished(key)["error"]
