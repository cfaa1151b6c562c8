"""All worker processes: how many, how fast they start, and that none is left behind."""

import asyncio
import logging
import multiprocessing
from collections.abc import Callable
from multiprocessing import forkserver

from app.errors import AppError
from app.session.spec import WorkerSpec
from app.web.channel import Head
from app.web.config import ServerConfig
from app.web.limits import TokenBucket
from app.web.worker import Ending, Worker

logger = logging.getLogger("hindsight.web")


class PoolFullError(AppError):
    """This machine bears no further session at present."""


class WorkerPool:
    """Owns the workers; one per running session."""

    def __init__(self, config: ServerConfig) -> None:
        self._config = config
        self._starts = TokenBucket(config.starts_per_s, config.start_burst)
        self._tasks: dict[Worker, asyncio.Task[None]] = {}
        self._closing = False

    @property
    def count(self) -> int:
        """Workers that run or start."""
        return len(self._tasks)

    @property
    def capacity(self) -> int:
        """Most workers at once."""
        return self._config.max_workers

    @property
    def full(self) -> bool:
        """Whether a further start would be refused."""
        return self._closing or self.count >= self.capacity

    async def open(self) -> None:
        """Start the forkserver, so that its imports are done before the first participant."""
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["app.web.child", *self._config.preload])
        await asyncio.to_thread(forkserver.ensure_running)

    def start(
        self,
        spec: WorkerSpec,
        on_message: Callable[[Head, str], None],
        on_exit: Callable[[Worker, Ending], None],
    ) -> Worker:
        """Start a worker; it is ready when its `ready` is set and it is `alive`.

        Args:
            spec: What the worker is told.
            on_message: Called with the head and JSON text of every message of the worker.
            on_exit: Called once, after the process is gone and its last message was read.

        Raises:
            PoolFullError: Naming the capacity.
        """
        if self.full:
            raise PoolFullError(f"all {self.capacity} places of this machine are taken")

        def left(worker: Worker, ending: Ending) -> None:
            self._tasks.pop(worker, None)
            on_exit(worker, ending)

        worker = Worker(spec, self._config, on_message, left)
        self._tasks[worker] = asyncio.get_running_loop().create_task(worker.live(self._admit))
        return worker

    async def close(self) -> None:
        """End all workers and wait until they are gone."""
        self._closing = True
        tasks = list(self._tasks.values())
        for worker in list(self._tasks):
            worker.end()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _admit(self) -> None:
        """Wait for the turn of one start; a burst of participants is spread, not refused."""
        while not self._starts.take() and not self._closing:
            await asyncio.sleep(0.05)
