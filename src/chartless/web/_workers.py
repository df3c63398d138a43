"""Processes that open what browsers send, so that the page answers while they do."""

import asyncio
import contextlib
import json
import os
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable
from pathlib import Path

from chartless.errors import ChartlessError
from chartless.types import JsonObject

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of it that is finished, 0 … 1."""

_AT_ONCE = min(2, max(1, (os.cpu_count() or 1) // 2))
_PROCESSES = _AT_ONCE + 1  # and one for what is brief
_LONGEST = 60.0  # seconds of that; all of a raw file is unpacked


class TaskError(ChartlessError):
    """A task that failed; the text is what the worker said, or why it said nothing."""


class Workers:
    """Runs tasks, some that are long and one that is brief at once, in processes of their own.

    A process that has done its task well waits for the next with everything imported.

    Parameters
    ----------
    folder : Path
        Where processes start.
    most_bytes : int
        Address space of each; less if the computer has not as much memory for all of them.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self._folder = folder
        self._most_bytes = most_bytes
        self._room = asyncio.Semaphore(_AT_ONCE)
        self._brief = asyncio.Lock()
        self._waiting: Process | None = None

    async def start(self) -> None:
        """Let a process wait for the first task."""
        self._waiting = await self._new()

    async def stop(self) -> None:
        """End the process that waits. Others end when their tasks are cancelled."""
        if self._waiting is not None:
            await _end(self._waiting)

    async def run(self, task: JsonObject, progress: Progress) -> JsonObject:
        """Run a task of `chartless.web._tasks` to its end; cancelled, its process is ended.

        Raises
        ------
        TaskError
            If it failed.
        """
        async with self._room:
            return _done(await self._answer(task, progress))

    async def run_briefly(self, task: JsonObject) -> JsonObject:
        """Run a task that takes no time to speak of; raises `TaskError` if it failed or does."""
        async with self._brief:
            try:
                async with asyncio.timeout(_LONGEST):
                    return _done(await self._answer(task, lambda _, __: None))
            except TimeoutError as error:
                msg = f"that takes more than {_LONGEST:g} seconds: give something smaller"
                raise TaskError(msg) from error

    async def _answer(self, task: JsonObject, progress: Progress) -> JsonObject:
        """The last answer to a task, of a process that is used again if that is no risk."""
        process, self._waiting = self._waiting, None
        if process is None or process.returncode is not None:
            process = await self._new()
        is_sound = False
        try:
            answer = await _asked(process, task, progress)
            is_sound = "broken" not in answer
        finally:
            if not is_sound or self._waiting is not None:
                await _end(process)
            else:
                self._waiting = process
        return answer

    async def _new(self) -> Process:
        # -P: a file that somebody uploaded must not be imported. A session of its own: Ctrl-C in
        # the terminal is for the server alone.
        return await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "chartless.web._worker"),
            *(str(self._most_bytes), str(_PROCESSES)),
            stdin=PIPE,
            stdout=PIPE,
            cwd=self._folder,
            start_new_session=True,
        )


async def _asked(process: Process, task: JsonObject, progress: Progress) -> JsonObject:
    """The last answer to a task."""
    if process.stdin is None or process.stdout is None:
        raise AssertionError
    with contextlib.suppress(ConnectionError):  # of a process that has ended: no answer comes
        process.stdin.write(json.dumps(task).encode() + b"\n")
        await process.stdin.drain()
    async for line in process.stdout:
        answer: JsonObject = json.loads(line)
        if "stage" not in answer:
            return answer
        progress(answer["stage"], answer["share"])
    text = "the calculation was stopped, perhaps for lack of memory: give smaller or fewer frames"
    return {"failed": text, "broken": True}


def _done(answer: JsonObject) -> JsonObject:
    if "failed" in answer:
        raise TaskError(answer["failed"])
    done: JsonObject = answer["done"]
    return done


async def _end(process: Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await process.wait()
