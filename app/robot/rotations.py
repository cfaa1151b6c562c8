# pyright: reportAttributeAccessIssue=false
"""Rotation matrices and quaternions (w x y z), many at once."""

import mujoco
import numpy as np

from app.core.types import Array

_LEFT = np.zeros((4, 4, 4))
"""L(p) = Σ_i p_i _LEFT[i], the products of the units 1, i, j, k from the left."""
_LEFT[0] = np.eye(4)
_LEFT[1][[0, 1, 2, 3], [1, 0, 3, 2]] = -1.0, 1.0, -1.0, 1.0
_LEFT[2][[0, 1, 2, 3], [2, 3, 0, 1]] = -1.0, 1.0, 1.0, -1.0
_LEFT[3][[0, 1, 2, 3], [3, 2, 1, 0]] = -1.0, -1.0, 1.0, 1.0

_TURN = np.zeros((4, 4, 3, 3))
"""R(p) = 1 + Σ_ij p_i p_j _TURN[i, j]."""
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _TURN[_i + 1, _i + 1][[_j, _k], [_j, _k]] = -2.0
    _TURN[_i + 1, _j + 1][[_i, _j], [_j, _i]] = 2.0
    _TURN[0, _k + 1][[_i, _j], [_j, _i]] = -2.0, 2.0


def matrices(quaternion: Array) -> Array:
    """Rotation matrices of unit quaternions, shape (n, 4) to (n, 3, 3)."""
    squares = quaternion[:, :, None] * quaternion[:, None, :]
    return np.eye(3) + (squares.reshape(-1, 16) @ _TURN.reshape(16, 9)).reshape(-1, 3, 3)


def left_matrices(quaternion: Array) -> Array:
    """L(p) with L(p) q = p ⊗ q, shape (n, 4) to (n, 4, 4)."""
    return (quaternion @ _LEFT.reshape(4, 16)).reshape(-1, 4, 4)


def quaternions(rotation: Array) -> Array:
    """Unit quaternions with w ≥ 0 of rotation matrices, shape (n, 3, 3) to (n, 4)."""
    result = np.empty((len(rotation), 4))
    for row, matrix in zip(result, rotation, strict=True):
        mujoco.mju_mat2Quat(row, np.ascontiguousarray(matrix).ravel())
    return np.where(result[:, :1] < 0.0, -result, result)
