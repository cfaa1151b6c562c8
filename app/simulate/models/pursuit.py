"""Pursuit of the nearest grasp, and what the paper's participants made of the assistance."""

import numpy as np

from app.core.types import Array
from app.simulate.models.base import Percept, User
from app.simulate.models.parameters import COMMON, Parameter

STILL = np.zeros(3)
EXPECTED_SPEED = Parameter(0.2, 0.01, 2.0, "speed the user expects of a full stick [m/s]")


class Continue(User):
    """Pushes toward the goal all the way, whatever the robot does."""

    def intend(self, percept: Percept) -> Array:
        """Pursue."""
        return self.pursue(percept)


class Lazy(User):
    """Lets go while the robot is seen moving the right way by itself (paper, Fig. 8)."""

    PARAMETERS = COMMON | {
        "content_cosine": Parameter(
            0.6, -1.0, 1.0, "cosine of the robot's motion and the wish from which it may go on"
        ),
        "content_m_s": Parameter(
            0.02, 0.0, 0.5, "speed from which the robot is seen to move by itself [m/s]"
        ),
        "full_stick_m_s": EXPECTED_SPEED,
    }

    def intend(self, percept: Percept) -> Array:
        """Pursue, unless the robot is on the way without that."""
        wish = self.pursue(percept)
        robot = _by_itself(self, percept)
        along = float(wish @ robot)
        speed = float(np.sqrt(robot @ robot))
        size = float(np.sqrt(wish @ wish))
        # Near the grasp the robot slows down, too; what counts as moving shrinks with the wish.
        moving = speed > self.p["content_m_s"] * min(1.0, size / self.p["vigour"])
        return STILL if moving and along > self.p["content_cosine"] * speed * size else wish


class Fight(User):
    """Pushes back against motion that was not asked for (paper, Fig. 9)."""

    PARAMETERS = COMMON | {
        "resistance": Parameter(
            1.0, 0.0, 5.0, "how much of unwanted motion is pushed back, 1: as fast as it is"
        ),
        "full_stick_m_s": EXPECTED_SPEED,
    }

    def intend(self, percept: Percept) -> Array:
        """Pursue, minus what the robot was seen to do by itself beside or against the wish."""
        wish = self.pursue(percept)
        size = float(np.sqrt(wish @ wish))
        if size == 0.0:
            return wish
        direction = wish / size
        robot = _by_itself(self, percept)
        unwanted = robot - max(0.0, float(robot @ direction)) * direction
        pushed = wish - self.p["resistance"] * unwanted / self.p["full_stick_m_s"]
        # No one presses harder against the robot than twice the usual.
        return pushed * min(1.0, 2.0 * self.p["vigour"] / float(np.sqrt(pushed @ pushed) + 1e-12))


def _by_itself(user: User, percept: Percept) -> Array:
    """The part of the seen velocity that the user's own pushing does not explain [m/s], (3,)."""
    return percept.velocity - user.p["full_stick_m_s"] * percept.pushed
