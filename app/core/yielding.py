"""Assistance that gives way: the policy, charged for motion against and across the user's.

The robot's cost w |s|² gains w_f |s∥|² where s points against the user's direction û, and
w_l |s⊥|² across it. The minimiser has a closed form: s∥ shrinks by w/(w + w_f) where s·û < 0, s⊥
by w/(w + w_l). Both weights grow continuously from 0 with |u|, so that nothing jumps when the
input crosses the dead zone: the factors go linearly from 1 at |u| = 0 to their full value at
`yield_full_input`, i.e. the weight charged is w f/(1 − f) with f = ρ w_x/(w + w_x).
"""

import math

import numpy as np

from app.core.settings import AssistanceSettings
from app.core.types import Array


def give_way(assistance: Array, direct: Array, settings: AssistanceSettings) -> Array:
    """Return the assistance after giving way to the user, translation and rotation apart.

    Args:
        assistance: s, what the policy adds to D(u) [m/s, rad/s], shape (6,).
        direct: D(u) [m/s, rad/s], shape (6,).
        settings: w, w_f, w_l, and what full stick means.
    """
    against = _share(settings.w_f, settings.w_translation)
    across = _share(settings.w_l, settings.w_translation)
    full = settings.yield_full_input
    s, u = assistance.tolist(), direct.tolist()
    linear = _shaped(s[:3], u[:3], full * settings.full_stick_speed, against, across)
    # about the commanded rotation axis, and only where the user commands rotation
    angular = _shaped(s[3:], u[3:], full * settings.full_stick_angular_speed, against, across)
    return np.array(linear + angular)


def _share(weight: float, w: float) -> float:
    """Return w_x/(w + w_x), the part of the motion that the full weight takes away."""
    return 1.0 if math.isinf(weight) else weight / (w + weight)


def _shaped(
    s: list[float], u: list[float], full_speed: float, against: float, across: float
) -> list[float]:
    speed = math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    if speed == 0.0:
        return s
    rho = min(1.0, speed / full_speed)
    along = (s[0] * u[0] + s[1] * u[1] + s[2] * u[2]) / speed
    kept_along = 1.0 - rho * against if along < 0.0 else 1.0
    kept_across = 1.0 - rho * across
    # s = across part + along part, each scaled by what is kept of it
    scale = (kept_along - kept_across) * along / speed
    return [kept_across * a + scale * b for a, b in zip(s, u, strict=True)]
