"""Processes that make calibrations, so that the page answers while they do."""

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

from chartless.errors import ChartlessError
from chartless.types import JsonObject

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of it that is finished, 0 … 1."""

_LONGEST_LINE = 1 << 24  # bytes, of what a process says
_AT_ONCE = max(1, (os.cpu_count() or 1) // 2)


class TaskError(ChartlessError):
    """A task that failed; the text is what the worker said."""


class Workers:
    """Runs tasks, some at once, each in a process of its own.

    One process more than needed waits with everything imported, so that a task starts at once.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._room = asyncio.Semaphore(_AT_ONCE)
        self._spare: asyncio.Task[asyncio.subprocess.Process] | None = None

    def start(self) -> None:
        """Let a process wait for the first task."""
        self._spare = asyncio.create_task(self._new())

    async def stop(self) -> None:
        """End the process that waits. Tasks end when they are cancelled."""
        if self._spare is not None:
            await _end(await self._spare)

    async def run(self, task: JsonObject, progress: Progress) -> JsonObject:
        """Run a task to its end; if this is cancelled, its process ends.

        Raises
        ------
        TaskError
            If it failed.
        """
        async with self._room:
            waiting = self._spare or asyncio.create_task(self._new())
            self.start()
            process = await waiting
            try:
                return await _answer(process, task, progress)
            finally:
                await _end(process)

    async def _new(self) -> asyncio.subprocess.Process:
        # -P: a file that somebody uploaded must not be imported. A session of its own: Ctrl-C in
        # the terminal is for the server alone.
        return await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "chartless.web._worker"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            cwd=self._folder,
            limit=_LONGEST_LINE,
            start_new_session=True,
        )


async def _answer(
    process: asyncio.subprocess.Process, task: JsonObject, progress: Progress
) -> JsonObject:
    if process.stdin is None or process.stdout is None:
        raise AssertionError
    with contextlib.suppress(ConnectionError):  # of a process that has ended: no answer comes
        process.stdin.write(json.dumps(task).encode() + b"\n")
        await process.stdin.drain()
    async for line in process.stdout:
        answer = json.loads(line)
        if "failed" in answer:
            raise TaskError(answer["failed"])
        if "done" in answer:
            done: JsonObject = answer["done"]
            return done
        progress(answer["stage"], answer["share"])
    msg = "the calculation was stopped, perhaps for want of memory: give smaller or fewer frames"
    raise TaskError(msg)


async def _end(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await process.wait()
