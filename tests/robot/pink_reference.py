# pyright: reportMissingImports=false
"""The inverse kinematics as Pink states it: the reference for `app.robot.kinematics`.

The same program from Pink's general parts and two of our own: the commanded twist, and limits on
the motion.
"""

import numpy as np
import pinocchio as pin
import qpsolvers
from pink import Configuration, build_ik
from pink.limits import Limit, VelocityLimit
from pink.tasks import DampingTask, PostureTask, Task

from app.core.types import Array
from app.robot.arm import HAND_SITE, JOINT_HIGH, JOINT_LOW, MAX_ACCELERATION, MAX_VELOCITY
from app.robot.kinematics import arm_model
from app.robot.scene import Scene

UNITS = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # [1, 1, 1, m/rad …]
STRAIGHTNESS = 10.0
REGULARISATION = 1e-3
POSTURE_GAIN = 0.1


class TwistTask(Task):
    """Make the hand move by a given small displacement: S (J Δq − [v; ω] dt) → 0.

    S counts rotation in units of 0.3 m/rad, and what leads off the commanded line STRAIGHTNESS
    times as much as what is missing along it.
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

    q̇ ≤ q̇_prev + a dt and q̇ dt + q̇²/(2a) ≤ q_max − q; the lower side is the mirror.
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


class PinkKinematics:
    """`Kinematics.solve` by Pink, for finite inputs and twists below 10 in every component."""

    def __init__(self, scene: Scene) -> None:
        model = arm_model()
        start = scene.start_joint_positions
        self._configuration = Configuration(model, model.createData(), start)
        self._twist = TwistTask(HAND_SITE)
        posture = PostureTask(cost=REGULARISATION, gain=POSTURE_GAIN)
        posture.set_target(start)
        self._tasks = (self._twist, posture, DampingTask(cost=REGULARISATION))
        self._motion = MotionLimit(JOINT_LOW, JOINT_HIGH, MAX_VELOCITY, MAX_ACCELERATION)
        self._limits = (VelocityLimit(model, MAX_VELOCITY), self._motion)

    def solve(self, q: Array, qd_previous: Array, twist: Array, dt: float) -> Array:
        """Joint velocities q̇ [rad/s], shape (7,)."""
        self._motion.set_state(q, qd_previous)
        middle = np.clip(q + 0.5 * dt * qd_previous, JOINT_LOW, JOINT_HIGH)
        self._configuration.update(middle)
        self._twist.set_displacement(twist * dt)
        problem = build_ik(self._configuration, self._tasks, dt, limits=self._limits)
        # Pink's unknown is Δq = q̇ dt: the usual tolerance of 1e-6 rad would be 1e-4 rad/s.
        solution = qpsolvers.solve_problem(problem, solver="daqp", primal_tol=1e-10)
        assert solution.found and solution.x is not None
        return solution.x / dt
