"""What the hand does by itself once it is told to close: close, lift a little, hold still."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.core.types import Array
from app.robot.arm import FINGER_CLOSED, FINGER_OPEN
from app.robot.outcomes import OutcomeMonitor
from app.robot.simulation import CONTROL_DT

HandPhase = Literal["open", "closing", "lifting", "done"]

FINGER_SPEED = 0.12  # [m/s]: 0.4 s for the full travel, gentle enough not to bat objects away
LIFT_SPEED = 0.12  # [m/s]
LIFT_ACCELERATION = 0.4  # [m/s²]
LIFT_DISTANCE = 0.08  # [m]


@dataclass(frozen=True, slots=True)
class HandCommand:
    """What to do in this tick.

    Attributes:
        twist: The hand's twist [m/s, rad/s], shape (6,); None: the operator's and the assistance's.
        finger_ctrl: What the grip's servo is given [m], 0 open, 0.05 closed.
    """

    twist: Array | None
    finger_ctrl: float


class HandController:
    """open → closing → lifting → done; each tick: command(), step the world, advance().

    Attributes:
        phase: Where it stands.
    """

    def __init__(self) -> None:
        self.phase: HandPhase = "open"
        self._finger = FINGER_OPEN
        self._speed = 0.0
        self._lifted = 0.0

    @property
    def closing(self) -> bool:
        """What `OutcomeMonitor.update` is to be told."""
        return self.phase in ("closing", "lifting")

    def close(self) -> None:
        """Begin to close, where the hand is open."""
        if self.phase == "open":
            self.phase = "closing"
            self._speed = self._lifted = 0.0

    def open(self) -> None:
        """Let go and give the arm back, in any phase."""
        self.phase = "open"

    def command(self) -> HandCommand:
        """Twist and finger command of the next tick."""
        goal = FINGER_OPEN if self.phase == "open" else FINGER_CLOSED
        step = FINGER_SPEED * CONTROL_DT
        self._finger += min(max(goal - self._finger, -step), step)
        if self.phase == "open":
            return HandCommand(None, self._finger)
        twist = np.zeros(6)
        if self.phase == "lifting":
            # Speed up, and slow down in time to stop at the top: v dt + v²/(2a) ≤ what is left.
            left = max(LIFT_DISTANCE - self._lifted, 0.0)
            room = (CONTROL_DT**2 + 2.0 * left / LIFT_ACCELERATION) ** 0.5
            braking = LIFT_ACCELERATION * (room - CONTROL_DT)
            faster = self._speed + LIFT_ACCELERATION * CONTROL_DT
            self._speed = min(faster, LIFT_SPEED, braking)
            self._lifted += self._speed * CONTROL_DT
            twist[2] = self._speed
        return HandCommand(twist, self._finger)

    def advance(self, monitor: OutcomeMonitor) -> None:
        """Go on to the next phase where the monitor's last update allows it."""
        if self.closing and monitor.outcome != "running":
            self.phase = "done"
        elif self.phase == "closing" and monitor.gripped is not None:
            self.phase = "lifting"
