"""One worker process as the web process sees it: start, watch, end."""

import asyncio
import contextlib
import logging
import multiprocessing
import signal
import socket
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from multiprocessing.context import ForkServerProcess
from typing import Any, Literal

import msgspec

from app.session.spec import WorkerSpec
from app.web.channel import MAX_QUEUE, Channel, Head
from app.web.child import run_worker
from app.web.config import ServerConfig

CHECK_S = 0.25
"""How often a worker's patience limits are looked at [s]."""

logger = logging.getLogger("hindsight.web")

Cause = Literal["done", "crashed", "hung", "failed"]


@dataclass(frozen=True)
class Ending:
    """Why a worker is gone.

    Attributes:
        cause: done: it was asked to end, or ended by itself in order; crashed: killed or failed
            in mid-session; hung: killed by us because it fell silent; failed: never got ready.
        text: The same in words, for the person.
        announced: Whether the worker said `ended` itself.
    """

    cause: Cause
    text: str
    announced: bool = False


class Worker:
    """Owns a worker's process and socket from the start to the last byte."""

    def __init__(
        self,
        spec: WorkerSpec,
        config: ServerConfig,
        on_message: Callable[[Head, str], None],
        on_exit: Callable[["Worker", Ending], None],
    ) -> None:
        self.spec = spec
        self.viewer_port = 0
        self.pid = 0
        self.hello: dict[str, Any] = {}
        self.ready = asyncio.Event()
        """Set once the worker is ready, or gone: see `alive`."""
        self.alive = True
        self._config = config
        self._on_message = on_message
        self._on_exit = on_exit
        self._channel: Channel | None = None
        self._pending: list[dict[str, Any]] = []
        self._silent_since_s = time.monotonic()
        self._end_by_s = float("inf")
        self._announced = False
        self._hung = False
        self._exited = asyncio.Event()

    def send(self, message: dict[str, Any]) -> bool:
        """Queue a message that must arrive; False where that cannot be promised."""
        if not self.alive:
            return False
        if self._channel is None:
            if len(self._pending) >= MAX_QUEUE:
                return False
            self._pending.append(message)
            return True
        return self._channel.send(message)

    def send_latest(self, key: str, message: dict[str, Any]) -> None:
        """Offer a message that replaces the waiting one of the same key."""
        if self._channel is not None and self.alive:
            self._channel.send_latest(key, message)

    def discard(self, key: str) -> None:
        """Forget the waiting message of this key."""
        if self._channel is not None:
            self._channel.discard(key)

    def end(self) -> None:
        """Ask the worker to close its log and exit; it is killed where it takes too long."""
        if self._end_by_s == float("inf"):
            self._end_by_s = time.monotonic() + self._config.end_grace_s
            self.send({"type": "end"})

    async def live(self, admission: Callable[[], Awaitable[None]]) -> None:
        """Start the process once `admission` returns, and see it to its end."""
        ending = Ending("failed", "The simulation could not be started.")
        try:
            await admission()
            if self._end_by_s == float("inf"):
                ending = await self._live()
        except (OSError, EOFError) as error:  # no memory, no file handles, forkserver gone
            logger.error("worker %s could not be started: %s", self.spec.id, error)
        finally:
            self.alive = False
            self.ready.set()
            self._on_exit(self, ending)

    async def _live(self) -> Ending:
        process, sock = await asyncio.to_thread(_spawn, self._config.worker_entry, self.spec)
        self.pid = process.pid or 0
        self._silent_since_s = time.monotonic()
        channel = Channel(sock, self._receive)
        self._channel = channel
        for message in self._pending:
            channel.send(message)
        channel.start()
        loop = asyncio.get_running_loop()
        sentinel = process.sentinel
        loop.add_reader(sentinel, self._process_exited, sentinel)
        try:
            await self._watch(process)
        finally:
            loop.remove_reader(sentinel)
            process.join()
            code = process.exitcode
            process.close()
            await channel.drained()
            await channel.close()
        return self._explain(code)

    def _process_exited(self, sentinel: int) -> None:
        asyncio.get_running_loop().remove_reader(sentinel)
        self._exited.set()

    async def _watch(self, process: ForkServerProcess) -> None:
        while not self._exited.is_set():
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._exited.wait(), CHECK_S)
            now_s = time.monotonic()
            ready = self.ready.is_set()
            patience_s = self._config.status_timeout_s if ready else self._config.ready_timeout_s
            if now_s > self._end_by_s or now_s - self._silent_since_s > patience_s:
                self._hung = not self._exited.is_set()
                process.kill()
                await self._exited.wait()

    def _receive(self, head: Head, text: str) -> None:
        self._silent_since_s = time.monotonic()
        if head.type == "ready":
            self.viewer_port = head.viewer_port
            self.hello = head.hello or {}
            self.ready.set()
        elif head.type == "hello":
            self.hello = msgspec.json.decode(text)
        elif head.type == "ended":
            self._announced = True
        self._on_message(head, text)

    def _explain(self, code: int | None) -> Ending:
        was_ready = self.viewer_port > 0
        how = _describe(code)
        if self._hung or code == -signal.SIGALRM:  # see child.DEAD_MAN_S
            logger.warning("worker %s fell silent and was killed", self.spec.id)
            text = "The simulation stopped answering and was ended."
            return Ending("hung", text, self._announced)
        if self._announced or self._end_by_s < float("inf"):
            return Ending("done", "The session has ended.", self._announced)
        logger.warning("worker %s ended unexpectedly: %s", self.spec.id, how)
        if was_ready:
            return Ending("crashed", f"The simulation stopped unexpectedly: {how}.")
        return Ending("failed", f"The simulation could not be started: {how}.")


def _spawn(entry: str, spec: WorkerSpec) -> tuple[ForkServerProcess, socket.socket]:
    """Fork a worker from the forkserver; blocks until the preloaded modules are imported."""
    context = multiprocessing.get_context("forkserver")
    parent, child = socket.socketpair()
    with child:
        try:
            # daemon: the interpreter's exit ends it where everything else failed
            process = context.Process(target=run_worker, args=(entry, spec, child), daemon=True)
            process.start()
        except BaseException:
            parent.close()
            raise
    parent.setblocking(False)
    return process, parent


def _describe(code: int | None) -> str:
    if code is None or code >= 0:
        return f"exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return f"killed by {name}" + (", perhaps for lack of memory" if name == "SIGKILL" else "")
