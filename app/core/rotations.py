"""Rotations as unit quaternions w x y z, angular velocities on the left: R' = exp(τ[ω]×) R."""

import math

import numpy as np

from app.core.types import Array


def multiply(a: Array, b: Array) -> Array:
    """Return the quaternion product a b, shape (4,)."""
    aw, ax, ay, az = a.tolist()
    bw, bx, by, bz = b.tolist()
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def from_rotation_vector(vector: Array) -> Array:
    """Return the quaternion of exp([vector]×), vector [rad] of shape (3,)."""
    x, y, z = vector.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    # sin(a/2)/a, by its series where the quotient would lose digits
    scale = 0.5 - angle * angle / 48.0 if angle < 1e-4 else math.sin(0.5 * angle) / angle
    return np.array([math.cos(0.5 * angle), scale * x, scale * y, scale * z])


def approach_axes(quaternions: Array) -> Array:
    """Return the third axis (z, along which a gripper approaches) of orientations, (n, 3)."""
    w, x, y, z = quaternions.T
    return np.stack(
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)], axis=1
    )


def rotation_between(quaternions: Array, quaternion: Array) -> tuple[Array, Array]:
    """Return angle and sine-scaled axis of the rotations that lead from one pose to targets.

    With q_κ q̄ = (w, n) taken with w ≥ 0 (both signs of a quaternion are one rotation; at an angle
    of exactly π the first component of n that is not zero is made positive, so that the choice
    does not depend on the signs given).

    Args:
        quaternions: Target orientations q_κ, unit, shape (n, 4).
        quaternion: Orientation q, unit, shape (4,).

    Returns:
        Angles r in [0, π] [rad], shape (n,), and n = axis · sin(r/2) in the world frame, (n, 3).
    """
    kw, kx, ky, kz = quaternions.T
    w, x, y, z = quaternion.tolist()
    scalar = kw * w + kx * x + ky * y + kz * z
    nx = w * kx - kw * x - (ky * z - kz * y)
    ny = w * ky - kw * y - (kz * x - kx * z)
    nz = w * kz - kw * z - (kx * y - ky * x)
    at_pi = np.where(nx != 0.0, nx < 0.0, np.where(ny != 0.0, ny < 0.0, nz < 0.0))
    flip = np.where((scalar < 0.0) | ((scalar == 0.0) & at_pi), -1.0, 1.0)
    cosine = np.abs(scalar)
    sine = np.sqrt(nx * nx + ny * ny + nz * nz)
    # each of asin and acos only where it is accurate, so that the angle reaches 0 and π
    angles = np.where(
        sine < cosine,
        2.0 * np.arcsin(np.minimum(sine, 1.0)),
        2.0 * np.arccos(np.minimum(cosine, 1.0)),
    )
    return angles, np.stack([nx * flip, ny * flip, nz * flip], axis=1)
