"""The worlds a trial can be stepped in: what they have in common."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from app.core import Goals, Pose
from app.core.types import Array
from app.recording.schema import Outcome
from app.robot.hand import HandPhase
from app.robot.scene import Scene
from app.robot.targets import GraspTargets, goals_in_world, grasp_targets


@dataclass(frozen=True, slots=True)
class Verdict:
    """How the trial stands after a tick.

    Attributes:
        outcome: "running" while it is open.
        hand: What the hand does by itself.
        object: The object between the pads; empty: none.
    """

    outcome: Outcome
    hand: HandPhase
    object: str


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The world after a tick, as the record lists it: flat lists of floats.

    Attributes:
        joint_positions: q [rad], (n_joints,).
        joint_velocities: q̇ [rad/s], (n_joints,).
        finger_positions: Travel of the fingers [m].
        ctrl: What the actuators were given.
        object_poses: Per object x y z qw qx qy qz, world frame.
    """

    joint_positions: list[float]
    joint_velocities: list[float]
    finger_positions: list[float]
    ctrl: list[float]
    object_poses: list[float]


class World(Protocol):
    """What a trial needs of the world it steps."""

    @property
    def kind(self) -> Literal["physics", "kinematic"]:
        """Which world."""
        ...

    @property
    def scene(self) -> Scene:
        """What stands in it."""
        ...

    @property
    def joint_names(self) -> tuple[str, ...]:
        """In the order of the snapshot; none where the hand moves without an arm."""
        ...

    @property
    def targets(self) -> GraspTargets:
        """Every goal's targets in the frame of its own object."""
        ...

    @property
    def model_hash(self) -> str:
        """Of the physics model; empty where there is none."""
        ...

    @property
    def physics_dt_s(self) -> float:
        """Length of a physics step [s]."""
        ...

    def reset(self, seed: int | None) -> None:
        """Put everything at its start; the seed draws which object stands where, None: default."""
        ...

    def begin(self, instructed: str) -> None:
        """Watch for the outcome of a trial with this goal, the hand open."""
        ...

    def start_state(self) -> list[float]:
        """mjSTATE_INTEGRATION, or empty where there is no physics."""
        ...

    def hand_pose(self) -> Pose:
        """Pose of the site `ee` in the world frame."""
        ...

    def goals(self) -> Goals:
        """The targets in the world frame, where the objects are now."""
        ...

    def close_hand(self) -> None:
        """Let the hand close, and lift what it holds, by itself."""
        ...

    def open_hand(self) -> None:
        """Let go."""
        ...

    def step(self, twist: Array) -> Array:
        """Move for one control tick.

        Args:
            twist: Of the hand, [v; ω] in the world frame [m/s, rad/s], (6,).

        Returns:
            The twist that was taken: the given one, or the hand's own while it checks a grasp.
        """
        ...

    def judge(self) -> Verdict:
        """What became of the tick; called once a tick while a trial is not done."""
        ...

    def snapshot(self) -> Snapshot:
        """The state after the tick."""
        ...


class GoalTracker:
    """The targets in the world frame, computed anew only where an object has moved."""

    MOVED_M = 1e-4
    MOVED_ROTATION = 1e-3  # of a quaternion's components: 0.1°
    """Resting contacts tremble by less; targets that follow only beyond it cost nothing at rest."""

    def __init__(self, scene: Scene) -> None:
        self.targets = grasp_targets(scene)
        self._tolerance = np.array([self.MOVED_M] * 3 + [self.MOVED_ROTATION] * 4)
        self._poses: Array | None = None
        self._goals: Goals | None = None

    def goals(self, object_poses: Array) -> Goals:
        """The targets of objects at these poses, (n_objects, 7)."""
        if self._goals is None or self._poses is None or self._moved(object_poses, self._poses):
            self._poses = object_poses.copy()
            self._goals = goals_in_world(self.targets, object_poses)
        return self._goals

    def _moved(self, poses: Array, before: Array) -> bool:
        difference = poses - before
        flat = difference.ravel()
        # Nearly always all of it together is below the smallest tolerance, which is quickly said.
        if flat.dot(flat) <= self.MOVED_M**2:
            return False
        return bool((np.abs(difference) > self._tolerance).any())

    def reset(self) -> None:
        """Forget where the objects were, so that equal trials begin equally."""
        self._poses = self._goals = None
