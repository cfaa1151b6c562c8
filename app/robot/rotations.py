# pyright: reportAttributeAccessIssue=false
"""Rotation matrices and quaternions (w x y z), many at once."""

import mujoco
import numpy as np

from app.core.types import Array


def matrices(quaternion: Array) -> Array:
    """Rotation matrices of unit quaternions, shape (n, 4) to (n, 3, 3)."""
    w, x, y, z = quaternion.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def left_matrices(quaternion: Array) -> Array:
    """L(p) with L(p) q = p ⊗ q, shape (n, 4) to (n, 4, 4)."""
    w, x, y, z = quaternion.T
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]).transpose(
        2, 0, 1
    )


def quaternions(rotation: Array) -> Array:
    """Unit quaternions with w ≥ 0 of rotation matrices, shape (n, 3, 3) to (n, 4)."""
    result = np.empty((len(rotation), 4))
    for row, matrix in zip(result, rotation, strict=True):
        mujoco.mju_mat2Quat(row, np.ascontiguousarray(matrix).ravel())
    return np.where(result[:, :1] < 0.0, -result, result)
