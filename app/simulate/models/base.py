"""What all simulated users share: late eyes, noisy hands, and when to close.

A user knows the goal and the grasps of its object, and sees the hand; nothing of the assistance.
All noise is drawn once a decision, whatever is done with it: under every method a user's noise is
the same at the same time.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from app.core import Goals, Pose, UserInput, compute_input
from app.core.rotations import rotation_between
from app.core.types import Array
from app.simulate.models.parameters import COMMON, Parameter

DECISION_TICKS = 4
"""Ticks between two decisions: sticks are moved 25 times a second, and held in between."""
DECISION_S = 0.04
_VELOCITY_LOOKS = 3  # decisions over which motion is seen
_METRES_PER_RADIAN = 0.1  # an angle of 0.1 rad is as far off as 10 mm
_LOYALTY_M = 0.003  # another grasp must be nearer by this to be preferred


@dataclass(frozen=True, slots=True)
class Sight:
    """What there is to see in a tick.

    Attributes:
        time_s: Since the start signal [s].
        pose: The hand's, world frame.
        goals: Every object with its grasps, world frame, whether the assistance models it or not.
    """

    time_s: float
    pose: Pose
    goals: Goals


@dataclass(frozen=True, slots=True)
class Action:
    """What the user does.

    Attributes:
        input: The sticks.
        close: Whether the hand is to close now.
    """

    input: UserInput
    close: bool = False


@dataclass(frozen=True, slots=True)
class Percept:
    """What the user has seen, `delay_s` ago.

    Attributes:
        time_s: Now, since the start signal [s].
        pose: The hand's pose then.
        velocity: The hand's velocity then [m/s], shape (3,).
        pushed: The input given while it moved so, per world axis, full stick = 1, shape (3,).
        target: Row of the grasp pursued, among those of the user's object.
        position: Of that grasp [m], shape (3,).
        quaternion: Of that grasp, w x y z, shape (4,).
        distance: To it [m].
        angle: To it [rad].
        grips: Whether the hand, as seen, is at any grasp of the object.
        sight: What there is to see now.
    """

    time_s: float
    pose: Pose
    velocity: Array
    pushed: Array
    target: int
    position: Array
    quaternion: Array
    distance: float
    angle: float
    grips: bool
    sight: Sight


REST = UserInput(device="simulated", dead_zone=0.0)


class User(ABC):
    """Owns one user's memory during one trial; a model overrides `intend`.

    Attributes:
        goal: Name of the object the user is after now.
    """

    PARAMETERS: ClassVar[Mapping[str, Parameter]] = COMMON
    OTHER_OBJECTS: ClassVar[int] = 0
    """How many objects beside the instructed one the model needs in a scene."""
    MODELLED: ClassVar[bool] = True
    """Whether the user's goal is among those the assistance knows."""

    def __init__(
        self, goal: str, parameters: Mapping[str, float], rng: np.random.Generator
    ) -> None:
        """Begin a trial.

        Args:
            goal: The instructed object.
            parameters: Value of every one of PARAMETERS.
            rng: Source of this trial's noise, for this user alone.
        """
        self.goal = goal
        self.p = parameters
        self._rng = rng
        self._late = round(parameters["delay_s"] / DECISION_S)
        self._seen: deque[Pose] = deque(maxlen=self._late + _VELOCITY_LOOKS + 1)
        self._given: deque[Array] = deque(maxlen=self._late + _VELOCITY_LOOKS)
        self._looks = 0
        self._kept = float(np.exp(-DECISION_S / parameters["noise_time_s"]))
        self._fresh = float(np.sqrt(1.0 - self._kept**2))
        self._noise = rng.standard_normal(3)
        self._patience = round(parameters["patience_s"] / DECISION_S)
        self._at_grasp = 0
        self._grasp = -1
        self._axis = -1

    @abstractmethod
    def intend(self, percept: Percept) -> Array:
        """The input the user means to give, per world axis, full stick = 1, shape (3,)."""

    def act(self, sight: Sight) -> Action:
        """Look and decide; called every DECISION_TICKS, the sticks are held in between."""
        self._seen.append(sight.pose)
        self._looks += 1
        self._noise = self._kept * self._noise + self._fresh * self._rng.standard_normal(3)
        action = self._decide(sight) if self._looks > self._late else Action(REST)
        self._given.append(compute_input(action.input)[:3])
        return action

    def _decide(self, sight: Sight) -> Action:
        percept = self._perceive(sight)
        if percept.grips:
            return Action(REST, close=True)
        self._at_grasp = self._at_grasp + 1 if percept.distance <= 0.03 else 0
        meant = self.intend(percept)
        there = percept.distance <= self.p["tolerance_m"]
        if self._at_grasp > self._patience and there and meant.any():
            return Action(self._turn(percept))
        return Action(self._push(meant))

    def _perceive(self, sight: Sight) -> Percept:
        seen = self._seen
        now = len(seen) - 1 - self._late
        before = max(0, now - _VELOCITY_LOOKS)
        pose = seen[now]
        velocity = (pose.position - seen[before].position) / (_VELOCITY_LOOKS * DECISION_S)
        given = list(self._given)[before:now]
        row = sight.goals.names.index(self.goal)
        start, stop = sight.goals.offsets[row], sight.goals.offsets[row + 1]
        positions = sight.goals.positions[start:stop]
        quaternions = sight.goals.quaternions[start:stop]
        offsets = positions - pose.position
        distances = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
        angles = 2.0 * np.arccos(np.minimum(np.abs(quaternions @ pose.quaternion), 1.0))
        near = (distances <= self.p["tolerance_m"]) & (angles <= self.p["tolerance_rad"])
        far = distances + _METRES_PER_RADIAN * angles
        if self._grasp >= 0:
            far[self._grasp] -= _LOYALTY_M
        self._grasp = best = int(far.argmin())
        return Percept(
            time_s=sight.time_s,
            pose=pose,
            velocity=velocity,
            pushed=np.sum(given, axis=0) / _VELOCITY_LOOKS if given else np.zeros(3),
            target=best,
            position=positions[best],
            quaternion=quaternions[best],
            distance=float(distances[best]),
            angle=float(angles[best]),
            grips=bool(near.any()),
            sight=sight,
        )

    def pursue(self, percept: Percept) -> Array:
        """Toward the grasp, lined up with it from before, slower when near, shape (3,)."""
        offset = percept.position - percept.pose.position
        approach = _approach(percept.quaternion)
        aside = offset - (offset @ approach) * approach
        # Grasps that point down are reached from above, where nothing stands in the way.
        back = min(self.p["standoff_m"], float(np.sqrt(aside @ aside)))
        aim = offset - back * approach
        far = float(np.sqrt(aim @ aim))
        if far < 1e-9:
            return np.zeros(3)
        slow = self.p["slow_down_m"]
        size = self.p["vigour"] * (min(1.0, far / slow) if slow > 0.0 else 1.0)
        return self._favour_axis(aim) * size

    def _favour_axis(self, aim: Array) -> Array:
        """Unit direction that leans to the axis that is farthest off."""
        sizes = np.abs(aim)
        if self._axis >= 0:
            sizes[self._axis] *= 1.3  # an axis once taken is not left for a little
        self._axis = int(sizes.argmax())
        weights = np.full(3, 1.0 - self.p["axis_preference"])
        weights[self._axis] = 1.0
        leaning = aim * weights
        return leaning / np.sqrt(leaning @ leaning)

    def _push(self, meant: Array) -> UserInput:
        """Sticks for an input in world axes, with motor noise in proportion to its size."""
        size = float(np.sqrt(meant @ meant))
        if size == 0.0:
            return REST
        x, y, z = (meant + self.p["noise"] * size * self._noise).tolist()
        return _sticks((0.0, z, -y, x), rotating=False)

    def _turn(self, percept: Percept) -> UserInput:
        """Sticks that turn the hand toward the grasp."""
        _, axes = rotation_between(percept.quaternion[None], percept.pose.quaternion)
        axis = axes[0] / np.sqrt(axes[0] @ axes[0])
        size = self.p["turn_vigour"] * min(1.0, percept.angle / 0.5)
        x, y, z = (size * (axis + self.p["noise"] * self._noise)).tolist()
        return _sticks((-z, 0.0, x, y), rotating=True)


def _sticks(axes: tuple[float, float, float, float], *, rotating: bool) -> UserInput:
    left_x, left_y, right_x, right_y = axes
    left = max(1.0, float(np.hypot(left_x, left_y)))
    right = max(1.0, float(np.hypot(right_x, right_y)))
    return UserInput(
        axes=(left_x / left, left_y / left, right_x / right, right_y / right),
        mode="rotate" if rotating else "translate",
        dead_zone=0.0,
        device="simulated",
    )


def _approach(quaternion: Array) -> Array:
    """The grasp's z axis in the world frame, shape (3,)."""
    w, x, y, z = quaternion.tolist()
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
