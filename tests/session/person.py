"""A person at the sticks: sees where hand and object are, pushes, and closes the hand.

Knows nothing of the assistance, the grasps or the simulation's insides.
"""

import math
from dataclasses import dataclass

import numpy as np

from app.core import UserInput
from app.core.types import Array
from app.recording.schema import StepRecord
from app.robot.objects import object_height
from app.session.commands import Command
from app.session.trial import Trial

ALIGNED_M = 0.012


@dataclass
class Person:
    """Steers beside and behind the object, then straight in."""

    target: str
    aligned: bool = False
    settled: int = 0

    def look(self, trial: Trial, record: StepRecord) -> tuple[Array, Array]:
        """Where the hand and the middle of the object seem to be [m]."""
        scene = trial.world.scene
        index = scene.object_index(self.target)
        x, y, z = record.object_poses[7 * index : 7 * index + 3]
        middle = z + 0.5 * object_height(scene.objects[index])
        return np.array(record.hand_position_m), np.array([x, y, middle])

    def act(self, trial: Trial, record: StepRecord) -> tuple[UserInput, list[Command]]:
        """What the person does next: sticks, and perhaps the button."""
        hand, middle = self.look(trial, record)
        dx, dy, dz = (middle - hand).tolist()
        if abs(dy) < ALIGNED_M and abs(dz) < 0.02:
            self.aligned = True
        if abs(dy) > 0.03 and dx > 0.05:
            self.aligned = False
        if self.aligned and math.hypot(dx, dy) < ALIGNED_M and abs(dz) < 0.03:
            self.settled += 1
            close = self.settled > 20 and record.phase == "running"
            return UserInput(device="person"), [Command("grasp")] if close else []
        self.settled = 0
        forward = dx if self.aligned else min(0.0, dx - 0.16)
        away, left, up = (max(-1.0, min(1.0, 9.0 * e)) for e in (forward, dy, dz))
        return UserInput(axes=(0.0, up, -left, away), device="person"), []


def finish(trial: Trial, person: Person, limit_s: float = 40.0) -> list[StepRecord]:
    """Let the person do the trial to its end; all its records."""
    records = [trial.step(UserInput())]
    while trial.phase != "done" and len(records) * trial.dt < limit_s:
        user_input, commands = person.act(trial, records[-1])
        records.append(trial.step(user_input, commands))
    return records
