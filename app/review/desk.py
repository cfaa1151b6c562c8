"""What the web process asks of a review worker: commands in order, the newest seek of each view."""

import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

Message = dict[str, Any]


@dataclass(slots=True)
class Work:
    """What waits.

    Attributes:
        commands: In order; none is dropped.
        seeks: View → the step to show; older wishes are forgotten.
    """

    commands: list[Message] = field(default_factory=list)
    seeks: dict[int, int] = field(default_factory=dict)


class Desk:
    """Filled by the channel's thread, emptied by the worker's."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._commands: deque[Message] = deque()
        self._seeks: dict[int, int] = {}
        self.ended = ""
        """Why the worker shall end; empty while it shall not."""

    def put(self, message: Message) -> None:
        """Take one message of the boundary."""
        kind = message.get("type")
        with self._changed:
            if kind == "command":
                self._commands.append(message)
            elif kind == "seek":
                view, step = message.get("view"), message.get("step")
                if type(view) is int and type(step) is int:
                    self._seeks[view] = step
            elif kind == "end":
                self.ended = self.ended or "The review was closed."
            else:
                return  # who watches is of no interest here
            self._changed.notify()

    def disconnect(self) -> None:
        """The web process is gone."""
        self.end_soon("The server is gone.")

    def end_soon(self, reason: str) -> None:
        """Let the worker end after what it does now."""
        self.ended = self.ended or reason
        # A signal's handler may run inside `put`: it must not wait for the lock.
        if self._changed.acquire(blocking=False):
            try:
                self._changed.notify()
            finally:
                self._changed.release()

    def take(self, timeout_s: float) -> Work:
        """All that waits; empty where nothing came in time."""
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while not (self._commands or self._seeks or self.ended):
                left = deadline - time.monotonic()
                if left <= 0.0:
                    break
                self._changed.wait(left)
            work = Work(list(self._commands), self._seeks)
            self._commands.clear()
            self._seeks = {}
        return work
