"""The worker's end of the boundary: newline-delimited JSON on a socket, never blocking the loop.

One thread reads and hands each message over at once; one writes. Status messages replace one
another while they wait; acks and notices queue.
"""

import socket
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec

MAX_LINE_BYTES = 64 * 1024
"""Longest message; the page's own limit is 4 KiB."""
_SEND_BUFFER_BYTES = 16 * 1024
"""Small, so that a status message is not stale by the time a slow reader gets to it."""

Message = dict[str, Any]


class Channel:
    """Owns the socket and its two threads."""

    def __init__(
        self,
        sock: socket.socket,
        on_message: Callable[[Message], None],
        on_close: Callable[[], None],
    ) -> None:
        """Take over a connected stream socket; nothing is read before `start`.

        Args:
            sock: One end of a socket pair (or a TCP connection).
            on_message: Called in the reader's thread for each message; must be quick.
            on_close: Called once in the reader's thread when the other side is gone.
        """
        self._sock = sock
        self._on_message = on_message
        self._on_close = on_close
        self._queue: deque[Message] = deque()
        self._status: Message | None = None
        self._waiting = threading.Condition()
        self._closing = False
        self.malformed = 0
        """Lines that were no JSON object, or too long."""
        sock.setblocking(True)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self._reader = threading.Thread(target=self._read, name="channel-read", daemon=True)
        self._writer = threading.Thread(target=self._write, name="channel-write", daemon=True)

    def start(self) -> None:
        """Begin to read and write."""
        self._reader.start()
        self._writer.start()

    def send(self, message: Message) -> None:
        """Queue a message that must arrive."""
        with self._waiting:
            self._queue.append(message)
            self._waiting.notify()

    def send_status(self, message: Message) -> None:
        """Offer a message that the next one replaces if it has not left by then."""
        with self._waiting:
            self._status = message
            self._waiting.notify()

    def close(self, timeout_s: float = 1.0) -> None:
        """Send what is queued (but give up after `timeout_s`), then close the socket."""
        with self._waiting:
            self._closing = True
            self._waiting.notify()
        if self._writer.is_alive():
            self._writer.join(timeout_s)
        try:
            self._sock.shutdown(socket.SHUT_RDWR)  # wakes both threads
        except OSError:
            pass  # the other side was first
        self._sock.close()
        for thread in (self._reader, self._writer):
            if thread.is_alive() and thread is not threading.current_thread():
                thread.join(timeout_s)

    def _read(self) -> None:
        decoder = msgspec.json.Decoder(dict[str, Any])
        rest, skipping = b"", False
        while True:
            try:
                block = self._sock.recv(65536)
            except OSError:
                block = b""
            if not block:
                break
            *lines, rest = (rest + block).split(b"\n")
            for line in lines:
                if skipping:
                    skipping = False  # the tail of a line that was too long
                elif line:
                    self._dispatch(decoder, line)
            if len(rest) > MAX_LINE_BYTES:
                self.malformed += not skipping
                rest, skipping = b"", True
        self._on_close()

    def _dispatch(self, decoder: "msgspec.json.Decoder[dict[str, Any]]", line: bytes) -> None:
        try:
            message = decoder.decode(line)
        except (ValueError, RecursionError):
            self.malformed += 1
            return
        self._on_message(message)

    def _write(self) -> None:
        encoder = msgspec.json.Encoder()
        while True:
            with self._waiting:
                while not self._queue and self._status is None and not self._closing:
                    self._waiting.wait()
                # What waits goes in one block: small messages cost the kernel's buffer far more
                # than their size.
                messages = list(self._queue)
                self._queue.clear()
                if not messages and self._status is not None and not self._closing:
                    messages, self._status = [self._status], None
                if not messages:
                    return  # closing, and nothing that must arrive is left
            try:
                self._sock.sendall(b"".join(encoder.encode(m) + b"\n" for m in messages))
            except OSError:
                return  # the reader sees the end of the stream and says so
