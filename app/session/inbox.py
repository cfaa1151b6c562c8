"""What arrives for a session: the newest input in its gate, everything else in order."""

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from app.session.watchdog import InputError, InputGate


class Inbox:
    """Sorts messages in the reader's thread; the loop takes what waits at its next tick.

    Attributes:
        gate: The newest input and whether it counts.
        round_trip_ms: As last measured by the page.
        ended: Why the session shall end; empty: it goes on.
        delay_s: How much later than it came input takes effect [s]; for studies of delay.
    """

    def __init__(self, wake: Callable[[], None], delay_s: float = 0.0) -> None:
        """Prepare.

        Args:
            wake: Called where something has come that the next tick should not wait for.
            delay_s: How much later than it came input takes effect [s].
        """
        self.gate = InputGate()
        self.round_trip_ms = 0.0
        self.ended = ""
        self._wake = wake
        self.delay_s = delay_s
        self._delayed: deque[tuple[float, dict[str, Any]]] = deque()
        self._waiting: deque[dict[str, Any]] = deque()  # append and popleft are atomic

    def put(self, message: dict[str, Any]) -> None:
        """Take a message from the web process; called in the reader's thread."""
        kind = message.get("type")
        if kind == "input":
            self._put_input(message)
        elif kind == "rtt":
            ms = message.get("ms")
            if isinstance(ms, (int, float)) and 0 <= ms < 1e6:
                self.round_trip_ms = float(ms)
        elif kind == "end":
            self.end("The session has ended.")
        else:
            if kind == "event":
                self.gate.page_event(str(message.get("client", "")), str(message.get("name", "")))
            elif kind == "clients":
                control = message.get("control")
                self.gate.set_control(None if control is None else str(control))
            self._waiting.append(message)
            self._wake()

    def end(self, reason: str) -> None:
        """Let the session end; the first reason stays."""
        self.ended = self.ended or reason
        self._wake()

    def end_soon(self, reason: str) -> None:
        """The same from a signal handler, which may not take the locks that waking needs."""
        self.ended = self.ended or reason

    def disconnect(self) -> None:
        """The other side is gone."""
        self.gate.disconnect()
        self.end("The server has gone away.")

    def take(self) -> list[dict[str, Any]]:
        """All messages but inputs that have come since the last call, oldest first."""
        while self._delayed and self._delayed[0][0] <= time.monotonic():
            self._accept(self._delayed.popleft()[1])
        taken: list[dict[str, Any]] = []
        while True:
            try:
                taken.append(self._waiting.popleft())
            except IndexError:
                return taken

    def _put_input(self, message: dict[str, Any]) -> None:
        if self.delay_s > 0.0:
            self._delayed.append((time.monotonic() + self.delay_s, message))
        else:
            self._accept(message)

    def _accept(self, message: dict[str, Any]) -> None:
        try:
            if self.gate.accept(message, time.monotonic()):
                self._wake()
        except InputError:
            pass  # counted by the gate; a refused input has no effect
