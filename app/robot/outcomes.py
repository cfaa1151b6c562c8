"""How a trial ends: a state machine over contacts and object poses, one update per control tick."""

import math

import numpy as np

from app.core.types import Array
from app.recording.schema import Outcome
from app.robot.arm import FINGER_CLOSED
from app.robot.contacts import gripped_object
from app.robot.scene import Scene
from app.robot.simulation import CONTROL_DT, Simulation

GRIP_FORCE = 0.5  # [N] of each pad on the same object
GRIP_TIME = 0.1  # [s] of it that make a grip
LOST_TIME = 0.2  # [s] without it that end one
LIFT_HEIGHT = 0.02  # [m]
LIFT_TIME = 0.3  # [s] above it
EMPTY_TRAVEL = FINGER_CLOSED - 0.002  # [m] of each finger: nothing is between them
STILL_SPEED = 0.002  # [m/s] of both fingers: they are blocked
STILL_TIME = 0.25  # [s]
CLOSE_LIMIT = 3.0  # [s] to get a grip
CHECK_LIMIT = 3.0  # [s] from the grip to the end of the lift
TILT = math.cos(math.radians(45.0))
TILT_TIME = 0.2  # [s]
FALL_DEPTH = 0.03  # [m] below the table's top


class _Timer:
    """Seconds for which a condition has held without a break."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def update(self, condition: bool) -> float:
        self.seconds = self.seconds + CONTROL_DT if condition else 0.0
        return self.seconds


class OutcomeMonitor:
    """Watches one trial. The first outcome that is known stays.

    grasped, wrong_object: both pads press one object > 0.5 N for 0.1 s, then it is lifted > 2 cm
    for 0.3 s. closed_on_nothing: the fingers meet. bad_grip: they are blocked, but not by one
    object between both pads, or the lift loses it. knocked_over: an object nobody holds tilts
    > 45° for 0.2 s. fell_off: an object is below the table's top.

    Attributes:
        outcome: What is known so far; "running" until the trial is decided.
        gripped: Object between the pads, by its place in the scene's order; None: no grip (yet).
    """

    def __init__(self, scene: Scene, instructed: str) -> None:
        """Watch for one instructed object.

        Raises:
            SceneError: If the scene has no object of this name.
        """
        self.outcome: Outcome = "running"
        self.gripped: int | None = None
        self._instructed = scene.object_index(instructed)
        self._names = scene.object_names
        self._heights: Array | None = None
        self._candidate: int | None = None
        self._grip, self._lost, self._lift = _Timer(), _Timer(), _Timer()
        self._empty, self._still = _Timer(), _Timer()
        self._closing, self._check = _Timer(), _Timer()
        self._tilted_s = [0.0] * len(scene.objects)

    @property
    def gripped_name(self) -> str:
        """Name of the object between the pads, or empty."""
        return "" if self.gripped is None else self._names[self.gripped]

    def update(self, sim: Simulation, closing: bool) -> Outcome:
        """Take in the tick that `sim` has just made.

        Args:
            sim: The world.
            closing: Whether the hand was told to close (while it closes and while it lifts).
        """
        if self.outcome != "running":
            return self.outcome
        if closing:
            self._watch_grip(sim, sim.object_centres())
        else:
            self._release()
        if self.outcome == "running":
            self._watch_objects(sim)
        return self.outcome

    def _release(self) -> None:
        self.gripped, self._heights = None, None
        timers = (self._grip, self._lost, self._lift, self._empty, self._still, self._closing,
                  self._check)  # fmt: skip
        for timer in timers:
            timer.seconds = 0.0

    def _watch_grip(self, sim: Simulation, centres: Array) -> None:
        if self._heights is None:
            self._heights = centres[:, 2].copy()
        between = gripped_object(sim, GRIP_FORCE)
        if self.gripped is None:
            self._watch_closing(sim, between)
            return
        rise = centres[self.gripped, 2] - self._heights[self.gripped]
        held = between == self.gripped
        if self._lift.update(held and rise > LIFT_HEIGHT) >= LIFT_TIME - 1e-9:
            good = self.gripped == self._instructed
            self.outcome = "grasped" if good else "wrong_object"
        elif self._lost.update(not held) >= LOST_TIME - 1e-9:
            self.outcome = "bad_grip"
        elif self._check.update(True) >= CHECK_LIMIT:
            self.outcome = "bad_grip"

    def _watch_closing(self, sim: Simulation, between: int | None) -> None:
        same = between is not None and between == self._candidate
        self._candidate = between
        empty = bool((sim.finger_positions > EMPTY_TRAVEL).all())
        still = bool((np.abs(sim.finger_velocities) < STILL_SPEED).all())
        if self._grip.update(same) >= GRIP_TIME - 1e-9:
            self.gripped = between
        elif self._empty.update(empty) >= GRIP_TIME - 1e-9:
            self.outcome = "closed_on_nothing"
        elif self._still.update(still and not empty and between is None) >= STILL_TIME - 1e-9:
            self.outcome = "bad_grip"
        elif self._closing.update(True) >= CLOSE_LIMIT:
            self.outcome = "bad_grip"

    def _watch_objects(self, sim: Simulation) -> None:
        """Every tick, so in plain numbers: numpy's price is per call."""
        centres, poses = sim.object_centres().tolist(), sim.object_poses().tolist()
        longest = 0.0
        for i, (centre, pose) in enumerate(zip(centres, poses, strict=True)):
            if i == self.gripped:
                self._tilted_s[i] = 0.0
                continue
            if centre[2] < -FALL_DEPTH:
                self.outcome = "fell_off"
                return
            x, y = pose[4:6]
            upright = 1.0 - 2.0 * (x * x + y * y)  # z component of the object's z axis
            self._tilted_s[i] = self._tilted_s[i] + CONTROL_DT if upright < TILT else 0.0
            longest = max(longest, self._tilted_s[i])
        if longest >= TILT_TIME - 1e-9:
            self.outcome = "knocked_over"
