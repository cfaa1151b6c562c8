"""What waits to be sent to one browser: a bounded queue, and one slot for the newest status."""

import asyncio
from collections import deque
from dataclasses import dataclass

MAX_WAITING = 256


@dataclass(frozen=True)
class Close:
    """The last thing in an outbox: close the socket with this code (RFC 6455)."""

    code: int
    reason: str


class Outbox:
    """Filled by the session, emptied by the socket's writer; never blocks who fills it."""

    def __init__(self) -> None:
        self._queue: deque[str] = deque()
        self._status: str | None = None
        self._close: Close | None = None
        self._wake = asyncio.Event()

    def put(self, text: str) -> None:
        """Queue a message; a browser that takes none for long is dropped."""
        if len(self._queue) >= MAX_WAITING:
            self._queue.clear()
            self.close(1013, "this page takes messages too slowly")
        elif self._close is None:
            self._queue.append(text)
            self._wake.set()

    def put_status(self, text: str) -> None:
        """Offer the newest status; it replaces one that still waits."""
        if self._close is None:
            self._status = text
            self._wake.set()

    def close(self, code: int, reason: str) -> None:
        """Let what is queued go out, then close."""
        if self._close is None:
            self._close = Close(code, reason)
            self._wake.set()

    async def next(self) -> str | Close:
        """The next thing to send; queued messages go before a status."""
        while True:
            if self._queue:
                return self._queue.popleft()
            if self._close is not None:
                return self._close
            if self._status is not None:
                status, self._status = self._status, None
                return status
            self._wake.clear()
            await self._wake.wait()
