"""The web process's end of the boundary: newline-delimited JSON, bounded, never blocking.

Messages that must arrive wait in a queue; messages that newer ones replace wait in one slot a
key. Of each message from the worker only the head is decoded: the text goes to the browser as
it came.
"""

import asyncio
import logging
import socket
from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec

MAX_LINE_BYTES = 256 * 1024
MAX_QUEUE = 512
_BUFFER_BYTES = 16 * 1024
"""Small, so that what waits in the kernel is not stale."""

logger = logging.getLogger("hindsight.web")


class Head(msgspec.Struct, frozen=True):
    """The fields of a worker's message that the web process itself reads."""

    type: str
    client: str | None = None
    viewer_port: int = 0
    pid: int = 0
    hello: dict[str, Any] | None = None


class Channel:
    """Owns the parent's end of a worker's socket pair."""

    def __init__(
        self,
        sock: socket.socket,
        on_message: Callable[[Head, str], None],
    ) -> None:
        """Take over a connected stream socket; nothing moves before `start`.

        Args:
            sock: The parent's end.
            on_message: Called with the head and the JSON text of each message.
        """
        self._sock = sock
        self._on_message = on_message
        self._queue: deque[bytes] = deque()
        self._latest: dict[str, bytes] = {}
        self._wake = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self.malformed = 0
        """Lines of the worker that were no message."""

    def start(self) -> None:
        """Begin to read and write."""
        self._task = asyncio.get_running_loop().create_task(self._run())

    def send(self, message: dict[str, Any]) -> bool:
        """Queue a message that must arrive; False where the queue is full."""
        if len(self._queue) >= MAX_QUEUE:
            return False
        self._queue.append(msgspec.json.encode(message) + b"\n")
        self._wake.set()
        return True

    def send_latest(self, key: str, message: dict[str, Any]) -> None:
        """Offer a message that replaces the waiting one of the same key."""
        self._latest[key] = msgspec.json.encode(message) + b"\n"
        self._wake.set()

    def discard(self, key: str) -> None:
        """Forget the waiting message of this key."""
        self._latest.pop(key, None)

    async def drained(self, timeout_s: float = 1.0) -> None:
        """Wait until all that the worker has sent is read, after it is gone."""
        if self._task is not None:
            await asyncio.wait([self._task], timeout=timeout_s)

    async def close(self) -> None:
        """Close the socket; the worker sees the end of its input."""
        if self._task is None:
            self._sock.close()
        else:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
        reader, writer = await asyncio.open_unix_connection(sock=self._sock, limit=MAX_LINE_BYTES)
        writer.transport.set_write_buffer_limits(high=4096)
        writing = asyncio.get_running_loop().create_task(self._write(writer))
        try:
            await self._read(reader)
        finally:
            writing.cancel()
            await asyncio.gather(writing, return_exceptions=True)
            writer.transport.abort()

    async def _read(self, reader: asyncio.StreamReader) -> None:
        decoder = msgspec.json.Decoder(Head)
        while True:
            try:
                line = await reader.readline()
            except ValueError:  # longer than MAX_LINE_BYTES; the reader has dropped it
                self.malformed += 1
                continue
            except OSError:
                return
            if not line.endswith(b"\n"):
                return
            try:
                head, text = decoder.decode(line), line[:-1].decode()
            except (ValueError, RecursionError) as error:
                self.malformed += 1
                logger.warning("a worker sent %d bytes that are no message: %s", len(line), error)
                continue
            self._on_message(head, text)

    async def _write(self, writer: asyncio.StreamWriter) -> None:
        while True:
            await self._wake.wait()
            self._wake.clear()
            while self._queue or self._latest:
                if self._queue:
                    block = self._queue.popleft()
                else:
                    block = self._latest.pop(next(iter(self._latest)))
                writer.write(block)
                try:
                    await writer.drain()
                except OSError:
                    return  # the reader sees the end of the stream and says so
