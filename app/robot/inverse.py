# pyright: reportMissingImports=false
"""Inverse kinematics of a pose: joint positions at which the hand stands at T_world_ee."""

import numpy as np
import pinocchio as pin

from app.core.types import Array
from app.robot.arm import HAND_SITE
from app.robot.kinematics import arm_model

TOLERANCE = 1e-4  # [m] and [rad] together
MAX_ITERATIONS = 60
DAMPING = 1e-4
MAX_STEP = 0.4  # [rad]


class PoseSolver:
    """Damped Gauss–Newton on log6, kept inside the joint limits; holds scratch data only."""

    def __init__(self) -> None:
        self._model = arm_model()
        self._data = self._model.createData()
        self._frame = self._model.getFrameId(HAND_SITE)
        self._low = self._model.lowerPositionLimit + 0.02
        self._high = self._model.upperPositionLimit - 0.02

    def solve(self, position: Array, rotation: Array, seed: Array) -> Array | None:
        """Joint positions near the seed with the hand at this pose, or None.

        Args:
            position: Tool centre in the world frame [m], shape (3,).
            rotation: R_world_ee, shape (3, 3).
            seed: Joint positions to start from [rad], shape (7,).

        Returns:
            q [rad], shape (7,), at least 0.02 rad inside the limits; None where none was found.
        """
        target = pin.SE3(rotation, position)
        q = np.clip(seed, self._low, self._high)
        for _ in range(MAX_ITERATIONS):
            pin.computeJointJacobians(self._model, self._data, q)
            pin.updateFramePlacement(self._model, self._data, self._frame)
            error = pin.log6(self._data.oMf[self._frame].actInv(target)).vector
            if np.abs(error).max() < TOLERANCE:
                return q
            jacobian = pin.getFrameJacobian(
                self._model, self._data, self._frame, pin.ReferenceFrame.LOCAL
            )
            gram = jacobian @ jacobian.T
            gram[np.diag_indices(6)] += DAMPING
            step = jacobian.T @ np.linalg.solve(gram, error)
            step *= min(1.0, MAX_STEP / max(np.abs(step).max(), 1e-9))
            q = np.clip(q + step, self._low, self._high)
        return None
