"""Building validated goals from targets."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from app.core.checks import as_array, as_quaternions
from app.core.errors import CoreError
from app.core.types import Goals


def make_goals(targets: Mapping[str, tuple[Any, Any]]) -> Goals:
    """Collect goals with their targets κ into one flat, validated `Goals`.

    Args:
        targets: Per goal's name the target positions in the world frame [m], shape (n, 3), and
            quaternions w x y z, shape (n, 4), n ≥ 1. Quaternions are scaled to unit norm. The
            third axis of a target is the way it is approached, where `translation_aside` > 1.

    Raises:
        CoreError: If there is no goal, a goal has no target, or an array has another shape, is not
            finite, or holds a quaternion that is no rotation.
    """
    if not isinstance(targets, Mapping):
        raise CoreError(
            "targets must map each goal's name to (positions, quaternions), "
            f"got {type(targets).__name__}"
        )
    if not targets:
        raise CoreError("targets must hold at least one goal, got none")
    positions, quaternions, offsets = [], [], [0]
    for name, pair in targets.items():
        if not isinstance(name, str) or not name:
            raise CoreError(f"a goal's name must be a non-empty string, got {name!r}")
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise CoreError(f"targets[{name!r}] must be a pair (positions, quaternions)")
        where = f"targets[{name!r}]"
        goal_positions = as_array(pair[0], (None, 3), f"{where} positions")
        goal_quaternions = as_quaternions(pair[1], (None, 4), f"{where} quaternions")
        if len(goal_positions) == 0:
            raise CoreError(f"{where} must hold at least one target, got positions of shape (0, 3)")
        if len(goal_positions) != len(goal_quaternions):
            raise CoreError(
                f"{where} must hold as many quaternions as positions, got shapes "
                f"{goal_positions.shape} and {goal_quaternions.shape}"
            )
        positions.append(goal_positions)
        quaternions.append(goal_quaternions)
        offsets.append(offsets[-1] + len(goal_positions))
    return Goals(
        names=tuple(targets),
        positions=np.concatenate(positions),
        quaternions=np.concatenate(quaternions),
        offsets=np.array(offsets, dtype=np.int64),
    )


def goal_index(goals: Goals, goal: str | int) -> int:
    """Return the row of a goal given by name or row.

    Raises:
        CoreError: If there is no such goal.
    """
    if isinstance(goal, str):
        if goal in goals.names:
            return goals.names.index(goal)
    elif 0 <= goal < goals.n_goals:
        return int(goal)
    raise CoreError(
        f"goal must be one of {', '.join(goals.names)} or a row below {goals.n_goals}, got {goal!r}"
    )
