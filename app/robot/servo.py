"""From joint velocities to what the position servos are given."""

import numpy as np

from app.core.types import Array
from app.robot.arm import JOINT_HIGH, JOINT_LOW, N_JOINTS

KP = np.array([2000.0, 2000, 2000, 2000, 800, 800, 800])  # [N m/rad], as in arm.xml
KV = np.array([100.0, 100, 100, 100, 30, 30, 30])  # [N m s/rad]
DAMPING = np.array([1.0, 1, 1, 1, 0.5, 0.5, 0.5])  # [N m s/rad] of the joints themselves
LEASH = 0.02  # [rad]
_LEAD = (KV + DAMPING) / KP  # [s]


class Servo:
    """Integrates joint velocities into a reference that stays on a leash to the arm.

    A position servo gives τ = kp (ctrl − q) − kv q̇; with ctrl = q_ref + (kv + d)/kp · q̇_ref it
    follows without lag. Without the leash, q_ref = q ± 0.02 rad, an arm that pushes into the table
    winds up hundreds of newtons and answers a reversal only after they are unwound.

    Attributes:
        reference: q_ref [rad], shape (7,): where the inverse kinematics is to be solved.
        velocity: The last q̇ [rad/s], shape (7,).
    """

    def __init__(self, joint_positions: Array) -> None:
        self.reference = np.array(joint_positions, dtype=np.float64)
        self.velocity = np.zeros(N_JOINTS)

    def reset(self, joint_positions: Array) -> None:
        """Start anew at rest from these joint positions [rad]."""
        self.reference = np.array(joint_positions, dtype=np.float64)
        self.velocity = np.zeros(N_JOINTS)

    def advance(self, joint_positions: Array, joint_velocities: Array, dt: float) -> Array:
        """Move the reference on by one tick.

        Args:
            joint_positions: Measured q [rad], shape (7,).
            joint_velocities: Commanded q̇ [rad/s], shape (7,).
            dt: Length of the tick [s].

        Returns:
            ctrl of the seven joint servos [rad], shape (7,).
        """
        # In place, and without np.clip: this runs in every tick.
        reference = self.reference - joint_positions
        np.minimum(reference, LEASH, out=reference)
        np.maximum(reference, -LEASH, out=reference)
        reference += joint_positions
        reference += dt * joint_velocities
        np.minimum(reference, JOINT_HIGH, out=reference)
        np.maximum(reference, JOINT_LOW, out=reference)
        self.reference, self.velocity = reference, joint_velocities.copy()
        return reference + _LEAD * joint_velocities
