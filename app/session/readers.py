"""Readers of the record that may be slow: each has a thread and sees the newest value only."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class LatestReader(Generic[T]):
    """Calls a function with the newest offered value, at most `rate_hz` times a second.

    Offering takes a lock for a few instructions and never waits for the function. Values that
    came between two calls are dropped; one value is read once. Jobs that concern what the function
    owns run in the same thread, in order, and none is dropped.
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
        self._jobs: deque[Callable[[], None]] = deque()
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

    def run(self, job: Callable[[], None]) -> None:
        """Queue a job for the reader's thread; it runs before the next value is read."""
        with self._changed:
            self._jobs.append(job)
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
            with self._changed:
                while not self._closing and not self._jobs and not self._ready(due):
                    # With a value at hand only its time is awaited; a job comes at once.
                    wait = None if self._value is None else max(0.0, due - time.monotonic())
                    self._changed.wait(wait)
                if self._closing:
                    return
                job = self._jobs.popleft() if self._jobs else None
                value = self._value
                if job is None:
                    self._value = None
            if job is not None:
                self._attempt(job)
            elif value is not None:
                # A fixed grid of times while values keep coming, a new one after a gap.
                now = time.monotonic()
                due = due + self._period if now - due < self._period else now + self._period
                self.calls += 1
                self._attempt(lambda value=value: self._read(value))

    def _ready(self, due: float) -> bool:
        return self._value is not None and time.monotonic() >= due

    def _attempt(self, action: Callable[[], None]) -> None:
        try:
            action()
        except Exception as error:
            self._on_error(error)
