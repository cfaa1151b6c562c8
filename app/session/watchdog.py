"""Whose input counts, and for how long: the newest fresh one, else zero.

No input for 0.3 s, a blurred or hidden page, nobody in control, or a dropped socket mean zero
user input. A message that is replayed, out of order, or waited on its way (it arrives much later
after its own time stamp than the fastest messages of the same page do) is refused, so that a
queue of stale commands never moves the arm.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

from app.core import Mode, UserInput
from app.errors import AppError

INPUT_TIMEOUT_S = 0.3
QUEUED_S = 0.3
"""A message this much slower than the page's fastest has waited in a queue [s]."""
CLOCK_STEP_S = 5.0
"""A delay beyond this is a stepped or sleeping clock, not a queue: learn the offset anew [s]."""
SETTLE_S = 0.5
"""How long input is refused while the offset of a stepped clock is learnt [s]."""
_WINDOW_S = 5.0

Loss = Literal["", "nobody", "silent", "blur", "hidden", "disconnected"]
"""Why there is no input; empty: there is."""


class InputError(AppError):
    """An input message that is refused."""


class ClockOffset:
    """Delay of each message beyond the fastest of the last 5 to 10 s.

    The two clocks share no zero; the smallest difference seen is the fastest way plus the
    offset. It is kept in two windows, so that drifting clocks and new routes are followed.
    """

    def __init__(self) -> None:
        self._current = self._previous = math.inf
        self._window_end = -math.inf

    def excess(self, client_s: float, now_s: float) -> float:
        """Delay of a message beyond the fastest one's [s]; 0 for the first."""
        difference = now_s - client_s
        if now_s >= self._window_end:
            self._previous = self._current
            self._current = math.inf
            self._window_end = now_s + _WINDOW_S
        self._current = min(self._current, difference)
        return difference - min(self._current, self._previous)


@dataclass(frozen=True, slots=True)
class Received:
    """An accepted input, replaced as one value so that readers never see half of it."""

    user_input: UserInput
    at_s: float


class InputGate:
    """Keeps the newest input of the client in control.

    `current` belongs to the loop's thread, everything else to the reader's.
    """

    def __init__(self) -> None:
        self._received: Received | None = None
        self._control: str | None = None
        self._blocked: frozenset[str] = frozenset()
        self._connected = True
        self._offset = ClockOffset()
        self._last_sequence = -1
        self._last_client_s = -math.inf
        self._settled_at = -math.inf
        self.refused = 0
        """Messages refused so far."""

    def set_control(self, client: str | None) -> None:
        """Let one client's input count; None: nobody's."""
        if client != self._control:
            self._received = None
            self._blocked = frozenset()
            self._offset = ClockOffset()
            self._last_sequence, self._last_client_s = -1, -math.inf
            self._settled_at = -math.inf
        self._control = client

    def page_event(self, client: str, name: str) -> None:
        """A blurred or hidden page blocks input until it is focused or visible again."""
        if client != self._control:
            return
        if name in ("blur", "hidden"):
            self._received = None
            self._blocked |= {name}
        elif name in ("focus", "visible"):
            self._blocked -= {"blur" if name == "focus" else "hidden"}

    def disconnect(self) -> None:
        """The socket to the web process is gone."""
        self._connected = False
        self._received = None

    def accept(self, message: Mapping[str, Any], now_s: float) -> bool:
        """Take one input message; returns whether it differs from what counted before.

        Args:
            message: The browser's `input` message with `client`.
            now_s: This process's monotonic clock [s].

        Raises:
            InputError: If it is malformed, stale, replayed or not from the client in control.
        """
        try:
            return self._accept(message, now_s)
        except InputError:
            self.refused += 1
            raise

    def _accept(self, message: Mapping[str, Any], now_s: float) -> bool:
        client = str(message.get("client", ""))
        if client != self._control:
            raise InputError(f"input from {client!r}, but {self._control!r} has control")
        user_input = parse_input(message)
        client_s = user_input.client_time / 1000
        excess = self._offset.excess(client_s, now_s)
        if user_input.sequence <= self._last_sequence or client_s < self._last_client_s:
            if client_s < self._last_client_s - CLOCK_STEP_S:
                self._last_client_s = client_s  # the page's clock was set back
            raise InputError(
                f"input {user_input.sequence} at {client_s:.3f} s is not after "
                f"{self._last_sequence} at {self._last_client_s:.3f} s"
            )
        self._last_sequence, self._last_client_s = user_input.sequence, client_s
        if excess > CLOCK_STEP_S:
            self._offset = ClockOffset()
            self._settled_at = now_s + SETTLE_S
        if now_s < self._settled_at:
            raise InputError("the page's clock was stepped; learning its offset")
        if excess > QUEUED_S:
            raise InputError(f"input waited {excess:.2f} s; valid: at most {QUEUED_S} s")
        before = self._received
        if self._blocked:
            return False
        self._received = Received(user_input, now_s)
        return before is None or before.user_input.axes != user_input.axes

    def current(self, now_s: float) -> tuple[UserInput, Loss]:
        """The input that counts now, and why it is zero where it was lost."""
        received = self._received
        if not self._connected:
            loss: Loss = "disconnected"
        elif self._control is None:
            loss = "nobody"
        elif self._blocked:
            loss = "hidden" if "hidden" in self._blocked else "blur"
        elif received is None or now_s - received.at_s > INPUT_TIMEOUT_S:
            loss = "silent"
        else:
            return received.user_input, ""
        last = received.user_input if received else UserInput()
        return replace(last, axes=(0.0, 0.0, 0.0, 0.0)), loss


def parse_input(message: Mapping[str, Any]) -> UserInput:
    """UserInput of a browser's message `{left:[x,y], right:[x,y], mode, yaw, dead_zone, …}`.

    Raises:
        InputError: Naming the field, its value and what is valid.
    """
    axes = (*_stick(message, "left"), *_stick(message, "right"))
    mode = message.get("mode", "translate")
    if mode not in get_args(Mode):
        raise InputError(f"mode is {mode!r}; valid: {', '.join(get_args(Mode))}")
    device = message.get("device", "none")
    if not isinstance(device, str) or len(device) > 100:
        raise InputError(f"device is {device!r}; valid: a text of at most 100 characters")
    sequence = message.get("seq")
    if type(sequence) is not int or not 0 <= sequence < 2**53:
        raise InputError(f"seq is {sequence!r}; valid: a whole number from 0 to 2**53")
    return UserInput(
        axes=axes,
        mode=mode,
        view_yaw=_number(message, "yaw", 0.0, -100.0, 100.0),
        dead_zone=_number(message, "dead_zone", 0.1, 0.0, 0.95),
        device=device,
        sequence=sequence,
        client_time=_number(message, "t", None, 0.0, 1e15),
    )


def _stick(message: Mapping[str, Any], name: str) -> tuple[float, float]:
    stick = message.get(name, (0.0, 0.0))
    if not isinstance(stick, (list, tuple)) or len(stick) != 2:
        raise InputError(f"{name} is {stick!r}; valid: [x, y]")
    x, y = (_finite(name, value, -1.0, 1.0) for value in stick)
    return x, y


def _number(
    message: Mapping[str, Any], name: str, default: float | None, low: float, high: float
) -> float:
    return _finite(name, message.get(name, default), low, high)


def _finite(name: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise InputError(f"{name} is {value!r}; valid: a number from {low} to {high}")
    return float(value)
