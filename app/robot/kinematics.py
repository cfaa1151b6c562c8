# pyright: reportMissingImports=false
"""Differential inverse kinematics: a twist of the hand to joint velocities within all limits.

Pink builds the quadratic program and daqp solves it. When the arm overreaches, damped least squares
with clipping leaves the commanded line by 215 mm and a plain program by 55 to 217 mm; with the
weights of `ik_terms.TwistTask` it is 2 mm.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
import pinocchio as pin
import qpsolvers
from pink import Configuration, build_ik
from pink.exceptions import PinkError
from pink.limits import VelocityLimit
from pink.tasks import DampingTask, PostureTask

from app.core.types import Array, Pose
from app.robot.arm import (
    ARM_FILE,
    FINGER_NAMES,
    HAND_SITE,
    JOINT_HIGH,
    JOINT_LOW,
    MAX_ACCELERATION,
    MAX_VELOCITY,
    N_JOINTS,
)
from app.robot.ik_terms import MotionLimit, TwistTask
from app.robot.scene import Scene

REGULARISATION = 1e-3
"""Weight of damping and posture against the twist. With the weighted twist 1e-3 tracks as well as
1e-5, and the arm no longer swirls about its free axis at the end of its reach."""
POSTURE_GAIN = 0.1
"""Share of the way to the start posture taken per tick along the free axis; 1 would jerk."""

MIN_DT, MAX_DT = 1e-4, 0.1  # [s]: a shorter or longer tick is a mistake
MAX_TWIST = 10.0  # [m/s, rad/s] of any component; what is asked beyond it only costs precision

SolveStatus = Literal["solved", "braking"]


@lru_cache(maxsize=1)
def arm_model() -> pin.Model:
    """The arm with its fingers locked, limits included, as Pinocchio's model (nq = nv = 7)."""
    full = pin.buildModelFromMJCF(str(ARM_FILE))
    locked = [full.getJointId(name) for name in FINGER_NAMES]
    model = pin.buildReducedModel(full, locked, pin.neutral(full))
    model.lowerPositionLimit, model.upperPositionLimit = JOINT_LOW, JOINT_HIGH
    # Pinocchio's MJCF parser leaves these infinite.
    model.velocityLimit = MAX_VELOCITY
    return model


class Kinematics:
    """Kinematics of the arm; holds scratch data only, no state of the robot.

    Attributes:
        status: "solved", or "braking" where the last `solve` found no solution and slows down.
    """

    def __init__(self, scene: Scene) -> None:
        self.status: SolveStatus = "solved"
        self._model = arm_model()
        self._frame = self._model.getFrameId(HAND_SITE)
        self._data = self._model.createData()
        start = np.clip(scene.start_joint_positions, JOINT_LOW, JOINT_HIGH)
        self._configuration = Configuration(self._model, self._data, start, copy_data=False)
        self._twist = TwistTask(HAND_SITE)
        posture = PostureTask(cost=REGULARISATION, gain=POSTURE_GAIN)
        posture.set_target(start)
        self._tasks = (self._twist, posture, DampingTask(cost=REGULARISATION))
        self._motion = MotionLimit(JOINT_LOW, JOINT_HIGH, MAX_VELOCITY, MAX_ACCELERATION)
        self._limits = (VelocityLimit(self._model, MAX_VELOCITY), self._motion)

    def hand_pose(self, joint_positions: Array) -> Pose:
        """T_world_ee at joint positions q [rad], shape (7,)."""
        pin.framesForwardKinematics(self._model, self._data, joint_positions)
        return to_pose(self._data.oMf[self._frame])

    def jacobian(self, joint_positions: Array) -> Array:
        """∂[v; ω]/∂q̇ of the hand in the world frame, shape (6, 7)."""
        return pin.computeFrameJacobian(
            self._model,
            self._data,
            joint_positions,
            self._frame,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )

    def solve(self, q: Array, qd_previous: Array, twist: Array, dt: float) -> Array:
        """Joint velocities that move the hand by a twist, as well as the limits allow.

        min |J q̇ − twist|² + small posture and damping, subject to velocity, acceleration and
        position limits, the latter with room to brake. Never raises: where no solution is found,
        or an input is not finite, `status` is "braking" and the result slows the arm down.

        Args:
            q: Joint positions to solve at [rad] (the servo's reference), shape (7,).
            qd_previous: Joint velocities of the tick before [rad/s], shape (7,).
            twist: [v; ω] of the hand in the world frame [m/s, rad/s], shape (6,).
            dt: Length of the tick [s].

        Returns:
            q̇ [rad/s], shape (7,).
        """
        previous = _finite(qd_previous)
        previous = np.clip(previous, -MAX_VELOCITY, MAX_VELOCITY)
        if not (np.isfinite(q).all() and np.isfinite(twist).all() and MIN_DT <= dt <= MAX_DT):
            return self._brake(previous, dt)
        twist = twist * min(1.0, MAX_TWIST / max(float(np.abs(twist).max()), MAX_TWIST))
        # Half a tick ahead, the Jacobian is that of the middle of the step: the hand leaves the
        # commanded line by O(dt³) rather than O(dt²) per tick.
        position = np.clip(q, JOINT_LOW, JOINT_HIGH)
        self._motion.set_state(position, previous)
        middle = np.clip(position + 0.5 * dt * previous, JOINT_LOW, JOINT_HIGH)
        try:
            self._configuration.update(middle)
            self._twist.set_displacement(twist * dt)
            problem = build_ik(self._configuration, self._tasks, dt, limits=self._limits)
            solution = qpsolvers.solve_problem(problem, solver="daqp")
        except (PinkError, qpsolvers.QPError, ValueError, ArithmeticError):
            return self._brake(previous, dt)
        if not solution.found or solution.x is None or not np.isfinite(solution.x).all():
            return self._brake(previous, dt)
        self.status = "solved"
        # daqp keeps the limits to 1e-6 rad, which is 1e-4 rad/s; here they are exact.
        return np.clip(solution.x / dt, *self._motion.bounds(dt))

    def _brake(self, previous: Array, dt: float) -> Array:
        self.status = "braking"
        step = MAX_ACCELERATION * (dt if MIN_DT <= dt <= MAX_DT else 0.01)
        return np.sign(previous) * np.maximum(np.abs(previous) - step, 0.0)


def to_pose(placement: pin.SE3) -> Pose:
    """Pinocchio's placement as a Pose (its quaternions are x y z w)."""
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    return Pose(placement.translation.copy(), np.array([w, x, y, z]))


def _finite(values: Array) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (N_JOINTS,):
        return np.zeros(N_JOINTS)
    return np.where(np.isfinite(array), array, 0.0)
