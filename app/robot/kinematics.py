# pyright: reportMissingImports=false
"""Differential inverse kinematics: a twist of the hand to joint velocities within all limits.

Pinocchio gives the arm's Jacobian, `ik_kernels` states the quadratic program, daqp solves it. When
the arm overreaches, damped least squares with clipping leaves the commanded line by 215 mm and a
plain program by 55 to 217 mm; with the program's weights it is 2 mm. Pink, which assembles such
programs from general parts, takes longer for that than a tick's physics; it is the reference in the
tests, which hold both solutions equal to 1e-6 rad/s.
"""

from functools import lru_cache
from typing import Literal

import daqp
import numpy as np
import pinocchio as pin

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
from app.robot.ik_kernels import bound, objective, settle
from app.robot.scene import Scene

MIN_DT, MAX_DT = 1e-4, 0.1  # [s]: a shorter or longer tick is a mistake

SolveStatus = Literal["solved", "braking"]

_LIMITS = np.stack([JOINT_LOW, JOINT_HIGH, MAX_VELOCITY, MAX_ACCELERATION])
_WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
_NO_ROWS = np.empty((0, N_JOINTS))  # all constraints are bounds of single joints
_INEQUALITIES = np.zeros(N_JOINTS, dtype=np.intc)


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
        self._start = start
        self._middle, self._lower, self._upper = np.empty((3, N_JOINTS))
        self._rows = np.empty((6, N_JOINTS))
        self._hessian, self._gradient = np.empty((N_JOINTS, N_JOINTS)), np.empty(N_JOINTS)

    def hand_pose(self, joint_positions: Array) -> Pose:
        """T_world_ee at joint positions q [rad], shape (7,)."""
        pin.framesForwardKinematics(self._model, self._data, joint_positions)
        return to_pose(self._data.oMf[self._frame])

    def jacobian(self, joint_positions: Array) -> Array:
        """∂[v; ω]/∂q̇ of the hand in the world frame, shape (6, 7)."""
        return pin.computeFrameJacobian(
            self._model, self._data, joint_positions, self._frame, _WORLD_AXES
        )

    def solve(self, q: Array, qd_previous: Array, twist: Array, dt: float) -> Array:
        """Joint velocities that move the hand by a twist, as well as the limits allow.

        `ik_kernels` says what is minimised within which bounds of velocity, acceleration and
        position. Never raises: where no solution is found, or an input is not finite or of another
        shape, `status` is "braking" and the result slows the arm down. Equal inputs give equal
        results, whatever was solved before.

        Args:
            q: Joint positions to solve at [rad] (the servo's reference), shape (7,).
            qd_previous: Joint velocities of the tick before [rad/s], shape (7,).
            twist: [v; ω] of the hand in the world frame [m/s, rad/s], shape (6,).
            dt: Length of the tick [s].

        Returns:
            q̇ [rad/s], shape (7,).
        """
        shapes = q.shape == qd_previous.shape == (N_JOINTS,) and twist.shape == (6,)
        if not (shapes and MIN_DT <= dt <= MAX_DT):
            return self._brake(qd_previous, dt)
        middle, lower, upper = self._middle, self._lower, self._upper
        if not bound(q, qd_previous, dt, _LIMITS, middle, lower, upper):
            return self._brake(qd_previous, dt)
        # Half a tick ahead, the Jacobian is that of the middle of the step: the hand leaves the
        # commanded line by O(dt³) rather than O(dt²) per tick.
        jacobian = self.jacobian(middle)
        hessian, gradient = self._hessian, self._gradient
        if not objective(jacobian, middle, self._start, twist, dt, self._rows, hessian, gradient):
            return self._brake(qd_previous, dt)
        velocity, _, flag, _ = daqp.solve(hessian, gradient, _NO_ROWS, upper, lower, _INEQUALITIES)
        # daqp keeps the bounds to 1e-6 rad/s; here they are exact.
        if flag <= 0 or not settle(velocity, lower, upper):
            return self._brake(qd_previous, dt)
        self.status = "solved"
        return velocity

    def _brake(self, previous: Array, dt: float) -> Array:
        self.status = "braking"
        if previous.shape != (N_JOINTS,):
            return np.zeros(N_JOINTS)
        speed = np.where(np.isfinite(previous), previous, 0.0)
        speed = np.clip(speed, -MAX_VELOCITY, MAX_VELOCITY)
        step = MAX_ACCELERATION * (dt if MIN_DT <= dt <= MAX_DT else 0.01)
        return np.sign(speed) * np.maximum(np.abs(speed) - step, 0.0)


def to_pose(placement: pin.SE3) -> Pose:
    """Pinocchio's placement as a Pose (its quaternions are x y z w)."""
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    return Pose(placement.translation.copy(), np.array([w, x, y, z]))
