# pyright: reportMissingImports=false
"""Our two terms of Pink's quadratic program: the commanded twist, and limits on the motion."""

import numpy as np
import pinocchio as pin
from pink import Configuration
from pink.limits import Limit
from pink.tasks import Task

from app.core.types import Array

UNITS = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # [1, 1, 1, m/rad …]
STRAIGHTNESS = 10.0


class TwistTask(Task):
    """Make the hand move by a given small displacement: S (J Δq − [v; ω] dt) → 0.

    Axes are those of the world, the point is the hand's: what a twist of the contract means.
    S counts rotation in units of 0.3 m/rad, and what leads off the commanded line STRAIGHTNESS
    times as much as what is missing along it: at the end of its reach the arm slows down on the
    line instead of sliding away from it.
    """

    def __init__(self, frame: str) -> None:
        super().__init__(cost=1.0)
        self.frame = frame
        self._displacement = np.zeros(6)
        self._weight = STRAIGHTNESS * np.diag(UNITS)

    def __repr__(self) -> str:  # pyright: ignore[reportIncompatibleMethodOverride]
        return f"TwistTask(frame={self.frame!r})"

    def set_displacement(self, displacement: Array) -> None:
        """Twist times dt [m, rad], shape (6,)."""
        self._displacement = displacement
        line = UNITS * displacement
        length = np.sqrt(line @ line)
        self._weight = STRAIGHTNESS * np.diag(UNITS)
        if length > 0.0:
            line = line / length
            self._weight += np.outer((1.0 - STRAIGHTNESS) * line, line * UNITS)

    def compute_error(self, configuration: Configuration) -> Array:
        """−S · displacement, shape (6,)."""
        return -self._weight @ self._displacement

    def compute_jacobian(self, configuration: Configuration) -> Array:
        """S times the world-aligned Jacobian of the hand, shape (6, 7)."""
        return self._weight @ pin.getFrameJacobian(
            configuration.model,
            configuration.data,
            configuration.model.getFrameId(self.frame),
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )


class MotionLimit(Limit):
    """Joint positions with room to brake, and joint acceleration, as one box that is never empty.

    For the upper side (the lower is its mirror), with d = q_max − q and a the acceleration limit:
        q̇ ≤ q̇_prev + a dt,   q̇ dt + q̇²/(2a) ≤ d.
    The second keeps, after this tick, room to stop at a; once it holds, it never asks for more than
    a, so the two agree. From a state that breaks it (the arm was pushed), the position limit wins.
    Pink's own AccelerationLimit has no such order and makes the program infeasible there; without
    any acceleration bound, joints jump by 60–280 rad/s² near a singularity.
    """

    def __init__(self, low: Array, high: Array, velocity: Array, acceleration: Array) -> None:
        self._low, self._high = low, high
        self._velocity = velocity
        self._acceleration = acceleration
        self._q = np.zeros_like(low)
        self._previous = np.zeros_like(low)
        eye = np.eye(len(low))
        self._matrix = np.vstack([eye, -eye])

    def set_state(self, q: Array, previous: Array) -> None:
        """Joint positions [rad] and velocities of the tick before [rad/s], shape (7,) each."""
        self._q = q
        self._previous = previous

    def bounds(self, dt: float) -> tuple[Array, Array]:
        """Lowest and highest q̇ [rad/s] of this tick, shape (7,) each."""
        room_up, room_down = self._high - self._q, self._q - self._low
        top = self._reachable(room_up, dt)
        bottom = -self._reachable(room_down, dt)
        high = np.clip(self._previous + self._acceleration * dt, bottom, top)
        low = np.clip(self._previous - self._acceleration * dt, bottom, top)
        return low, high

    def _reachable(self, room: Array, dt: float) -> Array:
        acceleration, room = self._acceleration, np.maximum(room, 0.0)
        fastest = acceleration * (np.sqrt(dt**2 + 2.0 * room / acceleration) - dt)
        return np.minimum(fastest, self._velocity)

    def compute_qp_inequalities(
        self, configuration: Configuration, dt: float
    ) -> tuple[Array, Array]:
        """G Δq ≤ h of the box."""
        low, high = self.bounds(dt)
        return self._matrix, np.concatenate([high, -low]) * dt
