"""Making worlds, and hiding one object from the assistance."""

from typing import Any

import numpy as np

from app.core import Goals
from app.robot.scene import Scene
from app.session.kinematic_world import KinematicWorld
from app.session.physics_world import PhysicsWorld
from app.session.worlds import World
from app.simulate.errors import SimulateError

WORLDS = {"kinematic": KinematicWorld, "physics": PhysicsWorld}


def make_world(kind: str, scene: Scene) -> World:
    """A world of this kind.

    Raises:
        SimulateError: If there is no such kind.
    """
    if kind not in WORLDS:
        raise SimulateError(f"world is {kind!r}; valid: {', '.join(WORLDS)}")
    return WORLDS[kind](scene)


class HidingWorld:
    """A world whose `goals` leave one object out; everything else is the world's own."""

    def __init__(self, world: World, hidden: str) -> None:
        """Hide an object from whoever asks for the goals.

        Args:
            world: The whole world.
            hidden: Name of the object that the assistance does not model.
        """
        self._world = world
        self._hidden = hidden
        self._whole: Goals | None = None
        self._shown: Goals | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)

    def goals(self) -> Goals:
        """The goals without the hidden one."""
        whole = self._world.goals()
        if whole is not self._whole or self._shown is None:
            self._whole, self._shown = whole, without(whole, self._hidden)
        return self._shown


def without(goals: Goals, name: str) -> Goals:
    """The goals but one."""
    row = goals.names.index(name)
    start, stop = int(goals.offsets[row]), int(goals.offsets[row + 1])
    keep = np.ones(goals.n_targets, dtype=bool)
    keep[start:stop] = False
    counts = np.delete(np.diff(goals.offsets), row)
    return Goals(
        names=tuple(n for n in goals.names if n != name),
        positions=goals.positions[keep],
        quaternions=goals.quaternions[keep],
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
    )
