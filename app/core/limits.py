"""From the twist asked for to the twist executed: speed limits, then slew limits."""

import math

import numpy as np

from app.core.settings import AssistanceSettings
from app.core.types import Array


def fixed_magnitude(twist: Array, direct: Array) -> Array:
    """Return `twist` scaled to the norm of D(u) over all six axes (the authors' "proportional")."""
    norm = math.sqrt(twist @ twist)
    return twist * (math.sqrt(direct @ direct) / norm) if norm > 0.0 else twist


def limited(asked: Array, previous: Array, settings: AssistanceSettings, dt: float) -> Array:
    """Return the executed twist: within the speed limits, and near enough to the previous one.

    The slew limit holds when the input crosses the dead zone, the best target changes, or the
    method is switched: |v − v_previous| ≤ a_max dt, and the same for rotation. Both twists lie
    within the speed limits, so what lies between them does, too.

    Args:
        asked: The twist asked for [m/s, rad/s], shape (6,).
        previous: The twist executed before, shape (6,).
        settings: The limits; inf is no limit.
        dt: Time since `previous` [s].
    """
    a, p = asked.tolist(), previous.tolist()
    linear = _slewed(_shortened(a[:3], settings.max_speed), p[:3], settings.max_acceleration * dt)
    angular = _slewed(
        _shortened(a[3:], settings.max_angular_speed), p[3:], settings.max_angular_acceleration * dt
    )
    return np.array(linear + angular)


def _shortened(v: list[float], longest: float) -> list[float]:
    norm = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if norm <= longest:
        return v
    scale = longest / norm
    return [v[0] * scale, v[1] * scale, v[2] * scale]


def _slewed(v: list[float], p: list[float], longest: float) -> list[float]:
    dx, dy, dz = v[0] - p[0], v[1] - p[1], v[2] - p[2]
    norm = math.sqrt(dx * dx + dy * dy + dz * dz)
    if norm <= longest:
        return v
    scale = longest / norm
    return [p[0] + dx * scale, p[1] + dy * scale, p[2] + dz * scale]
