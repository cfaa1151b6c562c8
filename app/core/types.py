"""The nouns of the method: poses, goals with their targets, user input."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.int64]
"""Row numbers of targets."""

Mode = Literal["translate", "rotate"]
"""What the sticks command: the hand's position, or its orientation."""


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid-body pose T_world_x.

    Attributes:
        position: Origin in the world frame [m], shape (3,).
        quaternion: Unit quaternion, order w x y z (MuJoCo's), shape (4,); q and −q are the same.
    """

    position: Array
    quaternion: Array


@dataclass(frozen=True, slots=True)
class Goals:
    """Goals (objects) and their targets κ (grasp poses), all targets in one flat array.

    Targets of goal g are rows offsets[g]:offsets[g + 1].

    Attributes:
        names: One name per goal, length n_goals.
        positions: Target positions in the world frame [m], shape (n_targets, 3).
        quaternions: Target orientations, unit, order w x y z, shape (n_targets, 4).
        offsets: First target of each goal and the end, int64, shape (n_goals + 1,).
    """

    names: tuple[str, ...]
    positions: Array
    quaternions: Array
    offsets: npt.NDArray[np.int64]

    @property
    def n_goals(self) -> int:
        """Number of goals."""
        return len(self.names)

    @property
    def n_targets(self) -> int:
        """Number of targets over all goals."""
        return len(self.positions)


@dataclass(frozen=True, slots=True)
class UserInput:
    """One reading of the operator's device; everything D(u) depends on.

    Attributes:
        axes: left x, left y, right x, right y in [−1, 1] before the dead zone; right and up
            are positive, shape (4,).
        mode: Whether the sticks move or rotate the hand.
        view_yaw: Heading of the operator's view about world z [rad]: the direction in the
            table's plane that "away" on the right stick means; 0 is world +x.
        dead_zone: Radius of each stick that counts as rest, in [0, 1).
        device: Where it came from: "pointer", "keyboard", "gamepad", "none", or a simulated user.
        sequence: Number of the message it came in; 0 where there was none.
        client_time: The browser's clock at sampling [ms].
    """

    axes: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    mode: Mode = "translate"
    view_yaw: float = 0.0
    dead_zone: float = 0.1
    device: str = "none"
    sequence: int = 0
    client_time: float = 0.0
