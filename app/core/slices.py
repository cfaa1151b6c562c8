"""The value function on a plane through space, for pictures: V at every point of a grid."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from app.core.backend import active
from app.core.checks import as_array, as_quaternions
from app.core.errors import CoreError
from app.core.goals import goal_index
from app.core.rotations import rotation_between
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals
from app.core.values import rotation_cost, value

Kind = Literal["min", "soft-min"]


def value_slice(
    settings: AssistanceSettings,
    goals: Goals,
    belief: Any,
    origin: Any,
    axis_u: Any,
    axis_v: Any,
    shape: Sequence[int],
    quaternion: Any,
    of: str | int = "expected",
    kind: Kind = "min",
) -> Array:
    """Return V [nat] on a grid in a plane, shape (n_u, n_v).

    Element (i, j) belongs to the point origin + i/(n_u − 1) axis_u + j/(n_v − 1) axis_v.

    Args:
        settings: Costs and the temperature of the soft-min.
        goals: Goals with targets, world frame.
        belief: b(g), shape (n_goals,); only used for "expected".
        origin: World position of the grid's first corner [m], shape (3,).
        axis_u: From there to the end of the grid's first side [m], shape (3,).
        axis_v: From there to the end of its second side [m], shape (3,).
        shape: Number of points along both, each at least 2.
        quaternion: The hand's orientation, held over the whole grid, w x y z, shape (4,).
        of: "expected" for Σ_g b(g) V_g, or a goal's name or row.
        kind: V over a goal's targets as assistance ("min") or prediction ("soft-min") takes it.

    Raises:
        CoreError: If an argument is not valid.
    """
    start = as_array(origin, (3,), "origin")
    u, v = as_array(axis_u, (3,), "axis_u"), as_array(axis_v, (3,), "axis_v")
    q = as_quaternions(quaternion, (4,), "quaternion")
    if len(shape) != 2 or min(shape) < 2:
        raise CoreError(f"shape must be two numbers of at least 2, got {tuple(shape)}")
    if kind not in ("min", "soft-min"):
        raise CoreError(f"kind must be one of min, soft-min, got {kind!r}")
    if of == "expected":
        weights = as_array(belief, (goals.n_goals,), "belief")
    else:
        weights = np.zeros(goals.n_goals)
        weights[goal_index(goals, of)] = 1.0
    angles, _ = rotation_between(goals.quaternions, q)
    rotation_values = settings.rotation_weight * value(angles, rotation_cost(settings))
    temperature = settings.temperature if kind == "soft-min" else 0.0
    grid = np.empty((int(shape[0]), int(shape[1])))
    active().fill_grid(settings, goals, rotation_values, weights, start, u, v, temperature, grid)
    return grid
