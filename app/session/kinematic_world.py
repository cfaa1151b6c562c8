"""The hand alone, in six dimensions, moving as commanded; for many simulated users at once.

There is no arm, no contact and nothing falls over. The hand's limits are a box over the table.
A grasp is judged by pose: closing within 20 mm and 0.35 rad of one of an object's targets grasps
that object (fingers that open 100 mm around objects of at most 90 mm leave the physics about as
much room); anywhere else it closes on nothing. The verdict comes in the tick after the command.
"""

from typing import Literal

import numpy as np

from app.core import Goals, Pose
from app.core.rotations import from_rotation_vector, multiply, rotation_between
from app.core.types import Array
from app.recording.schema import Outcome
from app.robot.arm import FINGER_CLOSED, FINGER_OPEN
from app.robot.hand import HandPhase
from app.robot.kinematics import Kinematics
from app.robot.layouts import random_layout
from app.robot.scene import Scene
from app.robot.simulation import CONTROL_DT
from app.robot.targets import GraspTargets
from app.session.worlds import GoalTracker, Snapshot, Verdict

GRASP_DISTANCE_M = 0.02
GRASP_ANGLE_RAD = 0.35
LOWEST_M, HIGHEST_M = 0.01, 0.60
"""Height of the tool centre over the table."""
_OUTSIDE_M = 0.05  # how far beyond the table's edge the hand may go


class KinematicWorld:
    """Owns the hand's pose.

    Attributes:
        scene: What stands in it.
    """

    kind: Literal["kinematic"] = "kinematic"
    joint_names: tuple[str, ...] = ()
    model_hash = ""
    physics_dt_s = CONTROL_DT

    def __init__(self, scene: Scene, seed: int | None = None) -> None:
        """Put everything at its start.

        Args:
            scene: What stands in the world.
            seed: Draws which object stands where; None: the scene's default.

        Raises:
            GraspError: If an object cannot be grasped.
        """
        self.scene = scene
        table = scene.table
        self._low = np.array([0.1, table.y_min_m - _OUTSIDE_M, LOWEST_M])
        self._high = np.array([table.x_max_m + _OUTSIDE_M, table.y_max_m + _OUTSIDE_M, HIGHEST_M])
        self._start = Kinematics(scene).hand_pose(scene.start_joint_positions)
        self._tracker = GoalTracker(scene)
        self._instructed = scene.object_names[0]
        self.reset(seed)

    @property
    def targets(self) -> GraspTargets:
        """Every goal's targets in the frame of its own object."""
        return self._tracker.targets

    def reset(self, seed: int | None) -> None:
        """Put everything at its start; the seed draws which object stands where."""
        layout = self.scene.default_layout
        if seed is not None:
            layout = random_layout(self.scene, np.random.default_rng(seed))
        self._objects = np.array([_place_pose(self.scene, place) for place in layout])
        self._object_list: list[float] = self._objects.ravel().tolist()
        self._tracker.reset()
        self._pose = self._start
        self._hand: HandPhase = "open"
        self._outcome: Outcome = "running"
        self._held = ""

    def begin(self, instructed: str) -> None:
        """Watch for the outcome of a trial with this goal, the hand open."""
        self.scene.object_index(instructed)
        self._instructed = instructed
        self._hand, self._outcome, self._held = "open", "running", ""

    def start_state(self) -> list[float]:
        """Empty: there is no physics."""
        return []

    def hand_pose(self) -> Pose:
        """Pose of the hand in the world frame."""
        return self._pose

    def goals(self) -> Goals:
        """The targets in the world frame; the objects never move."""
        return self._tracker.goals(self._objects)

    def close_hand(self) -> None:
        """Close where the hand is."""
        if self._hand == "open":
            self._hand = "closing"

    def open_hand(self) -> None:
        """Let go."""
        self._hand, self._held = "open", ""

    def step(self, twist: Array) -> Array:
        """Move for one control tick: p' = p + v dt within the box, R' = exp(dt [ω]×) R."""
        if self._hand != "open":
            return np.zeros(6)
        position = self._pose.position + CONTROL_DT * twist[:3]
        position = np.minimum(np.maximum(position, self._low), self._high)
        quaternion = self._pose.quaternion
        if twist[3:].any():
            quaternion = multiply(from_rotation_vector(CONTROL_DT * twist[3:]), quaternion)
            quaternion = quaternion / np.sqrt(quaternion @ quaternion)
        self._pose = Pose(position, quaternion)
        return twist

    def judge(self) -> Verdict:
        """Which object a closing hand has grasped."""
        if self._hand == "closing":
            self._hand = "done"
            self._held = self._grasped()
            good: Outcome = "grasped" if self._held == self._instructed else "wrong_object"
            self._outcome = good if self._held else "closed_on_nothing"
        return Verdict(self._outcome, self._hand, self._held)

    def snapshot(self) -> Snapshot:
        """The state after the tick: no joints, fingers open or closed."""
        travel = FINGER_OPEN if self._hand == "open" else FINGER_CLOSED
        return Snapshot([], [], [travel, travel], [], self._object_list)

    def _grasped(self) -> str:
        """The object whose target is near enough, the nearest where there are several."""
        goals = self.goals()
        distance = np.linalg.norm(goals.positions - self._pose.position, axis=1)
        angle, _ = rotation_between(goals.quaternions, self._pose.quaternion)
        good = (distance <= GRASP_DISTANCE_M) & (angle <= GRASP_ANGLE_RAD)
        if not good.any():
            return ""
        target = int(np.argmin(np.where(good, distance, np.inf)))
        return goals.names[int(np.searchsorted(goals.offsets, target, side="right")) - 1]


def _place_pose(scene: Scene, place: int) -> list[float]:
    """Pose (x y z qw qx qy qz) of an object that stands at a place."""
    spot = scene.places[place]
    half_yaw = 0.5 * np.radians(spot.yaw_degrees)
    return [spot.x_m, spot.y_m, 0.0, float(np.cos(half_yaw)), 0.0, 0.0, float(np.sin(half_yaw))]
