"""Whether a driver or a visitor steers: a driver fills the time in which nobody touches a stick."""

from typing import Literal, Protocol

from app.core import UserInput, compute_input
from app.session.trial import Trial

RESUME_S = 60.0
"""The driver takes over again when no visitor has done anything for this long [s]."""

Change = Literal["", "handed-over", "resumed"]


class Driver(Protocol):
    """Somebody who can steer in a visitor's place, such as a simulated user."""

    def act(self, trial: Trial) -> tuple[UserInput, bool]:
        """What it does in the tick to come: sticks, and whether the hand is to close."""
        ...

    def wants_next(self, trial: Trial) -> bool:
        """Whether the finished trial has been looked at for long enough."""
        ...


class Autopilot:
    """Remembers who steers.

    Attributes:
        driver: Who steers while no visitor does.
        drives: Whether the driver steers now.
    """

    def __init__(self, driver: Driver, resume_s: float = RESUME_S) -> None:
        """Let the driver begin.

        Args:
            driver: Who steers while no visitor does.
            resume_s: How long nobody must have done anything until the driver resumes [s].
        """
        self.driver = driver
        self.drives = True
        self._resume_s = resume_s
        self._seen_s: float | None = None
        self._touched = False

    def take(self) -> bool:
        """Let the visitor steer, who has sent a command; whether the driver did until now."""
        self._touched = True
        drove, self.drives = self.drives, False
        return drove

    def watch(self, user_input: UserInput, now_s: float) -> Change:
        """Once a tick: who steers in it, and whether that has changed.

        Args:
            user_input: The visitor's, zero where there is none.
            now_s: Monotonic time [s].
        """
        if self._touched or _is_pushed(user_input):
            self._seen_s = now_s
            drove = self.take()
            self._touched = False
            if drove:
                return "handed-over"
        elif not self.drives and self._seen_s is not None:
            if now_s - self._seen_s >= self._resume_s:
                self.drives = True
                return "resumed"
        return ""


def _is_pushed(user_input: UserInput) -> bool:
    """Whether a stick is beyond its dead zone."""
    return any(user_input.axes) and bool(compute_input(user_input).any())
