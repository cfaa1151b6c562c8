"""Direct teleoperation D(u): what a reading of the sticks asks of the hand.

The paper's mapping: the right stick moves in the table's plane, the left stick's y the height.
In mode "rotate" the sticks tip the hand the way they are pushed: right stick x rolls it about the
view's heading, right stick y pitches it, left stick x turns it about the vertical.
"""

import math
from typing import Protocol

import numpy as np

from app.core.checks import as_array
from app.core.errors import CoreError
from app.core.types import Array, UserInput

_FULL = 1.0 + 1e-9
"""A full stick, and the rounding of whoever scaled it."""


class OperatorSpeeds(Protocol):
    """What full stick means; `AssistanceSettings` is one."""

    @property
    def full_stick_speed(self) -> float:
        """Speed of the hand at full stick [m/s]."""
        ...

    @property
    def full_stick_angular_speed(self) -> float:
        """Angular speed of the hand at full stick [rad/s]."""
        ...


def compute_input(user_input: UserInput) -> Array:
    """Return u: the stick axes after the dead zone, turned into world axes, shape (6,).

    Rows are x y z of translation, then of rotation; full stick is 1. Each stick's dead zone is
    round and removed continuously: a deflection r counts as max(0, r − z)/(1 − z). The view's yaw
    turns the right stick, so ‖u‖ does not depend on where the operator looks from.

    Raises:
        CoreError: If an axis is not finite or outside [−1, 1], the dead zone is outside [0, 1),
            or the mode is unknown.
    """
    return np.array(_components(user_input))


def compute_command(user_input: UserInput, speeds: OperatorSpeeds) -> Array:
    """Return D(u), the twist of direct teleoperation [m/s, rad/s], world frame, shape (6,).

    Raises:
        CoreError: As `compute_input`.
    """
    x, y, z, roll, pitch, yaw = _components(user_input)
    v, w = speeds.full_stick_speed, speeds.full_stick_angular_speed
    return np.array([v * x, v * y, v * z, w * roll, w * pitch, w * yaw])


def _components(user_input: UserInput) -> tuple[float, float, float, float, float, float]:
    """Return u of `compute_input` in plain numbers: it is computed in most ticks."""
    axes = user_input.axes
    if type(axes) is not tuple or len(axes) != 4 or not all(type(axis) is float for axis in axes):
        axes = tuple(as_array(axes, (4,), "axes").tolist())
    if not all(-_FULL <= axis <= _FULL for axis in axes):
        as_array(axes, (4,), "axes")  # says so where one is not finite
        raise CoreError(f"axes must lie in [-1, 1], got {list(axes)}")
    dead_zone = user_input.dead_zone
    if not 0.0 <= dead_zone < 1.0:
        raise CoreError(f"dead_zone must lie in [0, 1), got {dead_zone!r}")
    if not math.isfinite(user_input.view_yaw):
        raise CoreError(f"view_yaw must be finite [rad], got {user_input.view_yaw!r}")
    left_x, left_y = _outside_dead_zone(axes[0], axes[1], dead_zone)
    right_x, right_y = _outside_dead_zone(axes[2], axes[3], dead_zone)
    cos, sin = math.cos(user_input.view_yaw), math.sin(user_input.view_yaw)
    if user_input.mode == "translate":
        # away = (cos, sin), right of the heading = (sin, −cos)
        return right_y * cos + right_x * sin, right_y * sin - right_x * cos, left_y, 0.0, 0.0, 0.0
    if user_input.mode == "rotate":
        # pushing away tips the hand's top away: about the heading's left (−sin, cos); pushing
        # right rolls about the heading; left stick to the right turns clockwise from above
        return 0.0, 0.0, 0.0, right_x * cos - right_y * sin, right_y * cos + right_x * sin, -left_x
    raise CoreError(f"mode must be one of translate, rotate, got {user_input.mode!r}")


def _outside_dead_zone(x: float, y: float, dead_zone: float) -> tuple[float, float]:
    radius = math.hypot(x, y)
    if radius <= dead_zone:
        return 0.0, 0.0
    scale = (radius - dead_zone) / ((1.0 - dead_zone) * radius)
    return x * scale, y * scale
