"""Cost and cost-to-go of one target, in closed form (robot takes over).

The user's cost per second at distance d from a target is C(d) = α min(1, d/δ) + c₀ [nat/s] (the
paper's, Sec. VI, plus an optional constant). With the robot moving straight at speed v the
cost-to-go is its integral,

    V(d) = (α d − α δ/2 + c₀ d)/v  for d > δ,    V(d) = (α d²/(2δ) + c₀ d)/v  for d ≤ δ.

Rotation has the same form in the angle r, with its own constants; V = V_t(d) + m V_r(r).

A gripper that arrives from the side pushes its object over. So a metre aside of a target's
approach axis z may count as a ≥ 1 metres along it: d = |L e|, L = z zᵀ + a (I − z zᵀ), e the way to
the target. With a = 1 this is the paper's |e|; with more, V prefers grasps that lie ahead, and the
way down turns into the approach before it ends.
Shapes: distances are arrays of any shape; results have the same.
"""

from typing import NamedTuple

import numpy as np

from app.core.settings import AssistanceSettings
from app.core.types import Array


class Cost(NamedTuple):
    """C(d) = α min(1, d/δ) + c₀ and the speed v the robot takes over with."""

    alpha: float  # [nat/s]
    delta: float  # [m] or [rad]
    offset: float  # c₀ [nat/s]
    speed: float  # v [m/s] or [rad/s]


def translation_cost(settings: AssistanceSettings) -> Cost:
    """Return the constants of the cost of distance."""
    return Cost(
        settings.translation_alpha,
        settings.translation_delta,
        settings.translation_offset,
        settings.translation_speed,
    )


def rotation_cost(settings: AssistanceSettings) -> Cost:
    """Return the constants of the cost of angle."""
    return Cost(
        settings.rotation_alpha,
        settings.rotation_delta,
        settings.rotation_offset,
        settings.rotation_speed,
    )


def cost_rate(distance: Array, cost: Cost) -> Array:
    """Return C(d) [nat/s]."""
    return cost.alpha * np.minimum(1.0, distance / cost.delta) + cost.offset


def weigh(way: Array, axes: Array, aside: float) -> Array:
    """Return L e: ways whose parts aside of the approach axes count `aside` times.

    Args:
        way: e, to or from targets [m], shape (…, 3).
        axes: z of the targets, unit, shape (…, 3).
        aside: a; 1 returns `way` itself.
    """
    if aside == 1.0:
        return way
    along = (way * axes).sum(axis=-1, keepdims=True)
    return aside * way + (1.0 - aside) * along * axes


def value(distance: Array, cost: Cost) -> Array:
    """Return V(d) [nat], the cost-to-go."""
    far = cost.alpha * (distance - 0.5 * cost.delta)
    near = 0.5 * cost.alpha / cost.delta * distance * distance
    return (np.where(distance > cost.delta, far, near) + cost.offset * distance) / cost.speed


def slope(distance: Array, cost: Cost) -> Array:
    """Return dV/dd = C(d)/v [nat/m or nat/rad]; at the target itself 0, where V has its minimum."""
    return np.where(distance > 0.0, cost_rate(distance, cost) / cost.speed, 0.0)
