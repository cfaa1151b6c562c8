"""Work that takes seconds, each piece in a process of its own: watched, bounded, and cancelled.

The web process stays quick and never touches the physics; a job that dies takes nothing along.
"""

import asyncio
import contextlib
import importlib
import multiprocessing
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from app.errors import AppError
from app.review.errors import MissingError, ReviewError

MAX_RUNNING = 2
MAX_WAITING = 32
MAX_KEPT = 12
"""Finished jobs whose results are kept for the page to fetch."""
REPORT_S = 0.1
"""How often a job tells its progress at most [s]."""

Progress = Callable[[float], None]
"""Told how much is done, in [0, 1]."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a job made.

    Attributes:
        content: The answer's body.
        media_type: Of the body.
        filename: Under which a browser should save it; empty: it should not.
    """

    content: bytes
    media_type: str
    filename: str = ""


class Job:
    """One piece of work, from its start to its result."""

    def __init__(self, entry: str, arguments: Mapping[str, Any]) -> None:
        self.id = secrets.token_hex(8)
        self.entry = entry
        self.arguments = dict(arguments)
        self.progress = 0.0
        self.result: Result | None = None
        self.error = ""
        self.done = asyncio.Event()
        self.process: Any = None
        self.cancelled = False


class Jobs:
    """Owns the jobs and their processes."""

    def __init__(self) -> None:
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._places = asyncio.Semaphore(MAX_RUNNING)
        self._tasks: set[asyncio.Task[None]] = set()

    def start(self, entry: str, arguments: Mapping[str, Any]) -> Job:
        """Queue a job, or join an unfinished one that does the same.

        Args:
            entry: "module:function"; called with the arguments and a Progress, returns a Result.
            arguments: Plain values.

        Raises:
            ReviewError: Where too many wait already.
        """
        for job in self._jobs.values():
            same = job.entry == entry and job.arguments == arguments
            if same and not job.done.is_set() and not job.cancelled:
                return job
        waiting = sum(not job.done.is_set() for job in self._jobs.values())
        if waiting >= MAX_WAITING:
            raise ReviewError(f"{waiting} computations are waiting already; try again in a moment")
        job = Job(entry, arguments)
        self._jobs[job.id] = job
        task = asyncio.get_running_loop().create_task(self._live(job))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        self._forget()
        return job

    def find(self, job_id: str) -> Job:
        """The job with this id.

        Raises:
            MissingError: If there is none, or its result was fetched too long ago.
        """
        job = self._jobs.get(job_id)
        if job is None:
            raise MissingError(f"there is no computation {job_id!r} any more; ask for it again")
        return job

    def cancel(self, job_id: str) -> None:
        """End a job that nobody waits for any more; raises as `find`."""
        job = self.find(job_id)
        job.cancelled = True
        kill(job)

    async def close(self) -> None:
        """End all jobs."""
        for job in list(self._jobs.values()):
            self.cancel(job.id)
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _live(self, job: Job) -> None:
        try:
            async with self._places:
                if not job.cancelled:
                    await asyncio.to_thread(run, job)
        except (OSError, EOFError) as error:
            job.error = f"the computation could not be started: {error}"
        finally:
            if job.result is None and not job.error:
                job.error = "the computation was cancelled"
            job.done.set()

    def _forget(self) -> None:
        finished = [job.id for job in self._jobs.values() if job.done.is_set()]
        for job_id in finished[: max(0, len(finished) - MAX_KEPT)]:
            del self._jobs[job_id]


def run(job: Job) -> None:
    """Run a job's process to its end; in a thread of the web process."""
    context = multiprocessing.get_context("forkserver")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(job.entry, job.arguments, theirs), daemon=True)
    process.start()
    job.process = process
    theirs.close()
    if job.cancelled:  # while it started
        kill(job)
    try:
        while True:
            kind, value = ours.recv()
            if kind == "progress":
                job.progress = value
            elif kind == "result":
                job.result = value
            else:
                job.error = value
    except EOFError:
        pass  # it has said all, or was killed
    finally:
        ours.close()
        process.join()
        code = process.exitcode
        if job.result is None and not job.error and not job.cancelled:
            job.error = f"the computation ended unexpectedly (exit code {code})"
        process.close()
        job.process = None


def kill(job: Job) -> None:
    """End a job's process if it runs; from any thread."""
    process = job.process
    if process is not None:
        with contextlib.suppress(ValueError):  # it has ended and was closed meanwhile
            process.kill()


def _run(entry: str, arguments: dict[str, Any], pipe: Connection) -> None:
    """In the job's own process."""
    module, _, function = entry.partition(":")
    told_s = 0.0

    def progress(share: float) -> None:
        nonlocal told_s
        now_s = time.monotonic()
        if now_s - told_s >= REPORT_S:
            told_s = now_s
            pipe.send(("progress", share))

    try:
        result = getattr(importlib.import_module(module), function)(**arguments, progress=progress)
        pipe.send(("result", result))
    except AppError as error:
        pipe.send(("error", str(error)))
    except BrokenPipeError:
        pass  # the web process is gone
    finally:
        pipe.close()
