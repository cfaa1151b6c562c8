"""Readers of the record that may be slow: each has a thread and sees the newest value only."""

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class LatestReader(Generic[T]):
    """Calls a function with the newest offered value, at most `rate_hz` times a second.

    Offering takes a lock for a few instructions and never waits for the function. Values that
    came between two calls are dropped; one value is read once.
    """

    def __init__(
        self,
        name: str,
        read: Callable[[T], None],
        rate_hz: float,
        on_error: Callable[[Exception], None],
    ) -> None:
        """Start the thread.

        Args:
            name: Of the thread.
            read: The slow function.
            rate_hz: Most calls a second.
            on_error: Told about an exception of `read`, in its thread; the reader goes on.
        """
        self._read = read
        self._period = 1.0 / rate_hz
        self._on_error = on_error
        self._value: T | None = None
        self._changed = threading.Condition()
        self._closing = False
        self.calls = 0
        """How often the function was called."""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def offer(self, value: T) -> None:
        """Replace the value that waits."""
        with self._changed:
            self._value = value
            self._changed.notify()

    def close(self, timeout_s: float = 1.0) -> bool:
        """Stop after the call that runs; False if it has not returned by then."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        due = time.monotonic()
        while True:
            pause = due - time.monotonic()
            if pause > 0:
                time.sleep(pause)
            with self._changed:
                while self._value is None and not self._closing:
                    self._changed.wait()
                if self._closing:
                    return
                value, self._value = self._value, None
            # A fixed grid of times while values keep coming; a new one after a gap or a slow call.
            now = time.monotonic()
            due = due + self._period if now - due < self._period else now + self._period
            self.calls += 1
            if value is not None:
                try:
                    self._read(value)
                except Exception as error:
                    self._on_error(error)
